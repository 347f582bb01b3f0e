// cli - logs made ready for a model, and the error on a held-out one; knows no method.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "host_sim/calibration/dataset.hpp"
#include "host_sim/cli/verb.hpp"

namespace armcal::cli {

class LogReader {
 public:
  // channels: path of a channel map, empty for our own column names. cutoff_Hz: of the derived speeds; 0: chosen for
  // each log.
  LogReader(const codegen::Model& model, std::string channels, double cutoff_Hz = 0)
      : model_(model), channels_(std::move(channels)), cutoff_Hz_(cutoff_Hz) {}
  io::Log Raw(const std::string& path) const;
  // Throws io::InputError where a log cannot be one of this arm; what is worth a line goes to stderr.
  calibration::Dataset One(const std::string& path) const;
  std::vector<calibration::Dataset> All(const std::vector<std::string>& paths) const;
  // The same logs with speed and acceleration of a lower bandwidth.
  std::vector<calibration::Dataset> Narrow(const std::vector<std::string>& paths) const;

 private:
  calibration::Dataset Checked(const io::Log& log) const;

  const codegen::Model& model_;
  std::string channels_;
  double cutoff_Hz_;
};

// Adds --cutoff: what is no frequency is refused in one line.
void AddCutoff(CLI::App& verb, double& cutoff_Hz);

// Commanded positions by the log's name; empty unless every log has them.
std::map<std::string, Eigen::MatrixXd> References(const std::vector<calibration::Dataset>& data);

std::vector<const calibration::Dataset*> Pointers(const std::vector<calibration::Dataset>& data);

// Per joint, over scored samples: all, and where the joint moves. relative: error / torque, moving samples. band: the
// same in a band.
struct HeldOutError {
  Eigen::VectorXd rms, rms_moving, relative, relative_band, moving_share;
  double band_Hz = 0;
};

HeldOutError CompareHeldOut(const calibration::Dataset& test, const Eigen::MatrixXd& predicted, double band_Hz);
void PrintHeldOut(const HeldOutError& e, const std::string& name);
nlohmann::ordered_json ToJson(const HeldOutError& e);
std::vector<double> ToList(const Eigen::VectorXd& v);

}  // namespace armcal::cli
