// calibration tests - a payload that only the held-out run carries is found, and nothing else is called one.
#include "host_sim/identify/calibration/carried.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "host_sim/identify/calibration/information.hpp"
#include "tests/unit/calibration/laden_arm.hpp"

namespace armcal::calibration {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using tests::LadenArm;

// How often a draw is repeated: 4, or what ARMCAL_DRAWS says.
int Draws() {
  const char* draws = std::getenv("ARMCAL_DRAWS");
  return draws ? std::atoi(draws) : 4;
}

Carried Ask(const codegen::Model& model, const std::vector<const Dataset*>& train, const Dataset& run,
            double tolerance = 0) {
  const Fit fit = WeightedFit(model, train);
  return FindCarried(model, fit, fit.sigma, run, run.tau - Predict(model, run, fit.x, fit.eta), tolerance);
}

// The declared Coulomb or viscous friction of a joint.
double Declared(const codegen::Model& model, const std::string& name, int j) {
  for (int c = 0; c < model.front(); ++c)
    if (model.column_name(c) == name + std::to_string(j + 1)) return model.table()[model.table_index(c)].mean;
  return 0;
}

// Gears that are cold at the start and warm up, each joint by a share and a time of its own; magnets that get weaker.
void Warm(const codegen::Model& model, Dataset& d, std::uint64_t seed, double magnets = 0.03) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit;
  for (int j = 0; j < d.joints(); ++j) {
    const double change = 0.5 * unit(random), constant_s = 5 + 40 * unit(random), offset = 0.5 * (unit(random) - 0.5),
                 weaker = magnets * unit(random), coulomb = Declared(model, "Fc", j),
                 viscous = Declared(model, "Fv", j);
    for (int k = 0; k < d.samples(); ++k) {
      const double qd = d.s.qd(k, j), cold = std::exp(-d.s.t[k] / constant_s);
      d.tau(k, j) += change * (2 * cold - 1) * (coulomb * (qd > 0 ? 1 : -1) + viscous * qd) + offset * coulomb;
      d.tau(k, j) *= 1 + weaker * (1 - cold);
    }
  }
}

// Friction of a form that the model lacks, in training and held-out runs: it falls with speed at first, grows with the
// torque and differs over position.
void MakeFrictionWrong(const codegen::Model& model, Dataset& d, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit;
  for (int j = 0; j < d.joints(); ++j) {
    const double stribeck = unit(random), load = 0.08 * unit(random), over_position = 0.4 * unit(random),
                 coulomb = Declared(model, "Fc", j), slow = 0.1 * model.robot().joint[j].speed_limit_radps;
    for (int k = 0; k < d.samples(); ++k) {
      const double qd = d.s.qd(k, j), sign = qd > 0 ? 1 : -1;
      d.tau(k, j) +=
          sign *
          (coulomb * (stribeck * std::exp(-std::abs(qd) / slow) + over_position * std::sin(2 * d.s.q(k, j) + j)) +
           load * std::abs(d.tau(k, j)));
    }
  }
}

TEST(Carried, ByTheHeldOutRunAlone_IsFoundWithinItsInterval) {
  int held = 0, named = 0;
  for (int draw = 0; draw < Draws(); ++draw) {
    const auto seed = static_cast<std::uint64_t>(draw);
    // The true gains lie within 5 %, which the caller states.
    LadenArm arm(seed, 0.05);
    const plant::Body body{draw % 2 ? 4.0 : 8.0, {0.04, -0.03, 0.12}, {0.02, 0, 0, 0.02, 0, 0.02}};
    const Dataset train = arm.Run(30, 100 + seed, {});
    Dataset run = arm.Run(30, 200 + seed, body);
    if (draw % 3 == 2) Warm(arm.model(), run, seed, 0);  // the interval asks for the training run's torque constants
    const Carried found = Ask(arm.model(), {&train}, run, 0.05);
    named += found.named;
    held += found.interval_kg[0] < body.mass_kg && body.mass_kg < found.interval_kg[1];
    EXPECT_TRUE(found.tolerance_stated);
  }
  std::printf("%d of %d payloads named, %d in the interval\n", named, Draws(), held);
  EXPECT_EQ(named, Draws());
  EXPECT_GE(held, Draws() - (Draws() + 9) / 10);  // two standard deviations; friction is wrong in a third of the draws
}

// The torque's noise is in the residual and in the measured torque. A gain of the measured torque would cancel it.
TEST(Carried, ByAnArmOfFewJoints_IsFound_AndNothingIsWhereNothingIsCarried) {
  const char* const tool = "\n[tool_frame]\nxyz_m = [0.3, 0.0, 0.0]\nrpy_deg = [0.0, 0.0, 0.0]\n";
  for (const double noise_scale : {1.0, 5.0}) {
    LadenArm arm(3, 0, noise_scale, tests::RobotWith(tool, "two_link"));
    const plant::Body body{2, {0, 0, 0.1}, {0.01, 0, 0, 0.01, 0, 0.01}};
    const Dataset train = arm.Run(30, 1, {}), bare = arm.Run(30, 2, {}), laden = arm.Run(30, 3, body);
    EXPECT_FALSE(Ask(arm.model(), {&train}, bare).named);
    const Carried found = Ask(arm.model(), {&train}, laden);
    EXPECT_TRUE(found.named) << found.mass_kg << " +- " << found.sd_kg << " scores " << found.score[0] << " "
                             << found.score[1];
    EXPECT_NEAR(found.mass_kg, 2, 3 * found.sd_kg);
  }
}

TEST(Carried, ByTheTrainingRunAlone_IsMissingInTheOther) {
  LadenArm arm(5, 0);
  const plant::Body body{6, {0, 0, 0.1}, {0.02, 0, 0, 0.02, 0, 0.02}};
  const Dataset train = arm.Run(30, 1, body), run = arm.Run(30, 2, {});
  codegen::Robot robot = arm.model().robot();
  robot.has_prior = false;  // link data of the bare arm would contradict the training run
  const Carried found = Ask(codegen::Model(robot, tests::Records()), {&train}, run, 0.01);
  EXPECT_TRUE(found.named);
  EXPECT_NEAR(found.mass_kg, -6, 0.12);  // within the tolerance and two standard deviations
}

// What the halves' loads add to the model's coordinates is the plant's payload: each half is predicted down to noise.
TEST(Carried, AsCoordinates_PredictsTheRun) {
  LadenArm arm(7, 0);
  const plant::Body body{6, {0.03, -0.05, 0.1}, {0.05, 0, 0, 0.04, 0, 0.03}};
  const Dataset train = arm.Run(30, 1, {}), run = arm.Run(30, 2, body);
  const Fit fit = WeightedFit(arm.model(), {&train});
  const MatrixXd bare = run.tau - Predict(arm.model(), run, fit.x, fit.eta);
  const Carried found = FindCarried(arm.model(), fit, fit.sigma, run, bare);
  ASSERT_TRUE(found.named);
  for (const int half : {0, 1}) {
    const MatrixXd left = run.tau - Predict(arm.model(), run, fit.x + found.Coordinates(arm.model(), half), fit.eta);
    const VectorXd rms = Rms(run, left, true), before = Rms(run, bare, true);
    for (int j = 0; j < 6; ++j) EXPECT_LT(rms[j], 1.1 * arm.noise_Nm(j)) << half << ", joint " << j + 1;
    EXPECT_GT(before[1], 10 * rms[1]);
  }
}

// The arm drops its payload halfway, or takes it up. What one half carries makes the errors of the other half larger.
// No payload of the whole run is named.
TEST(Carried, ByOneHalfAlone_IsWorthNothingOnTheOther) {
  LadenArm arm(7, 0);
  const plant::Body body{6, {0.03, -0.05, 0.1}, {0.05, 0, 0, 0.04, 0, 0.03}};
  const Dataset train = arm.Run(10, 1, {}), bare = arm.Run(10, 2, {});
  for (const bool first : {true, false}) {
    Dataset run = arm.Run(10, 2, body);  // the same motion
    const int half = run.samples() / 2;
    if (first) run.tau.bottomRows(run.samples() - half) = bare.tau.bottomRows(run.samples() - half);
    else run.tau.topRows(half) = bare.tau.topRows(half);
    const Carried found = Ask(arm.model(), {&train}, run);
    const std::size_t empty = first ? 1 : 0;
    EXPECT_LT(found.score[empty], 0) << empty;
    EXPECT_GT(found.factor[empty], 1) << empty;
    EXPECT_FALSE(found.named) << empty;
  }
}

TEST(Carried, AWarmerRunOrWrongFriction_IsNoPayload) {
  int named = 0, asked = 0;
  for (int draw = 0; draw < Draws(); ++draw)
    for (const bool warm : {true, false}) {
      const auto seed = static_cast<std::uint64_t>(draw);
      LadenArm arm(seed, 0.05);
      Dataset train = arm.Run(30, 100 + seed, {}), run = arm.Run(30, 200 + seed, {});
      if (warm) Warm(arm.model(), run, seed);
      else MakeFrictionWrong(arm.model(), train, seed), MakeFrictionWrong(arm.model(), run, seed);
      const Carried found = Ask(arm.model(), {&train}, run);
      named += found.named, ++asked;
      if (found.named)
        std::printf("draw %d, %s: %.3g +- %.2g kg\n", draw, warm ? "warm" : "wrong friction", found.mass_kg,
                    found.sd_kg);
    }
  std::printf("%d of %d runs without a payload are said to carry one\n", named, asked);
  EXPECT_LE(50 * named, asked + 49);  // 2 of 100
}

}  // namespace
}  // namespace armcal::calibration
