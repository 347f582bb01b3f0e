// estimator - an arm of any model that moves with some joints, rests with others and picks up a load; the tests' bench.
#pragma once

#include <random>

#include "tests/unit/estimator/oracle.hpp"

namespace armcal::estimator::test {

// Bodies 10 % heavier or lighter than the table's, friction 30 % more, torque noise as the table says. Each joint that
// moves follows three harmonics of a tone of its own; one that rests stands where it stood, at a torque anywhere in its
// friction band.
template <class Model>
struct MovingArm {
  using Sample = model::Sample<Model::kJoints>;
  static constexpr int n = Model::kJoints;
  static constexpr std::uint32_t kAll = (1u << n) - 1u;

  std::mt19937 random{17};
  std::normal_distribution<double> normal;
  double body[Model::kBodyParameters];
  Vector truth = Vector::Zero(Model::kColumns);
  double clock_s[n] = {};  // of each joint's motion: it stands while the joint does
  std::uint32_t tick = 0;

  MovingArm() {
    std::uniform_real_distribution<double> off(0.9, 1.1);
    for (int link = 0; link < n; ++link) {
      const double share = off(random);
      for (int k = link * model::kBodyBlock; k < (link + 1) * model::kBodyBlock; ++k)
        body[k] = share * Model::kInfo[k].mean;
    }
    MapTruth();
    for (int k = 0; k < Model::kFront; ++k) truth(k) = 1.3 * Amplitude(k);
  }
  // A point mass on the last link, away from its axes.
  void PickUp(double mass_kg) {
    const double r[3] = {0.1, 0.15, 0.2};
    double* b = body + (n - 1) * model::kBodyBlock;
    const double inertia[6] = {r[1] * r[1] + r[2] * r[2], -r[0] * r[1], -r[0] * r[2],
                               r[0] * r[0] + r[2] * r[2], -r[1] * r[2], r[0] * r[0] + r[1] * r[1]};
    b[0] += mass_kg;
    for (int k = 0; k < 3; ++k) b[1 + k] += mass_kg * r[k];
    for (int k = 0; k < 6; ++k) b[4 + k] += mass_kg * inertia[k];
    MapTruth();
  }
  static bool Estimated(int front) {
    return Model::kInfo[Model::kBodyParameters + front].state == model::ParameterState::kEstimated;
  }

  // bit i of `moving`: joint i moves.
  Sample Next(std::uint32_t moving = kAll) {
    static constexpr double kTone[6] = {0.9, 1.1, 1.3, 1.9, 2.3, 2.9}, kSize[6] = {1.0, 0.5, 0.7, 0.9, 0.9, 1.2};
    Sample s;
    s.tick = tick;
    tick += Model::kSampleTicks;
    for (int i = 0; i < n; ++i) {
      const bool moves = (moving >> i & 1u) != 0u;
      double motion[3] = {};
      for (int h = 1; h <= 3; ++h) {
        const double w = h * kTone[i], a = kSize[i] / (h * h), angle = w * clock_s[i] + 0.7 * i + h;
        motion[0] += a * std::sin(angle);
        motion[1] += moves ? a * w * std::cos(angle) : 0;
        motion[2] -= moves ? a * w * w * std::sin(angle) : 0;
      }
      if (moves) clock_s[i] += Model::kSampleTicks / static_cast<double>(Model::kTickRate_Hz);
      s.q[i] = static_cast<float>(motion[0]);
      s.qd[i] = static_cast<float>(motion[1]);
      s.qdd[i] = static_cast<float>(motion[2]);
      const bool fast = std::abs(s.qd[i]) > Model::kAxes[i].v_min_radps;
      s.flags[i] = static_cast<std::uint8_t>(model::kValid | (fast ? model::kMoving : 0));
    }
    const Vector tau = Regressor<Model>(s) * truth;
    std::uniform_real_distribution<double> band(-1, 1);
    for (int i = 0; i < n; ++i) {
      const double stuck = (moving >> i & 1u) != 0u ? 0 : band(random) * truth(Model::kFrontBegin[i]);
      s.tau[i] = static_cast<float>(tau(i) + stuck + Model::kAxes[i].sigma_Nm * normal(random));
    }
    return s;
  }

  // Root mean square error of a joint's friction curve, over its size, at speeds up to 1 rad/s.
  double FrictionError(const float* value, int joint) const {
    double error = 0, size = 0;
    for (double speed = 0.05; speed <= 1; speed += 0.05) {
      double wrong = 0, right = 0;
      for (int k = Model::kFrontBegin[joint]; k < Model::kFrontBegin[joint + 1]; ++k) {
        const double column = k == Model::kFrontBegin[joint] ? 1 : k == Model::kFrontBegin[joint] + 1 ? speed : 0;
        wrong += column * (value[k] - truth(k));
        right += column * truth(k);
      }
      error += wrong * wrong;
      size += right * right;
    }
    return std::sqrt(error / size);
  }

 private:
  static double Amplitude(int k) {
    return Estimated(k) ? static_cast<double>(Model::kInfo[Model::kBodyParameters + k].mean) : 0;
  }
  void MapTruth() {
    double base[Model::kRigid];
    physical::MapBodies<Model>(body, base);
    for (int k = 0; k < Model::kRigid; ++k) truth(Model::kFront + k) = base[k];
  }
};

}  // namespace armcal::estimator::test
