// tool - reads logs for a model, as the options of a verb ask for.
#pragma once

#include <string>
#include <vector>

#include "host_sim/diagnose/analysis/checked_logs.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

class LogReader {
 public:
  // channels: path of a channel map, empty for our own column names. cutoff_Hz: of the derived speeds; 0: chosen for
  // each log.
  LogReader(const codegen::Model& model, std::string channels, double cutoff_Hz = 0)
      : model_(model), channels_(std::move(channels)), cutoff_Hz_(cutoff_Hz) {}
  logs::Log Raw(const std::string& path) const;
  std::vector<logs::Log> Raw(const std::vector<std::string>& paths) const;
  // Throws io::InputError where a log cannot be one of this arm; what is worth a line goes to stderr.
  calibration::Dataset One(const std::string& path) const { return All({path})[0]; }
  // The same for several logs. What one of them lacks the others may have: a log that is too short is left out.
  std::vector<calibration::Dataset> All(const std::vector<std::string>& paths) const;
  // Says which faults of the columns nobody can see, where the robot file has no link data.
  void PrintUntold(const std::vector<calibration::Dataset>& data) const;

 private:
  const codegen::Model& model_;
  std::string channels_;
  double cutoff_Hz_;
};

// A line on stderr.
void SayAside(const std::string& line);

// Adds --cutoff. Anything but a frequency is refused in one line.
void AddCutoff(CLI::App& verb, double& cutoff_Hz);

}  // namespace armcal::tool
