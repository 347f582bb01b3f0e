// verdict tests - terms of several splits are compared on the same samples, beside what the declared model takes up.
#include <gtest/gtest.h>

#include "host_sim/diagnose/verdict/splits.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::verdict {
namespace {

using calibration::Dataset;
using nlohmann::ordered_json;

constexpr int kJoint = 1;  // 0-based

// A verdict of one term as armcal diagnose writes it. joint: as in the JSON.
ordered_json Verdict(const std::string& record, const ordered_json& joint, std::vector<int> joints,
                     std::vector<double> eta, std::vector<double> amplitude, double sd) {
  const std::size_t size = eta.size() + amplitude.size();
  std::vector<std::vector<double>> covariance(size, std::vector<double>(size, 0));
  ordered_json parameters, deviations;
  for (std::size_t k = 0; k < size; ++k) {
    covariance[k][k] = k < eta.size() ? 0 : sd * sd;
    const std::string name = "p" + std::to_string(k);
    parameters[name] = k < eta.size() ? eta[k] : amplitude[k - eta.size()], deviations[name] = sd;
  }
  for (int& j : joints) ++j;
  ordered_json term{{"kind", record}, {"record", record}, {"class", "static"}, {"joint", joint}, {"joints", joints}};
  term["signals"] = {"q"}, term["also_fits"] = ordered_json::array(), term["confirmed"] = true;
  term["training_only"] = false, term["parameters"] = parameters, term["parameter_sd"] = deviations;
  term["eta"] = eta, term["amplitude"] = amplitude, term["covariance"] = covariance;
  term["without_moving"] = {1.0, 1.0}, term["score"] = 100, term["folds"] = {1.0, 1.0};
  return {{"verdict", "effect"},
          {"terms", ordered_json::array({term})},
          {"before_moving", {1.0, 1.0}},
          {"after_moving", {1.0, 0.5}},
          {"torque_moving", {9.0, 9.0}}};
}

class SplitTerms : public testing::Test {
 protected:
  static const tests::SyntheticArm& arm() {
    static const tests::SyntheticArm arm(codegen::ReadRobot("codegen/robots/two_link.toml"), 8);
    return arm;
  }
  static const std::vector<Dataset>& runs() {
    static const std::vector<Dataset> runs = [] {
      tests::SyntheticArm moved(codegen::ReadRobot("codegen/robots/two_link.toml"), 8);
      return std::vector<Dataset>{moved.Run(20, 90), moved.Run(20, 91)};
    }();
    return runs;
  }
  static const CommonRows& rows() {
    static const CommonRows rows(arm().model(), runs());
    return rows;
  }
  static Agreed Compare(const Verdicts& splits) {
    return Agree(splits, {TracesOf(splits, rows(), tests::Records()), {}});
  }
};

// Its bin means over q average to nothing, and a second run has other ones. Torque for torque the two are one.
TEST_F(SplitTerms, ARippleFinerThanAnyBin_Holds) {
  const Agreed agreed = Compare({{"a", Verdict("torque_ripple", 2, {kJoint}, {200}, {0.3, 0.1}, 0.01)},
                                 {"b", Verdict("torque_ripple", 2, {kJoint}, {200.02}, {0.31, 0.09}, 0.01)}});
  ASSERT_EQ(agreed.holds.size(), 1u) << agreed.does_not[0].why;
  EXPECT_LT(agreed.holds[0].apart, 0.2);
}

TEST_F(SplitTerms, OfOppositeSigns_DoNotHold) {
  const Agreed agreed = Compare({{"a", Verdict("load_friction", 2, {kJoint}, {}, {0.06}, 0.002)},
                                 {"b", Verdict("load_friction", 2, {kJoint}, {}, {-0.06}, 0.002)}});
  EXPECT_TRUE(agreed.holds.empty());
  ASSERT_FALSE(agreed.does_not.empty());
  EXPECT_NE(agreed.does_not[0].why.find("of another form"), std::string::npos) << agreed.does_not[0].why;
}

// What the declared friction can do is no difference. A ripple is not taken up: cos(30 q) has an RMS of 1 / sqrt(2).
TEST_F(SplitTerms, AreComparedBesideWhatTheDeclaredModelTakesUp) {
  const Trace friction = rows().Of({&tests::Records().at("coulomb_viscous"), {kJoint}, {}, Eigen::Vector2d(1, 1)},
                                   Eigen::MatrixXd::Zero(2, 2)),
              ripple = rows().Of({&tests::Records().at("torque_ripple"), {kJoint}, {30}, Eigen::Vector2d(1, 0)},
                                 Eigen::MatrixXd::Zero(3, 3));
  EXPECT_LT(friction.rms_Nm[kJoint], 0.02);  // of 1 N m and more; the prior holds it back a little
  EXPECT_NEAR(ripple.rms_Nm[kJoint], std::sqrt(0.5), 0.05);
}

// A curve with a large constant part is a ripple with Coulomb friction that the declared model has: the ripple is left.
TEST_F(SplitTerms, OfOneRun_LeaveWhatTheDeclaredModelCannotGive) {
  const std::vector<Dataset> one{runs()[1]};
  const Dataset& run = one[0];
  Eigen::MatrixXd curve = Eigen::MatrixXd::Zero(run.samples(), 2), ripple = curve;
  for (int k = 0; k < run.samples(); ++k) {
    ripple(k, kJoint) = std::cos(30 * run.s.q(k, kJoint));
    curve(k, kJoint) = ripple(k, kJoint) + (run.s.qd(k, kJoint) > 0 ? 5 : -5);
  }
  const std::vector<Eigen::MatrixXd> left = CommonRows(arm().model(), one).Beyond({curve, ripple});
  ASSERT_EQ(left.size(), 2u);
  const auto rms = [&](int t) { return calibration::Rms(run, left[static_cast<std::size_t>(t)], true); };
  EXPECT_NEAR(rms(0)[kJoint], std::sqrt(0.5), 0.1);  // of 5 N m; the prior holds friction back a little
  EXPECT_NEAR(rms(1)[kJoint], std::sqrt(0.5), 0.05);
  EXPECT_TRUE(left[0].col(1 - kJoint).isZero(0));
}

TEST_F(SplitTerms, WhoseDifferenceIsUncertain_AreNotCalledOfAnotherForm) {
  const Agreed agreed = Compare({{"a", Verdict("load_friction", 2, {kJoint}, {}, {0.06}, 0.04)},
                                 {"b", Verdict("load_friction", 2, {kJoint}, {}, {0.01}, 0.04)}});
  EXPECT_TRUE(agreed.holds.empty());
  EXPECT_NE(agreed.does_not[0].why.find("too uncertain"), std::string::npos) << agreed.does_not[0].why;
}

// A pair is a pair in either order; which joint does what to which is in the torque.
TEST_F(SplitTerms, OfAPair_AreComparedInEitherOrder) {
  const auto pair = [](const char* joint, std::vector<int> joints) {
    return Verdict("cross_ripple", joint, std::move(joints), {20}, {0.3, 0.1}, 0.01);
  };
  EXPECT_EQ(Compare({{"a", pair("1-2", {0, 1})}, {"b", pair("1-2", {0, 1})}}).holds.size(), 1u);
  const Agreed other = Compare({{"a", pair("1-2", {0, 1})}, {"b", pair("2-1", {1, 0})}});
  EXPECT_TRUE(other.holds.empty());
  EXPECT_NE(other.does_not[0].why.find("of another form"), std::string::npos) << other.does_not[0].why;
}

TEST_F(SplitTerms, GiveAnInterval_ThatHoldsTheSpreadBetweenRuns) {
  const Agreed agreed = Compare({{"a", Verdict("load_friction", 2, {kJoint}, {}, {0.060}, 0.001)},
                                 {"b", Verdict("load_friction", 2, {kJoint}, {}, {0.064}, 0.001)},
                                 {"c", Verdict("load_friction", 2, {kJoint}, {}, {0.068}, 0.001)}});
  ASSERT_EQ(agreed.holds.size(), 1u);
  ASSERT_EQ(agreed.holds[0].parameters.size(), 1u);
  const Spread& s = agreed.holds[0].parameters[0].second;
  EXPECT_NEAR(s.mean, 0.064, 1e-12);
  EXPECT_NEAR(s.sd, std::sqrt(2.0 / 3 * 2 * 0.004 * 0.004), 1e-6);  // jackknife: (G - 1) / G times the sum of squares
  EXPECT_GT(s.upper - s.lower, 2 * 4.3 * 0.0045);
  // Two runs that are held out together have one fit: they count once.
  const Verdicts splits{{"a", Verdict("load_friction", 2, {kJoint}, {}, {0.060}, 0.001)},
                        {"b", Verdict("load_friction", 2, {kJoint}, {}, {0.060}, 0.001)},
                        {"c", Verdict("load_friction", 2, {kJoint}, {}, {0.068}, 0.001)}};
  const Agreed grouped = Agree(splits, {TracesOf(splits, rows(), tests::Records()), {{"a", 0}, {"b", 0}, {"c", 1}}});
  ASSERT_EQ(grouped.holds.size(), 1u);
  EXPECT_NEAR(grouped.holds[0].parameters[0].second.mean, 0.064, 1e-12);
}

}  // namespace
}  // namespace armcal::verdict
