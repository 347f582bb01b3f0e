// methods tests - (19), (21), (23), (24) against batch least squares and a filter with difference
// quotients.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/method_list.hpp"
#include "tests/unit/methods/classic_arm.hpp"

namespace armcal::tests {
namespace {

using calibration::Problem;
using calibration::Solution;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Minimum of sum mu^(N - i) |tau_i - K_i p|^2 + mu^N |p|^2 / variance: which the recursions compute. N counts all
// samples of the log.
VectorXd Forgotten(const Stacked& rows, int samples, double mu, double variance) {
  VectorXd weight(rows.tau.size());
  for (Eigen::Index r = 0; r < weight.size(); ++r) weight[r] = std::pow(mu, samples - 1 - rows.sample[r]);
  MatrixXd gram = rows.K.transpose() * weight.asDiagonal() * rows.K;
  gram.diagonal().array() += std::pow(mu, samples) / variance;
  return gram.ldlt().solve(rows.K.transpose() * weight.cwiseProduct(rows.tau));
}

class LinearArm : public testing::Test {
 protected:
  SyntheticArm arm_{PlainRobot("er20_like", Columns::kBase), 21};
  calibration::Dataset data_ = arm_.Run(4, 22);
  Problem problem_ = calibration::MakeProblem(arm_.model(), {&data_});
  Stacked rows_ = StackByHand(arm_.model(), data_);
};

TEST_F(LinearArm, Kalman_EqualsRidgeRegressionWithAHundredthOfOne) {
  const Solution s = calibration::Kalman(problem_);
  // The covariance form loses about the condition of P, 1e5, times 1e-16 in each of 500 steps.
  EXPECT_LT(TorqueShare(rows_, s.z, Forgotten(rows_, data_.samples(), 1, 100)), 1e-8);
  EXPECT_GT(TorqueShare(rows_, s.z, Forgotten(rows_, data_.samples(), 1, 200)), 1e-7);  // planted fault: P0 = 200 I
  EXPECT_EQ(s.iterations, data_.samples());
  EXPECT_TRUE(s.converged);
}

TEST_F(LinearArm, KalmanThatKnowsNothing_EqualsThePseudoInverse) {
  const Solution s = calibration::RunOnline(problem_, 1, 1e8);
  EXPECT_LT(TorqueShare(rows_, s.z, calibration::PseudoInverse(problem_).z), 1e-6);
}

TEST_F(LinearArm, Path_HoldsTheEstimateAfterEverySample) {
  const Solution whole = calibration::Kalman(problem_);
  ASSERT_EQ(whole.path.rows(), data_.samples());
  EXPECT_EQ(whole.path.row(data_.samples() - 1).transpose(), whole.z);
  calibration::Dataset first = data_;
  first.used.bottomRows(data_.samples() - 100).setZero();
  EXPECT_EQ(calibration::Kalman(calibration::MakeProblem(arm_.model(), {&first})).z, whole.path.row(99).transpose());
}

TEST_F(LinearArm, TwoLogs_EqualOneAfterTheOther) {
  calibration::Dataset a = data_, b = data_;
  a.used.bottomRows(data_.samples() - 200).setZero();
  b.used.topRows(200).setZero();
  const Solution s = calibration::Kalman(calibration::MakeProblem(arm_.model(), {&a, &b}));
  EXPECT_EQ(s.z, calibration::Kalman(problem_).z);
  EXPECT_EQ(s.path.rows(), 2 * data_.samples());
}

TEST_F(LinearArm, ForgettingNothing_EqualsTheKalmanFilter) {
  problem_.forgetting = 1;
  EXPECT_EQ(calibration::Forgetting(problem_).z, calibration::Kalman(problem_).z);
}

TEST_F(LinearArm, Forgetting_EqualsLeastSquaresWithAgeingWeights) {
  problem_.forgetting = 0.99;
  const Solution s = calibration::Forgetting(problem_);
  EXPECT_LT(TorqueShare(rows_, s.z, Forgotten(rows_, data_.samples(), 0.99, 100)), 1e-6);
  EXPECT_GT(TorqueShare(rows_, s.z, Forgotten(rows_, data_.samples(), 0.985, 100)), 1e-4);  // planted fault: mu
}

TEST_F(LinearArm, ExtendedKalman_EqualsTheKalmanFilter) {
  EXPECT_EQ(calibration::ExtendedKalman(problem_).z, calibration::Kalman(problem_).z);
}

TEST_F(LinearArm, ForgettingThatIsNoShare_IsRefused) {
  for (const double mu : {0.0, -0.5, 1.01, std::nan("")}) {
    problem_.forgetting = mu;
    EXPECT_THROW(calibration::Forgetting(problem_), io::InputError) << mu;
  }
}

TEST_F(LinearArm, Stopped_GivesWhatItHasAndSaysSo) {
  std::atomic<bool> stop = true;
  problem_.stop = &stop;
  const Solution s = calibration::Kalman(problem_);
  EXPECT_FALSE(s.converged);
  EXPECT_EQ(s.iterations, 1);
  EXPECT_TRUE(s.z.allFinite());
}

// The variance of columns that the torque cannot tell apart grows with mu^-n, as in the survey's (23).
TEST(Forgetting, DependentColumns_BlowUpAndTheRemarkSaysSo) {
  SyntheticArm arm(PlainRobot("er20_like", Columns::kStandard), 23);
  const calibration::Dataset d = arm.Run(4, 24);
  Problem problem = calibration::MakeProblem(arm.model(), {&d});
  problem.forgetting = 0.2;
  const Solution s = calibration::Forgetting(problem);
  EXPECT_FALSE(s.converged);
  EXPECT_NE(s.remark.find("diverged at sample"), std::string::npos) << s.remark;
  EXPECT_TRUE(s.z.allFinite());
  ASSERT_LT(s.iterations, d.samples());
  EXPECT_TRUE(s.path.topRows(s.iterations).allFinite());
  EXPECT_TRUE(s.path.row(s.iterations).hasNaN());
}

// (21) and (24) once more, with the torque's derivatives as difference quotients of predictions.
VectorXd FilterByDifferences(const Problem& problem, double mu, int samples) {
  const codegen::Model& model = *problem.model;
  const calibration::Dataset& d = *problem.train[0];
  const int columns = model.columns(), n = model.joints(), size = static_cast<int>(problem.start.size());
  VectorXd z = problem.start;
  z.head(columns).setZero();
  MatrixXd P = 100 * MatrixXd::Identity(size, size);
  for (int c = columns; c < size; ++c)
    if (problem.lower[c] == problem.upper[c]) P(c, c) = 0;
  for (int k = 0; k < samples; ++k) {
    codegen::Signals s;
    s.t = d.s.t.segment(k, 1);
    s.q = d.s.q.row(k), s.qd = d.s.qd.row(k), s.qdd = d.s.qdd.row(k);
    const auto torque = [&](VectorXd at) {
      at.tail(size - columns) = at.tail(size - columns).cwiseAbs();
      std::vector<MatrixXd> row;
      model.Regressor(s, {at.data(), static_cast<std::size_t>(columns)},
                      {at.data() + columns, static_cast<std::size_t>(size - columns)}, row);
      VectorXd tau(n);
      for (int j = 0; j < n; ++j) tau[j] = row[j].row(0).dot(at.head(columns));
      return tau;
    };
    const VectorXd error = d.tau.row(k).transpose() - torque(z);
    MatrixXd K(n, size);
    for (int c = 0; c < columns; ++c) {  // linear: the torque of one unit of it
      VectorXd one = z;
      one.head(columns) = VectorXd::Unit(columns, c);
      K.col(c) = torque(one);
    }
    for (int c = columns; c < size; ++c) {
      // Five points: a step of 1e-3 leaves neither rounding nor truncation above 1e-12.
      const double h = 1e-3 * std::abs(z[c]);
      const VectorXd step = h * VectorXd::Unit(size, c);
      K.col(c) = (8 * (torque(z + step) - torque(z - step)) - torque(z + 2 * step) + torque(z - 2 * step)) / (12 * h);
    }
    std::vector<int> used;
    for (int j = 0; j < n; ++j)
      if (d.used(k, j)) used.push_back(j);
    if (!used.empty()) {
      const MatrixXd Ku = K(used, Eigen::all);
      const VectorXd e = error(used);
      const MatrixXd S = Ku * P * Ku.transpose() + mu * MatrixXd::Identity(Ku.rows(), Ku.rows());
      const MatrixXd G = P * Ku.transpose() * S.fullPivLu().inverse();
      z += G * e;
      P = (P - G * Ku * P).eval();
    }
    P /= mu;
  }
  z.tail(size - columns) = z.tail(size - columns).cwiseAbs();
  return z;
}

TEST(ExtendedKalman, StribeckModel_EqualsTheFilterByDifferences) {
  SyntheticArm arm(WithStribeck(PlainRobot("two_link", Columns::kBase)), 25);
  const calibration::Dataset d = arm.Run(2, 26, Stribeck(arm));
  Problem problem = calibration::MakeProblem(arm.model(), {&d});
  HoldDelta(problem);
  for (const double mu : {1.0, 0.99}) {
    problem.forgetting = mu;
    const Solution s = calibration::Forgetting(problem);
    const VectorXd expected = FilterByDifferences(problem, mu, d.samples());
    // The slopes agree to 1e-12; 250 nonlinear steps amplify that.
    EXPECT_LT((s.z - expected).norm() / expected.norm(), 3e-5) << mu;
    EXPECT_GE(s.z.tail(arm.model().nonlinear()).minCoeff(), 0);
    if (mu == 1) {
      EXPECT_EQ(calibration::ExtendedKalman(problem).z, s.z);
    }
  }
}

}  // namespace
}  // namespace armcal::tests
