// plant - computes friction that remembers where the joint has been: elastic cells that slip, and bristles.
#include <algorithm>
#include <cmath>

#include "host_sim/machine/plant/joint_effects.hpp"
#include "host_sim/machine/plant/slipping_cells.hpp"

namespace armcal::plant {
namespace {

constexpr int kCells = 24;

// Elastic cells between the joint's two sides.
class SlipsWithTheJoint : public JointEffect {
 public:
  std::size_t memory() const override { return cells_.count(); }
  void Begin(const JointState& s, std::span<double> m) const override { std::fill(m.begin(), m.end(), s.q_rad); }
  void Remember(const JointState& s, std::span<double> m) const override { cells_.Drag(s.q_rad, m); }

 protected:
  double Slip(const JointState& s) const { return cells_.At(s.q_rad, s.memory); }
  SlippingCells cells_;
};

// Asperities of many sizes (Iwan's distribution of Jenkin elements) carry the Coulomb friction: each one is a spring
// until it slips. Their lengths are the quantiles of an exponential distribution.
class Asperities : public SlipsWithTheJoint {
 public:
  explicit Asperities(const io::TomlReader& keys) {
    const double mean_rad = keys.Positive("length_rad");
    for (int i = 0; i < kCells; ++i) cells_.Add(1.0 / kCells, -mean_rad * std::log1p(-(i + 0.5) / kCells));
  }
  double DryLevel(const JointState& s) const override { return -s.coulomb_Nm; }
  double Drag(const JointState& s) const override { return s.coulomb_Nm * Slip(s); }
};

// Further friction in a few elastic parts that slip one after the other: a harmonic drive's flex spline, a cable guide.
class SlippingParts : public SlipsWithTheJoint {
 public:
  explicit SlippingParts(const io::TomlReader& keys) : level_Nm_(keys.Positive("level_Nm")) {
    const auto lengths = keys.Numbers("lengths_rad");
    for (const double length : lengths) {
      if (length <= 0) keys.Fail("lengths_rad", "numbers above zero");
      cells_.Add(1.0 / static_cast<double>(lengths.size()), length);
    }
    if (lengths.empty()) keys.Fail("lengths_rad", "one number or more");
  }
  double Drag(const JointState& s) const override { return level_Nm_ * Slip(s); }

 private:
  double level_Nm_;
};

// LuGre: bristles of one stiffness bend by z and slip; z' = v - |v| z / g(v), torque = stiffness z + damping z'. Here
// g falls as mixed lubrication does. Memory: the position, and z over the bending length.
class Bristles : public JointEffect {
 public:
  explicit Bristles(const io::TomlReader& keys)
      : length_rad_(keys.Positive("length_rad")),
        breakaway_(keys.NotNegative("breakaway_ratio", 1)),
        speed_(keys.Positive("speed_radps")),
        damping_s_(keys.NotNegative("damping_s", 0)) {
    if (breakaway_ < 1) keys.Fail("breakaway_ratio", "a number not below 1");
  }
  double DryLevel(const JointState& s) const override { return -s.coulomb_Nm; }
  double Drag(const JointState& s) const override {
    const double z = Bent(s), v = s.qd_radps / length_rad_;
    return s.coulomb_Nm * (z + damping_s_ * (v - std::abs(v) * z / Level(s)));
  }
  std::size_t memory() const override { return 2; }
  void Begin(const JointState& s, std::span<double> m) const override { m[0] = s.q_rad, m[1] = 0; }
  void Remember(const JointState& s, std::span<double> m) const override {
    m[1] = Bent(s);
    m[0] = s.q_rad;
  }

 private:
  double Level(const JointState& s) const {
    const double ratio = s.qd_radps / speed_;
    return 1 + (breakaway_ - 1) / (1 + ratio * ratio);
  }
  // The bending at s, moved from the remembered place at the present level.
  double Bent(const JointState& s) const {
    const double path = (s.q_rad - s.memory[0]) / length_rad_, level = Level(s), end = std::copysign(level, path);
    return end + (s.memory[1] - end) * std::exp(-std::abs(path) / level);
  }

  double length_rad_, breakaway_, speed_, damping_s_;
};

}  // namespace

JointEffectReaders BristleReaders() {
  return {{"presliding_dahl", ReaderOf<Asperities>()},
          {"hysteresis", ReaderOf<SlippingParts>()},
          {"presliding_lugre", ReaderOf<Bristles>()}};
}

}  // namespace armcal::plant
