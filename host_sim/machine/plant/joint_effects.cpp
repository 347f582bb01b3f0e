// plant - computes the physics of each joint effect, one class each.
#include "host_sim/machine/plant/joint_effects.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

namespace armcal::plant {
namespace {

// Mixed lubrication: the share of the load carried by asperities falls as the film builds up, ~ 1 / (1 + (v/vs)^2).
// With an exponent: Stribeck's empirical law, exp(-(v/vs)^exponent).
class Stribeck : public JointEffect {
 public:
  explicit Stribeck(const io::TomlReader& keys)
      : excess_Nm_(keys.Positive("excess_Nm")),
        speed_(keys.Positive("speed_radps")),
        exponent_(keys.Has("exponent") ? keys.Positive("exponent") : 0) {}
  double DryLevel(const JointState& s) const override {
    const double ratio = std::abs(s.qd_radps / speed_);
    return exponent_ > 0 ? excess_Nm_ * std::exp(-std::pow(ratio, exponent_)) : excess_Nm_ / (1 + ratio * ratio);
  }

 private:
  double excess_Nm_, speed_, exponent_;  // exponent 0: mixed lubrication
};

// Law (5) of the survey beside Coulomb and viscous friction: one term falls with speed, one comes with it.
class TwoExponentials : public JointEffect {
 public:
  explicit TwoExponentials(const io::TomlReader& keys)
      : excess_Nm_(keys.Number("excess_Nm")),
        falls_(keys.Positive("falls_radps")),
        late_Nm_(keys.Number("late_Nm")),
        comes_(keys.Positive("comes_radps")) {}
  double DryLevel(const JointState& s) const override {
    const double speed = std::abs(s.qd_radps);
    return excess_Nm_ * std::exp(-speed / falls_) + (speed > 0 ? late_Nm_ * std::exp(-comes_ / speed) : 0);
  }

 private:
  double excess_Nm_, falls_, late_Nm_, comes_;
};

// Law (6) of the survey: dry friction that is zero at rest and rises within a small speed; a part of it fades again.
class SmoothDry : public JointEffect {
 public:
  explicit SmoothDry(const io::TomlReader& keys)
      : excess_Nm_(keys.Number("excess_Nm")),
        rises_(keys.Positive("rises_radps")),
        falls_(keys.Positive("falls_radps")) {}
  double DryLevel(const JointState& s) const override {
    const double speed = std::abs(s.qd_radps), risen = std::tanh(speed / rises_);
    return s.coulomb_Nm * (risen - 1) + excess_Nm_ * risen / std::cosh(speed / falls_);
  }

 private:
  double excess_Nm_, rises_, falls_;
};

// Law (8) of the survey: drag by the cube root of speed. It counts as dry friction because it stops a slow joint.
class CubeRoot : public JointEffect {
 public:
  explicit CubeRoot(const io::TomlReader& keys) : at_one_Nm_(keys.Number("drag_at_1radps_Nm")) {}
  double DryLevel(const JointState& s) const override { return at_one_Nm_ * std::cbrt(std::abs(s.qd_radps)); }

 private:
  double at_one_Nm_;
};

// Tooth friction grows with the transmitted torque; preload hides the first part: mu (sqrt(load^2 + preload^2) -
// preload).
class GearMesh : public JointEffect {
 public:
  explicit GearMesh(const io::TomlReader& keys)
      : mu_(keys.Positive("mu")), preload_Nm_(keys.NotNegative("preload_Nm", 0)) {}
  double DryLevel(const JointState& s) const override {
    return mu_ * (std::hypot(s.load_Nm, preload_Nm_) - preload_Nm_);
  }

 private:
  double mu_, preload_Nm_;
};

// A worn or preloaded gear runs on other tooth flanks in each direction: two Coulomb levels, as ratios of the joint's
// own.
class Asymmetry : public JointEffect {
 public:
  explicit Asymmetry(const io::TomlReader& keys)
      : forward_ratio_(keys.NotNegative("forward_ratio")), backward_ratio_(keys.NotNegative("backward_ratio")) {}
  double DryLevel(const JointState& s) const override {
    return s.coulomb_Nm * ((s.direction > 0 ? forward_ratio_ : backward_ratio_) - 1);
  }

 private:
  double forward_ratio_, backward_ratio_;
};

// Residual of a gas counterweight: the gas is compressed as the joint moves on, torque (1 - c q)^-1.3; c = 0: a
// constant torque such as a brush bias or a wrong sensor zero gives.
class Counterweight : public JointEffect {
 public:
  explicit Counterweight(const io::TomlReader& keys)
      : torque_Nm_(keys.Number("torque_Nm")), compression_(keys.NotNegative("compression_per_rad", 0)) {
    if (compression_ > 0.2) keys.Fail("compression_per_rad", "a number from 0 to 0.2");
  }
  double Torque(const JointState& s) const override {
    return torque_Nm_ * std::pow(std::max(0.1, 1 - compression_ * s.q_rad), -1.3);
  }

 private:
  double torque_Nm_, compression_;
};

// Lubricant viscosity by Vogel's law, nu(T) ~ exp(B / (T - T_vogel)), 1 at the reference temperature.
class Lubricant : public JointEffect {
 public:
  explicit Lubricant(const io::TomlReader& keys)
      : b_K_(keys.Positive("vogel_b_K")),
        vogel_degC_(keys.Number("vogel_degC")),
        reference_degC_(keys.Number("reference_degC")) {
    if (reference_degC_ <= vogel_degC_ + 1) keys.Fail("reference_degC", "a temperature above vogel_degC + 1");
  }
  double Drag(const JointState& s) const override {
    const double above = std::max(1.0, s.temperature_degC - vogel_degC_);
    return s.viscous_Nm * (std::exp(b_K_ / above - b_K_ / (reference_degC_ - vogel_degC_)) - 1);
  }

 private:
  double b_K_, vogel_degC_, reference_degC_;
};

// Periodic torque of motor poles, gear teeth or an eccentric: two harmonics of `per_motor_turn` in the MOTOR's angle.
class Ripple : public JointEffect {
 public:
  explicit Ripple(const io::TomlReader& keys)
      : per_turn_(keys.Positive("per_motor_turn")),
        first_Nm_(keys.NotNegative("first_Nm")),
        second_Nm_(keys.NotNegative("second_Nm", 0)),
        phase_rad_(keys.Number("phase_rad", 0)) {}
  double Torque(const JointState& s) const override {
    const double angle = per_turn_ * s.motor_angle_rad + phase_rad_;
    return first_Nm_ * std::cos(angle) + second_Nm_ * std::sin(2 * angle);
  }

 private:
  double per_turn_, first_Nm_, second_Nm_, phase_rad_;
};

// A hose and cable pack twisted about its neutral angle stiffens: k s sinh((q - q0) / s).
class CablePack : public JointEffect {
 public:
  explicit CablePack(const io::TomlReader& keys)
      : stiffness_(keys.Positive("stiffness_Nmprad")),
        neutral_rad_(keys.Number("neutral_rad", 0)),
        stiffening_rad_(keys.Positive("stiffening_rad")) {}
  double Torque(const JointState& s) const override {
    return stiffness_ * stiffening_rad_ * std::sinh((s.q_rad - neutral_rad_) / stiffening_rad_);
  }

 private:
  double stiffness_, neutral_rad_, stiffening_rad_;
};

// Gears churning in oil: drag ~ |v|^p with p between 2 and 3.
class Churning : public JointEffect {
 public:
  explicit Churning(const io::TomlReader& keys)
      : at_one_Nm_(keys.Positive("drag_at_1radps_Nm")), exponent_(keys.Positive("exponent", 2.7)) {}
  double Drag(const JointState& s) const override {
    return std::copysign(at_one_Nm_ * std::pow(std::abs(s.qd_radps), exponent_), s.qd_radps);
  }

 private:
  double at_one_Nm_, exponent_;
};

// A weight balancer: a spring of free length l0 between a point at radius r on the link and an anchor at distance h.
class SpringBalancer : public JointEffect {
 public:
  explicit SpringBalancer(const io::TomlReader& keys)
      : rate_Npm_(keys.Positive("rate_Npm")),
        crank_m_(keys.Positive("crank_m")),
        anchor_m_(keys.Positive("anchor_m")),
        free_m_(keys.NotNegative("free_length_m", 0)),
        top_rad_(keys.Number("top_rad", 0)) {
    if (crank_m_ == anchor_m_) keys.Fail("crank_m", "another length than anchor_m");
  }
  // Length by the law of cosines; torque of the motor = d(energy)/dq.
  double Torque(const JointState& s) const override {
    const double angle = s.q_rad - top_rad_;
    const double length =
        std::sqrt(crank_m_ * crank_m_ + anchor_m_ * anchor_m_ - 2 * crank_m_ * anchor_m_ * std::cos(angle));
    return rate_Npm_ * (1 - free_m_ / length) * crank_m_ * anchor_m_ * std::sin(angle);
  }

 private:
  double rate_Npm_, crank_m_, anchor_m_, free_m_, top_rad_;
};

using Reader = std::function<std::unique_ptr<const JointEffect>(const io::TomlReader&)>;

template <class Effect>
Reader ReaderOf() {
  return [](const io::TomlReader& keys) { return std::make_unique<const Effect>(keys); };
}

const std::map<std::string, Reader>& Readers() {
  static const std::map<std::string, Reader> readers = {{"stribeck", ReaderOf<Stribeck>()},
                                                        {"friction_exponential", ReaderOf<TwoExponentials>()},
                                                        {"friction_sech_tanh", ReaderOf<SmoothDry>()},
                                                        {"viscous_cuberoot", ReaderOf<CubeRoot>()},
                                                        {"load_friction", ReaderOf<GearMesh>()},
                                                        {"coulomb_asymmetry", ReaderOf<Asymmetry>()},
                                                        {"torque_offset", ReaderOf<Counterweight>()},
                                                        {"temp_viscous", ReaderOf<Lubricant>()},
                                                        {"torque_ripple", ReaderOf<Ripple>()},
                                                        {"cable_pack", ReaderOf<CablePack>()},
                                                        {"viscous_cubic", ReaderOf<Churning>()},
                                                        {"gravity_spring", ReaderOf<SpringBalancer>()}};
  return readers;
}

}  // namespace

std::unique_ptr<const JointEffect> ReadJointEffect(const std::string& kind, const io::TomlReader& keys) {
  const auto reader = Readers().find(kind);
  if (reader == Readers().end()) keys.Fail("kind", "one of: " + JointEffectKinds() + ", payload_step, base_tilt");
  return reader->second(keys);
}

std::string JointEffectKinds() {
  std::string text;
  for (const auto& [kind, reader] : Readers()) text += (text.empty() ? "" : ", ") + kind;
  return text;
}

}  // namespace armcal::plant
