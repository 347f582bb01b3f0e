// plant - computes what another joint's motion, position or load does in a joint.
#include <algorithm>
#include <cmath>
#include <optional>

#include "host_sim/machine/plant/joint_effects.hpp"
#include "host_sim/machine/plant/slipping_cells.hpp"
#include "host_sim/machine/plant/table.hpp"

namespace armcal::plant {
namespace {

constexpr double kPresliding_rad = 5e-4;  // of dry friction between two shafts

// A shaft that runs through this joint drags it along: dry friction and oil follow the other joint's motion alone.
class DraggingShaft : public JointEffect {
 public:
  DraggingShaft(const io::TomlReader& keys, int joint)
      : other_(ReadOtherJoint(keys, joint)),
        level_Nm_(keys.NotNegative("level_Nm", 0)),
        viscous_(keys.NotNegative("viscous_Nmsprad", 0)) {
    cell_.Add(1, kPresliding_rad);
  }
  double Torque(const JointState& s) const override {
    return level_Nm_ * cell_.At(Angle(s), s.memory) + viscous_ * s.all_qd[static_cast<std::size_t>(other_)];
  }
  std::size_t memory() const override { return 1; }
  void Begin(const JointState& s, std::span<double> m) const override { m[0] = Angle(s); }
  void Remember(const JointState& s, std::span<double> m) const override { cell_.Drag(Angle(s), m); }
  int other_joint() const override { return other_; }

 private:
  double Angle(const JointState& s) const { return s.all_q[static_cast<std::size_t>(other_)]; }

  int other_;
  double level_Nm_, viscous_;
  SlippingCells cell_;
};

// A motor's shaft that this joint turns, and the other one by a ratio: its bearing's friction acts on both.
class SharedShaft : public JointEffect {
 public:
  SharedShaft(const io::TomlReader& keys, int joint)
      : first_(joint),
        second_(ReadOtherJoint(keys, joint)),
        ratio_(keys.Number("ratio")),
        level_Nm_(keys.NotNegative("level_Nm", 0)),
        viscous_(keys.NotNegative("viscous_Nmsprad", 0)) {
    cell_.Add(1, kPresliding_rad);
  }
  double Torque(const JointState& s) const override {
    return lever_ * (level_Nm_ * cell_.At(Turned(s.all_q), s.memory) + viscous_ * Turned(s.all_qd));
  }
  std::size_t memory() const override { return 1; }
  void Begin(const JointState& s, std::span<double> m) const override { m[0] = Turned(s.all_q); }
  void Remember(const JointState& s, std::span<double> m) const override { cell_.Drag(Turned(s.all_q), m); }
  int other_joint() const override { return second_; }
  std::unique_ptr<const JointEffect> AtTheOtherJoint() const override {
    auto there = std::make_unique<SharedShaft>(*this);
    there->lever_ = ratio_;
    return there;
  }

 private:
  double Turned(std::span<const double> joints) const {
    return joints[static_cast<std::size_t>(first_)] + ratio_ * joints[static_cast<std::size_t>(second_)];
  }

  int first_, second_;
  double ratio_, level_Nm_, viscous_, lever_ = 1;
  SlippingCells cell_;
};

// Teeth of a wheel that the other joint's MOTOR turns on this joint's shaft.
class PassingTeeth : public JointEffect {
 public:
  PassingTeeth(const io::TomlReader& keys, int joint)
      : other_(ReadOtherJoint(keys, joint)),
        per_turn_(keys.Positive("per_motor_turn")),
        first_Nm_(keys.Positive("first_Nm")),
        phase_rad_(keys.Number("phase_rad", 0)) {}
  double Torque(const JointState& s) const override {
    return first_Nm_ * std::cos(per_turn_ * s.all_motor[static_cast<std::size_t>(other_)] + phase_rad_);
  }
  int other_joint() const override { return other_; }

 private:
  int other_;
  double per_turn_, first_Nm_, phase_rad_;
};

// A wheel that spins with the other joint while this joint swivels it.
class SpinningWheel : public JointEffect {
 public:
  SpinningWheel(const io::TomlReader& keys, int joint)
      : other_(ReadOtherJoint(keys, joint)), inertia_(keys.Number("inertia_kgm2")) {}
  double Torque(const JointState& s) const override {
    return inertia_ * s.qd_radps * s.all_qd[static_cast<std::size_t>(other_)];
  }
  int other_joint() const override { return other_; }

 private:
  int other_;
  double inertia_;
};

// Torque, dry or viscous friction over a signal of any joint, by points; a second table may multiply it. It has no
// cause: for the curves of the catalogue.
class ByPoints : public JointEffect {
 public:
  ByPoints(const io::TomlReader& keys, int joint) : first_(keys, joint, "at", "torque_Nm"), acts_(keys.Text("acts")) {
    if (acts_ != "torque" && acts_ != "dry" && acts_ != "viscous")
      keys.Fail("acts", "\"torque\", \"dry\" or \"viscous\"");
    if (!keys.Has("times")) return;
    const io::TomlReader times = keys.Table("times");
    second_.emplace(times, joint, "at", "factor");
    times.Finish();
  }
  double DryLevel(const JointState& s) const override { return acts_ == "dry" ? At(s) : 0; }
  double Drag(const JointState& s) const override { return acts_ == "viscous" ? At(s) * s.qd_radps : 0; }
  double Torque(const JointState& s) const override { return acts_ == "torque" ? At(s) : 0; }
  int other_joint() const override { return std::max(first_.other(), second_ ? second_->other() : -1); }

 private:
  class Curve {
   public:
    Curve(const io::TomlReader& keys, int joint, const std::string& at, const std::string& value)
        : joint_(keys.Has("of_joint") ? ReadOtherJoint(keys, joint) : joint),
          own_(joint_ == joint),
          over_(keys.Text("over")),
          table_(keys, at, value) {
      if (over_ != "q" && over_ != "qd" && over_ != "load" && (over_ != "temp" || !own_))
        keys.Fail("over", own_ ? "\"q\", \"qd\", \"load\" or \"temp\"" : "\"q\", \"qd\" or \"load\"");
    }
    double At(const JointState& s) const {
      const auto k = static_cast<std::size_t>(joint_);
      if (over_ == "temp") return table_.At(s.temperature_degC);
      return table_.At(over_ == "q" ? s.all_q[k] : over_ == "qd" ? s.all_qd[k] : s.all_load[k]);
    }
    int other() const { return own_ ? -1 : joint_; }

   private:
    int joint_;
    bool own_;
    std::string over_;
    Table table_;
  };

  double At(const JointState& s) const { return first_.At(s) * (second_ ? second_->At(s) : 1); }

  Curve first_;
  std::string acts_;
  std::optional<Curve> second_;
};

template <class Effect>
JointEffectReader PairOf() {
  return [](const io::TomlReader& keys, int joint) { return std::make_unique<const Effect>(keys, joint); };
}

}  // namespace

JointEffectReaders PairReaders() {
  return {{"coupled_friction", PairOf<DraggingShaft>()},
          {"wrist_coupling", PairOf<SharedShaft>()},
          {"cross_ripple", PairOf<PassingTeeth>()},
          {"velocity_product", PairOf<SpinningWheel>()},
          {"unknown", PairOf<ByPoints>()}};
}

}  // namespace armcal::plant
