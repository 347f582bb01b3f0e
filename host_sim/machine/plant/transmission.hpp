// plant - computes the torque that an elastic belt, a gear that gives way, or a gear with play hands to its link.
//
// Motor and link of such a joint are two masses. The motor's side has the friction, the rotor and the encoder.
#pragma once

#include <cmath>
#include <string>

#include "codegen/src/io/toml_reader.hpp"

namespace armcal::plant {

struct Transmission {
  std::string kind;
  int joint = 0;  // from 0
  double stiffness_Nmprad = 0, damping_Nmsprad = 0, gap_rad = 0;
  double stiffening_rad = 0;  // deflection at which the stiffness has doubled; 0: it does not stiffen

  // On the link, where the link is `deflection` ahead of its motor. Inside the gap nothing touches; flanks only push.
  double Torque(double deflection_rad, double rate_radps) const {
    const double in = std::abs(deflection_rad) - 0.5 * gap_rad;
    if (in <= 0) return 0;
    const double more = stiffening_rad > 0 ? in / stiffening_rad : 0;
    const double side = deflection_rad > 0 ? 1 : -1;
    const double push = stiffness_Nmprad * in * (1 + more * more) + damping_Nmsprad * side * rate_radps;
    return gap_rad > 0 && push < 0 ? 0 : -side * push;
  }
  // The deflection at which the link hangs at rest; without a load in the middle of the gap.
  double Hanging(double torque_Nm) const {
    if (torque_Nm == 0) return 0;
    double low = -1, high = 1;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (Torque(middle, 0) > torque_Nm ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }
};

inline bool IsTransmission(const std::string& kind) {
  return kind == "belt_elasticity" || kind == "joint_compliance" || kind == "backlash";
}

inline Transmission ReadTransmission(const std::string& kind, int joint, const io::TomlReader& keys) {
  Transmission t;
  t.kind = kind, t.joint = joint;
  t.stiffness_Nmprad = keys.Positive("stiffness_Nmprad");
  t.damping_Nmsprad = keys.NotNegative("damping_Nmsprad", 0);
  if (kind == "backlash") t.gap_rad = keys.Positive("gap_rad");
  if (kind == "joint_compliance") t.stiffening_rad = keys.NotNegative("stiffening_rad", 0);
  return t;
}

}  // namespace armcal::plant
