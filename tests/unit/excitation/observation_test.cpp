// excitation tests - the condition number and torque against a singular value decomposition and a published trajectory.
#include "host_sim/identify/excitation/observation.hpp"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cmath>

#include "host_sim/identify/excitation/optimise.hpp"
#include "host_sim/identify/excitation/peaks.hpp"
#include "tests/unit/excitation/arms.hpp"

namespace armcal::excitation {
namespace {

using Eigen::MatrixXd;

// From the model's rows alone: stacked, divided by the noise, unit columns, JacobiSVD.
double ConditionBySvd(const codegen::Model& model, const std::vector<int>& columns, const codegen::Signals& s) {
  std::vector<MatrixXd> row;
  const Eigen::VectorXd committed = Eigen::VectorXd::Zero(model.columns());
  model.Regressor(s, {committed.data(), static_cast<std::size_t>(committed.size())}, {}, row);
  const Eigen::Index samples = s.q.rows(), asked = static_cast<Eigen::Index>(columns.size());
  MatrixXd K(samples * model.joints(), asked);
  for (int i = 0; i < model.joints(); ++i)
    for (Eigen::Index c = 0; c < asked; ++c)
      K.col(c).segment(i * samples, samples) = row[i].col(columns[c]) / model.robot().joint[i].torque_noise_Nm;
  K.colwise().normalize();
  const Eigen::VectorXd s_values = Eigen::JacobiSVD<MatrixXd>(K).singularValues();
  return s_values[0] / s_values[s_values.size() - 1];
}

TEST(Observation, ConditionNumber_IsThatOfTheStackedScaledMatrix) {
  const codegen::Model model = test::Arm(test::RobotFile("er20_like"));
  const codegen::Signals s = test::PublishedSeries().At(test::OnePeriod(150));
  for (const auto rotors : {Observation::Rotors::kAsked, Observation::Rotors::kLeftOut}) {
    const Observation observation(model, rotors);
    EXPECT_NEAR(observation.ConditionNumber(s) / ConditionBySvd(model, observation.columns(), s), 1, 1e-9);
  }
}

TEST(Observation, OfAMotionLongerThanOnePiece_IsThatOfTheWhole) {
  const codegen::Model model = test::Arm(test::RobotFile("two_link"));
  const Observation observation(model);
  Series series = test::PublishedSeries();
  series.coefficient = series.coefficient.leftCols(2).eval();
  const codegen::Signals s = series.At(test::OnePeriod(2500));
  EXPECT_NEAR(observation.ConditionNumber(s) / ConditionBySvd(model, observation.columns(), s), 1, 1e-9);
}

TEST(Observation, OfThePublishedSeriesWithoutRotors_HasThePublishedConditionNumber) {
  const codegen::Model model = test::Arm(test::RobotFile("er20_like"));
  const Observation observation(model, Observation::Rotors::kLeftOut);
  EXPECT_EQ(observation.columns().size(), 48u);  // 36 of the bodies, 12 of friction
  EXPECT_NEAR(PeriodCondition(observation, test::PublishedSeries()), 4.37,
              0.02);  // published with 3 digits, coefficients with 4
}

TEST(Observation, OfThePublishedSeriesWithoutRotors_HasThePublishedTorquePeaks) {
  codegen::Robot robot = test::RobotFile("er20_like");
  for (codegen::Joint& j : robot.joint) j.motor.rotor_inertia_kgm2 = 0;
  const codegen::Model model = test::Arm(robot);
  const auto peaks = FindPeaks(Observation(model), test::PublishedSeries().At(test::OnePeriod(1000)));
  const double published[] = {311, 821, 301, 52, 33, 26};
  for (int j = 0; j < 6; ++j)
    EXPECT_NEAR(peaks[j].torque_Nm, published[j], 0.6) << "joint " << j + 1;  // rounded to 1 N m
}

// An arm that is turned by half a turn about its first axis, which lies level: gravity pulls the other way.
TEST(FindPeaks, OfATorqueThatIsNegativeOnly_AreItsSize) {
  const codegen::Model model = test::Arm(test::RobotFile("two_link"));
  const Observation observation(model);
  const auto held = [&](double q1) {
    codegen::Signals s;
    s.t = Eigen::VectorXd::LinSpaced(5, 0, 1);
    s.q = s.qd = s.qdd = Eigen::MatrixXd::Zero(5, 2);
    s.q.col(0).setConstant(q1);
    return FindPeaks(observation, s)[0].torque_Nm;
  };
  for (const double q1 : {-0.4, 0.3}) {
    EXPECT_GT(held(q1), 1) << q1;
    EXPECT_NEAR(held(q1 + std::numbers::pi), held(q1), 1e-9 * held(q1)) << q1;
  }
}

TEST(Observation, OfAnArmAtRest_IsSingular) {
  const codegen::Model model = test::Arm(test::RobotFile("er20_like"));
  codegen::Signals s;
  s.t = Eigen::VectorXd::LinSpaced(50, 0, 1);
  s.q = MatrixXd::Constant(50, 6, 0.3), s.qd = s.qdd = MatrixXd::Zero(50, 6);
  EXPECT_TRUE(std::isinf(Observation(model).ConditionNumber(s)));
}

TEST(Observation, AsksForEstimatedColumnsThatMotionExcites) {
  codegen::Robot robot = test::RobotFile("er20_like");
  const codegen::Model standby = test::Arm(robot);
  EXPECT_EQ(Observation(standby).columns().size(), 52u);  // 48 and four rotors; the offsets are in standby
  robot.effect[0].state = "estimated";
  const codegen::Model offsets = test::Arm(robot);
  EXPECT_EQ(Observation(offsets).columns().size(), 58u);
  robot.effect.push_back({"temp_viscous", {0}, "estimated", {}, {}});
  const codegen::Model warm = test::Arm(robot);
  const Observation observation(warm);
  EXPECT_EQ(observation.columns().size(), 58u);
  EXPECT_EQ(observation.left_out().size(), 1u);
}

}  // namespace
}  // namespace armcal::excitation
