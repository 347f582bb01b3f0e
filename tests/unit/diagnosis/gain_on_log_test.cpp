// diagnosis tests - compare what a held-out log adds to a term's gain with dense least squares over both logs.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <random>

#include "host_sim/diagnose/diagnosis/gain_on_log.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::diagnosis {
namespace {

using calibration::Dataset;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kJoint = 1;

// The least sum of squares over the noise, the prior's included, of these logs. The model has the cubic term or not.
double Chi2(const codegen::Model& model, const std::vector<const Dataset*>& logs, const VectorXd& sigma, bool cubic) {
  const calibration::Prior prior = calibration::MakePrior(model);
  const auto active = static_cast<Eigen::Index>(prior.active.size());
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(prior.covariance(prior.active, prior.active));
  const MatrixXd root = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
  std::vector<VectorXd> row;
  std::vector<double> left;
  for (const Dataset* log : logs) {
    std::vector<MatrixXd> regressor;
    model.Regressor(log->s, {prior.mean.data(), static_cast<std::size_t>(model.columns())}, {}, regressor);
    for (int j = 0; j < model.joints(); ++j)
      for (int k = 0; k < log->samples(); ++k) {
        if (!log->used(k, j)) continue;
        const VectorXd columns = regressor[static_cast<std::size_t>(j)].row(k).transpose();
        row.emplace_back(active + 1);
        row.back() << root.transpose() * columns(prior.active), cubic && j == kJoint ? std::pow(log->s.qd(k, j), 3) : 0;
        row.back() /= sigma[j];
        left.push_back((log->tau(k, j) - columns.dot(prior.mean.head(model.columns()))) / sigma[j]);
      }
  }
  const auto rows = static_cast<Eigen::Index>(row.size());
  MatrixXd A = MatrixXd::Zero(rows + active, active + 1);
  VectorXd b = VectorXd::Zero(rows + active);
  for (Eigen::Index k = 0; k < rows; ++k)
    A.row(k) = row[static_cast<std::size_t>(k)], b[k] = left[static_cast<std::size_t>(k)];
  A.bottomLeftCorner(active, active).setIdentity();
  return (b - A * A.completeOrthogonalDecomposition().solve(b)).squaredNorm();
}

TEST(AddedBy, IsTheGainOfBothLogsTogether_LessThatOfTraining) {
  codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
  for (codegen::Joint& joint : robot.joint) joint.motor.torque_constant_tolerance = 0;
  tests::SyntheticArm arm(robot, 6);
  const tests::Effect cubic = [](const tests::State& s) { return s.joint == kJoint ? 0.03 * std::pow(s.qd, 3) : 0; };
  const Dataset train = arm.Run(20, 60, cubic);
  const codegen::Catalogue records{{"viscous_cubic", tests::Records().at("viscous_cubic")}};
  for (const bool shows : {true, false}) {
    const Dataset log = arm.Run(16, 61, shows ? cubic : tests::Effect());
    Diagnosis::Work work(arm.model(), records, {&train});
    work.Solve({});
    Chosen term;
    for (const auto& c : work.candidates)
      if (c->joints() == std::vector<int>{kJoint}) term.candidate = c.get();
    const auto gain = [&](const std::vector<const Dataset*>& logs) {
      return Chi2(arm.model(), logs, work.estimate.sigma, false) - Chi2(arm.model(), logs, work.estimate.sigma, true);
    };
    const double expected = gain({&train, &log}) - gain({&train});
    EXPECT_EQ(expected > 0, shows);
    // AddedBy takes for noise what the term leaves, which is a few percent less than what the declared model leaves.
    EXPECT_NEAR(AddedBy(work, log, term, {}), expected, 0.05 * std::abs(expected));
  }
}

// With the term a log leaves white noise, without it 1.2 times that. A knock in every 97th row is 50 times the noise.
TEST(GainOn, OfALogWithKnocks_IsAboutThatOfItsOtherRows) {
  tests::SyntheticArm arm(codegen::ReadRobot("codegen/robots/two_link.toml"), 6);
  const Dataset log = arm.Run(16, 62);
  const codegen::Catalogue records{{"viscous_cubic", tests::Records().at("viscous_cubic")}};
  Diagnosis::Work work(arm.model(), records, {&log});
  const auto& candidates = work.candidates;
  const auto own = std::find_if(candidates.begin(), candidates.end(),
                                [](const auto& c) { return c->joints() == std::vector<int>{kJoint}; });
  ASSERT_NE(own, candidates.end());
  std::mt19937_64 random(63);
  std::normal_distribution<double> normal;
  MatrixXd with = MatrixXd::Zero(log.samples(), log.joints());
  for (int k = 0; k < log.samples(); ++k) with(k, kJoint) = normal(random);
  MatrixXd without = 1.2 * with;
  for (int k = 0; k < log.samples(); k += 97) with(k, kJoint) += 50, without(k, kJoint) += 50;
  const double expected = log.used.col(kJoint).sum() * 2 * std::log(1.2);
  EXPECT_NEAR(GainOn(log, **own, without, with), expected, 0.3 * expected);
}

}  // namespace
}  // namespace armcal::diagnosis
