// tool - one diagnosis from files to files; armcal diagnose, its batches and the demo run it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "host_sim/diagnose/verdict/diagnosis_report.hpp"

namespace armcal::tool {

struct DiagnoseOptions {
  std::string robot, channels, test, json, report, model_out;
  std::vector<std::string> train;
  double cutoff_Hz = 0;
};

// One diagnosis from files to files, with everything its view refers to.
struct DiagnosisRun {
  codegen::Catalogue catalogue;
  std::unique_ptr<codegen::Model> model;
  std::vector<calibration::Dataset> train;
  calibration::Dataset test;
  std::unique_ptr<diagnosis::Diagnosis> diagnosis;
  diagnosis::HeldOut held_out;
  verdict::DiagnosisView view;
  nlohmann::ordered_json json;
};

// Train, decide, write the model file and take its hash; only then open the held-out log. Prints the verdict.
std::unique_ptr<DiagnosisRun> RunDiagnosis(const DiagnoseOptions& options);

}  // namespace armcal::tool
