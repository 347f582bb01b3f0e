// plant - computes friction of one joint that depends on the present only: speed, load, temperature, time, position.
#include <algorithm>
#include <cmath>

#include "host_sim/machine/plant/joint_effects.hpp"
#include "host_sim/machine/plant/table.hpp"

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

// Coulomb and viscous friction that the robot file does not have: a seal that was fitted later.
class SecondSeal : public JointEffect {
 public:
  explicit SecondSeal(const io::TomlReader& keys)
      : level_Nm_(keys.NotNegative("level_Nm", 0)), viscous_(keys.NotNegative("viscous_Nmsprad", 0)) {}
  double DryLevel(const JointState&) const override { return level_Nm_; }
  double Drag(const JointState& s) const override { return viscous_ * s.qd_radps; }

 private:
  double level_Nm_, viscous_;
};

// A film that collapses around a speed: 4 x^2 / (1 + x^2)^2 with x = v / speed is 1 there, 0 at rest and at high speed.
class FilmCollapse : public JointEffect {
 public:
  explicit FilmCollapse(const io::TomlReader& keys)
      : excess_Nm_(keys.Positive("excess_Nm")), speed_(keys.Positive("speed_radps")) {}
  double DryLevel(const JointState& s) const override {
    const double x = s.qd_radps / speed_, below = 1 + x * x;
    return excess_Nm_ * 4 * x * x / (below * below);
  }

 private:
  double excess_Nm_, speed_;
};

// Dry friction measured at some speeds, in the place of the Coulomb level; straight lines between.
class MeasuredFriction : public JointEffect {
 public:
  explicit MeasuredFriction(const io::TomlReader& keys) : level_Nm_(keys, "speeds_radps", "levels_Nm") {}
  double DryLevel(const JointState& s) const override { return level_Nm_.At(std::abs(s.qd_radps)) - s.coulomb_Nm; }

 private:
  Table level_Nm_;
};

// Oil that is thrown about turbulently: the square of speed.
class Turbulence : public JointEffect {
 public:
  explicit Turbulence(const io::TomlReader& keys) : at_one_Nm_(keys.Positive("drag_at_1radps_Nm")) {}
  double Drag(const JointState& s) const override { return at_one_Nm_ * s.qd_radps * std::abs(s.qd_radps); }

 private:
  double at_one_Nm_;
};

// A lip seal pumps oil under itself in one direction: two viscous coefficients, as ratios of the joint's own.
class PumpingSeal : public JointEffect {
 public:
  explicit PumpingSeal(const io::TomlReader& keys)
      : forward_ratio_(keys.NotNegative("forward_ratio")), backward_ratio_(keys.NotNegative("backward_ratio")) {}
  double Drag(const JointState& s) const override {
    return s.viscous_Nm * ((s.qd_radps > 0 ? forward_ratio_ : backward_ratio_) - 1);
  }

 private:
  double forward_ratio_, backward_ratio_;
};

// A rubber seal softens as it warms and presses less: Coulomb level x exp(-(T - reference) / softening).
class SofteningSeal : public JointEffect {
 public:
  explicit SofteningSeal(const io::TomlReader& keys)
      : softening_K_(keys.Positive("softening_K")), reference_degC_(keys.Number("reference_degC")) {}
  double DryLevel(const JointState& s) const override {
    return s.coulomb_Nm * std::expm1((reference_degC_ - s.temperature_degC) / softening_K_);
  }

 private:
  double softening_K_, reference_degC_;
};

// A seal settles: its level tends to (1 + change) x Coulomb, fast at first.
class SettlingSeal : public JointEffect {
 public:
  explicit SettlingSeal(const io::TomlReader& keys)
      : change_(keys.Number("change")), time_s_(keys.Positive("time_constant_s")) {
    if (change_ < -1) keys.Fail("change", "a number not below -1");
  }
  double DryLevel(const JointState& s) const override {
    return s.coulomb_Nm * change_ * -std::expm1(-s.since_s / time_s_);
  }

 private:
  double change_, time_s_;
};

// Air is beaten into the oil: viscous torque x (1 + change t / (t + time)).
class FoamingOil : public JointEffect {
 public:
  explicit FoamingOil(const io::TomlReader& keys)
      : change_(keys.Number("change")), time_s_(keys.Positive("half_time_s")) {
    if (change_ < -1) keys.Fail("change", "a number not below -1");
  }
  double Drag(const JointState& s) const override { return s.viscous_Nm * change_ * s.since_s / (s.since_s + time_s_); }

 private:
  double change_, time_s_;
};

// Wheels out of round press on each other more and less as the MOTOR turns: Coulomb level x (1 + depth cos(angle)).
class EccentricMesh : public JointEffect {
 public:
  explicit EccentricMesh(const io::TomlReader& keys)
      : per_turn_(keys.Positive("per_motor_turn")),
        depth_(keys.NotNegative("depth")),
        phase_rad_(keys.Number("phase_rad", 0)) {
    if (depth_ > 1) keys.Fail("depth", "a number from 0 to 1");
  }
  double DryLevel(const JointState& s) const override {
    return s.coulomb_Nm * depth_ * std::cos(per_turn_ * s.motor_angle_rad + phase_rad_);
  }

 private:
  double per_turn_, depth_, phase_rad_;
};

// A dent in a bearing's race: level / (1 + ((q - at) / width)^2).
class TightSpot : public JointEffect {
 public:
  explicit TightSpot(const io::TomlReader& keys)
      : level_Nm_(keys.Positive("level_Nm")), at_rad_(keys.Number("at_rad")), width_rad_(keys.Positive("width_rad")) {}
  double DryLevel(const JointState& s) const override {
    const double off = (s.q_rad - at_rad_) / width_rad_;
    return level_Nm_ / (1 + off * off);
  }

 private:
  double level_Nm_, at_rad_, width_rad_;
};

// A journal that runs eccentrically in its bush: the oil film is 1 - e cos(q - at) thick, and drags in inverse
// proportion.
class EccentricFilm : public JointEffect {
 public:
  explicit EccentricFilm(const io::TomlReader& keys)
      : eccentricity_(keys.Positive("eccentricity")), at_rad_(keys.Number("at_rad", 0)) {
    if (eccentricity_ >= 1) keys.Fail("eccentricity", "a number above 0 and below 1");
  }
  double Drag(const JointState& s) const override {
    return s.viscous_Nm * (1 / (1 - eccentricity_ * std::cos(s.q_rad - at_rad_)) - 1);
  }

 private:
  double eccentricity_, at_rad_;
};

}  // namespace

JointEffectReaders FrictionReaders() {
  return {{"stribeck", ReaderOf<Stribeck>()},
          {"friction_exponential", ReaderOf<TwoExponentials>()},
          {"friction_sech_tanh", ReaderOf<SmoothDry>()},
          {"viscous_cuberoot", ReaderOf<CubeRoot>()},
          {"load_friction", ReaderOf<GearMesh>()},
          {"coulomb_asymmetry", ReaderOf<Asymmetry>()},
          {"temp_viscous", ReaderOf<Lubricant>()},
          {"viscous_cubic", ReaderOf<Churning>()},
          {"coulomb_viscous", ReaderOf<SecondSeal>()},
          {"stribeck_basis", ReaderOf<FilmCollapse>()},
          {"friction_table", ReaderOf<MeasuredFriction>()},
          {"viscous_quadratic", ReaderOf<Turbulence>()},
          {"viscous_asymmetry", ReaderOf<PumpingSeal>()},
          {"temp_coulomb", ReaderOf<SofteningSeal>()},
          {"time_varying_coulomb", ReaderOf<SettlingSeal>()},
          {"time_varying_viscous", ReaderOf<FoamingOil>()},
          {"meshing_friction", ReaderOf<EccentricMesh>()},
          {"position_friction", ReaderOf<TightSpot>()},
          {"position_viscous", ReaderOf<EccentricFilm>()}};
}

}  // namespace armcal::plant
