// diagnosis tests - forces at the flange of KDL's arm, and a torque over two positions, are named where they act.
#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "host_sim/diagnose/diagnosis/diagnose.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::diagnosis {
namespace {

using calibration::Dataset;
using tests::KdlArm;
using tests::SyntheticArm;

class OnTheEr20 : public testing::Test {
 protected:
  OnTheEr20() : arm_(tests::Er20(), 3), log_(arm_.Run(20, 11)) {}

  // What holds a force at a point of the last link's z axis: the slope of the work that the force does.
  void Push(double along_m, const std::function<KDL::Vector(double t, const KDL::Vector& at)>& force) {
    constexpr double kStep_rad = 1e-5;
    const KdlArm kdl(arm_.model().robot(), arm_.bodies());
    const KDL::Vector hand(0, 0, along_m);
    for (int k = 0; k < log_.samples(); ++k) {
      const Eigen::VectorXd q = log_.s.q.row(k);
      const KDL::Vector f = force(log_.s.t[k], kdl.Flange(q) * hand);
      for (int j = 0; j < log_.joints(); ++j) {
        const Eigen::VectorXd step = kStep_rad * Eigen::VectorXd::Unit(q.size(), j);
        log_.tau(k, j) -= KDL::dot(f, kdl.Flange(q + step) * hand - kdl.Flange(q - step) * hand) / (2 * kStep_rad);
      }
    }
  }
  const Term* First() {
    diagnosis_ = std::make_unique<Diagnosis>(arm_.model(), tests::Records(), std::vector<const Dataset*>{&log_},
                                             std::vector<const Dataset*>{});
    const auto& terms = diagnosis_->finding().terms;
    return terms.empty() ? nullptr : &terms[0];
  }

  SyntheticArm arm_;
  Dataset log_;
  std::unique_ptr<Diagnosis> diagnosis_;
};

TEST_F(OnTheEr20, AHoseToTheCeiling_IsNamedWithItsAnchorAndLength) {
  const KDL::Vector anchor(0.6, -0.9, 3.1);
  constexpr double kFree_m = 0.8, kStiffness_Npm = 60;
  Push(0.15, [&](double, const KDL::Vector& at) {
    const KDL::Vector to = anchor - at;
    return to * (kStiffness_Npm * std::max(0.0, 1 - kFree_m / to.Norm()));
  });
  const Term* t = First();
  ASSERT_NE(t, nullptr);
  ASSERT_EQ(t->record->name, "flange_hose");
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(t->eta[static_cast<std::size_t>(axis)], anchor[axis], 4 * t->eta_sd[axis] + 0.01) << axis;
  EXPECT_NEAR(t->amplitude[0], kStiffness_Npm, 4 * t->sd[0]);
}

TEST_F(OnTheEr20, TwoPushesAtTheFlange_AreOneContactThere) {
  const double begin[] = {5.2, 13.1}, length = 0.6;
  Push(0, [&](double t, const KDL::Vector&) {
    double size = 0;
    for (const double from : begin)
      if (const double u = (t - from) / length; u > 0 && u < 1) size = 30 * std::sin(std::numbers::pi * u);
    return KDL::Vector(0.6, -0.5, 0.62) * size;
  });
  const Term* t = First();
  ASSERT_NE(t, nullptr);
  ASSERT_EQ(t->record->name, "flange_contact");
  ASSERT_EQ(t->eta.size(), 4U);  // on, off of each
  std::vector<double> middle{(t->eta[0] + t->eta[1]) / 2, (t->eta[2] + t->eta[3]) / 2};
  std::sort(middle.begin(), middle.end());
  for (int k = 0; k < 2; ++k) EXPECT_NEAR(middle[static_cast<std::size_t>(k)], begin[k] + length / 2, 0.06);
}

TEST_F(OnTheEr20, AProductOfTwoPositions_IsASurfaceOverThem) {
  for (int k = 0; k < log_.samples(); ++k)
    log_.tau(k, 3) += 1.5 * std::sin(1.9 * log_.s.q(k, 3) + 0.3) * std::cos(1.6 * log_.s.q(k, 1));
  const Term* t = First();
  ASSERT_NE(t, nullptr);
  EXPECT_EQ(t->record->name, "curve_two_positions");
  EXPECT_EQ(t->joints, (std::vector{3, 1}));
}

// The same arm without any of them.
TEST_F(OnTheEr20, NothingAtTheFlange_IsNotNamed) { EXPECT_EQ(First(), nullptr); }

}  // namespace
}  // namespace armcal::diagnosis
