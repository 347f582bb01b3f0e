// cli - connects and checks that drive and model speak of the same table.
#include "host_sim/cli/connect.hpp"

#include <fmt/core.h>
#include <charconv>

#include "host_sim/io/input_error.hpp"

namespace armcal::cli {

client::DriveClient ConnectTo(const std::string& host_port) {
  const auto colon = host_port.rfind(':');
  int port = 0;
  const char* begin = host_port.c_str() + colon + 1;
  if (colon == std::string::npos ||
      std::from_chars(begin, host_port.c_str() + host_port.size(), port).ec != std::errc() || port < 1 || port > 65535)
    throw io::InputError("--connect " + host_port + ": expected HOST:PORT, for instance 127.0.0.1:1502");
  return client::DriveClient(host_port.substr(0, colon), port);
}

calibration::TableFile LayoutOf(client::DriveClient& drive, const codegen::Model& model) {
  calibration::TableFile layout = calibration::DefaultTable(model);
  const client::Identity id = drive.ReadIdentity();
  if (id.schema != layout.schema)
    throw client::RefusedError(
        fmt::format("{}: runs schema {:08X}, robot {} has {:08X}: generate and build the drive for this robot file",
                    drive.name(), id.schema, model.robot().name, layout.schema),
        0, core::Status::kWrongSchema);
  return layout;
}

}  // namespace armcal::cli
