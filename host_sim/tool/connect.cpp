// tool - connects to a drive, and checks that drive and model have the same schema.
#include "host_sim/tool/connect.hpp"

#include <fmt/core.h>
#include <algorithm>
#include <charconv>
#include <vector>

#include "codegen/src/io/input_error.hpp"

namespace armcal::tool {
namespace {

// A number from `least` to `most`, and nothing else.
bool TakeNumber(const std::string& text, int least, int most, int& number) {
  const char* const end = text.c_str() + text.size();
  const auto [stopped, error] = std::from_chars(text.c_str(), end, number);
  return error == std::errc() && stopped == end && number >= least && number <= most;
}

std::vector<std::string> Parts(const std::string& address) {
  std::vector<std::string> parts(1);
  for (const char c : address)
    if (c == ':') parts.emplace_back();
    else parts.back() += c;
  return parts;
}

}  // namespace

bool IsSerialLine(const std::string& address) { return address.rfind('/', 0) == 0; }

std::optional<HostAddress> HostAndPort(const std::string& address) {
  const bool bracket = address.starts_with('[');
  const auto colon = bracket                                                ? address.find("]:")
                     : std::count(address.begin(), address.end(), ':') <= 2 ? address.find(':')
                                                                            : address.rfind(':');  // IPv6, no brackets
  if (colon == std::string::npos) return std::nullopt;
  HostAddress out;
  out.host = address.substr(bracket, colon - bracket);
  const std::vector<std::string> numbers = Parts(address.substr(colon + bracket + 1));
  if (numbers.size() > 2 || !TakeNumber(numbers[0], 1, 65535, out.port)) return std::nullopt;
  if (numbers.size() == 2 && !TakeNumber(numbers[1], 1, kLastUnit, out.unit)) return std::nullopt;
  return out;
}

std::optional<SerialAddress> LineAndUnit(const std::string& address) {
  const std::vector<std::string> parts = Parts(address);
  SerialAddress out;
  out.line.device = parts[0];
  if (parts.size() > 1 && !TakeNumber(parts[1], 300, 12000000, out.line.baud)) return std::nullopt;
  if (parts.size() > 2) {
    if (parts[2].size() != 1 || std::string("NEO").find(parts[2]) == std::string::npos) return std::nullopt;
    out.line.parity = parts[2][0];
  }
  if (parts.size() > 4 || (parts.size() == 4 && !TakeNumber(parts[3], 1, kLastUnit, out.unit))) return std::nullopt;
  return out;
}

client::DriveClient ConnectTo(const std::string& address) {
  if (IsSerialLine(address)) {
    const std::optional<SerialAddress> serial = LineAndUnit(address);
    if (!serial)
      throw io::InputError("--connect " + address +
                           ": expected DEVICE[:BAUD[:PARITY[:UNIT]]], for instance /dev/ttyUSB0:115200:E:1; 300 to "
                           "12000000 baud, parity N, E or O, unit 1 to 247");
    return client::DriveClient(serial->line, serial->unit == 0 ? 1 : serial->unit);
  }
  const std::optional<HostAddress> at = HostAndPort(address);
  if (!at)
    throw io::InputError("--connect " + address +
                         ": expected HOST:PORT, for instance 127.0.0.1:1502, HOST:PORT:UNIT with a unit from 1 to 247 "
                         "behind a gateway, or a serial line, for instance /dev/ttyUSB0:115200");
  return client::DriveClient(at->host, at->port, at->unit);
}

void AddKeyOption(CLI::App& verb, std::string& path) {
  verb.add_option("--key", path, "file with the drive's key, if it takes signed tables only");
}

std::optional<client::Key> ReadKeyOption(const std::string& path) {
  return path.empty() ? std::nullopt : std::optional<client::Key>(client::ReadKey(path));
}

calibration::TableFile LayoutOf(client::DriveClient& drive, const codegen::Model& model) {
  calibration::TableFile layout = calibration::DefaultTable(model);
  const client::Identity id = drive.ReadIdentity();
  if (id.schema != layout.schema)
    throw client::RefusedError(
        fmt::format("{}: runs schema {:08X}, robot {} has {:08X}: is this the robot file that the drive was built for? "
                    "If the file was changed, generate and build the drive again",
                    drive.name(), id.schema, model.robot().name, layout.schema),
        0, core::Status::kWrongSchema);
  return layout;
}

}  // namespace armcal::tool
