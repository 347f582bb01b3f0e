// verdict tests - units, intervals and curves that a page shows, against values made by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "host_sim/diagnose/verdict/curves.hpp"
#include "host_sim/diagnose/verdict/json_values.hpp"

namespace armcal::verdict {
namespace {

using nlohmann::ordered_json;

const ordered_json kArm{{"torque_units", {"N m", "N", "N"}}, {"joint_names", {"axis 1", "slide", "joint 3"}}};

TEST(PageValues, UnitsOfAJointThatSlides) {
  EXPECT_EQ(UnitOn(kArm, {2}, "N*m"), "N");
  EXPECT_EQ(UnitOn(kArm, {2, 3}, "N*m*s/rad"), "N*s/m");
  EXPECT_EQ(UnitOn(kArm, {2}, "1/rad"), "1/m");
  EXPECT_EQ(UnitOn(kArm, {2}, "s"), "s");
  EXPECT_EQ(UnitOn(kArm, {1, 2}, "N*m"), "N*m");  // one of them turns
  EXPECT_EQ(UnitOn(kArm, {}, "N*m"), "N*m");      // of the whole arm
}

TEST(PageValues, UnitsOfColumns_FollowTheirJoint_AndThoseOfBodiesDoNot) {
  EXPECT_EQ(ColumnUnit(kArm, "Fv2", "N*m*s/rad"), "N*s/m");
  EXPECT_EQ(ColumnUnit(kArm, "Fv1", "N*m*s/rad"), "N*m*s/rad");
  EXPECT_EQ(ColumnUnit(kArm, "Ia2", "kg*m^2"), "kg");
  EXPECT_EQ(ColumnUnit(kArm, "Izz2", "kg*m^2"), "kg*m^2");
  EXPECT_EQ(ColumnUnit(kArm, "Izz2R", "kg*m^2"), "kg*m^2");
  EXPECT_EQ(ColumnUnit(kArm, "Fc", "N*m"), "N*m");
  EXPECT_EQ(ColumnUnit(kArm, "Fc99", "N*m"), "N*m");
}

TEST(PageValues, IntervalsNumbersAndNames) {
  EXPECT_EQ(Interval95(1, 0.1), "0.8040 to 1.196");
  EXPECT_EQ(Interval95(1, 0), "-");
  EXPECT_EQ(Interval95(1, NAN), "-");
  EXPECT_TRUE(std::isnan(NumberOf(nullptr)));
  EXPECT_TRUE(std::isnan(NumberOf(INFINITY)));
  EXPECT_EQ(NumberOf(2), 2);
  EXPECT_EQ(JointTitle(kArm, 1), "joint 1");
  EXPECT_EQ(JointTitle(kArm, 2), "joint 2, slide");
  EXPECT_EQ(JointTitle(kArm, 3), "joint 3");
}

// One joint, 250 Hz; the joint rests in the second half.
calibration::Dataset Log(int samples) {
  calibration::Dataset d;
  d.s.t = Eigen::VectorXd::LinSpaced(samples, 0, (samples - 1) / 250.0);
  d.tau = d.s.q = Eigen::MatrixXd::Zero(samples, 1);
  d.used = Eigen::MatrixXi::Ones(samples, 1);
  d.used.bottomRows(samples / 2).setZero();
  return d;
}

TEST(Curves, APeakOfOneSampleStays_OfTheTorqueAndOfWhatAPredictionLeaves) {
  calibration::Dataset d = Log(400000);
  for (Eigen::Index k = 0; k < d.tau.rows(); ++k) d.tau(k, 0) = static_cast<double>(k % 1000);
  Eigen::VectorXd predicted = d.tau.col(0);
  d.tau(300000, 0) = 4321;
  predicted[100300] -= 77;
  const ordered_json curves = CurvesOf(d, 0, {{"model", predicted}});
  EXPECT_LT(curves.at("t").size(), 40000u);
  double highest = 0, most = 0;
  for (std::size_t k = 0; k < curves["t"].size(); ++k) {
    const double measured = curves.at("measured")[k], t = curves["t"][k];
    highest = std::max(highest, measured);
    EXPECT_EQ(curves.at("model")[k].is_null(), t >= 800) << t;  // where the joint rests
    if (!curves["model"][k].is_null()) most = std::max(most, measured - curves["model"][k].get<double>());
  }
  EXPECT_EQ(highest, 4321);
  EXPECT_EQ(most, 77);
}

TEST(Curves, ASpectrum_ShowsWhatIsLeftAtItsFrequency) {
  calibration::Dataset d = Log(20000);
  d.used.setOnes();
  for (Eigen::Index k = 0; k < d.tau.rows(); ++k) d.tau(k, 0) = std::sin(2 * M_PI * 5 * d.s.t[k]);
  const ordered_json spectrum =
      CurvesOf(d, 0, {{"all", d.tau.col(0)}, {"nothing", Eigen::VectorXd::Zero(20000)}}).at("spectrum");
  EXPECT_EQ(spectrum.at("nothing"), spectrum.at("measured"));
  std::size_t peak = 0;
  for (std::size_t k = 0; k < spectrum.at("Hz").size(); ++k) {
    EXPECT_EQ(spectrum.at("all")[k], 0) << k;
    if (spectrum["nothing"][k].get<double>() > spectrum["nothing"][peak].get<double>()) peak = k;
  }
  EXPECT_NEAR(spectrum["Hz"][peak].get<double>(), 5, 0.4);
}

}  // namespace
}  // namespace armcal::verdict
