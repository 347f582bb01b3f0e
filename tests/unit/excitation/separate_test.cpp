// excitation tests - which pairs of effects a motion can tell apart, over the whole catalogue.
#include <gtest/gtest.h>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/excitation/optimise.hpp"
#include "host_sim/identify/excitation/target.hpp"
#include "tests/unit/excitation/arms.hpp"

namespace armcal::excitation {
namespace {

// "stribeck:1", "wrist_coupling:1-2", "base_tilt": a record on the first joints it can have.
std::string Asked(const codegen::EffectRecord& record, int joints) {
  const std::vector<int> first = codegen::JointSets(record, joints).at(0);
  std::string out = record.name;
  for (const int j : first) out += (out == record.name ? ":" : "-") + std::to_string(j + 1);
  return out;
}

TEST(Separate, TakesEveryConfusablePairThatMotionShows_AndRefusesTheOthers) {
  const codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
  const codegen::Catalogue records = codegen::ReadCatalogue("codegen/effects");
  int taken = 0, refused = 0;
  for (const auto& [name, record] : records)
    for (const std::string& like : record.confusable_with) {
      const codegen::EffectRecord& other = records.at(like);
      const std::vector<std::string> asked{Asked(record, robot.joints()), Asked(other, robot.joints())};
      if (!MotionShows(record) || !MotionShows(other)) {
        EXPECT_THROW(Target(robot, records, asked), io::InputError) << asked[0] << " " << asked[1];
        ++refused;
        continue;
      }
      const Target target(robot, records, asked);
      EXPECT_GE(target.criterion().about.size(), record.linear.size() + other.linear.size()) << asked[0] << asked[1];
      ++taken;
    }
  EXPECT_GT(taken, 20);
  EXPECT_GT(refused, 15);
}

// A ripple's columns are cos and sin of k q: with the k that was found, not the record's.
TEST(Separate, LooksAtTheEffectAsItWasFound) {
  constexpr double kFound = 12.25;
  const codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
  const codegen::Catalogue records = codegen::ReadCatalogue("codegen/effects");
  codegen::EffectUse ripple;
  ripple.effect = "torque_ripple", ripple.joints = {1}, ripple.nonlinear = {{"k", kFound}};
  const Target target(robot, records, {"torque_ripple:2", "position_torque:2"}, {ripple});
  codegen::Signals s;
  s.t.setZero(9), s.q.setZero(9, 2), s.qd.setOnes(9, 2), s.qdd.setZero(9, 2);
  s.q.col(1) = Eigen::VectorXd::LinSpaced(9, -1, 1);
  std::vector<Eigen::MatrixXd> row;
  target.observation().Rows(s, row);
  const codegen::Model& model = target.observation().model();
  int seen = 0;
  for (int c = 0; c < model.columns(); ++c)
    for (const bool cosine : {true, false}) {
      if (model.column_name(c) != (cosine ? "torque_ripple.Rc2" : "torque_ripple.Rs2")) continue;
      ++seen;
      for (int k = 0; k < 9; ++k) {
        const double angle = kFound * s.q(k, 1);
        EXPECT_NEAR(row[1](k, c), cosine ? std::cos(angle) : std::sin(angle), 1e-12);
      }
    }
  EXPECT_EQ(seen, 2);
}

// A ripple that the robot file has may be in the model many times. It is asked for itself, not once more beside itself:
// two equal columns would have no motion that shows them.
TEST(Separate, OfAnEffectThatTheRobotHas_AsksForThatOne) {
  codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
  const codegen::Catalogue records = codegen::ReadCatalogue("codegen/effects");
  codegen::EffectUse use;
  use.effect = "torque_ripple", use.joints = {0, 1}, use.nonlinear = {{"k", 30}};
  robot.effect.push_back(use);
  EXPECT_TRUE(CanSeparate(robot, records, {"torque_ripple:2"}));
  const Target target(robot, records, {"torque_ripple:2"});
  int ripples = 0;
  for (const auto& p : target.observation().model().table()) ripples += p.effect == "torque_ripple" && p.unit == "N*m";
  EXPECT_EQ(ripples, 4);  // a cosine and a sine for each joint
}

// A search finds a motion for effects that are called separable, and finds none for the others.
TEST(Separate, IsPromisedWhereASearchSucceeds) {
  const codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
  const codegen::Catalogue records = codegen::ReadCatalogue("codegen/effects");
  OptimiseSettings settings;
  settings.starts = 1, settings.seconds = 0.1, settings.threads = 1;
  settings.shape.terms = 20, settings.shape.samples = 250;
  int can = 0, cannot = 0;
  for (const auto& [name, record] : records)
    for (const std::string& like : record.confusable_with) {
      const std::vector<std::string> asked{Asked(record, 2), Asked(records.at(like), 2)};
      SCOPED_TRACE(asked[0] + ", " + asked[1]);
      if (!MotionShows(record) || !MotionShows(records.at(like))) {
        EXPECT_FALSE(CanSeparate(robot, records, asked));
        continue;
      }
      const Target target(robot, records, asked);
      settings.criterion = target.criterion();
      if (CanSeparate(robot, records, asked)) {
        ++can;
        EXPECT_TRUE(std::isfinite(Optimise(target.observation(), settings).figure));
      } else {
        ++cannot;
        EXPECT_THROW(Optimise(target.observation(), settings), io::InputError);
      }
    }
  EXPECT_GT(can, 15);
  EXPECT_GT(cannot, 2);
  std::printf("%d pairs can be separated by motion, %d cannot\n", can, cannot);
}

}  // namespace
}  // namespace armcal::excitation
