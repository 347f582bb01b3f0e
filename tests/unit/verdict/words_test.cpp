// verdict tests - what a person reads of a term: how much, where, what to do; and what was not looked at.
#include <gtest/gtest.h>

#include <memory>

#include "host_sim/diagnose/verdict/json.hpp"
#include "host_sim/diagnose/verdict/words.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::verdict {
namespace {

using calibration::Dataset;
using diagnosis::Rival;
using diagnosis::Term;

TEST(RunnerUp, WithAHigherScore_IsExplainedByTheGateThatRefusedIt) {
  Term t;
  t.score = 300;
  t.rivals.push_back({&tests::Records().at("stribeck"), {1}, 480, "out of fold it keeps 20 % of its gain", 500});
  EXPECT_EQ(RunnerUp(t), "stribeck, joint 2 (score 480), not taken: out of fold it keeps 20 % of its gain");
  t.rivals[0].refused = "";
  EXPECT_NE(RunnerUp(t).find("this term scored 500"), std::string::npos) << RunnerUp(t);
  t.score = 490;
  EXPECT_EQ(RunnerUp(t), "stribeck, joint 2 (score 480)");
}

// An arm with a ripple of 0.3 N m on joint 2, trained on one run and judged on another.
struct Diagnosed {
  explicit Diagnosed(std::uint64_t test_seed) : arm(codegen::ReadRobot("codegen/robots/two_link.toml"), 8) {
    const auto ripple = [](const tests::State& s) { return s.joint == 1 ? 0.3 * std::cos(12 * s.q) : 0.0; };
    train.push_back(arm.Run(20, 80, ripple));
    test = arm.Run(20, test_seed, ripple);
    test.tau.array() += test_seed == 80 ? 1e-6 : 0;  // another measurement
    diagnosis = std::make_unique<diagnosis::Diagnosis>(arm.model(), tests::Records(), calibration::Pointers(train));
    held_out = diagnosis->Judge(test);
    view.model = &arm.model(), view.finding = &diagnosis->finding(), view.test = &test, view.held_out = &held_out;
    view.train = &train;
    view.motion = calibration::CompareMotion(arm.model(), view.finding->declared, calibration::Pointers(train), test);
    if (view.motion.repeats()) diagnosis->ConfirmNothing("it repeats");
    view.term_torque = diagnosis->TermTorque(test);
    view.separation.resize(view.finding->terms.size());
  }
  tests::SyntheticArm arm;
  std::vector<Dataset> train;
  Dataset test;
  std::unique_ptr<diagnosis::Diagnosis> diagnosis;
  diagnosis::HeldOut held_out;
  DiagnosisView view;
};

TEST(Sentence, SaysWhatWhereHowMuchAndWhatToDo) {
  const Diagnosed d(81);
  ASSERT_EQ(d.view.finding->terms.size(), 1u);
  const std::string s = Sentence(d.view, 0);
  EXPECT_TRUE(s.starts_with("torque_ripple on joint 2: 0.2")) << s;  // 0.3 / sqrt(2) = 0.212 N m
  EXPECT_NE(s.find("N m RMS of joint 2 on the held-out log"), std::string::npos) << s;
  EXPECT_TRUE(s.ends_with("put it in the model (--model-out).")) << s;
}

TEST(Sentence, OfATermThatReachesOtherJoints_NamesItsOwnFirst) {
  Diagnosed d(81);
  d.view.term_torque[0].col(0) = 0.1 * d.view.term_torque[0].col(1);
  const std::string s = Sentence(d.view, 0);
  EXPECT_TRUE(s.starts_with("torque_ripple on joint 2, with torque on joint 1, too: 0.2")) << s;
}

// Three copies of the term that was found: one a tenth as large, one twice as large but not confirmed.
TEST(Verdict, TheLargestConfirmedTermIsShownFirst) {
  const Diagnosed d(81);
  ASSERT_EQ(d.view.finding->terms.size(), 1u);
  diagnosis::Finding finding = *d.view.finding;
  finding.terms.insert(finding.terms.end(), 2, finding.terms[0]);
  finding.terms[2].confirmed = false;
  DiagnosisView view = d.view;
  view.finding = &finding;
  const Eigen::MatrixXd torque = d.view.term_torque[0];
  view.term_torque = {0.1 * torque, torque, 2 * torque};
  EXPECT_EQ(OrderOfTerms(view), (std::vector<std::size_t>{1, 0, 2}));
}

TEST(Verdict, OnARepeatedTrajectory_ConfirmsNothing_AndWritesNothing) {
  const Diagnosed d(80);
  ASSERT_EQ(d.view.finding->terms.size(), 1u);
  EXPECT_FALSE(d.view.finding->terms[0].confirmed);
  EXPECT_NE(DiagnosisText(d.view).find("found on this trajectory, NOT CONFIRMED"), std::string::npos);
  EXPECT_NE(Sentence(d.view, 0).find("another trajectory"), std::string::npos) << Sentence(d.view, 0);
  EXPECT_EQ(diagnosis::ModelFile(d.arm.model(), tests::Records(), *d.view.finding, "").text.find("torque_ripple"),
            std::string::npos);
  const nlohmann::ordered_json json = DiagnosisJson(d.view);
  EXPECT_EQ(json["verdict"], "none");
  EXPECT_EQ(json["terms"][0]["unconfirmed"], "it repeats");
  EXPECT_LT(json["after"][1].get<double>(), 0.7 * json["before"][1].get<double>());  // it stays in the comparison
}

// The held-out run alone has a torque of 3 sin(2 q) on joint 1.
TEST(Verdict, OfAHeldOutLogThatDiffers_NamesTheJoint) {
  Diagnosed d(81);
  EXPECT_TRUE(StrangeText(StrangeJoints(d.view), d.arm.model().robot()).empty());
  EXPECT_TRUE(DiagnosisJson(d.view)["held_out_differs"].empty());
  const Eigen::VectorXd torque = 3 * (2 * d.test.s.q.col(0)).array().sin();
  d.held_out.after.col(0) += torque;
  const nlohmann::ordered_json json = DiagnosisJson(d.view);
  ASSERT_EQ(json["held_out_differs"].size(), 1u);
  EXPECT_EQ(json["held_out_differs"][0]["joint"], 1);
  const double rms = std::sqrt(torque.squaredNorm() / static_cast<double>(torque.size()));
  EXPECT_NEAR(json["held_out_differs"][0]["held_out"].get<double>(), rms, 0.1 * rms);
  EXPECT_NE(DiagnosisText(d.view).find("joint 1: the held-out log leaves"), std::string::npos);
}

std::string NotLookedAtText(const DiagnosisView& view) {
  std::string all;
  for (const std::string& line : NotLookedAt(view)) all += line + "\n";
  return all;
}

TEST(NotLookedAt, NamesJointsThatStoodAndRowsLeftOut) {
  Diagnosed d(81);
  d.train[0].moving.col(0).setZero(), d.train[0].used.col(0).setZero();
  d.train[0].cutoff_Hz = Eigen::Vector2d(6, 8);
  const std::string all = NotLookedAtText(d.view);
  EXPECT_NE(all.find("faster than 6, 8 Hz"), std::string::npos) << all;
  EXPECT_NE(all.find("100, "), std::string::npos) << all;  // per cent of the rows of joint 1
  EXPECT_NE(all.find("joint 1: at rest"), std::string::npos) << all;
  EXPECT_EQ(all.find("further terms"), std::string::npos) << all;
}

// The terms predict joint 2 better where it moves. At rest they add 5 N m.
TEST(NotLookedAt, SaysThatTheTermsAreWrongAtRest) {
  Diagnosed d(81);
  const std::string sound = NotLookedAtText(d.view);
  EXPECT_EQ(sound.find("friction at rest"), std::string::npos) << sound;
  int rested = 0;
  for (int k = 0; k < d.test.samples(); ++k)
    if (!d.test.moving(k, 1)) d.held_out.after(k, 1) += 5, ++rested;
  ASSERT_GT(rested, 10);
  const std::string all = NotLookedAtText(d.view);
  EXPECT_NE(all.find("it grows (joint 2 from "), std::string::npos) << all;
}

// A log of 0.4 s leaves fewer rows than a search needs.
TEST(NotLookedAt, SaysThatALogIsTooShort) {
  tests::SyntheticArm arm(codegen::ReadRobot("codegen/robots/two_link.toml"), 8);
  const auto nothing = [](const tests::State&) { return 0.0; };
  const std::vector<Dataset> train = {arm.Run(0.4, 80, nothing)};
  const diagnosis::Diagnosis d(arm.model(), tests::Records(), calibration::Pointers(train));
  EXPECT_EQ(d.finding().too_short, (std::vector<int>{0, 1}));
  EXPECT_TRUE(Headline(d.finding()).find("too few rows") != std::string::npos) << Headline(d.finding());
}

}  // namespace
}  // namespace armcal::verdict
