// estimator - a noisy motion of the two-link arm whose truth is known; the tests' bench.
#pragma once

#include <limits>
#include <random>

#include "tests/unit/estimator/oracle.hpp"
#include "tests/unit/estimator/two_link_model.hpp"

namespace armcal::estimator::test {

using armcal::test::TwoLink;
using Sample = model::Sample<2>;
constexpr int kColumns = TwoLink::kColumns;

// Truth: bodies up to 20 % off the table, other friction.
inline Vector Truth() {
  std::mt19937 random(21);
  std::uniform_real_distribution<double> off(0.85, 1.15);
  double body[TwoLink::kBodyParameters], base[TwoLink::kRigid];
  for (int k = 0; k < TwoLink::kBodyParameters; ++k) body[k] = TwoLink::kInfo[k].mean * off(random);
  physical::MapBodies<TwoLink>(body, base);
  Vector p = Vector::Zero(kColumns);
  for (int k = 0; k < TwoLink::kRigid; ++k) p(TwoLink::kFront + k) = base[k];
  p(0) = 11;
  p(1) = 3.5;
  p(3) = 2.5;
  p(4) = 2.7;
  return p;
}

// 125 Hz samples of a two-tone motion; `rest` from that second on (speed zero, torque anywhere in the friction band).
struct Motion {
  std::mt19937 random{33};
  std::normal_distribution<double> normal;
  Vector truth = Truth();
  std::uint32_t tick = 0;

  Sample Next(bool rest = false) {
    Sample s;
    s.tick = tick;
    const double t = tick * 1e-3;
    tick += TwoLink::kSampleTicks;
    const double w[2][2] = {{1.1, 3.7}, {1.7, 4.9}}, a[2][2] = {{0.7, 0.25}, {0.8, 0.3}};
    for (int i = 0; i < 2; ++i) {
      double q = 0, qd = 0, qdd = 0;
      for (int k = 0; k < 2; ++k) {
        q += a[i][k] * std::sin(w[i][k] * t + i);
        qd += a[i][k] * w[i][k] * std::cos(w[i][k] * t + i);
        qdd -= a[i][k] * w[i][k] * w[i][k] * std::sin(w[i][k] * t + i);
      }
      s.q[i] = static_cast<float>(rest ? 0.3 : q);
      s.qd[i] = static_cast<float>(rest ? 0 : qd);
      s.qdd[i] = static_cast<float>(rest ? 0 : qdd);
      s.temperature_degC[i] = std::numeric_limits<float>::quiet_NaN();  // no sensor
      const bool moving = std::abs(s.qd[i]) > TwoLink::kAxes[i].v_min_radps;
      s.flags[i] = static_cast<std::uint8_t>(model::kValid | (moving ? model::kMoving : 0));
    }
    const Vector tau = Regressor<TwoLink>(s) * truth;
    for (int i = 0; i < 2; ++i) {
      const double stuck = rest ? 6.0 : 0.0;
      s.tau[i] = static_cast<float>(tau(i) + stuck + TwoLink::kAxes[i].sigma_Nm * normal(random));
    }
    return s;
  }
};

}  // namespace armcal::estimator::test
