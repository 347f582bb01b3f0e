// methods tests - MAP with barrier: bodies exist in every draw, for any coordinates, and with nonlinear laws, too.
#include <gtest/gtest.h>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"
#include "tests/unit/methods/better_arm.hpp"
#include "tests/unit/methods/classic_arm.hpp"

namespace armcal::calibration {
namespace {

using Eigen::VectorXd;
using tests::SyntheticArm;

TEST(MapBarrier, OfRandomArms_GivesBodiesThatExistEveryTime) {
  constexpr int kDraws = 8;
  int bayes = 0;
  for (int draw = 1; draw <= kDraws; ++draw) {
    SyntheticArm arm(tests::PlainRobot("er20_like", draw % 2 ? tests::Columns::kBase : tests::Columns::kStandard),
                     draw);
    const Dataset d = arm.Run(8, 100 + draw);
    const Problem p = tests::ProblemOf(arm, {&d});
    const Solution s = MapBarrier(p);
    EXPECT_TRUE(s.converged) << draw << s.remark;
    EXPECT_TRUE(s.physical) << draw;
    printf("map_barrier: %d steps, %.4f s\n", s.iterations, s.seconds);
    EXPECT_TRUE(tests::CanExist(s.bodies)) << draw;
    EXPECT_LT(tests::TorqueError(arm, d, s.z), 0.25) << draw;  // sqrt(48 / 6000) is 0.09
    const Linearised at = Linearise(p, p.start);
    const VectorXd z =
        SolveRegularised(p, at.A.transpose() * at.A, at.A.transpose() * (at.residual + at.A * p.start), nullptr);
    bayes += tests::CanExist(ReadOutBodies(arm.model(), z.segment(arm.model().front(), arm.model().rigid())));
  }
  EXPECT_LT(bayes, kDraws);  // planted fault: without the barrier some cannot
}

TEST(MapBarrier, InStandardAndInBaseCoordinates_IsTheSameArm) {
  SyntheticArm base(tests::PlainRobot("er20_like", tests::Columns::kBase), 3);
  SyntheticArm standard(tests::PlainRobot("er20_like", tests::Columns::kStandard), 3);
  ASSERT_GT(standard.model().rigid(), base.model().rigid());
  const Dataset d = base.Run(8, 9);
  const Solution a = MapBarrier(tests::ProblemOf(base, {&d})), b = MapBarrier(tests::ProblemOf(standard, {&d}));
  // One problem in two coordinates. The base set's regrouping is a rounded map, 14 digits; the minimum is flat where
  // only the prior holds a body.
  for (int k = 0; k < 66; ++k)
    EXPECT_NEAR(a.bodies[k], b.bodies[k], 2e-3 * std::abs(base.model().table()[k].sd) + 1e-3 * std::abs(a.bodies[k]))
        << k;
}

TEST(MapBarrier, OfManySamples_GivesFrictionTheDeviationsOfABayesUpdate) {
  SyntheticArm arm(tests::PlainRobot("two_link", tests::Columns::kBase), 6);
  const Dataset d = arm.Run(8, 7);
  Problem p = tests::ProblemOf(arm, {&d});
  p.sigma_Nm = Eigen::Vector2d(0.02, 0.3);  // far from 1 and from each other, so that a wrong power of them shows
  const Solution s = MapBarrier(p);
  // (K' W K + P^-1)^-1 with W = 1 / sigma^2. Its prior of the bodies is only nearly that of the table, but they share
  // little with friction, and here the data say far more than both.
  const tests::Stacked rows = tests::StackByHand(arm.model(), d);
  VectorXd weight(rows.tau.size());
  for (Eigen::Index r = 0; r < weight.size(); ++r)
    weight[r] = std::pow(p.sigma_Nm[rows.joint[static_cast<std::size_t>(r)]], -2);
  const Eigen::MatrixXd posterior =
      (rows.K.transpose() * weight.asDiagonal() * rows.K + p.covariance.inverse()).inverse();
  int friction = 0;
  for (int c = 0; c < arm.model().columns(); ++c) {
    const std::string name = arm.model().column_name(c);
    if (name[0] != 'F') continue;
    EXPECT_NEAR(std::sqrt(s.covariance(c, c)), std::sqrt(posterior(c, c)), 0.05 * std::sqrt(posterior(c, c))) << name;
    ++friction;
  }
  EXPECT_EQ(friction, 4);  // Coulomb and viscous, twice
}

TEST(MapBarrier, WithAStribeckLaw_FindsItAndTheBodies) {
  SyntheticArm arm(tests::WithStribeck(tests::PlainRobot("two_link", tests::Columns::kBase)), 2);
  const Dataset d = arm.Run(20, 3, tests::Stribeck(arm));
  Problem p = tests::ProblemOf(arm, {&d});
  tests::HoldDelta(p);
  const Solution s = MapBarrier(p);
  EXPECT_TRUE(s.physical);
  EXPECT_TRUE(tests::CanExist(s.bodies));
  std::vector<double> eta(s.z.data() + arm.model().columns(), s.z.data() + s.z.size());
  VectorXd x = VectorXd::Zero(arm.model().columns() + 2);
  x.head(arm.model().columns()) = s.z.head(arm.model().columns());
  const Eigen::MatrixXd residual = Predict(arm.model(), d, x, eta) - d.tau;
  for (int j = 0; j < 2; ++j) {
    const VectorXd used = residual.col(j).cwiseProduct(d.used.col(j).cast<double>());
    EXPECT_NEAR(used.norm() / std::sqrt(d.used.col(j).sum()) / arm.noise_Nm(j), 1, 0.06) << j;  // 4 sd of 2500 samples
  }
}

TEST(MapBarrier, APriorThatCannotExist_IsRefused) {
  SyntheticArm arm(tests::PlainRobot("two_link", tests::Columns::kBase), 1);
  const Dataset d = arm.Run(4, 1);
  codegen::Robot robot = arm.model().robot();
  robot.joint[1].link.inertia_kgm2 = {0.1, 0, 0, 0.1, 0, 0.5};
  const codegen::Model model(robot, tests::Records());
  EXPECT_THROW(MapBarrier(MakeProblem(model, {&d})), io::InputError);
}

}  // namespace
}  // namespace armcal::calibration
