// plant - reads a frame {xyz_m, rpy_deg} from a TOML table.
#pragma once

#include <numbers>

#include <kdl/frames.hpp>

#include "codegen/src/io/toml_reader.hpp"

namespace armcal::plant {

inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;

// xyz_m: origin; rpy_deg: rotation about the fixed x, then y, then z axis (Rz Ry Rx). Each may be absent: zero.
inline KDL::Frame ReadFrame(const io::TomlReader& keys) {
  KDL::Frame frame;
  if (keys.Has("xyz_m")) {
    const auto xyz = keys.Numbers("xyz_m", 3);
    frame.p = KDL::Vector(xyz[0], xyz[1], xyz[2]);
  }
  if (keys.Has("rpy_deg")) {
    const auto rpy = keys.Numbers("rpy_deg", 3);
    frame.M = KDL::Rotation::RPY(rpy[0] * kRadPerDeg, rpy[1] * kRadPerDeg, rpy[2] * kRadPerDeg);
  }
  keys.Finish();
  return frame;
}

}  // namespace armcal::plant
