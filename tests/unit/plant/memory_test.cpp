// plant - tests friction that remembers: Masing's rule, the bristles' own equation, and a joint that springs back.
#include "tests/unit/plant/bench.hpp"

namespace armcal::plant {
namespace {

using namespace bench;

// An effect that is led from place to place, in steps of at most `step`.
class Led {
 public:
  Led(const std::string& kind, const std::string& keys) : effect_(Make(kind, keys)), memory_(effect_->memory()) {
    effect_->Begin({.q_rad = 0}, memory_);
  }
  double To(double q, double step = 1e-4, double speed = 0.1) {
    const int steps = std::max(1, static_cast<int>(std::lround(std::abs(q - q_) / step)));
    const double begin = q_;
    JointState s{.coulomb_Nm = 10};
    for (int k = 1; k <= steps; ++k) {
      s.q_rad = q_ = begin + (q - begin) * k / steps;
      s.qd_radps = q > begin ? speed : -speed;
      s.memory = memory_;
      effect_->Remember(s, memory_);
    }
    return effect_->Drag(s);
  }

 private:
  std::unique_ptr<const JointEffect> effect_;
  std::vector<double> memory_;
  double q_ = 0;
};

// Masing: a branch after a turn is the first loading at half the size, twice as high.
TEST(SlippingCells, FollowMasingsRule) {
  const std::pair<std::string, std::string> kinds[] = {
      {"presliding_dahl", "length_rad = 0.01"}, {"hysteresis", "level_Nm = 10.0\nlengths_rad = [0.002, 0.01, 0.05]"}};
  for (const auto& [kind, keys] : kinds) {
    const auto first = [&](double q) { return Led(kind, keys).To(q); };
    Led led(kind, keys);
    const double turn = 0.013, at_turn = led.To(turn);
    EXPECT_NEAR(at_turn, first(turn), 1e-9) << kind;
    for (const double back : {0.001, 0.004, 0.011, 0.02})
      EXPECT_NEAR(led.To(turn - back), at_turn - 2 * first(0.5 * back), 1e-9) << kind << " " << back;
  }
}

TEST(SlippingCells, SlideAtTheirLevelAndLoseItAtATurn) {
  Led led("presliding_dahl", "length_rad = 0.01");
  EXPECT_NEAR(led.To(1), 10, 1e-12);  // all cells slip
  EXPECT_LT(led.To(1 - 0.02), 0);
  EXPECT_NEAR(led.To(0), -10, 1e-12);
  EXPECT_DOUBLE_EQ(Make("presliding_dahl", "length_rad = 0.01")->DryLevel({.coulomb_Nm = 10}), -10);
  EXPECT_DOUBLE_EQ(Make("hysteresis", "level_Nm = 1.0\nlengths_rad = [0.1]")->DryLevel({.coulomb_Nm = 10}), 0);
}

TEST(Bristles, FollowTheirDifferentialEquation) {
  const double length = 0.01, v = 0.05, level = 1 + 0.4 / (1 + 0.25);  // speed 0.1: (v / speed)^2 = 1/4
  Led led("presliding_lugre", "length_rad = 0.01\nbreakaway_ratio = 1.4\nspeed_radps = 0.1\ndamping_s = 0.004");
  double z = 0, moved = 0;
  const auto torque = [&](double way) { return 10 * (z + 0.004 * (way * v / length) * (1 - way * z / level)); };
  for (const double target : {0.012, 0.004, 0.3}) {  // fine Euler steps of z' = (v - |v| z / g) / length
    const double way = target > moved ? 1 : -1, h = 1e-7;
    for (long k = std::lround(std::abs(target - moved) / h); k > 0; --k) z += (way * h - h * z / level) / length;
    moved = target;
    EXPECT_NEAR(led.To(target, 1e-4, v), torque(way), 1e-3) << target;
  }
  EXPECT_NEAR(led.To(0.5, 1e-4, v), 10 * level, 1e-6);
}

TEST(Asperities, InTheArm_SpringBackBelowTheirLevel) {
  const std::string robot = WriteText("one.toml", RobotText({{.coulomb = 30}}));
  Arm arm(MakeScenario("[[effect]]\nkind = \"presliding_dahl\"\njoint = 1\nlength_rad = 0.01\n"), robot);
  Sensors sensors;
  const auto hold = [&](double torque) {
    double mean = 0;
    for (int k = 0; k < 4000; ++k) {
      arm.Step(std::vector<double>{CurrentFor(arm, 0, torque)}, sensors);
      if (k >= 3000) mean += arm.q()[0] / 1000;
    }
    return mean;
  };
  const double pushed = hold(6), back = hold(0);
  EXPECT_GT(pushed, 5e-4);
  EXPECT_LT(pushed, 0.02);  // below the level nothing slides away
  EXPECT_LT(std::abs(back), 0.6 * pushed);
}

}  // namespace
}  // namespace armcal::plant
