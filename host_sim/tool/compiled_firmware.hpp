// tool - compiles parts of the firmware for a robot, each once, and keeps them in the user's cache.
#pragma once

#include <filesystem>

#include "codegen/src/generator/model.hpp"

namespace armcal::tool {

enum class FirmwarePart {
  kDrive,       // the controller behind Modbus, for the simulated drive
  kEstimators,  // for armcal estimate
};

// The shared object of `model`, in ${XDG_CACHE_HOME:-~/.cache}/armcal/<schema>-<version>. The version is a hash of the
// generated model, of the sources and of the options. If it is not there, the sources of the checkout are compiled with
// $CXX or g++, and stderr says so. Several starts at once compile it once. Throws io::InputError: no compiler; the
// compiler fails, with the file that holds its output; no folder to write to.
std::filesystem::path CompiledFirmware(const codegen::Model& model, FirmwarePart part);

}  // namespace armcal::tool
