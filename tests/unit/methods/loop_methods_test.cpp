// methods tests - IDIM-IV and DIDIM have no bias where least squares has one; torque by KDL, motion by the true arm.
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

TEST(InstrumentalVariable, NoiseInPosition_BiasesLeastSquaresAndNotTheInstrument) {
  SyntheticArm arm(tests::TwoLinkWithControl(), 1);
  const Dataset reference = arm.Run(10, 2);
  VectorXd biased = VectorXd::Zero(arm.model().columns()), clean = biased;
  constexpr int kDraws = 8;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Dataset d = tests::Measured(arm, reference, 3e-4, 1, 50 + draw);
    Problem p = tests::ProblemOf(arm, {&d});
    p.covariance.resize(0, 0);  // (17) as printed: nobody knows anything
    p.closed_loop = MakeClosedLoop(arm.model());
    const Solution iv = InstrumentalVariable(p);
    EXPECT_TRUE(iv.converged) << iv.remark;
    EXPECT_LE(iv.iterations, 5);
    biased += tests::LeastSquares(p).z / kDraws, clean += iv.z / kDraws;
  }
  // A mean over draws keeps the bias alone. 3e-4 rad at 125 Hz is 7 rad/s^2 of noise in qdd.
  const double least_squares = tests::TorqueError(arm, reference, biased);
  const double instrument = tests::TorqueError(arm, reference, clean);
  EXPECT_GT(least_squares, 1);
  EXPECT_LT(instrument, 0.2 * least_squares);
}

TEST(InstrumentalVariable, WithThePrior_SolvesForStandardParametersToo) {
  codegen::Robot robot = tests::TwoLinkWithControl();
  robot.parameters.standard = true;
  SyntheticArm arm(robot, 4);
  const Dataset reference = arm.Run(10, 2);
  const Dataset d = tests::Measured(arm, reference, 1e-4, 1, 7);
  Problem p = tests::ProblemOf(arm, {&d});
  p.closed_loop = MakeClosedLoop(arm.model());
  const Solution iv = InstrumentalVariable(p);
  EXPECT_TRUE(iv.converged) << iv.remark;
  EXPECT_LT(tests::TorqueError(arm, reference, iv.z), 0.25);
  EXPECT_LT(tests::TorqueError(arm, reference, iv.z), tests::TorqueError(arm, reference, tests::LeastSquares(p).z));
}

// The minimum of |(tau - K z) / sigma|^2 + (z - z0)' P^-1 (z - z0) over the measured rows.
VectorXd BayesByHand(const SyntheticArm& arm, const Problem& p, const MatrixXd& P, MatrixXd& covariance) {
  const tests::Stacked rows = tests::StackByHand(arm.model(), *p.train[0]);
  VectorXd weight(rows.tau.size());
  for (Eigen::Index r = 0; r < weight.size(); ++r)
    weight[r] = std::pow(p.sigma_Nm[rows.joint[static_cast<std::size_t>(r)]], -2);
  covariance = (rows.K.transpose() * weight.asDiagonal() * rows.K + P.inverse()).inverse();
  return covariance * (rows.K.transpose() * weight.cwiseProduct(rows.tau) + P.inverse() * p.start);
}

TEST(InstrumentalVariable, OfAShortLogWithoutNoiseInPosition_IsTheBayesUpdateOfTheMeasuredRows) {
  SyntheticArm arm(tests::TwoLinkWithControl(), 3);
  const Dataset reference = arm.Run(2, 4);
  const Dataset d = tests::Measured(arm, reference, 0, 1, 5);
  Problem p = tests::ProblemOf(arm, {&d});
  p.closed_loop = MakeClosedLoop(arm.model());
  const Solution iv = InstrumentalVariable(p);
  EXPECT_TRUE(iv.converged) << iv.remark;
  MatrixXd covariance, ignored;
  const VectorXd once = BayesByHand(arm, p, p.covariance, covariance);
  const VectorXd twice = BayesByHand(arm, p, 0.5 * p.covariance, ignored);
  const VectorXd sd = covariance.diagonal().cwiseSqrt();
  const double apart = (iv.z - once).cwiseQuotient(sd).norm(), planted = (twice - once).cwiseQuotient(sd).norm();
  EXPECT_LT(apart, 0.05);   // instruments that are a little off the measured motion
  EXPECT_GT(planted, 0.2);  // so a prior that counts twice would show
}

TEST(Didim, FindsTheParametersWithoutMeasuredPositions) {
  SyntheticArm arm(tests::TwoLinkWithControl(), 5);
  const Dataset reference = arm.Run(10, 6);
  Dataset d = tests::Measured(arm, reference, 0, 1, 9);
  d.s.q.setConstant(1), d.s.qd.setZero(), d.s.qdd.setZero();  // what was measured must not matter
  Problem p = tests::ProblemOf(arm, {&d});
  p.covariance.resize(0, 0);
  p.closed_loop = MakeClosedLoop(arm.model());
  const Solution s = Didim(p);
  EXPECT_TRUE(s.converged) << s.remark;
  EXPECT_LT(tests::WorstDeviation(arm, s), 4);               // a dozen Gaussian errors pass 4 sd once in 1300 runs
  EXPECT_LT(tests::TorqueError(arm, reference, s.z), 0.15);  // sqrt(12 parameters / 2000 rows) is 0.08
  EXPECT_GT(tests::TorqueError(arm, reference, p.start), 1);
}

TEST(Didim, ATorqueThatTheModelLacks_ShowsInTheEstimate) {  // planted
  SyntheticArm arm(tests::TwoLinkWithControl(), 5);
  const Dataset reference = arm.Run(10, 6);
  Dataset d = tests::Measured(arm, reference, 0, 1, 9);
  d.tau.col(1) += 0.5 * d.s.qd.col(1).cwiseAbs2();
  Problem p = tests::ProblemOf(arm, {&d});
  p.covariance.resize(0, 0);
  p.closed_loop = MakeClosedLoop(arm.model());
  EXPECT_GT(tests::WorstDeviation(arm, Didim(p)), 4);
}

TEST(FourierFit, OfNoisyPositions_GivesTheTrueDerivatives) {
  SyntheticArm arm(tests::TwoLinkWithControl(), 1);
  const Dataset clean = arm.Run(10, 2);  // five harmonics of 0.1 Hz: one period
  Dataset noisy = clean;
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0, 3e-4);
  for (double& q : noisy.s.q.reshaped()) q += normal(random);
  EXPECT_NEAR(FindPeriod_s(noisy), 10, 1e-9);
  const Dataset fitted = FourierFit(arm.model(), noisy, 10);
  // Fifteenth harmonic: w = 9.4 rad/s; a coefficient errs by 3e-4 sqrt(2 / 1250) = 1.2e-5; 31 of them, four sd.
  EXPECT_LT((fitted.s.q - clean.s.q).cwiseAbs().maxCoeff(), 4 * 1.2e-5 * std::sqrt(31 / 2.0));
  EXPECT_LT((fitted.s.qdd - clean.s.qdd).cwiseAbs().maxCoeff(), 4 * 1.2e-5 * 89 * std::sqrt(31 / 2.0));
  for (int j = 0; j < 2; ++j) EXPECT_NEAR(FourierResidual(noisy, 10)[j], 3e-4, 3e-5);
  EXPECT_GT(FourierResidual(noisy, 7.3)[0], 1e-3);  // planted: not its period
}

TEST(FourierFit, AsAMethod_UndoesTheBiasOfNoisyPositions) {
  SyntheticArm arm(tests::TwoLinkWithControl(), 1);
  const Dataset reference = arm.Run(10, 2);
  const Dataset d = tests::Measured(arm, reference, 3e-4, 1, 50);
  Problem p = tests::ProblemOf(arm, {&d});
  p.covariance.resize(0, 0);
  const Solution s = Solve(FindMethod("fourier_fit"), p);
  EXPECT_LT(tests::TorqueError(arm, reference, s.z),
            0.2 * tests::TorqueError(arm, reference, tests::LeastSquares(p).z));
  EXPECT_NE(s.remark.find("period 10 s"), std::string::npos) << s.remark;
}

}  // namespace
}  // namespace armcal::calibration
