// verdict - thins the curves of a held-out log and computes its spectra.
#include "host_sim/diagnose/verdict/curves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "host_sim/data/logs/spectrum.hpp"
#include "host_sim/data/report/thin.hpp"

namespace armcal::verdict {

using Eigen::VectorXd;
using nlohmann::ordered_json;

namespace {

constexpr std::size_t kRows = 20000;  // about, of all joints together: some 600 kB of text
constexpr double kSegment_s = 4;      // of spectra: bins of a quarter hertz

// So many digits; a page and its file need no more.
ordered_json Rounded(double value, int digits) {
  if (!std::isfinite(value)) return nullptr;
  return std::stod(fmt::format("{:.{}g}", value, digits));
}

ordered_json List(const std::vector<double>& values, const std::vector<std::size_t>& rows, int digits) {
  ordered_json out = ordered_json::array();
  for (const std::size_t k : rows) out.push_back(Rounded(values[k], digits));
  return out;
}

std::vector<double> ToVector(const VectorXd& v) { return {v.data(), v.data() + v.size()}; }

ordered_json SpectrumJson(const calibration::Dataset& log, const VectorXd& measured,
                          const std::vector<JointPrediction>& predicted) {
  ordered_json out;
  const auto add = [&](const std::string& name, const VectorXd& signal) {
    const VectorXd known = signal.array().isFinite().select(signal, 0.0);
    const double segment_s = std::min(kSegment_s, static_cast<double>(log.samples()) / log.rate_Hz() / 4);
    const logs::Spectrum s = logs::AmplitudeDensity(known, log.rate_Hz(), segment_s);
    ordered_json f_Hz = ordered_json::array(), density = ordered_json::array();
    for (std::size_t k = 0; k < s.f_Hz.size(); ++k)
      f_Hz.push_back(Rounded(s.f_Hz[k], 5)), density.push_back(Rounded(s.density[k], 4));
    out["Hz"] = f_Hz, out[name] = density;
  };
  add("measured", measured + 0 * predicted[0].torque);  // the same samples
  for (const JointPrediction& p : predicted) add(p.name, measured - p.torque);
  return out;
}

}  // namespace

VectorXd LookedAtTo_Hz(const DiagnosisView& v) {
  VectorXd out = VectorXd::Constant(v.model->joints(), INFINITY);
  for (const calibration::Dataset& d : *v.train)
    for (const VectorXd* limit_Hz : {&d.cutoff_Hz, &d.band_Hz})
      for (Eigen::Index j = 0; j < std::min(out.size(), limit_Hz->size()); ++j)
        out[j] = std::min(out[j], (*limit_Hz)[j]);
  return out;
}

ordered_json CurvesOf(const calibration::Dataset& log, int joint, std::vector<JointPrediction> predicted) {
  for (JointPrediction& p : predicted)
    p.torque = (log.used.col(joint).array() != 0).select(p.torque, std::numeric_limits<double>::quiet_NaN());
  const VectorXd measured = log.tau.col(joint);
  std::vector<std::vector<double>> values{ToVector(measured)};
  for (const JointPrediction& p : predicted) values.push_back(ToVector(p.torque));
  for (const JointPrediction& p : predicted) values.push_back(ToVector(measured - p.torque));
  std::vector<const std::vector<double>*> columns;
  for (const auto& column : values) columns.push_back(&column);
  const std::size_t most = kRows / static_cast<std::size_t>(log.joints());
  const std::vector<std::size_t> rows = report::KeepExtremes(columns, most / (2 * columns.size()));

  ordered_json out{
      {"joint", joint + 1}, {"t", List(ToVector(log.s.t), rows, 7)}, {"measured", List(values[0], rows, 5)}};
  for (std::size_t p = 0; p < predicted.size(); ++p) out[predicted[p].name] = List(values[p + 1], rows, 5);
  out["spectrum"] = SpectrumJson(log, measured, predicted);
  return out;
}

ordered_json CurvesJson(const DiagnosisView& v) {
  const calibration::Dataset& log = *v.test;
  const VectorXd reach_Hz = LookedAtTo_Hz(v);
  ordered_json out = ordered_json::array();
  for (int j = 0; j < log.joints(); ++j) {
    const std::vector<JointPrediction> predicted{{"before", log.tau.col(j) - v.held_out->before.col(j)},
                                                 {"after", log.tau.col(j) - v.held_out->after.col(j)}};
    out.push_back(CurvesOf(log, j, predicted));
    out.back()["looked_at_to_Hz"] = Rounded(reach_Hz[j], 4);
  }
  return out;
}

}  // namespace armcal::verdict
