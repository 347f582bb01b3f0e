// tool - reads logs for a model, as the options of a verb ask for.
#pragma once

#include <string>
#include <vector>

#include "host_sim/data/logs/channels.hpp"
#include "host_sim/diagnose/analysis/checked_logs.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

// How logs are written that are not ours.
struct LogFormat {
  std::string channels;               // path of a channel map; empty: our own column names
  std::vector<std::string> messages;  // files *.msg, for types that a recording does not define
};

// A line on stderr.
void SayAside(const std::string& line);

class LogReader {
 public:
  // cutoff_Hz: of the derived speeds; 0: chosen for each log.
  LogReader(const codegen::Model& model, LogFormat format, double cutoff_Hz = 0)
      : model_(model), format_(std::move(format)), cutoff_Hz_(cutoff_Hz) {}
  logs::Log Raw(const std::string& path) const;
  std::vector<logs::Log> Raw(const std::vector<std::string>& paths) const;
  // Throws io::InputError where a log cannot be one of this arm; what is worth a line goes to `say`.
  calibration::Dataset One(const std::string& path, const analysis::Say& say = SayAside) const {
    return All({path}, say)[0];
  }
  // The same for several logs. What one of them lacks the others may have: a log that is too short is left out.
  std::vector<calibration::Dataset> All(const std::vector<std::string>& paths,
                                        const analysis::Say& say = SayAside) const;
  // Says which faults of the columns nobody can see, where the robot file has no link data.
  void PrintUntold(const std::vector<calibration::Dataset>& data) const;

 private:
  const codegen::Model& model_;
  LogFormat format_;
  double cutoff_Hz_;
};

// The channel map and the definitions given beside it.
logs::ChannelMap MapOf(const LogFormat& format);

// Adds --channels and --msg.
void AddLogFormat(CLI::App& verb, LogFormat& format);
// Adds --msg.
CLI::Option* AddMessages(CLI::App& verb, std::vector<std::string>& messages);

// Adds --cutoff. Anything but a frequency is refused in one line.
void AddCutoff(CLI::App& verb, double& cutoff_Hz);
// Adds --band, likewise.
void AddBand(CLI::App& verb, double& band_Hz);

}  // namespace armcal::tool
