// cli - HOST:PORT and the table layout of the drive that answers there; knows no verb.
#pragma once

#include <string>

#include "host_sim/calibration/table_file.hpp"
#include "host_sim/client/drive_client.hpp"

namespace armcal::cli {

// "HOST:PORT" -> a connection. Throws io::InputError (form), client::LinkError.
client::DriveClient ConnectTo(const std::string& host_port);

// The layout that the drive's schema names: the default table of `model`. Throws client::RefusedError if the drive runs
// another one.
calibration::TableFile LayoutOf(client::DriveClient& drive, const codegen::Model& model);

}  // namespace armcal::cli
