// methods tests - (15) against Eigen's complete orthogonal decomposition and the normal equations.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"
#include "tests/unit/methods/classic_arm.hpp"

namespace armcal::tests {
namespace {

using calibration::Problem;
using calibration::Solution;
using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST(PseudoInverse, AllColumns_IsTheSmallestOfAllThatFit) {
  SyntheticArm arm(PlainRobot("er20_like", Columns::kStandard), 1);
  const calibration::Dataset d = arm.Run(6, 2);
  const Problem problem = calibration::MakeProblem(arm.model(), {&d});
  const Solution s = calibration::PseudoInverse(problem);
  const Stacked rows = StackByHand(arm.model(), d);
  const VectorXd expected = rows.K.completeOrthogonalDecomposition().solve(rows.tau);
  // Directions of K differ by 1e3; rounding 1e-16 times 1e3 times the length of the sums.
  EXPECT_LT((s.z - expected).norm() / expected.norm(), 1e-9);
  EXPECT_NE(s.remark.find("rank 48 of"), std::string::npos) << s.remark;  // 36 base and 12 friction columns
  EXPECT_GT(s.z.size(), 60);
}

TEST(PseudoInverse, BaseColumns_GiveTheSameBodiesAsAllColumns) {
  SyntheticArm all(PlainRobot("er20_like", Columns::kStandard), 1);
  const calibration::Dataset d = all.Run(6, 2);
  const codegen::Model base(PlainRobot("er20_like", Columns::kBase), Records());
  const Solution a = calibration::PseudoInverse(calibration::MakeProblem(all.model(), {&d}));
  const Solution b = calibration::PseudoInverse(calibration::MakeProblem(base, {&d}));
  EXPECT_LT((a.bodies - b.bodies).norm() / a.bodies.norm(), 1e-8);
  EXPECT_TRUE(b.remark.empty());
  EXPECT_FALSE(a.physical);  // nothing keeps the smallest bodies possible: the survey's Table 5
}

TEST(PseudoInverse, TorqueWithoutNoise_GivesTheTrueBaseAndFriction) {
  codegen::Robot robot = PlainRobot("er20_like", Columns::kBase);
  for (auto& joint : robot.joint) joint.torque_noise_Nm = 1e-9;
  SyntheticArm arm(robot, 3);
  const calibration::Dataset d = arm.Run(6, 4);
  const Solution s = calibration::PseudoInverse(calibration::MakeProblem(arm.model(), {&d}));
  EXPECT_LT((s.z - arm.truth().head(s.z.size())).norm() / s.z.norm(), 1e-9);
}

TEST(WeightedPseudoInverse, BaseColumns_EqualTheNormalEquationsAndTheirCovariance) {
  SyntheticArm arm(PlainRobot("er20_like", Columns::kBase), 5);
  const calibration::Dataset d = arm.Run(4, 6);
  const Problem problem = calibration::MakeProblem(arm.model(), {&d});
  const Stacked rows = StackByHand(arm.model(), d);
  VectorXd weight(rows.tau.size());
  for (Eigen::Index r = 0; r < weight.size(); ++r) weight[r] = std::pow(problem.sigma_Nm[rows.joint[r]], -2);
  const MatrixXd WK = weight.asDiagonal() * rows.K;
  const Eigen::LDLT<MatrixXd> gram(rows.K.transpose() * WK);
  const VectorXd expected = gram.solve(WK.transpose() * rows.tau);
  const Solution s = calibration::WeightedPseudoInverse(problem), plain = calibration::PseudoInverse(problem);
  EXPECT_LT(TorqueShare(rows, s.z, expected), 1e-10);
  EXPECT_GT(TorqueShare(rows, plain.z, expected), 1e-6);  // planted fault: weights forgotten
  const MatrixXd P = gram.solve(MatrixXd::Identity(s.z.size(), s.z.size()));
  EXPECT_LT((s.covariance - P).norm() / P.norm(), 1e-8);

  // Without weights the estimate is A tau, A = (K' K)^-1 K'; its covariance is A Sigma A'.
  const MatrixXd A = (rows.K.transpose() * rows.K).ldlt().solve(MatrixXd(rows.K.transpose()));
  const MatrixXd Q = A * weight.cwiseInverse().asDiagonal() * A.transpose();
  EXPECT_LT((plain.covariance - Q).norm() / Q.norm(), 1e-8);
}

TEST(WeightedPseudoInverse, FewRows_StillGiveTheSmallestThatFits) {
  SyntheticArm arm(PlainRobot("two_link", Columns::kStandard), 7);
  calibration::Dataset d = arm.Run(4, 8);
  for (int k = 0; k < d.samples(); ++k)
    if (k != 50 && k != 200) d.used.row(k).setZero();
  ASSERT_EQ(d.used.sum(), 4);
  const Problem problem = calibration::MakeProblem(arm.model(), {&d});
  const Stacked rows = StackByHand(arm.model(), d);
  const VectorXd expected = rows.K.completeOrthogonalDecomposition().solve(rows.tau);
  EXPECT_LT((calibration::PseudoInverse(problem).z - expected).norm() / expected.norm(), 1e-10);
}

TEST(PseudoInverse, NonlinearModel_IsRefusedInOneLine) {
  SyntheticArm arm(PlainRobot("two_link", Columns::kBase), 9);
  const calibration::Dataset d = arm.Run(2, 10);
  const codegen::Model model(WithStribeck(PlainRobot("two_link", Columns::kBase)), Records());
  for (const auto solve : {calibration::PseudoInverse, calibration::WeightedPseudoInverse, calibration::Kalman}) {
    try {
      solve(calibration::MakeProblem(model, {&d}));
      ADD_FAILURE() << "accepted";
    } catch (const io::InputError& e) {
      EXPECT_NE(std::string(e.what()).find("stribeck.vs1"), std::string::npos) << e.what();
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace armcal::tests
