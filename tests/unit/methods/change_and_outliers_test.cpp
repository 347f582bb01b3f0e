// methods tests - friction that changes, outliers and ripple: multiple model, robust weights, parallel decimation.
#include <gtest/gtest.h>

#include "host_sim/identify/methods/prefilter.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"
#include "tests/unit/methods/better_arm.hpp"
#include "tests/unit/methods/classic_arm.hpp"

namespace armcal::calibration {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using tests::SyntheticArm;

int Column(const codegen::Model& model, const std::string& name) {
  for (int c = 0; c < model.columns(); ++c)
    if (model.column_name(c) == name) return c;
  throw std::logic_error("no " + name);
}

// Relative root mean square of the path of beta after 5 s, per joint; beta(t) = Fv (1 + rise t / 30 s).
VectorXd FollowError(const SyntheticArm& arm, const Dataset& d, const MatrixXd& path, double rise) {
  VectorXd error(arm.model().joints());
  for (int j = 0; j < error.size(); ++j) {
    const int c = Column(arm.model(), "Fv" + std::to_string(j + 1));
    double sum = 0;
    int count = 0;
    for (int k = 0; k < d.samples(); ++k)
      if (d.s.t[k] > 5)
        sum += std::pow(path(k, c) / (arm.Friction("Fv", j) * (1 + rise * d.s.t[k] / 30)) - 1, 2), ++count;
    error[j] = std::sqrt(sum / count);
  }
  return error;
}

TEST(MultipleModel, FollowsARampOfViscousFriction) {
  SyntheticArm arm(tests::PlainRobot("er20_like", tests::Columns::kBase), 2);
  Dataset d = arm.Run(30, 3);
  for (int j = 0; j < 6; ++j)
    d.tau.col(j).array() += 0.5 / 30 * d.s.t.array() * arm.Friction("Fv", j) * d.s.qd.col(j).array();
  const Solution s = MultipleModel(tests::ProblemOf(arm, {&d}));
  ASSERT_EQ(s.path.rows(), d.samples());
  const VectorXd error = FollowError(arm, d, s.path, 0.5);
  printf("multiple_model: relative RMS of beta after 5 s, ramp: %.4f mean, %.4f worst\n", error.mean(),
         error.maxCoeff());
  EXPECT_LT(error.maxCoeff(), 0.05);  // the "follows": 5 % after 5 s
  // planted: a filter without process noise does not follow
  const VectorXd stiff = FollowError(arm, d, LogEkf(tests::ProblemOf(arm, {&d})).path, 0.5);
  EXPECT_GT(stiff.mean(), 2 * error.mean());
}

TEST(MultipleModel, WhereNothingChanges_StaysAsGood) {
  SyntheticArm arm(tests::PlainRobot("er20_like", tests::Columns::kBase), 2);
  const Dataset d = arm.Run(20, 3);
  const VectorXd error = FollowError(arm, d, MultipleModel(tests::ProblemOf(arm, {&d})).path, 0);
  EXPECT_LT(error.maxCoeff(), 0.05);
}

TEST(MultipleModel, AtRest_NeitherMovesNorLosesItsCertainty) {
  SyntheticArm arm(tests::PlainRobot("two_link", tests::Columns::kBase), 2);
  const Dataset d = arm.Run(10, 3);
  Dataset rest = d;
  rest.used.setZero();
  rest.used(0, 0) = d.used(0, 0);
  const Solution once = MultipleModel(tests::ProblemOf(arm, {&d})),
                 then = MultipleModel(tests::ProblemOf(arm, {&d, &rest}));
  const int c = Column(arm.model(), "Fv2");
  EXPECT_NEAR(then.z[c], once.z[c], 0.02 * once.z[c]);
  EXPECT_LT(then.covariance(c, c), 1.5 * once.covariance(c, c));
}

TEST(Robust, TwoPercentOfOutliers_DoNotMoveTheEstimate) {
  SyntheticArm arm(tests::PlainRobot("er20_like", tests::Columns::kBase), 3);
  Dataset d = arm.Run(10, 4);
  const Problem p = tests::ProblemOf(arm, {&d});
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> u(0, 1);
  const double clean = tests::TorqueError(arm, d, Robust(p).z);
  EXPECT_LT(clean, 1.15 * tests::TorqueError(arm, d, tests::LeastSquares(p).z));  // 95 % efficient, and one draw's luck
  for (int k = 0; k < d.samples(); ++k)
    for (int j = 0; j < 6; ++j)
      if (u(random) < 0.02) d.tau(k, j) += 30 * arm.noise_Nm(j);  // one-sided: an average would not cancel them
  const Solution robust = Robust(p), plain = tests::LeastSquares(p);
  printf("robust: %d rounds, %.3f s\n", robust.iterations, robust.seconds);
  EXPECT_TRUE(robust.converged) << robust.remark;
  EXPECT_LT(tests::WorstDeviation(arm, robust), 4.5);  // 48 Gaussian errors, deviations 5 % too small
  EXPECT_LT(tests::TorqueError(arm, d, robust.z), 1.3 * clean);
  EXPECT_GT(tests::TorqueError(arm, d, plain.z), 3 * clean);  // planted
}

// Joint 2 has five times the noise that it is said to have.
TEST(Robust, AJointThatIsNoisierThanStated_HasLargerDeviations) {
  SyntheticArm arm(tests::PlainRobot("er20_like", tests::Columns::kBase), 3);
  Dataset d = arm.Run(10, 4);
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal;
  for (int k = 0; k < d.samples(); ++k) d.tau(k, 1) += 4.9 * arm.noise_Nm(1) * normal(random);
  const Problem p = tests::ProblemOf(arm, {&d});
  const Solution robust = Robust(p), plain = tests::LeastSquares(p);
  EXPECT_LT(tests::WorstDeviation(arm, robust), 4.5);
  const int c = Column(arm.model(), "Fv2");
  EXPECT_NEAR(std::sqrt(robust.covariance(c, c) / plain.covariance(c, c)), 5, 1);
}

// Viscous friction grows by a half at once.
TEST(MultipleModel, AfterAStep_IsThereWithinThreeSeconds) {
  SyntheticArm arm(tests::PlainRobot("er20_like", tests::Columns::kBase), 2);
  Dataset d = arm.Run(30, 3);
  constexpr double kStep_s = 15;
  for (int j = 0; j < 6; ++j)
    d.tau.col(j).array() +=
        (d.s.t.array() > kStep_s).cast<double>() * 0.5 * arm.Friction("Fv", j) * d.s.qd.col(j).array();
  const Solution s = MultipleModel(tests::ProblemOf(arm, {&d}));
  for (int j = 0; j < 6; ++j) {
    const int c = Column(arm.model(), "Fv" + std::to_string(j + 1));
    double worst = 0;
    for (int k = 0; k < d.samples(); ++k)
      if (d.s.t[k] > kStep_s + 3) worst = std::max(worst, std::abs(s.path(k, c) / (1.5 * arm.Friction("Fv", j)) - 1));
    EXPECT_LT(worst, 0.07) << j + 1;
  }
}

TEST(ParallelDecimation, RippleAboveItsBand_DoesNotMatter) {
  SyntheticArm arm(tests::PlainRobot("two_link", tests::Columns::kBase), 3);
  Dataset d = arm.Run(20, 4);
  const Problem p = tests::ProblemOf(arm, {&d});
  const VectorXd before = ParallelDecimation(p).z;
  for (int k = 0; k < d.samples(); ++k)  // 50 Hz: the filter leaves (20 / 50)^8 = 7e-4 of it, more at the ends
    for (int j = 0; j < 2; ++j) d.tau(k, j) += 20 * arm.noise_Nm(j) * std::sin(2 * std::numbers::pi * 50 * d.s.t[k]);
  const Solution after = ParallelDecimation(p);
  std::vector<MatrixXd> row;
  arm.model().Regressor(d.s, {}, {}, row);
  for (int j = 0; j < 2; ++j)
    EXPECT_LT((row[j] * (after.z - before)).norm() / std::sqrt(d.samples()), 0.05 * arm.noise_Nm(j));
  EXPECT_LT(tests::WorstDeviation(arm, after), 4.5);
}

TEST(ParallelDecimation, ColumnsAndTorqueMustPassTheSameFilter) {
  SyntheticArm arm(tests::PlainRobot("two_link", tests::Columns::kBase), 3);
  const Dataset d = arm.Run(20, 4);
  const Problem p = tests::ProblemOf(arm, {&d});
  const Linearised rows = FilteredRows(p, p.start, {3, 0});  // 3 Hz: edges of the sign are rounded far into the motion
  const VectorXd both = SolveRegularised(p, rows.A.transpose() * rows.A,
                                         rows.A.transpose() * (rows.residual + rows.A * p.start), nullptr);
  EXPECT_LT(tests::TorqueError(arm, d, both), 0.3);
}

}  // namespace
}  // namespace armcal::calibration
