// survey tests - the indices of section 5, worked out by hand on small cases.
#include "host_sim/study/survey/trial.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host_sim/identify/calibration/prior.hpp"
#include "host_sim/study/survey/platform.hpp"
#include "tests/unit/survey/survey_arm.hpp"

namespace armcal::survey {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Two links: m, c, I about the centre -> [22] about the origin.
VectorXd Bodies(const VectorXd& first, const VectorXd& second) {
  VectorXd out = VectorXd::Zero(22);
  out.head(10) = calibration::ToOrigin(first);
  out.segment(11, 10) = calibration::ToOrigin(second);
  return out;
}

VectorXd Link() {
  VectorXd link(10);
  link << 2, 0.1, -0.2, 0.3, 0.5, 0.01, 0.02, 0.6, 0.03, 0.7;
  return link;
}

TEST(BodyErrors, OneEntryOff_CountsATenthOfItsLinkAndHalfOfTheArm) {
  VectorXd off = Link();
  off[0] *= 1.5;  // mass alone: centre and inertia about the centre as set
  const BodyError e = CompareBodies(Bodies(Link(), Link()), Bodies(off, Link()), test::LevelFile());
  EXPECT_NEAR(e.per_link[0], 0.05, 1e-12);
  EXPECT_NEAR(e.per_link[1], 0, 1e-12);
  EXPECT_NEAR(e.e_d, 0.025, 1e-12);
  EXPECT_EQ(e.massless, 0);
  EXPECT_EQ(e.impossible, 0);
}

TEST(BodyErrors, EveryEntryTwentyPercentOff_IsTwoTenths) {
  VectorXd off = Link();
  for (int k = 0; k < 10; ++k) off[k] *= k % 2 ? 1.2 : 0.8;
  EXPECT_NEAR(CompareBodies(Bodies(Link(), Link()), Bodies(off, off), test::LevelFile()).e_d, 0.2, 1e-12);
}

TEST(BodyErrors, MassOfZero_CountsOneForTheCentreAndIsNamed) {
  VectorXd nothing = Bodies(Link(), Link());
  nothing.head(10).setZero();
  const BodyError e = CompareBodies(Bodies(Link(), Link()), nothing, test::LevelFile());
  EXPECT_EQ(e.massless, 1);
  EXPECT_EQ(e.impossible, 1);
  EXPECT_NEAR(e.per_link[0], 1, 1e-12);  // everything 100 % off, never NaN
}

TEST(BodyErrors, EntrySetToAlmostNothing_IsSkippedAndCounted) {
  VectorXd set = Link();
  set[1] = 1e-5;  // metres: below the floor
  VectorXd found = set;
  found[1] = 0.5;
  const BodyError e = CompareBodies(Bodies(set, Link()), Bodies(found, Link()), test::LevelFile());
  EXPECT_EQ(e.skipped, 1);
  EXPECT_NEAR(e.e_d, 0, 1e-9);
}

TEST(BodyErrors, NegativeMass_IsNoBody) {
  VectorXd off = Link();
  off[0] = -2;
  EXPECT_EQ(CompareBodies(Bodies(Link(), Link()), Bodies(off, Link()), test::LevelFile()).impossible, 1);
}

TEST(FrictionErrors, AreTheMeanOverParametersThenJoints) {
  MatrixXd set(2, 2), found(2, 2);
  set << 10, 20, 4, 5;
  found << 11, 20, 4, 10;  // 0.1, 0; 0, 1
  EXPECT_NEAR(FrictionError(set, found), (0.05 + 0.5) / 2, 1e-12);
}

TEST(TorqueErrors, BothReadings_OfTwoSamplesByHand) {
  MatrixXd e(2, 2);
  e << 1, 2, -1, 6;  // joint 1: +1, -1; joint 2: 2, 6
  const TorqueError t = CompareTorques(e, {10, 20});
  EXPECT_NEAR(t.mean_abs, (0.1 + 0.2) / 2, 1e-12);    // Mean(|e| / tau_max)
  EXPECT_NEAR(t.abs_mean, (0.0 + 0.2) / 2, 1e-12);    // |Mean(e)| / tau_max
  EXPECT_NEAR(t.std_signed, (0.1 + 0.1) / 2, 1e-12);  // Std(e / tau_max)
  EXPECT_NEAR(t.std_abs, (0.0 + 0.1) / 2, 1e-12);     // Std(|e| / tau_max)
}

TEST(TorqueErrors, WhiteNoise_HasTheRatiosOfTheNormalDistribution) {
  srand(1);
  const VectorXd u = (VectorXd::Random(200000).array() + 1) / 2, v = (VectorXd::Random(200000).array() + 1) / 2;
  const VectorXd e = (-2 * (1 - u.array() * 0.999999).log()).sqrt() * (2 * M_PI * v.array()).cos();
  const TorqueError t = CompareTorques(e, {50});
  EXPECT_NEAR(t.mean_abs * 50, std::sqrt(2 / M_PI), 0.01);     // 0.8 sigma: why the survey's e_T is no Mean(|e|)
  EXPECT_NEAR(t.std_abs * 50, std::sqrt(1 - 2 / M_PI), 0.01);  // 0.6 sigma
  EXPECT_NEAR(t.std_signed * 50, 1, 0.01);
}

TEST(BaseErrors, AreInUnitsOfEachJointsNoise) {
  MatrixXd d(2, 2);
  d << 10, 2, -10, -2;
  EXPECT_NEAR(BaseError(d, Eigen::Vector2d(10, 2)), 1, 1e-12);
}

TEST(Coverages, CountTruthsInsideOnePointNineSixDeviations) {
  const MatrixXd P = Eigen::Vector4d(1, 4, 1, 0).asDiagonal();
  EXPECT_NEAR(Coverage(Eigen::Vector4d(0, 0, 0, 0), Eigen::Vector4d(1.9, 3.9, 2, 9), P), 2.0 / 3, 1e-12);
  EXPECT_TRUE(std::isnan(Coverage(Eigen::Vector4d::Zero(), Eigen::Vector4d::Zero(), MatrixXd())));
}

// The mean over many noises of an efficient estimator's e_f is the bound.
TEST(FrictionErrors, OfLeastSquaresOverManyNoises_AreTheBound) {
  const Truth truth = AnalyticTruth(test::Arm(Law::kCoulombViscous, Bodies::kBase), Sampled(test::StudyLinear()),
                                    Sampled(test::StudyNonlinear()));
  std::vector<double> errors;
  double least = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const calibration::Dataset log = truth.Noisy(seed);
    calibration::Problem problem = calibration::MakeProblem(truth.model, {&log});
    problem.covariance.resize(0, 0);
    least = LeastFrictionError(truth, problem);
    const calibration::Solution found = Solve(calibration::FindMethod("weighted_pseudo_inverse"), problem);
    errors.push_back(FrictionError(truth.friction, Friction(truth.model, found.z)));
  }
  EXPECT_NEAR(Summarise(errors).mean / least, 1, 0.15);  // of 240 errors
}

TEST(FollowErrors, LookOnlyAtWhatComesAfterSettling) {
  MatrixXd truth = MatrixXd::Constant(100, 1, 2), found = truth;
  found.topRows(50).setConstant(99);
  found.bottomRows(50).setConstant(2.1);
  EXPECT_NEAR(FollowError(truth, found, 0.1, 5), 0.05, 1e-12);
  EXPECT_GT(FollowError(truth, found, 0.1, 4.9), 1);
}

TEST(Summaries, OfThreeValues_HaveStudentsInterval) {
  const Statistic s = Summarise({1, 2, 3, std::nan("")});
  EXPECT_EQ(s.draws, 3);
  EXPECT_NEAR(s.mean, 2, 1e-12);
  EXPECT_NEAR(s.high - s.mean, 4.303 / std::sqrt(3.0), 1e-3);  // sd 1, t with 2 degrees of freedom 4.303
  EXPECT_EQ(s.p95, 3);
  EXPECT_TRUE(std::isnan(Summarise({5}).low));
}

TEST(Summaries, IntervalOfManyDraws_ApproachesTheNormalOne) {
  std::vector<double> v;
  for (int k = 0; k < 200; ++k) v.push_back(k % 2 ? 1 : -1);
  EXPECT_NEAR(Summarise(v).high, 1.972 * std::sqrt(200.0 / 199 / 200), 1e-3);  // t with 199 degrees of freedom 1.972
  v.clear();
  for (int k = 1; k <= 100; ++k) v.push_back(k);
  EXPECT_EQ(Summarise(v).p95, 95);
}

}  // namespace
}  // namespace armcal::survey
