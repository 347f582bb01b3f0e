// verdict - computes the held-out error, and gives it and the exogeneity test as text and JSON.
#include "host_sim/diagnose/verdict/figures.hpp"
#include "host_sim/identify/calibration/log_check.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/logs/butterworth.hpp"
#include "host_sim/data/report/table.hpp"

namespace armcal::verdict {

using calibration::Exogeneity;

namespace {

constexpr double kRounding = 1e-12;

std::string FileName(const std::string& path) { return std::filesystem::path(path).filename().string(); }

const char* Result(const calibration::JointExogeneity& j) {
  return j.restrictions == 0 ? "cannot be told" : j.exogenous ? "holds" : "FAILS";
}

std::string Remedy(const Exogeneity& e) {
  std::string method = "armcal identify --method instrumental_variable";
  if (e.instruments == calibration::kSimulatedLoop) return method;
  const std::string lower = "a lower --cutoff or a finer encoder; or " + method;
  if (e.instruments == calibration::kCommandedMotion)
    return lower + ", which needs a [control] table in the robot file";
  return lower + ", which needs qref in the log and a [control] table in the robot file";
}

// Of one joint over the samples that `counts` says; NaN: there are none.
template <class Counts>
double RootMean(const std::vector<Predicted>& logs, const std::vector<Eigen::MatrixXd>& value, int joint,
                const Counts& counts) {
  double sum = 0;
  int count = 0;
  for (std::size_t l = 0; l < logs.size(); ++l)
    for (int k = 0; k < logs[l].log->samples(); ++k)
      if (counts(*logs[l].log, k)) sum += value[l](k, joint) * value[l](k, joint), ++count;
  return count ? std::sqrt(sum / count) : std::numeric_limits<double>::quiet_NaN();
}

// Over the joints that have the figure.
double MeanOf(const Eigen::VectorXd& of_joint) {
  double sum = 0;
  int count = 0;
  for (const double x : of_joint)
    if (!std::isnan(x)) sum += x, ++count;
  return count ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

// Population standard deviation over every sample; 0: it is rounding alone.
double DeviationOf(const std::vector<Eigen::MatrixXd>& value, int joint) {
  double sum = 0, square = 0, count = 0;
  for (const Eigen::MatrixXd& v : value) sum += v.col(joint).sum(), count += static_cast<double>(v.rows());
  for (const Eigen::MatrixXd& v : value) square += (v.col(joint).array() - sum / count).square().sum();
  const double deviation = std::sqrt(square / count);
  return deviation > kRounding * std::abs(sum / count) ? deviation : 0;
}

ErrorFigures FiguresOf(const std::vector<Predicted>& logs, const std::vector<Eigen::MatrixXd>& torque,
                       const std::vector<Eigen::MatrixXd>& error) {
  const Eigen::Index n = logs[0].log->joints();
  ErrorFigures f;
  f.rms.resize(n), f.rms_moving.resize(n), f.relative.resize(n), f.nrmse.resize(n);
  for (int j = 0; j < n; ++j) {
    const auto scored = [](const calibration::Dataset& d, int k) { return d.scored[k] != 0; };
    const auto moving = [j](const calibration::Dataset& d, int k) { return d.scored[k] && d.moving(k, j); };
    f.rms[j] = RootMean(logs, error, j, scored);
    f.rms_moving[j] = RootMean(logs, error, j, moving);
    f.relative[j] = f.rms_moving[j] / std::max(RootMean(logs, torque, j, moving), 1e-300);
    const double deviation = DeviationOf(torque, j);  // 0: a brake holds the joint
    const double all = RootMean(logs, error, j, [](const calibration::Dataset&, int) { return true; });
    f.nrmse[j] = deviation > 0 ? all / deviation : std::numeric_limits<double>::quiet_NaN();
  }
  return f;
}

Eigen::MatrixXd Below(const calibration::Dataset& log, const Eigen::MatrixXd& value, double band_Hz) {
  const double rate = (log.samples() - 1) / (log.s.t[log.samples() - 1] - log.s.t[0]);
  if (band_Hz >= 0.5 * rate)
    throw io::InputError(fmt::format("{}: --band {:g}: expected a frequency below {:g} Hz, half the log's sample rate",
                                     log.source, band_Hz, 0.5 * rate));
  Eigen::MatrixXd out = value;
  for (Eigen::Index j = 0; j < value.cols(); ++j) out.col(j) = logs::ZeroPhaseLowPass(value.col(j), band_Hz, rate);
  return out;
}

}  // namespace

HeldOutError CompareHeldOut(const std::vector<Predicted>& logs, double band_Hz) {
  std::vector<Eigen::MatrixXd> torque, error;
  for (const Predicted& p : logs) torque.push_back(p.log->tau), error.push_back(p.log->tau - p.torque);
  HeldOutError e;
  e.full = FiguresOf(logs, torque, error);
  e.moving_share.setZero(logs[0].log->joints());
  int samples = 0;
  for (const Predicted& p : logs) {
    e.moving_share += p.log->moving.cast<double>().colwise().sum().transpose();
    samples += p.log->samples();
  }
  e.moving_share /= samples;
  if (band_Hz <= 0) return e;
  for (std::size_t l = 0; l < logs.size(); ++l)
    for (auto* value : {&torque[l], &error[l]}) *value = Below(*logs[l].log, *value, band_Hz);
  e.band_Hz = band_Hz;
  e.band = FiguresOf(logs, torque, error);
  return e;
}

HeldOutError CompareHeldOut(const calibration::Dataset& test, const Eigen::MatrixXd& predicted, double band_Hz) {
  return CompareHeldOut({{&test, predicted}}, band_Hz);
}

void PrintError(const HeldOutError& e, const codegen::Robot& robot, const std::string& of) {
  report::Table t{{"joint", "unit", "error rms", "moving", "moving / torque %", "NRMSE", "R2"}, {}, of};
  const auto add = [](std::vector<std::string>& row, const ErrorFigures& f, int j) {
    const auto say = [&row](double v, int digits, char form) {
      row.push_back(std::isnan(v) ? "-"
                    : form == 'g' ? fmt::format("{:.{}g}", v, digits)
                                  : fmt::format("{:.{}f}", v, digits));
    };
    for (const double v : {f.rms[j], f.rms_moving[j]}) say(v, 4, 'g');
    say(100 * f.relative[j], 2, 'f');
    for (const double v : {f.nrmse[j], f.r2()[j]}) say(v, 4, 'f');
  };
  const bool band = e.band_Hz > 0;
  if (band)
    for (const char* title : {"rms", "moving", "%", "NRMSE", "R2"})
      t.header.push_back(fmt::format("{}{}", *title == 'r' ? fmt::format("below {:g} Hz: ", e.band_Hz) : "", title));
  for (int j = 0; j < e.full.rms.size(); ++j) {
    t.rows.push_back({std::to_string(j + 1), calibration::TorqueUnit(robot.joint[static_cast<std::size_t>(j)])});
    add(t.rows.back(), e.full, j);
    if (band) add(t.rows.back(), e.band, j);
  }
  fmt::print("{}", report::Text(t));
  if (e.full.rms.size() < 2) return;
  const auto mean = [](const ErrorFigures& f) {
    return fmt::format("NRMSE {:.4f}, R2 {:.4f}", MeanOf(f.nrmse), MeanOf(f.r2()));
  };
  fmt::print("mean of joints: {}{}\n", mean(e.full),
             band ? fmt::format("; below {:g} Hz: {}", e.band_Hz, mean(e.band)) : "");
}

std::vector<double> ToList(const Eigen::VectorXd& v) { return {v.data(), v.data() + v.size()}; }

nlohmann::ordered_json ToJson(const HeldOutError& e) {
  nlohmann::ordered_json j{{"rms", ToList(e.full.rms)},
                           {"rms_moving", ToList(e.full.rms_moving)},
                           {"relative_moving", ToList(e.full.relative)},
                           {"moving_share", ToList(e.moving_share)},
                           {"nrmse", ToList(e.full.nrmse)},
                           {"r2", ToList(e.full.r2())},
                           {"nrmse_mean", MeanOf(e.full.nrmse)},
                           {"r2_mean", MeanOf(e.full.r2())}};
  if (e.band_Hz > 0) {
    j["band_Hz"] = e.band_Hz, j["relative_moving_in_band"] = ToList(e.band.relative);
    j["rms_in_band"] = ToList(e.band.rms), j["rms_moving_in_band"] = ToList(e.band.rms_moving);
    j["nrmse_in_band"] = ToList(e.band.nrmse), j["r2_in_band"] = ToList(e.band.r2());
    j["nrmse_mean_in_band"] = MeanOf(e.band.nrmse), j["r2_mean_in_band"] = MeanOf(e.band.r2());
  }
  return j;
}

std::string ExogeneityText(const Exogeneity& e, const std::string& otherwise) {
  std::map<std::string, std::string> joints;
  for (std::size_t j = 0; j < e.joint.size(); ++j) {
    std::string& list = joints[Result(e.joint[j])];
    list += fmt::format("{}{}", list.empty() ? "" : ", ", j + 1);
    if (e.joint[j].exogenous) continue;
    list +=
        fmt::format(" (p {:.1g}, bias {:.2g} of {:.2g} left)", e.joint[j].p, e.joint[j].bias_Nm, e.joint[j].left_Nm);
  }
  // What the motion itself took up of the torque's error is in its smoothed positions, too.
  const char* shown =
      e.instruments == calibration::kSmoothedPositions ? ", which show noise of the derivation alone" : "";
  std::string text = fmt::format(
      "exogeneity: are the regressors free of the torque's error? (instruments: {}{}):", e.instruments, shown);
  const char* separator = " ";
  for (const auto& [result, list] : joints)
    text += fmt::format("{}{} on joint {}", separator, result, list), separator = "; ";
  text += "\n";
  if (e.passed()) return text;
  return text + "  on joints that fail, least squares is biased: " + Remedy(e) + "; or " + otherwise + "\n";
}

nlohmann::ordered_json ToJson(const Exogeneity& e) {
  nlohmann::ordered_json out{{"instruments", e.instruments}, {"passed", e.passed()}};
  for (const calibration::JointExogeneity& j : e.joint)
    out["joints"].push_back({{"rows", j.rows},
                             {"restrictions", j.restrictions},
                             {"F", j.F},
                             {"p", j.p},
                             {"bias_Nm", j.bias_Nm},
                             {"left_Nm", j.left_Nm},
                             {"exogenous", j.exogenous},
                             {"told", j.restrictions > 0}});
  return out;
}

std::string JointGroup(const std::vector<int>& joints) {
  std::string out;
  for (std::size_t k = 0; k < joints.size(); ++k)
    out += fmt::format("{}{}", k == 0 ? "" : k + 1 < joints.size() ? ", " : " and ", joints[k] + 1);
  return out;
}

std::vector<std::string> MotionText(const calibration::HeldOutMotion& m) {
  constexpr double kHardlyMore = 1.1;  // as a variance, which one digit of a deviation does not show
  std::vector<std::string> out;
  if (m.samples.share > 0.5)
    out.push_back(fmt::format("the held-out log is not held out: {:.0f} % of its samples are those of {}",
                              100 * m.samples.share, FileName(m.samples.source)));
  else if (m.repeats())
    out.push_back(fmt::format("the held-out log repeats a trajectory: {:.0f} % of its motion is that of {}",
                              100 * m.trajectory.share, FileName(m.trajectory.source)));
  for (std::size_t j = 0; j < m.joint.size(); ++j) {
    const calibration::Outside& o = m.joint[j];
    if (!o.beyond()) continue;
    out.push_back(fmt::format(
        "joint {}: extrapolation: {:.0f} % of its positions and {:.0f} % of its speeds are outside "
        "of the training logs' range{}",
        j + 1, 100 * o.position, 100 * o.speed,
        !std::isfinite(o.leverage) ? "; no row of its torque could be fitted"
        : o.leverage < kHardlyMore
            ? ""
            : fmt::format("; the model's torque is {:.1f} times as uncertain there", std::sqrt(o.leverage))));
  }
  for (const auto& group : m.in_phase) {
    out.push_back(
        fmt::format("joints {} move in phase in the training logs{}: these do not tell a torque over one of "
                    "them from a torque over another",
                    JointGroup(group.joints), group.together ? " and in the held-out log" : ""));
  }
  return out;
}

nlohmann::ordered_json ToJson(const calibration::HeldOutMotion& m) {
  nlohmann::ordered_json out{{"same_samples", m.samples.share},
                             {"same_as", m.samples.source},
                             {"repeated", m.trajectory.share},
                             {"repeats", m.trajectory.source}};
  out["joints"] = out["in_phase"] = nlohmann::ordered_json::array();
  for (const calibration::Outside& o : m.joint)
    out["joints"].push_back({{"positions_outside", o.position},
                             {"speeds_outside", o.speed},
                             {"variance_ratio", o.leverage},
                             {"extrapolation", o.beyond()}});
  for (const auto& group : m.in_phase) {
    nlohmann::ordered_json joints;
    for (const int j : group.joints) joints.push_back(j + 1);
    out["in_phase"].push_back({{"joints", joints}, {"held_out_too", group.together}});
  }
  return out;
}

}  // namespace armcal::verdict
