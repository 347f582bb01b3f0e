// analysis - runs a diagnosis: everything is decided on the training logs, and judged on a held-out log after that.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "host_sim/diagnose/analysis/checked_logs.hpp"
#include "host_sim/diagnose/diagnosis/diagnose.hpp"
#include "host_sim/diagnose/verdict/verdict.hpp"
#include "host_sim/identify/calibration/channel.hpp"

namespace armcal::analysis {

struct DiagnoseOptions {
  diagnosis::AtTurns at_turns = diagnosis::AtTurns::kWhereAveraged;
  double cutoff_Hz = 0;       // as CheckedLogs has it
  double gain_tolerance = 0;  // of each joint's torque; 0: the robot file's
};

// One diagnosis, with everything its view refers to.
struct Diagnosed {
  Diagnosed(std::unique_ptr<codegen::Model> declared, codegen::Catalogue records,
            const std::vector<logs::Log>& train_logs, const DiagnoseOptions& given, const Say& say);
  // Once. robot, file: how the user calls the robot and the file of the JSON, for commands that the report names;
  // file may be empty.
  void Judge(const logs::Log& log, const std::string& robot, const std::string& file, const Say& say);

  DiagnoseOptions options;
  codegen::Catalogue catalogue;
  std::unique_ptr<codegen::Model> model;
  std::vector<calibration::Dataset> train;
  calibration::Dataset test;
  std::unique_ptr<diagnosis::Diagnosis> diagnosis;
  diagnosis::HeldOut held_out;
  verdict::DiagnosisView view;
  nlohmann::ordered_json json;

 private:
  // The log as its torque channel shows it.
  void PutBehindChannel(calibration::Dataset& log) const;
  Eigen::VectorXd LeftAtSamples() const;
  void WriteJson();

  // The training logs, not thinned, and at a lower bandwidth. The diagnosis refers to these and to `train`.
  std::vector<calibration::Dataset> whole_, narrow_;
  calibration::TorqueChannel channel_;
};

}  // namespace armcal::analysis
