// unit tests - the widths of the links' prior against the spread from which a KDL arm was drawn.
#include <gtest/gtest.h>

#include "host_sim/identify/methods/link_widths.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::tests {
namespace {

using calibration::LinkWidths;
using Eigen::VectorXd;

// Distance of centres and inertias from the truth, each over the spread from which it was drawn.
double Distance(const SyntheticArm& arm, const VectorXd& bodies) {
  double sum = 0;
  for (int j = 0; j < arm.model().joints(); ++j) {
    const VectorXd d =
        calibration::ToCentre(bodies.segment(11 * j, 10)) - calibration::ToCentre(arm.bodies().segment(11 * j, 10));
    for (int k = 1; k < 10; ++k) sum += std::pow(d[k] / arm.model().table()[11 * j + k].sd, 2);
  }
  return std::sqrt(sum / (9 * arm.model().joints()));
}

struct Found {
  LinkWidths widths;
  double cad, as_filed, estimated;  // distances
};

// The arm is drawn with the spread of `drawn`; the estimate knows the shipped file only.
Found Estimate(const codegen::Robot& drawn, std::uint64_t seed) {
  SyntheticArm arm(drawn, seed);
  const calibration::Dataset log = arm.Run(20, seed + 1);
  const codegen::Model& shipped = Er20Model();
  const calibration::Fit fit = calibration::WeightedFit(shipped, {&log});
  Found out;
  out.widths = calibration::EstimateLinkWidths(shipped, fit);
  const calibration::PhysicalReadOut found = calibration::ReadOutWithWidths(shipped, fit, out.widths);
  EXPECT_TRUE(calibration::IsPhysical(found.bodies));
  out.cad = Distance(arm, calibration::BodyMean(shipped));
  out.as_filed = Distance(arm, calibration::ReadOutPhysical(shipped, fit).bodies);
  out.estimated = Distance(arm, found.bodies);
  return out;
}

codegen::Robot Spread(double relative, double center_m, double inertia_ratio) {
  codegen::Robot robot = Er20();
  robot.link_relative_sd = relative, robot.center_floor_m = center_m, robot.inertia_floor_ratio = inertia_ratio;
  return robot;
}

TEST(LinkWidths, OfAnArmThatIsOffByAShareOfEachValue_AreThatShare_AndLeadNearerToTheTruth) {
  for (const double share : {0.05, 0.15}) {
    double w = 0;
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const Found found = Estimate(Spread(share, 0, 0), seed);
      w += found.widths.relative.mean() / 3;
      EXPECT_LT(found.widths.center_m, 1e-3) << share;  // a tenth of what the file allows
      EXPECT_LT(found.estimated, found.cad) << share;
      EXPECT_LT(found.estimated, found.as_filed) << share;
    }
    // 36 directions tell of the width, so its logarithm is known to some 0.15 for each of the three arms.
    EXPECT_NEAR(std::log(w / share), 0, 0.3);
  }
}

TEST(LinkWidths, OfCentresAndProductsThatAreOffByAnAmount_AreSeen_AlsoWhereCadHasNext) {
  for (const std::uint64_t seed : {1U, 2U}) {
    const Found found = Estimate(Spread(1e-3, 0.01, 0.05), seed);
    EXPECT_GT(found.widths.center_m, 0.004);
    EXPECT_LT(found.widths.center_m, 0.02);
    EXPECT_LT(found.widths.relative.mean(), 0.1);
    EXPECT_LT(found.estimated, found.cad);
  }
}

TEST(LinkWidths, ABodyParameterThatTheTableHolds_IsHeld) {
  SyntheticArm arm(Er20(), 4);
  const calibration::Dataset log = arm.Run(10, 5);
  const calibration::Fit fit = calibration::WeightedFit(arm.model(), {&log});
  LinkWidths widths = calibration::EstimateLinkWidths(arm.model(), fit);
  widths.sd[0] = 0;  // the mass of link 1
  const calibration::PhysicalReadOut found = calibration::ReadOutWithWidths(arm.model(), fit, widths);
  EXPECT_EQ(found.bodies[0], calibration::BodyMean(arm.model())[0]);
}

}  // namespace
}  // namespace armcal::tests
