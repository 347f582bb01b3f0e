// analysis - predicts logs with given parameters, and compares.
#include "host_sim/diagnose/analysis/evaluated.hpp"

namespace armcal::analysis {

Evaluated Evaluate(const codegen::Model& model, const calibration::Given& given,
                   const std::vector<calibration::Dataset>& logs, double band_Hz) {
  Evaluated out;
  std::vector<verdict::Predicted> all;
  for (const calibration::Dataset& log : logs) {
    all.push_back({&log, calibration::Predict(model, log, given.x, given.eta)});
    out.each.push_back(verdict::CompareHeldOut({all.back()}, band_Hz));
    nlohmann::ordered_json row{{"log", log.source}};
    row.update(verdict::ToJson(out.each.back()));
    out.json["logs"].push_back(row);
  }
  if (logs.size() < 2) return out;
  out.together = verdict::CompareHeldOut(all, band_Hz);
  out.json["together"] = verdict::ToJson(*out.together);
  return out;
}

}  // namespace armcal::analysis
