// calibration tests - the PC judges a table as the firmware does, and a robot file may set its own ceilings.
#include "host_sim/identify/calibration/table_ceilings.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "codegen/src/generator/ceilings.hpp"
#include "codegen/src/generator/emit.hpp"
#include "tests/unit/calibration/laden_arm.hpp"

namespace armcal::calibration {
namespace {

using files::test::ErrorOf;
using tests::RobotWith;

codegen::Model Load(const std::string& path) {
  return codegen::Model(codegen::ReadRobot(path), codegen::ReadCatalogue("codegen/effects"));
}
codegen::Model Shipped(const std::string& robot) { return Load("codegen/robots/" + robot + ".toml"); }

TableRow& Row(TableFile& t, const std::string& name) {
  for (TableRow& row : t.row)
    if (row.name == name) return row;
  throw std::logic_error(name);
}

TEST(TableCeilings, DefaultTablesOfShippedRobots_AreWithinThem) {
  for (const char* robot : {"emps", "er20_like", "kuka_kr300", "kuka_lwr4", "puma560", "two_link", "ur10"}) {
    const codegen::Model model = Shipped(robot);
    EXPECT_EQ(BeyondCeiling(model, DefaultTable(model)), "") << robot;
  }
}

TEST(TableCeilings, WhatIsBeyond_IsNamedWithItsBound) {
  const codegen::Model model = Shipped("two_link");
  const auto beyond = [&](const auto& change) {
    TableFile t = DefaultTable(model);
    change(t);
    return BeyondCeiling(model, t);
  };
  EXPECT_EQ(beyond([](TableFile& t) { t.joint[1].torque_limit_Nm = 31; }),
            "joint 2: torque_limit_Nm is 31, expected at most 30");
  EXPECT_EQ(beyond([](TableFile& t) { t.joint[0].torque_scale = 0.25; }),
            "joint 1: torque_scale is 0.25, expected at least 0.5");
  EXPECT_EQ(beyond([](TableFile& t) { t.bumpless = true, t.blend_ms = 20; }), "blend_ms is 20, expected at least 500");
  EXPECT_EQ(beyond([](TableFile& t) { t.row[0].mean = 1e30; }).substr(0, 12), "m1: mean is ");
  EXPECT_EQ(beyond([](TableFile& t) { t.row[3].sd = 1e30; }).substr(0, 11), "mz1: sd is ");
  EXPECT_EQ(beyond([](TableFile& t) { t.forgetting[2] = 0.5; }).substr(0, 24), "forgetting of group 2 is");
}

// 60 N m hold 7.645 kg at 0.5 + 0.3 m; the elbow's 30 N m would hold more at 0.3 m. The link's own: 2 kg, and 20 times
// 0.3 of it.
TEST(TableCeilings, TheLastLink_MayCarryWhatEveryJointHolds) {
  const codegen::Ceilings c = codegen::MakeCeilings(Shipped("two_link"));
  const double load_kg = 60 / (9.81 * 0.8);
  EXPECT_NEAR(c.parameter[11].high, 2 * (1 + 20 * 0.3) + load_kg, 1e-9);
  EXPECT_NEAR(c.parameter[13].high, 14 * 20 * 0.005 + 0.3 * load_kg, 1e-9) << "my2: its centre lies on the axis";
  EXPECT_NEAR(c.parameter[0].high, 3 * (1 + 20 * 0.3), 1e-9) << "link 1 carries none";
}

// What a fit must keep: at the table itself each limit is broken, at the model's own values all are kept.
TEST(TableCeilings, LimitsOfAFit_LieBetweenTheModelsOwnTableAndWhatIsRefused) {
  const codegen::Model model = Shipped("two_link");
  TableFile t = DefaultTable(model);
  const auto left = [&](const Limit& limit, const TableFile& table) {
    double sum = limit.base;
    for (int k = 0; k < model.body_parameters(); ++k) sum += limit.bodies[k] * table.row[k].mean;
    for (int c = 0; c < model.columns(); ++c)
      if (!model.is_rigid(c)) sum += limit.x[c] * table.row[model.table_index(c)].mean;
    return sum;
  };
  EXPECT_TRUE(BeyondCeilings(model, t).limits.empty());
  const TableFile own = t;
  Row(t, "m2").mean = 30;
  Row(t, "Fc1").mean = 4, Row(t, "Fv1").mean = -2.2;  // 4 - 2.2 * 3.49 = -3.68 at full speed; 3 are allowed
  const Ceiled beyond = BeyondCeilings(model, t);
  EXPECT_EQ(
      beyond.said,
      (std::vector<std::string>{
          "m2: the fit gives 30; a drive takes at most 21.6453, so it was held there",
          "joint 1: at 3.49 rad/s (m/s) the fitted friction would push by 3.679 N m (N); a drive takes at most 3, so "
          "it was held there"}));
  ASSERT_EQ(beyond.limits.size(), 1u + 2 * 16) << "eight speeds in two directions, two limits each";
  int broken = 0;
  for (const Limit& limit : beyond.limits) {
    broken += left(limit, t) < 0;
    EXPECT_GT(left(limit, own), 0);
  }
  EXPECT_EQ(broken, 3) << "m2, and the friction at full speed in both directions";
  Row(t, "m2").mean = 21.62, Row(t, "Fv1").mean = -(4 + 2.95) / (200 * std::numbers::pi / 180);
  for (const Limit& limit : beyond.limits) EXPECT_GT(left(limit, t), 0);
  EXPECT_EQ(BeyondCeiling(model, t), "");
}

// The shoulder reaches 200 deg/s = 3.49 rad/s; 5 % of its 60 N m is the tolerance.
TEST(TableCeilings, FrictionThatPushes_IsNamedByTheColumnThatDoes) {
  const codegen::Model model = Shipped("two_link");
  TableFile t = DefaultTable(model);
  TableRow& Fc = Row(t, t.row[22].name);
  TableRow& Fv = Row(t, t.row[23].name);
  Fc.mean = 4, Fv.mean = -1.4;
  EXPECT_EQ(BeyondCeiling(model, t), "") << "4 - 1.4 * 3.49 = -0.9";
  Fv.mean = -2.2;
  EXPECT_EQ(BeyondCeiling(model, t).substr(0, Fv.name.size() + 48),
            Fv.name + ": mean: the joint's friction would push by 3.679");
}

const char* const kEffects =
    "\n[[effect]]\nname = \"temp_coulomb\"\njoints = [1]\n[[effect]]\nname = \"viscous_asymmetry\"\njoints = [1]\n"
    "[[effect]]\nname = \"load_friction\"\njoints = [1]\n[[effect]]\nname = \"torque_offset\"\njoints = [1]\n"
    "[[effect]]\nname = \"presliding_dahl\"\njoints = [2]\n[[effect]]\nname = \"coupled_friction\"\njoints = [1, 2]\n";

// Which columns brake, and what they depend on, found by trying them.
TEST(TableCeilings, FrictionColumns_AreThoseThatBrakeTheirOwnJoint) {
  const codegen::Model model = Load(RobotWith(kEffects, "two_link"));
  const codegen::Ceilings c = codegen::MakeCeilings(model);
  std::string found;
  for (int k = 0; k < model.front(); ++k)
    if (c.friction[k]) found += model.table()[model.table_index(k)].effect + " ";
  EXPECT_EQ(found,
            "coulomb_viscous coulomb_viscous temp_coulomb viscous_asymmetry load_friction presliding_dahl "
            "presliding_dahl ");
  EXPECT_EQ(c.friction_reads, 7u) << "load, temperature, history";
}

TEST(TableCeilings, NegativeCoefficientsWhoseSumBrakes_AreAccepted) {
  const codegen::Model model = Load(RobotWith(kEffects, "two_link"));
  const auto judged = [&](const std::string& name, double mean) {
    TableFile t = DefaultTable(model);
    Row(t, "Fc1").mean = 10;
    Row(t, name).mean = mean;
    return BeyondCeiling(model, t);
  };
  EXPECT_EQ(judged("temp_coulomb.FcT1", -0.3), "") << "10 - 0.3 * 30 at 60 deg C";
  EXPECT_NE(judged("temp_coulomb.FcT1", -0.5), "");
  EXPECT_EQ(judged("viscous_asymmetry.dFv1", -2), "") << "10 + 3.5 - 2 * 3.5 forward";
  EXPECT_NE(judged("viscous_asymmetry.dFv1", -5), "");
  EXPECT_NE(judged("viscous_asymmetry.dFv1", 5), "");
  EXPECT_EQ(judged("load_friction.mu1", -0.2), "");
  EXPECT_NE(judged("load_friction.mu1", -0.9), "");
  EXPECT_EQ(judged("torque_offset.To1", -50), "") << "no friction, and less than ten times its scale";
  EXPECT_NE(judged("torque_offset.To1", -61), "");
  EXPECT_NE(judged("presliding_dahl.Fc2", -5), "");
}

TEST(TableCeilings, ARobotFile_MaySetItsOwn_AndTheSchemaStays) {
  const codegen::Model plain = Shipped("two_link");
  const codegen::Model own = Load(RobotWith(
      "\n[ceilings]\ntorque_Nm = [100.0, 30.0]\nleast_fade_ms = 50\n[ceilings.parameter]\nm1 = [2, 4]\n", "two_link"));
  EXPECT_EQ(codegen::Schema(own), codegen::Schema(plain));
  TableFile t = DefaultTable(own);
  t.joint[0].torque_limit_Nm = 90, t.bumpless = true, t.blend_ms = 50;
  EXPECT_EQ(BeyondCeiling(own, t), "");
  EXPECT_NE(BeyondCeiling(plain, t), "");
  t.row[0].mean = 4.5;
  EXPECT_EQ(BeyondCeiling(own, t), "m1: mean is 4.5, expected at most 4");
  const auto refusal = [](const std::string& text) {
    return ErrorOf([&] { (void)codegen::MakeCeilings(Load(RobotWith("\n[ceilings]\n" + text, "two_link"))); });
  };
  EXPECT_NE(refusal("torque_Nm = [1.0]\n").find("ceilings.torque_Nm"), std::string::npos);
  EXPECT_NE(refusal("torque = [1.0]\n").find("ceilings.torque"), std::string::npos);
  EXPECT_NE(refusal("parameter = { m9 = [0, 1] }\n").find("ceilings.parameter.m9"), std::string::npos);
  EXPECT_NE(refusal("parameter = { m1 = [0, 1] }\n").find("m1: the model's own value"), std::string::npos);
  EXPECT_NE(refusal("torque_Nm = [100.0, 10.0]\n").find("ceilings.torque_Nm: joint 2: the torque limit of the file"),
            std::string::npos);
  EXPECT_NE(refusal("noise_Nm = [0.01, 1.0]\n").find("ceilings.noise_Nm: joint 1: the torque noise of the file"),
            std::string::npos);
  EXPECT_NE(refusal("torque_scale = [1.1, 1.2]\n").find("ceilings.torque_scale"), std::string::npos);
  EXPECT_NE(refusal("parameter = { m1 = [1, 0] }\n").find("ceilings.parameter.m1"), std::string::npos);
}

}  // namespace
}  // namespace armcal::calibration
