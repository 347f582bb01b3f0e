// tool - reads logs, with a channel map if one is given, and checks them against the model.
#include "host_sim/tool/logs.hpp"

#include <fmt/core.h>

#include <charconv>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/logs/channels.hpp"
#include "host_sim/data/logs/log.hpp"
#include "host_sim/identify/calibration/body_check.hpp"
#include "host_sim/identify/calibration/column_check.hpp"
#include "host_sim/identify/calibration/log_check.hpp"
#include "host_sim/identify/calibration/untold.hpp"

namespace armcal::tool {

logs::Log LogReader::Raw(const std::string& path) const {
  return channels_.empty() ? logs::ReadLog(path) : logs::ReadLog(path, logs::ReadChannelMap(channels_));
}

calibration::Dataset LogReader::One(const std::string& path) const {
  const logs::Log log = Raw(path);
  const calibration::SignalCheck check = Check(log);
  if (!check.lack.empty()) throw io::InputError(log.source + ": " + check.lack);
  calibration::Dataset data = calibration::Prepare(model_, log, {cutoff_Hz_});
  CheckTogether({&data});
  return data;
}

void LogReader::CheckTogether(const std::vector<const calibration::Dataset*>& data) const {
  for (const std::string& note : calibration::CheckRows(model_.robot(), data)) fmt::print(stderr, "{}\n", note);
  for (const std::string& note : calibration::CheckColumns(model_, data)) fmt::print(stderr, "{}\n", note);
  for (const calibration::Dataset* log : data) calibration::CheckAgainstModel(model_, *log);
}

void LogReader::PrintUntold(const std::vector<calibration::Dataset>& data) const {
  if (model_.robot().has_prior) return;
  std::string text;
  for (const std::string& fault : calibration::UntoldFaults(model_)) text += (text.empty() ? "" : "; ") + fault;
  if (!text.empty()) fmt::print("cannot be told without link data: {}\n", text);
  text.clear();
  for (const std::string& fault : calibration::EquallyGood(model_, calibration::Pointers(data)))
    text += (text.empty() ? "" : "; ") + fault;
  if (!text.empty()) fmt::print("cannot be told from these logs: {}\n", text);
}

calibration::SignalCheck LogReader::Check(const logs::Log& log) const {
  if (log.joints != model_.joints()) return {};  // Prepare names what is wrong
  const calibration::SignalCheck check = calibration::CheckSignals(model_.robot(), log);
  for (const std::string& note : check.notes) fmt::print(stderr, "{}: {}\n", log.source, note);
  return check;
}

std::vector<calibration::Dataset> LogReader::Narrow(const std::vector<std::string>& paths) const {
  constexpr double kNarrow = 0.62;  // of the cut-off: half the noise of an acceleration
  std::vector<calibration::Dataset> out;
  for (const std::string& p : paths) {
    const logs::Log log = Raw(p);
    if (paths.size() == 1 || calibration::CheckSignals(model_.robot(), log).lack.empty())
      out.push_back(calibration::Prepare(model_, log, {cutoff_Hz_, kNarrow}));
  }
  return out;
}

std::vector<calibration::Dataset> LogReader::All(const std::vector<std::string>& paths) const {
  std::vector<calibration::Dataset> out;
  if (paths.size() == 1) return {One(paths[0])};
  for (const std::string& p : paths) {
    const logs::Log log = Raw(p);
    const calibration::SignalCheck check = Check(log);
    if (check.lack.empty()) out.push_back(calibration::Prepare(model_, log, {cutoff_Hz_}));
    else fmt::print(stderr, "{}: left out: {}\n", p, check.lack);
  }
  if (out.empty()) throw io::InputError(paths[0] + " and others: none is long enough to be fitted");
  CheckTogether(calibration::Pointers(out));
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

}  // namespace armcal::tool
