// tool - reads logs, with a channel map if one is given.
#include "host_sim/tool/logs.hpp"

#include <fmt/core.h>

#include <charconv>
#include <cmath>

#include "codegen/src/io/input_error.hpp"

namespace armcal::tool {

logs::Log LogReader::Raw(const std::string& path) const {
  return format_.channels.empty() ? logs::ReadLog(path) : logs::ReadLog(path, MapOf(format_));
}

std::vector<logs::Log> LogReader::Raw(const std::vector<std::string>& paths) const {
  std::vector<logs::Log> out;
  for (const std::string& path : paths) out.push_back(Raw(path));
  return out;
}

std::vector<calibration::Dataset> LogReader::All(const std::vector<std::string>& paths,
                                                 const analysis::Say& say) const {
  return analysis::CheckedLogs(model_, Raw(paths), cutoff_Hz_, say);
}

void LogReader::PrintUntold(const std::vector<calibration::Dataset>& data) const {
  for (const std::string& line : analysis::Untold(model_, data)) fmt::print("{}\n", line);
}

void SayAside(const std::string& line) { fmt::print(stderr, "{}\n", line); }

logs::ChannelMap MapOf(const LogFormat& format) {
  return logs::ReadChannelMap(format.channels, {format.messages.begin(), format.messages.end()});
}

CLI::Option* AddMessages(CLI::App& verb, std::vector<std::string>& messages) {
  return verb
      .add_option("--msg", messages, "definition (.msg) of a message that the log does not define; may be repeated")
      ->allow_extra_args(false);
}

void AddLogFormat(CLI::App& verb, LogFormat& format) {
  auto* channels = verb.add_option("--channels", format.channels, "channel map (TOML) of foreign logs");
  AddMessages(verb, format.messages)->needs(channels);
}

namespace {
// The longest log is shorter than a period of a lower one.
constexpr double kLowest_Hz = 1e-6;

void AddFrequency(CLI::App& verb, const std::string& option, double& value_Hz, const std::string& help) {
  const auto read = [option, &value_Hz](const std::string& text) {
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, value_Hz);
    if (error != std::errc() || rest != end || !std::isfinite(value_Hz) || value_Hz < kLowest_Hz)
      throw io::InputError(option + " " + text + ": expected a frequency above 0 Hz");
  };
  verb.add_option_function<std::string>(option, read, help)->type_name("HZ");
}
}  // namespace

void AddCutoff(CLI::App& verb, double& cutoff_Hz) {
  AddFrequency(verb, "--cutoff", cutoff_Hz,
               "derive speed and acceleration below this frequency (Hz); default: chosen from the noise of the log");
}

void AddBand(CLI::App& verb, double& band_Hz) {
  AddFrequency(verb, "--band", band_Hz,
               "also compare in the band below this frequency (Hz): torque and prediction through the same zero-phase "
               "filter");
}

}  // namespace armcal::tool
