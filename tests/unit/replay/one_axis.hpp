// tests - one axis with viscous and Coulomb friction, solved exactly: M v' = F - offset - Fc sgn(v) - Fv v.
#pragma once

#include <cmath>
#include <map>

#include "host_sim/identify/replay/refine.hpp"

namespace armcal::tests {

// codegen/robots/emps.toml: a prismatic axis across gravity, no prior.
inline const codegen::Model& AxisModel() {
  static const codegen::Model model(codegen::ReadRobot("codegen/robots/emps.toml"),
                                    codegen::ReadCatalogue("codegen/effects"));
  return model;
}

struct Axis {
  double M = 2, Fv = 4, Fc = 3, offset = 0;

  replay::Parameters parameters() const {
    const std::map<std::string, double> value{{"m1R", M}, {"Fv1", Fv}, {"Fc1", Fc}, {"torque_offset.To1", offset}};
    replay::Parameters p{Eigen::VectorXd::Zero(AxisModel().columns()), Eigen::VectorXd::Zero(1)};
    for (int c = 0; c < AxisModel().columns(); ++c) p.z[c] = value.at(AxisModel().column_name(c));
    return p;
  }

  // Moves q and v by `time` under a constant force, exactly: exponentials between the instants at which it stops.
  void Move(double force, double time, double& q, double& v) const {
    const double f = force - offset;
    while (time > 0) {
      if (v == 0 && std::abs(f) <= Fc) return;  // friction holds it
      const double sign = v != 0 ? std::copysign(1.0, v) : std::copysign(1.0, f);
      const double end = (f - sign * Fc) / Fv, tau = M / Fv;  // the speed that it tends to, and how fast
      const double stop = end * sign < 0 ? tau * std::log(1 - v / end) : HUGE_VAL;
      const double part = std::min(time, stop), decay = std::exp(-part / tau);
      q += end * part + (v - end) * tau * (1 - decay);
      v = part == stop ? 0 : end + (v - end) * decay;
      time -= part;
    }
  }
};

}  // namespace armcal::tests
