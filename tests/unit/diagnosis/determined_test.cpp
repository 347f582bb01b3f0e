// diagnosis tests - parameters that nobody could use are marked, and a term without any other is left out.
#include <gtest/gtest.h>

#include "host_sim/diagnose/diagnosis/candidate.hpp"
#include "host_sim/diagnose/diagnosis/determined.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::diagnosis {
namespace {

// A term as a diagnosis leaves it, its parameters independent of one another.
Term TermOf(const std::string& record, const std::vector<double>& eta, const std::vector<double>& eta_sd,
            const std::vector<double>& amplitude, const std::vector<double>& sd) {
  static const codegen::Robot robot = codegen::ReadRobot("codegen/robots/er20_like.toml");
  const codegen::EffectRecord& found = tests::Records().at(record);
  const std::vector<int> joints = found.scope == codegen::EffectScope::kJoint  ? std::vector{1}
                                  : found.scope == codegen::EffectScope::kPair ? std::vector{4, 5}
                                                                               : std::vector<int>{};
  const Candidate candidate(found, robot, joints);
  Term t;
  t.record = &found, t.joints = candidate.joints();
  t.columns = candidate.instance().columns, t.unknowns = candidate.unknowns();
  t.eta = eta, t.eta_sd = Eigen::VectorXd::Map(eta_sd.data(), static_cast<Eigen::Index>(eta_sd.size()));
  t.amplitude = Eigen::VectorXd::Map(amplitude.data(), static_cast<Eigen::Index>(amplitude.size()));
  t.sd = Eigen::VectorXd::Map(sd.data(), static_cast<Eigen::Index>(sd.size()));
  Eigen::VectorXd all(t.eta_sd.size() + t.sd.size());
  all << t.eta_sd, t.sd;
  t.covariance = all.cwiseAbs2().asDiagonal();
  return t;
}

TEST(Determined, AWellDeterminedTerm_HasNoMark) {
  const Term t = TermOf("torque_ripple", {48}, {0.01}, {0.3, 0.2}, {0.01, 0.01});
  EXPECT_TRUE(MarkParameters(t).usable);
  EXPECT_EQ(MarkText(t), "");
}

// A delay has no amplitude that could be compared with chance.
TEST(Determined, ADelayWithinThreeDeviationsOfNothing_IsNotUsable) {
  EXPECT_FALSE(MarkParameters(TermOf("time_delay", {-2e-5}, {0.85e-5}, {1}, {0})).usable);
  EXPECT_TRUE(MarkParameters(TermOf("time_delay", {2e-3}, {1e-4}, {1}, {0})).usable);
}

// One of two amplitudes may be nothing: the ripple's phase is then what it is.
TEST(Determined, ARippleWithOneAmplitudeOfNothing_IsUsable) {
  const Term t = TermOf("torque_ripple", {48}, {0.01}, {0.3, 0.001}, {0.01, 0.01});
  EXPECT_TRUE(MarkParameters(t).usable);
  EXPECT_NE(MarkText(t).find("Rs"), std::string::npos) << MarkText(t);
  EXPECT_NE(MarkText(t).find("not determined"), std::string::npos) << MarkText(t);
}

TEST(Determined, AParameterWithinItsOwnDeviation_IsMarked) {
  const Term t = TermOf("wrist_coupling", {0.91}, {45}, {2, 3}, {0.1, 0.1});
  const Marks marks = MarkParameters(t);
  EXPECT_EQ(marks.eta[0], Mark::kUndetermined);
  EXPECT_TRUE(marks.usable);
  EXPECT_NE(MarkText(t).find("0.91 +- 45"), std::string::npos) << MarkText(t);
}

TEST(Determined, ATermWhoseAmplitudeIsWithinItsDeviation_IsNotUsable) {
  EXPECT_FALSE(MarkParameters(TermOf("load_friction", {}, {}, {0.02}, {0.03})).usable);
  EXPECT_FALSE(MarkParameters(TermOf("torque_ripple", {48}, {0.01}, {0.005, 0.008}, {0.01, 0.01})).usable);
}

// Two amplitudes that are large and uncertain one by one, because their columns are nearly one: their sum is
// determined.
TEST(Determined, AmplitudesThatAreDeterminedTogether_AreUsable) {
  Term t = TermOf("torque_ripple", {48}, {0.01}, {0.6, 0.4}, {1, 1});
  t.covariance(1, 2) = t.covariance(2, 1) = -0.95;  // their sum: 1 +- 0.32, chi^2 10
  EXPECT_TRUE(MarkParameters(t).amplitude[0] == Mark::kUndetermined);
  EXPECT_TRUE(MarkParameters(t).usable);
  // Every single one is marked. Their sum is seen, but not clearly.
  t.eta_sd[0] = 100, t.covariance(0, 0) = 1e4;
  EXPECT_FALSE(MarkParameters(t).usable);
  t.covariance(1, 2) = t.covariance(2, 1) = -0.9999;  // 1 +- 0.014
  EXPECT_TRUE(MarkParameters(t).usable);
}

// Viscosity that falls by exp(-dT / Tc): over few degrees only FvT / Tc shows, and each of the two is uncertain.
TEST(Determined, ParametersThatTradeOff_AreUsableWhereTheirTorqueIsClear) {
  Term t = TermOf("temp_viscous", {38}, {79}, {29}, {59});
  EXPECT_FALSE(MarkParameters(t).usable);
  t.covariance(0, 1) = t.covariance(1, 0) = 0.997 * 79 * 59;  // with Tc known, FvT is 29 +- 4.6
  EXPECT_TRUE(MarkParameters(t).usable);
  EXPECT_NE(MarkText(t).find("FvT"), std::string::npos) << MarkText(t);
  t.covariance(0, 1) = t.covariance(1, 0) = 0.95 * 79 * 59;  // 29 +- 18
  EXPECT_FALSE(MarkParameters(t).usable);
}

// An arm that does not feel gravity: the column of the load is zero in every row, and its estimate and deviation are.
TEST(Determined, AColumnThatTheLogsDoNotSee_CostsTheTermNothing) {
  const Term t = TermOf("backlash", {3e-4}, {1e-5}, {1e5, 0}, {1e3, 0});
  EXPECT_TRUE(MarkParameters(t).usable);
  EXPECT_EQ(MarkParameters(t).amplitude[1], Mark::kUndetermined);
}

// Coefficients of neighbouring splines, each uncertain: the form is not.
TEST(Determined, AFormWhoseCoefficientsAreUncertainOneByOne_IsUsable) {
  Term t = TermOf("torque_drift", {0, 20}, {0, 0}, std::vector<double>(40, 0.1), std::vector<double>(40, 1));
  const auto n = static_cast<Eigen::Index>(t.columns.size());
  t.amplitude.conservativeResize(n), t.sd.conservativeResize(n);
  // All coefficients have one common error: their differences are sharp.
  t.covariance = Eigen::MatrixXd::Zero(n + 2, n + 2);
  t.covariance.bottomRightCorner(n, n) = Eigen::MatrixXd::Constant(n, n, 1) + 1e-4 * Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index k = 0; k < n; ++k) t.amplitude[k] = k % 2 ? 0.1 : -0.1;
  EXPECT_TRUE(MarkParameters(t).usable);
  EXPECT_EQ(MarkText(t), "");
}

TEST(Determined, AParameterWhereItsRangeEnds_IsOnItsBound) {
  const Term t = TermOf("torque_ripple", {4}, {0.01}, {0.3, 0.2}, {0.01, 0.01});  // the record's range begins at 4
  EXPECT_EQ(MarkParameters(t).eta[0], Mark::kOnBound);
}

// The record says that it is not negative.
TEST(Determined, AnAmplitudeBeyondWhatTheRecordAllows_IsMarked) {
  const Marks marks = MarkParameters(TermOf("load_friction", {}, {}, {-0.2}, {0.01}));
  EXPECT_EQ(marks.amplitude[0], Mark::kOnBound);
  EXPECT_FALSE(marks.usable);
}

// A thousandth of the logarithm of a range from 4 to 800 is 0.0053: 4.02 and 795.8 are that far from its ends.
TEST(Determined, ARangeOfLogarithms_HasTwoEnds) {
  codegen::EffectUnknown unknown;
  unknown.lower = 4, unknown.upper = 800, unknown.logarithmic = true;
  for (const double value : {4.0, 4.01, 797.0, 800.0}) EXPECT_TRUE(IsAtEdge(unknown, value)) << value;
  for (const double value : {4.05, 48.0, 790.0}) EXPECT_FALSE(IsAtEdge(unknown, value)) << value;
}

}  // namespace
}  // namespace armcal::diagnosis
