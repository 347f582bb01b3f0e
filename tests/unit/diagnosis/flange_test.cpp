// diagnosis tests - forces at the flange of KDL's arm, and a torque over two positions, are named where they act.
#include <gtest/gtest.h>

#include <algorithm>
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
  const Term* First(const codegen::Catalogue& records = tests::Records()) {
    diagnosis_ = std::make_unique<Diagnosis>(arm_.model(), records, std::vector<const Dataset*>{&log_},
                                             std::vector<const Dataset*>{});
    const auto& terms = diagnosis_->finding().terms;
    return terms.empty() ? nullptr : &terms[0];
  }

  static constexpr double kLength_s = 0.6;
  void PushAt(const std::vector<double>& begin, double size_N) {
    Push(0, [&](double t, const KDL::Vector&) {
      double size = 0;
      for (const double from : begin)
        if (const double u = (t - from) / kLength_s; u > 0 && u < 1) size = size_N * std::sin(std::numbers::pi * u);
      return KDL::Vector(0.6, -0.5, 0.62) * size;
    });
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

// The middle of each push that a term names, in order.
std::vector<double> Middles(const Term& t) {
  std::vector<double> out;
  for (std::size_t k = 0; k + 1 < t.eta.size(); k += 2) out.push_back((t.eta[k] + t.eta[k + 1]) / 2);
  std::sort(out.begin(), out.end());
  return out;
}

TEST_F(OnTheEr20, TwoPushesAtTheFlange_AreOneContactThere) {
  const double begin[] = {5.2, 13.1};
  PushAt({begin[0], begin[1]}, 30);
  const Term* t = First();
  ASSERT_NE(t, nullptr);
  ASSERT_EQ(t->record->name, "flange_contact");
  ASSERT_EQ(t->eta.size(), 4U);  // on, off of each
  const std::vector<double> middle = Middles(*t);
  for (int k = 0; k < 2; ++k) EXPECT_NEAR(middle[static_cast<std::size_t>(k)], begin[k] + kLength_s / 2, 0.06);
}

// One of them alone would not be seen.
TEST_F(OnTheEr20, WeakPushesAtTheFlange_AreOneContactThere) {
  const std::vector<double> begin{3.1, 7.2, 11.5, 16.3};
  PushAt(begin, 5);
  codegen::Catalogue records;
  for (const char* name : {"flange_contact", "external_contact", "payload_step"})
    records.insert({name, tests::Records().at(name)});
  const Term* t = First(records);
  ASSERT_NE(t, nullptr);
  ASSERT_EQ(t->record->name, "flange_contact");
  const std::vector<double> middle = Middles(*t);
  EXPECT_GT(middle.size(), 1U);
  for (const double at : middle)
    EXPECT_TRUE(std::any_of(begin.begin(), begin.end(), [&](double from) {
      return std::abs(from + kLength_s / 2 - at) < 0.2;
    })) << at;
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
