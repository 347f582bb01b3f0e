// cli - reads logs by name or channel map and compares predictions with a held-out log.
#include "host_sim/cli/logs.hpp"

#include <fmt/core.h>

#include <charconv>
#include <cmath>

#include "host_sim/calibration/log_check.hpp"
#include "host_sim/io/butterworth.hpp"
#include "host_sim/io/channels.hpp"
#include "host_sim/io/input_error.hpp"
#include "host_sim/io/log.hpp"
#include "host_sim/report/table.hpp"

namespace armcal::cli {

io::Log LogReader::Raw(const std::string& path) const {
  return channels_.empty() ? io::ReadLog(path) : io::ReadLog(path, io::ReadChannelMap(channels_));
}

calibration::Dataset LogReader::One(const std::string& path) const { return Checked(Raw(path)); }

calibration::Dataset LogReader::Checked(const io::Log& log) const {
  if (log.joints == model_.joints())  // Prepare names what is wrong otherwise
    for (const std::string& note : calibration::CheckSignals(model_.robot(), log)) fmt::print(stderr, "{}\n", note);
  calibration::Dataset data = calibration::Prepare(model_, log, {cutoff_Hz_});
  calibration::CheckAgainstModel(model_, data);
  return data;
}

std::vector<calibration::Dataset> LogReader::Narrow(const std::vector<std::string>& paths) const {
  constexpr double kNarrow = 0.62;  // of the cut-off: half the noise of an acceleration
  std::vector<calibration::Dataset> out;
  for (const std::string& p : paths) out.push_back(calibration::Prepare(model_, Raw(p), {cutoff_Hz_, kNarrow}));
  return out;
}

std::vector<calibration::Dataset> LogReader::All(const std::vector<std::string>& paths) const {
  std::vector<calibration::Dataset> out;
  for (const std::string& p : paths) out.push_back(One(p));
  return out;
}

void AddCutoff(CLI::App& verb, double& cutoff_Hz) {
  const auto read = [&cutoff_Hz](const std::string& text) {
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, cutoff_Hz);
    if (error != std::errc() || rest != end || !std::isfinite(cutoff_Hz) || cutoff_Hz <= 0)
      throw io::InputError("--cutoff " + text + ": expected a frequency above 0 Hz");
  };
  verb.add_option_function<std::string>(
          "--cutoff", read,
          "derive speed and acceleration below this frequency (Hz); default: chosen from the noise of the log")
      ->type_name("HZ");
}

std::map<std::string, Eigen::MatrixXd> References(const std::vector<calibration::Dataset>& data) {
  std::map<std::string, Eigen::MatrixXd> out;
  for (const auto& d : data) {
    if (d.reference.size() == 0) return {};
    out.emplace(d.source, d.reference);
  }
  return out;
}

std::vector<const calibration::Dataset*> Pointers(const std::vector<calibration::Dataset>& data) {
  std::vector<const calibration::Dataset*> out;
  for (const auto& d : data) out.push_back(&d);
  return out;
}

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
      residual.col(j) = io::ZeroPhaseLowPass(residual.col(j), band_Hz, rate);
      filtered.col(j) = io::ZeroPhaseLowPass(test.tau.col(j), band_Hz, rate);
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

}  // namespace armcal::cli
