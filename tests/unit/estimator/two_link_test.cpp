// estimator - the tests' own model against Lagrange's equation by finite differences.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "armcal/physical/rigid_prior.hpp"
#include "tests/unit/estimator/two_link_model.hpp"

namespace armcal {
namespace {
using test::TwoLink;

// Kinetic minus potential energy of the two bodies and rotors, from the body parameters alone.
long double Lagrangian(const double* b, const long double* q, const long double* qd) {
  const long double a = TwoLink::kA1, g = TwoLink::kGravity;
  const long double w2 = qd[0] + qd[1], c1 = std::cos(q[0]), s1 = std::sin(q[0]);
  const long double c12 = std::cos(q[0] + q[1]), s12 = std::sin(q[0] + q[1]);
  const double *b1 = b, *b2 = b + model::kBodyBlock;
  // Velocity and place of the second frame's origin, and of its first moment.
  const long double vx = -a * s1 * qd[0], vy = a * c1 * qd[0];
  const long double rx = b2[1] * c12 - b2[2] * s12, ry = b2[1] * s12 + b2[2] * c12;
  const long double kinetic = (b1[9] + b1[10]) * qd[0] * qd[0] / 2 + b2[9] * w2 * w2 / 2 + b2[10] * qd[1] * qd[1] / 2 +
                              b2[0] * (vx * vx + vy * vy) / 2 + w2 * (vy * rx - vx * ry);
  const long double potential = g * (b1[1] * s1 + b1[2] * c1) + g * (b2[0] * a * s1 + ry);
  return kinetic - potential;
}

TEST(TwoLink, RigidColumns_AreLagrangesEquation) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> any(-1.5, 1.5);
  for (int trial = 0; trial < 20; ++trial) {
    double body[TwoLink::kBodyParameters], base[TwoLink::kRigid];
    for (double& b : body) b = any(random);
    physical::MapBodies<TwoLink>(body, base);
    model::ModelInput<double, 2> x{};
    for (int i = 0; i < 2; ++i) {
      x.q[i] = any(random);
      x.qd[i] = any(random);
      x.qdd[i] = any(random);
    }
    const double eta[1] = {0.1};
    double front[TwoLink::kFront], dense[2 * TwoLink::kDense];
    TwoLink::Regressor<double>(x, nullptr, eta, nullptr, nullptr, front, dense);

    const long double h = 1e-5L;
    const auto at = [&](long double t, int dq, int dv, long double step_q, long double step_v) {
      long double q[2], qd[2];
      for (int i = 0; i < 2; ++i) {
        q[i] = x.q[i] + x.qd[i] * t + x.qdd[i] * t * t / 2 + (i == dq ? step_q : 0);
        qd[i] = x.qd[i] + x.qdd[i] * t + (i == dv ? step_v : 0);
      }
      return Lagrangian(body, q, qd);
    };
    for (int j = 0; j < 2; ++j) {
      const auto momentum = [&](long double t) { return (at(t, -1, j, 0, h) - at(t, -1, j, 0, -h)) / (2 * h); };
      const long double rate = (momentum(h) - momentum(-h)) / (2 * h);
      const long double force = (at(0, j, -1, h, 0) - at(0, j, -1, -h, 0)) / (2 * h);
      double tau = 0;
      for (int k = 0; k < TwoLink::kRigid; ++k) tau += dense[j * TwoLink::kDense + k] * base[k];
      EXPECT_NEAR(tau, static_cast<double>(rate - force), 1e-7);  // h^2 = 1e-10, roundings 1e-19 / h^2
    }
  }
}

}  // namespace
}  // namespace armcal
