// tool - reads the address of a drive, connects, and gives the layout of its table.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <utility>

#include "host_sim/client/drive_client.hpp"
#include "host_sim/client/key_file.hpp"
#include "host_sim/identify/calibration/table_file.hpp"

namespace armcal::tool {

// What --connect takes: "HOST:PORT[:UNIT]", or a serial line "DEVICE[:BAUD[:PARITY[:UNIT]]]" whose device is a path
// from the root; 115200, E and unit 1 if left out. The host may be an IPv6 address, in brackets, or without them and
// without a unit. Throws io::InputError (form), client::LinkError.
client::DriveClient ConnectTo(const std::string& address);
// IsSerialLine tells the two forms apart. The others split them; nothing if an address has not this form.
bool IsSerialLine(const std::string& address);
struct HostAddress {
  std::string host;
  int port = 0, unit = 1;
};
std::optional<HostAddress> HostAndPort(const std::string& address);
struct SerialAddress {
  client::SerialLine line;
  int unit = 0;  // 0: left out
};
std::optional<SerialAddress> LineAndUnit(const std::string& address);
inline constexpr int kLastUnit = 247;  // of Modbus
inline constexpr char kConnectHelp[] = "drive: HOST:PORT[:UNIT], or a serial line as /dev/ttyUSB0[:115200[:E[:1]]]";

// The file with the key of a drive that takes signed tables only. Throws io::InputError.
void AddKeyOption(CLI::App& verb, std::string& path);
std::optional<client::Key> ReadKeyOption(const std::string& path);
inline const client::Key* KeyOf(const std::optional<client::Key>& key) { return key ? &*key : nullptr; }

// The layout that the drive's schema names: the default table of `model`. Throws client::RefusedError if the drive runs
// another one.
calibration::TableFile LayoutOf(client::DriveClient& drive, const codegen::Model& model);

}  // namespace armcal::tool
