// calibration tests - a good log of a simulated arm passes, and each planted fault is refused and named.
#include "host_sim/identify/calibration/log_check.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/body_check.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::calibration {
namespace {

using tests::SyntheticArm;

class LogCheck : public testing::Test {
 protected:
  LogCheck() : arm_(codegen::ReadRobot("codegen/robots/two_link.toml"), 1), data_(arm_.Run(20, 2)) {
    log_.joints = 2;
    log_.source = "run.csv";
    log_.t = data_.s.t, log_.q = data_.s.q, log_.tau = data_.tau;
  }
  std::string Said() const {
    try {
      if (const std::string lack = CheckSignals(arm_.model().robot(), log_).lack; !lack.empty())
        return "run.csv: " + lack;
      (void)CheckAgainstModel(arm_.model(), data_);
    } catch (const io::InputError& e) {
      return e.what();
    }
    return "";
  }
  void ExpectRefused(const std::string& named) const {
    const std::string said = Said();
    EXPECT_NE(said.find("run.csv"), std::string::npos) << said;
    EXPECT_NE(said.find(named), std::string::npos) << said << " expected to name " << named;
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
  }
  SyntheticArm arm_;
  Dataset data_;
  logs::Log log_;
};

TEST_F(LogCheck, OfAGoodLog_SaysNothing) { EXPECT_EQ(Said(), ""); }

TEST_F(LogCheck, OfOneSecond_AsksForMore) {
  log_.t.conservativeResize(125);
  log_.q.conservativeResize(125, 2), log_.tau.conservativeResize(125, 2);
  ExpectRefused("expected at least 3 s");
}

TEST_F(LogCheck, OfDegrees_NamesThem) {
  log_.q *= 57.29577951308232;
  ExpectRefused("degrees");
}

TEST_F(LogCheck, OfRadiansReadAsDegreesBesideSpeedsInRadians_NamesBoth) {
  log_.qd = data_.s.qd;
  EXPECT_EQ(Said(), "");
  log_.q /= 57.29577951308232;
  ExpectRefused("both in rad or both in deg");
}

TEST_F(LogCheck, OfAmperesReadAsNewtonMetres_AsksForTheUnit) {
  EXPECT_TRUE(CheckAgainstModel(arm_.model(), data_).empty());
  data_.tau /= 12;
  const std::vector<std::string> notes = CheckAgainstModel(arm_.model(), data_);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("joint 1 0.0"), std::string::npos) << notes[0];  // a twelfth, within its noise
  EXPECT_NE(notes[0].find("joint 2 0.0"), std::string::npos) << notes[0];
}

TEST_F(LogCheck, OfATorqueThatIsTooLarge_AsksForALoadWhereAJointNearerTheBaseFits) {
  data_.source = "run.csv";
  data_.tau.col(1) *= 30;
  const std::vector<std::string> notes = CheckAgainstModel(arm_.model(), data_);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("load"), std::string::npos) << notes[0];
  data_.tau.col(0) *= 30;
  ExpectRefused("joint 1: torque is");
}

TEST_F(LogCheck, OfATorqueThatIsTooSmall_RefusesWhateverTheOthersAre) {
  data_.source = "run.csv";
  data_.tau.col(1) /= 30;
  ExpectRefused("joint 2: torque is");
}

TEST_F(LogCheck, OfMillinewtons_NamesThem) {
  log_.tau *= 1000;
  ExpectRefused("mN m");
}

TEST_F(LogCheck, OfAJointWithoutTorque_NamesIt) {
  log_.tau.col(1).setZero();
  ExpectRefused("joint 2: torque is zero");
}

TEST_F(LogCheck, OfAJointThatRests_SaysWhichOneAndRefusesItOnlyIfOtherColumnsMove) {
  log_.q.col(1).setConstant(0.3);
  EXPECT_EQ(CheckSignals(arm_.model().robot(), log_).resting, std::vector<int>{1});
  log_.qd = data_.s.qd;
  ExpectRefused("joint 2: position never changes while its logged speed does");
  log_.q.col(0).setConstant(0.1), log_.qd.resize(0, 0);
  ExpectRefused("no joint moves");
}

TEST_F(LogCheck, OfTimeInAnotherUnit_TheLoggedSpeedTells) {
  log_.qd = data_.s.qd;
  EXPECT_EQ(Said(), "");
  log_.t *= 10;
  ExpectRefused("10 times more slowly");
  log_.t /= 100;
  ExpectRefused("10 times faster");
}

TEST_F(LogCheck, OfSpeedsInRpm_SaysSoAndReadsTheLog) {  // 1 rpm is 0.105 rad/s, nearly a tenth
  log_.qd = data_.s.qd * (60 / (2 * std::numbers::pi));
  const SignalCheck check = CheckSignals(arm_.model().robot(), log_);
  ASSERT_EQ(check.notes.size(), 2u);
  for (const std::string& note : check.notes) EXPECT_NE(note.find("rpm"), std::string::npos) << note;
}

TEST_F(LogCheck, OfAnEncoderThatSticksForASecond_NamesIt) {
  Eigen::Index fastest = 0;
  (void)data_.s.qd.col(0).segment(500, 1000).cwiseAbs().maxCoeff(&fastest);
  const Eigen::Index from = 500 + fastest;
  log_.q.col(0).segment(from, 125).setConstant(log_.q(from, 0));
  ExpectRefused("joint 1: ");
}

TEST_F(LogCheck, OfAClockThatJumps_NamesTheLine) {
  Eigen::Index fastest = 0;
  (void)data_.s.qd.col(0).segment(500, 1000).cwiseAbs().maxCoeff(&fastest);
  const Eigen::Index from = 500 + fastest;
  log_.t.tail(log_.t.size() - from - 1).array() += 3;
  log_.gaps = {static_cast<int>(from)};
  ExpectRefused("time jumps by 3");
}

TEST_F(LogCheck, OfAFewMissingSamples_IsALineAndOfManyARefusal) {
  const auto without = [this](int first, int count) {
    logs::Log cut = log_;
    const Eigen::Index rest = log_.t.size() - first - count;
    cut.t.segment(first, rest) = log_.t.tail(rest);
    cut.q.middleRows(first, rest) = log_.q.bottomRows(rest);
    cut.tau.middleRows(first, rest) = log_.tau.bottomRows(rest);
    cut.t.conservativeResize(first + rest);
    cut.q.conservativeResize(first + rest, 2), cut.tau.conservativeResize(first + rest, 2);
    cut.gaps = {first - 1};
    return cut;
  };
  const std::vector<std::string> notes = CheckSignals(arm_.model().robot(), without(1000, 20)).notes;
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("20 samples are missing"), std::string::npos) << notes[0];
  log_ = without(1000, 600);
  ExpectRefused("600 samples are missing");
  // Each value stood in four lines of the file, and the gap is one line wide there.
  log_.line.resize(log_.samples());
  for (int k = 0; k < log_.samples(); ++k) log_.line[k] = 2 + 4 * k;
  ExpectRefused("600 samples are missing");
}

TEST_F(LogCheck, OfExchangedTorqueColumns_NamesThem) {
  data_.source = "run.csv";
  data_.tau.col(0).swap(data_.tau.col(1));
  ExpectRefused("tau1 and tau2");
}

// The bodies tell the torque's size and sign even where its signals look well.
TEST_F(LogCheck, OfATorqueThatTheBodiesCannotNeed_NamesTheJoint) {
  data_.source = "run.csv";
  const Eigen::MatrixXd tau = data_.tau;
  for (const double factor : {100.0, 0.01, -1.0}) {
    data_.tau = tau;
    data_.tau.col(1) *= factor;
    ExpectRefused("joint 2: torque is ");
  }
  data_.tau = 0.5 * tau;  // the gear ratio or the motor may be another one
  EXPECT_EQ(Said(), "");
}

// A brake holds joint 2. Its torque tells neither its unit nor whether columns are exchanged; those of joint 1 do.
TEST_F(LogCheck, OfABrakedJoint_JudgesTheOthers) {
  data_ = arm_.Run(20, 2, {}, 0.5, {1});
  data_.source = "run.csv";
  const Eigen::MatrixXd tau = data_.tau;
  for (const double held : {0.0, 7.3}) {
    data_.tau = tau;
    data_.tau.col(1).setConstant(held);
    EXPECT_EQ(Said(), "") << held;
    data_.tau.col(0).swap(data_.tau.col(1));
    EXPECT_NE(Said(), "") << held;
  }
}

// Rows that can be fitted are what a fit is made of: without any there is none, and a moving joint without any is
// named.
TEST_F(LogCheck, OfLogsWithoutAUsableRow_RefusesThem) {
  const codegen::Robot& robot = arm_.model().robot();
  EXPECT_TRUE(CheckRows(robot, {&data_}).empty());
  Dataset other = data_;
  other.used.col(1).setZero();
  EXPECT_TRUE(CheckRows(robot, {&data_, &other}).empty());  // the other log has such rows
  ASSERT_EQ(CheckRows(robot, {&other}).size(), 1u);
  EXPECT_EQ(CheckRows(robot, {&other})[0].find("synthetic: joint 2: no usable row"), 0u);
  other.used.setZero();
  try {
    CheckRows(robot, {&other});
    ADD_FAILURE() << "expected a refusal";
  } catch (const io::InputError& e) {
    EXPECT_EQ(std::string(e.what()).find("synthetic: none of the 2500 samples can be used; expected"), 0u) << e.what();
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
  }
}

}  // namespace
}  // namespace armcal::calibration
