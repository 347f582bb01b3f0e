// verdict - computes the held-out error, and gives it and the exogeneity test as text and JSON.
#include "host_sim/diagnose/verdict/figures.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "host_sim/data/logs/butterworth.hpp"
#include "host_sim/data/report/table.hpp"

namespace armcal::verdict {

using calibration::Exogeneity;

namespace {

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

}  // namespace

HeldOutError CompareHeldOut(const calibration::Dataset& test, const Eigen::MatrixXd& predicted, double band_Hz) {
  const int n = test.joints();
  HeldOutError e;
  Eigen::MatrixXd residual = test.tau - predicted;
  e.rms = calibration::Rms(test, residual, false);
  e.rms_moving = calibration::Rms(test, residual, true);
  const Eigen::VectorXd torque = calibration::Rms(test, test.tau, true);
  e.relative = e.rms_moving.cwiseQuotient(torque.cwiseMax(1e-300));
  e.moving_share.resize(n);
  for (int j = 0; j < n; ++j) e.moving_share[j] = test.moving.col(j).cast<double>().mean();
  if (band_Hz > 0) {
    const double rate = (test.samples() - 1) / (test.s.t[test.samples() - 1] - test.s.t[0]);
    Eigen::MatrixXd filtered = test.tau;
    for (int j = 0; j < n; ++j) {
      residual.col(j) = logs::ZeroPhaseLowPass(residual.col(j), band_Hz, rate);
      filtered.col(j) = logs::ZeroPhaseLowPass(test.tau.col(j), band_Hz, rate);
    }
    e.band_Hz = band_Hz;
    e.relative_band =
        calibration::Rms(test, residual, true).cwiseQuotient(calibration::Rms(test, filtered, true).cwiseMax(1e-300));
  }
  return e;
}

void PrintHeldOut(const HeldOutError& e, const std::string& name) {
  report::Table t{{"joint", "error rms", "moving", "moving / torque %"}, {}, "held out: " + name};
  if (e.band_Hz > 0) t.header.push_back(fmt::format("below {:g} Hz %", e.band_Hz));
  for (int j = 0; j < e.rms.size(); ++j) {
    t.rows.push_back({std::to_string(j + 1), fmt::format("{:.4g}", e.rms[j]), fmt::format("{:.4g}", e.rms_moving[j]),
                      fmt::format("{:.2f}", 100 * e.relative[j])});
    if (e.band_Hz > 0) t.rows.back().push_back(fmt::format("{:.2f}", 100 * e.relative_band[j]));
  }
  fmt::print("{}", report::Text(t));
}

std::vector<double> ToList(const Eigen::VectorXd& v) { return {v.data(), v.data() + v.size()}; }

nlohmann::ordered_json ToJson(const HeldOutError& e) {
  nlohmann::ordered_json j{{"rms", ToList(e.rms)},
                           {"rms_moving", ToList(e.rms_moving)},
                           {"relative_moving", ToList(e.relative)},
                           {"moving_share", ToList(e.moving_share)}};
  if (e.band_Hz > 0) j["band_Hz"] = e.band_Hz, j["relative_moving_in_band"] = ToList(e.relative_band);
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
  std::string text = fmt::format("regressors free of the torque's error (instruments: {}{}):", e.instruments, shown);
  const char* separator = " ";
  for (const auto& [result, list] : joints)
    text += fmt::format("{}{} on joint {}", separator, result, list), separator = "; ";
  text += "\n";
  if (e.passed()) return text;
  return text + "  least squares is biased where it fails: " + Remedy(e) + "; or " + otherwise + "\n";
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
    out.push_back(
        fmt::format("joint {}: extrapolation: {:.0f} % of its positions and {:.0f} % of its speeds are outside "
                    "of the training logs' range; the model's torque is {:.1f} times as uncertain there",
                    j + 1, 100 * o.position, 100 * o.speed, std::sqrt(std::max(0.0, o.leverage))));
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
