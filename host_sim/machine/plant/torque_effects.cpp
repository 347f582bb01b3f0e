// plant - computes torque in one joint that is no friction.
#include <algorithm>
#include <cmath>

#include "host_sim/machine/plant/joint_effects.hpp"

namespace armcal::plant {
namespace {

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

// A hose that comes tight beyond an angle: rate (side (q - from))^1.5 towards that side.
class TightHose : public JointEffect {
 public:
  explicit TightHose(const io::TomlReader& keys)
      : at_1rad_Nm_(keys.Positive("torque_at_1rad_Nm")),
        from_rad_(keys.Number("from_rad")),
        side_(static_cast<int>(keys.Integer("side", -1, 1, 1))) {
    if (side_ == 0) keys.Fail("side", "-1 or 1");
  }
  double Torque(const JointState& s) const override {
    return side_ * at_1rad_Nm_ * std::pow(std::max(0.0, side_ * (s.q_rad - from_rad_)), 1.5);
  }

 private:
  double at_1rad_Nm_, from_rad_;
  int side_;
};

// A branch that carries a share of the gear's load past the link.
class LoadShare : public JointEffect {
 public:
  explicit LoadShare(const io::TomlReader& keys) : share_(keys.Number("share")) {
    // The load follows the acceleration, which follows this torque.
    if (std::abs(share_) > 0.5) keys.Fail("share", "a number from -0.5 to 0.5");
  }
  double Torque(const JointState& s) const override { return share_ * s.load_Nm; }

 private:
  double share_;
};

}  // namespace

JointEffectReaders TorqueReaders() {
  return {{"torque_offset", ReaderOf<Counterweight>()}, {"torque_ripple", ReaderOf<Ripple>()},
          {"cable_pack", ReaderOf<CablePack>()},        {"gravity_spring", ReaderOf<SpringBalancer>()},
          {"position_torque", ReaderOf<TightHose>()},   {"load_linear", ReaderOf<LoadShare>()}};
}

}  // namespace armcal::plant
