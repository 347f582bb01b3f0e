// health - tests the verdict on joints whose trouble is known.
#include "host_sim/diagnose/health/joint_health.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/health/synthetic_joint.hpp"

namespace armcal::health {
namespace {

using monitor::ResidualRow;
using test::SyntheticJoint;

double Sign(double x) { return x > 0 ? 1 : -1; }

// 160 s healthy, 200 s with `trouble`; the answer on it.
JointHealth After(const std::function<double(const ResidualRow&)>& trouble) {
  SyntheticJoint joint([&](const ResidualRow& r, double t) { return t < 160 ? 0 : trouble(r); });
  joint.Run(360);
  return Judge(joint.Read());
}

TEST(JointHealth, WithoutTrouble_Fits) {
  const JointHealth h = After([](const ResidualRow&) { return 0; });
  EXPECT_EQ(h.verdict, Verdict::kFits);
  EXPECT_NEAR(h.rms_now_Nm, test::kSigma_Nm, 0.1);
}

struct Case {
  const char* name;
  int shape;
  double value;
  std::function<double(const ResidualRow&)> torque_Nm;
};

class EachCause : public testing::TestWithParam<Case> {};

TEST_P(EachCause, IsNamedWithItsSizeAndItsTime) {
  const JointHealth h = After(GetParam().torque_Nm);
  ASSERT_EQ(h.verdict, Verdict::kNoLongerFits);
  ASSERT_EQ(h.looks_like.terms.size(), 1u);
  const Term& term = h.looks_like.terms[0];
  EXPECT_STREQ(ShapeOf(term.shape).name, ShapeOf(GetParam().shape).name);
  EXPECT_TRUE(term.also.empty()) << ShapeOf(term.also[0]).name;
  // 29 s went to the recent rows before the trouble began; these forget with 131 s of motion.
  const double healthy = std::exp(-200 / 131.0) * (1 - std::exp(-29 / 131.0)) / (1 - std::exp(-229 / 131.0));
  EXPECT_NEAR(term.value / GetParam().value, 1 - healthy, 0.04);  // four standard deviations of the weakest
  ASSERT_TRUE(h.onset);
  EXPECT_NEAR(h.onset->at_s, 160, 10);  // a slice is 8 s
  EXPECT_LE(h.onset->earliest_s, 160);
  EXPECT_GE(h.onset->latest_s, 160);
}

INSTANTIATE_TEST_SUITE_P(
    All, EachCause,
    testing::Values(Case{"offset", kOffset, -3, [](const ResidualRow&) { return -3; }},
                    Case{"coulomb", kCoulomb, 4, [](const ResidualRow& r) { return 4 * Sign(r.speed_radps); }},
                    Case{"viscous", kViscous, 3, [](const ResidualRow& r) { return 3.0 * r.speed_radps; }},
                    Case{"gain", kGain, 0.03, [](const ResidualRow& r) { return 0.03 * r.load_Nm; }},
                    Case{"load_friction", kLoadFriction, 0.05,
                         [](const ResidualRow& r) { return 0.05 * std::abs(r.load_Nm) * Sign(r.speed_radps); }},
                    Case{"position", kPosition, 5, [](const ResidualRow& r) { return 5.0 * r.position_rad; }}),
    [](const auto& cause) { return cause.param.name; });

TEST(JointHealth, TwoCausesAtOnce_AreBothNamed) {
  const JointHealth h = After([](const ResidualRow& r) { return 5 * Sign(r.speed_radps) - 4; });
  ASSERT_EQ(h.looks_like.terms.size(), 2u);
  EXPECT_EQ(h.looks_like.terms[0].shape, kCoulomb);
  EXPECT_EQ(h.looks_like.terms[1].shape, kOffset);
}

TEST(JointHealth, AtOneSpeedOnly_CoulombAndViscousAreNotToldApart) {
  SyntheticJoint joint([](const ResidualRow& r, double t) { return t < 160 ? 0.0 : 4 * Sign(r.speed_radps); });
  joint.one_speed = true;
  joint.Run(360);
  const JointHealth h = Judge(joint.Read());
  ASSERT_EQ(h.verdict, Verdict::kNoLongerFits);
  ASSERT_EQ(h.looks_like.terms.size(), 1u);
  std::vector<int> said = h.looks_like.terms[0].also;
  said.push_back(h.looks_like.terms[0].shape);
  for (const int k : {kCoulomb, kViscous}) EXPECT_TRUE(std::count(said.begin(), said.end(), k)) << ShapeOf(k).name;
  EXPECT_FALSE(std::count(said.begin(), said.end(), kOffset));
}

TEST(JointHealth, ARippleThatNoBinResolves_IsSeenButNotNamed) {
  const JointHealth h = After([](const ResidualRow& r) { return 3 * std::sin(90.0 * r.position_rad); });
  EXPECT_EQ(h.verdict, Verdict::kNoLongerFits);
  EXPECT_TRUE(h.looks_like.terms.empty());
  EXPECT_TRUE(h.onset);
}

TEST(JointHealth, AViscosityThatFallsAsTheJointWarms_IsNamedByTemperature) {
  SyntheticJoint joint(
      [](const ResidualRow& r, double) { return -0.25 * (r.temperature_degC - 25.0) * r.speed_radps; });
  joint.temperature_degC = [](double t) { return t < 140 ? 25 : 25 + 0.08 * (t - 140); };  // 25 to 42 degC
  joint.Run(360);
  const JointHealth h = Judge(joint.Read());
  ASSERT_EQ(h.verdict, Verdict::kNoLongerFits);
  ASSERT_FALSE(h.looks_like.terms.empty());
  EXPECT_STREQ(ShapeOf(h.looks_like.terms[0].shape).kind, "temp_viscous");
  EXPECT_NEAR(h.looks_like.terms[0].value, -0.25, 0.05);
}

TEST(JointHealth, AMisfitThatWasThereFromTheStart_IsNoChange_WhateverTheMotion) {
  SyntheticJoint joint([](const ResidualRow& r, double) { return 1.2 * r.speed_radps; });
  joint.Run(160);
  joint.speed_scale = 1.5;
  joint.Run(200);
  const JointHealth h = Judge(joint.Read());
  EXPECT_TRUE(h.looks_like.terms.empty()) << ShapeOf(h.looks_like.terms[0].shape).name;
}

TEST(JointHealth, ALargeResidualFromTheStart_NeverFitted) {
  SyntheticJoint joint([](const ResidualRow& r, double) { return 9 * Sign(r.speed_radps); });
  joint.Run(360);
  const JointHealth h = Judge(joint.Read());
  EXPECT_EQ(h.verdict, Verdict::kNeverFitted);
  ASSERT_EQ(h.looks_like.terms.size(), 1u);
  EXPECT_EQ(h.looks_like.terms[0].shape, kCoulomb);
  EXPECT_NEAR(h.looks_like.terms[0].value, 9, 0.3);
}

TEST(JointHealth, AGainThatNoSensorHas_IsNotOffered) {
  SyntheticJoint joint([](const ResidualRow& r, double t) { return t < 160 ? 0.0 : 0.8 * r.load_Nm; });
  joint.Run(360);
  const JointHealth h = Judge(joint.Read());
  EXPECT_EQ(h.verdict, Verdict::kNoLongerFits);
  for (const Term& t : h.looks_like.terms) EXPECT_STRNE(ShapeOf(t.shape).name, "torque gain");
}

TEST(ChangedTogether, AreJointsWithAnotherLoadSinceTheSameTime) {
  const auto joint = [](int number, Verdict verdict, int shape, double earliest_s, double latest_s) {
    JointHealth h;
    h.joint = number, h.verdict = verdict;
    h.looks_like.terms.push_back({shape, 1, 0.1, 1, {}});
    h.onset = Onset{earliest_s, earliest_s, latest_s};
    return h;
  };
  using Joints = std::vector<int>;
  const JointHealth offset = joint(2, Verdict::kNoLongerFits, kOffset, 100, 120),
                    gain = joint(3, Verdict::kNoLongerFits, kGain, 90, 110),
                    friction = joint(4, Verdict::kNoLongerFits, kCoulomb, 100, 120),
                    later = joint(5, Verdict::kNoLongerFits, kGain, 300, 310),
                    fits = joint(6, Verdict::kFits, kGain, 100, 120);
  EXPECT_EQ(ChangedTogether({offset, gain, friction, fits}), (Joints{2, 3}));
  EXPECT_EQ(ChangedTogether({offset, later}), Joints{});
  EXPECT_EQ(ChangedTogether({offset, friction, fits}), Joints{});
}

TEST(JointHealth, BeforeEnoughMotion_SaysThatItIsTooEarly) {
  SyntheticJoint joint([](const ResidualRow&, double) { return 30; });
  EXPECT_EQ(Judge(joint.Read()).verdict, Verdict::kTooEarly);
  EXPECT_EQ(kReferenceRows, monitor::ResidualBins::kReferenceRows);
  EXPECT_FLOAT_EQ(static_cast<float>(1 - monitor::ResidualBins::kBins / kMemory), monitor::ResidualBins::kKeep);
  joint.Run(140);
  const JointHealth early = Judge(joint.Read());
  EXPECT_EQ(early.verdict, Verdict::kTooEarly);
  EXPECT_GT(early.missing_rows, 0);
  joint.Run(early.missing_rows / 125 - 1);
  EXPECT_EQ(Judge(joint.Read()).verdict, Verdict::kTooEarly);
  joint.Run(2);
  EXPECT_NE(Judge(joint.Read()).verdict, Verdict::kTooEarly);
}

}  // namespace
}  // namespace armcal::health
