// robot - the [payload] table: a body clamped to the flange.
//
//   [payload]                 # flange axes (tool_frame), inertia about the centre
//   mass_kg = 5.0
//   center_m = [0.0, 0.02, 0.08]
//   inertia_kgm2 = [0.02, 0.0, 0.0, 0.02, 0.0, 0.01]   # xx xy xz yy yz zz
// The same table at the end of a robot file makes the last link carry it.
#pragma once

#include <array>
#include <filesystem>
#include <optional>

#include <Eigen/Geometry>

#include "codegen/src/robot/robot.hpp"

namespace armcal::io {
class TomlReader;
}

namespace armcal::codegen {

struct Payload {
  double mass_kg = 0;
  std::optional<std::array<double, 3>> center_m;      // flange axes
  std::optional<std::array<double, 6>> inertia_kgm2;  // about the centre; only with a centre
};

// in: the [payload] table itself. Throws io::InputError: no mass, an inertia without a centre, an unknown key.
Payload ReadPayload(const io::TomlReader& in);
// A file that holds nothing but that table.
Payload ReadPayload(const std::filesystem::path& path);

// The link and a payload whose centre and inertia are known as one body. flange: its pose in the link's frame.
Link Carrying(const Link& link, const Eigen::Isometry3d& flange, const Payload& payload);

}  // namespace armcal::codegen
