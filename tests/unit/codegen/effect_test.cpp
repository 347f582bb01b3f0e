// tests - each effect record's columns against a formula written by hand, and what a bad record or robot gets.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include "codegen/src/generator/model.hpp"
#include "host_sim/io/input_error.hpp"

namespace armcal::tests {
namespace {

const codegen::Catalogue& Records() {
  static const codegen::Catalogue c = codegen::ReadCatalogue("codegen/effects");
  return c;
}

struct State {
  double q, qd, temp, t, tau_rigid;
};

// First column of a joint record on joint 2 of er20_like.
double Column(const std::string& record, int column, const State& s, const std::map<std::string, double>& eta) {
  codegen::Graph g;
  const codegen::Robot robot = codegen::ReadRobot("codegen/robots/er20_like.toml");
  const auto instance = codegen::Instantiate(g, Records().at(record), robot, {1}, codegen::QuantitiesAsInputs(g));
  const codegen::Tape tape(g, {instance.columns[column].rows.at(1)});
  std::vector<double> inputs;
  for (const std::string& name : g.inputs()) {
    double value = name == "q2"           ? s.q
                   : name == "qd2"        ? s.qd
                   : name == "temp2"      ? s.temp
                   : name == "t"          ? s.t
                   : name == "tau_rigid2" ? s.tau_rigid
                                          : NAN;
    for (const auto& [key, v] : eta)
      if (name == record + "." + key + "2") value = v;
    inputs.push_back(value);
  }
  return tape.EvaluateAt<double>(inputs)[0];
}

TEST(Effects, Columns_EqualFormulasWrittenByHand) {
  for (const double v : {-1.3, -0.02, 0.01, 0.4, 2.0})
    for (const double q : {-1.1, 0.2, 0.9}) {
      const State s{q, v, 41.0, 3.0, -350.0};
      const double sign = v > 0 ? 1 : -1;
      EXPECT_NEAR(Column("stribeck", 0, s, {{"vs", 0.1}, {"delta", 1.5}}),
                  std::exp(-std::pow(std::abs(v) / 0.1, 1.5)) * sign, 1e-14);
      EXPECT_NEAR(Column("viscous_cubic", 0, s, {}), v * v * v, 1e-13);
      EXPECT_NEAR(Column("viscous_quadratic", 0, s, {}), v * std::abs(v), 1e-14);
      EXPECT_NEAR(Column("viscous_cuberoot", 0, s, {}), std::cbrt(v), 1e-14);
      EXPECT_NEAR(Column("load_friction", 0, s, {}), 350 * sign, 1e-12);
      EXPECT_NEAR(Column("temp_viscous", 0, s, {{"Tc", 25.0}}), v * std::exp(-11.0 / 25.0), 1e-14);
      EXPECT_NEAR(Column("temp_coulomb", 0, s, {}), 1.1 * sign, 1e-14);
      EXPECT_NEAR(Column("torque_ripple", 1, s, {{"k", 40.0}}), std::sin(40 * q), 1e-13);
      EXPECT_NEAR(Column("meshing_friction", 0, s, {{"k", 40.0}}), std::cos(40 * q) * sign, 1e-13);
      EXPECT_NEAR(Column("cable_pack", 1, s, {{"q0", 0.3}}), std::pow(q - 0.3, 3), 1e-14);
      EXPECT_EQ(Column("torque_offset", 0, s, {}), 1.0);
      EXPECT_EQ(Column("coulomb_asymmetry", 0, s, {}), 1.0);
    }
}

// The payload's columns are the last link's own: ten unit bodies, only while the window is open.
TEST(Effects, PayloadStep_IsTheFlangeBodyInsideItsWindow) {
  codegen::Graph g;
  const codegen::Robot robot = codegen::ReadRobot("codegen/robots/er20_like.toml");
  const auto instance =
      codegen::Instantiate(g, Records().at("payload_step"), robot, {}, codegen::QuantitiesAsInputs(g));
  ASSERT_EQ(instance.columns.size(), 10u);
  const codegen::Tape tape(g, {instance.columns[2].rows.at(4)});  // my in row 5
  for (const double t : {1.0, 5.0, 9.0}) {
    std::vector<double> inputs;
    for (const std::string& name : g.inputs())
      inputs.push_back(name == "t"                    ? t
                       : name == "payload_step.t_on"  ? 3.0
                       : name == "payload_step.t_off" ? 7.0
                       : name == "Y4_5_2"             ? 0.37
                                                      : 99.0);
    EXPECT_EQ(tape.EvaluateAt<double>(inputs)[0], t == 5.0 ? 0.37 : 0.0);
  }
}

class BadFile : public testing::Test {
 protected:
  std::string Write(const std::string& name, const std::string& text) {
    const auto path = folder_ / name;
    std::ofstream(path) << text;
    return path.string();
  }
  void ExpectError(const std::function<void()>& read, const std::string& part) {
    try {
      read();
      ADD_FAILURE() << "accepted, expected: " << part;
    } catch (const io::InputError& e) {
      EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
    }
  }
  std::filesystem::path folder_ = std::filesystem::temp_directory_path() / "armcal_codegen_test";
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
};

TEST_F(BadFile, Record_IsRefusedWithFileAndKey) {
  const std::string head = "name = \"x\"\ntitle = \"x\"\nclass = \"static\"\nscope = \"joint\"\n";
  ExpectError([&] { codegen::ReadEffect(Write("x.toml", head)); }, "linear");
  ExpectError([&] { codegen::ReadEffect(Write("x.toml", head + "colour = 1\n")); }, "colour");
  ExpectError([&] { codegen::ReadEffect(Write("x.toml", "name = \"y\"\n")); }, "name");
  ExpectError([&] { codegen::ReadEffect(Write("x.toml", head + "inputs = [\"torque\"]\n")); }, "inputs");
  ExpectError([&] { codegen::ReadEffect(Write("x.toml", "name = \n")); }, "line 1");
  const auto record = codegen::ReadEffect(
      Write("x.toml", head + "[[linear]]\nname = \"a\"\nunit = \"N*m\"\nrows = { j = \"qd*frequency\" }\n"));
  codegen::Graph g;
  const codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
  ExpectError([&] { codegen::Instantiate(g, record, robot, {0}, codegen::QuantitiesAsInputs(g)); }, "column 4");
}

TEST_F(BadFile, Robot_IsRefusedWithFileAndKey) {
  std::ifstream in("codegen/robots/two_link.toml");
  const std::string good(std::istreambuf_iterator<char>(in), {});
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string s = good;
    s.replace(s.find(from), from.size(), to);
    return s;
  };
  ExpectError([&] { codegen::ReadRobot(folder_ / "none.toml"); }, "no such file");
  ExpectError([&] { codegen::ReadRobot(Write("r.toml", with("dh = \"modified\"", "dh = \"other\""))); }, "dh");
  ExpectError([&] { codegen::ReadRobot(Write("r.toml", with("torque_noise_Nm = 0.5", "torque_noise_Nm = -1"))); },
              "joint[1].torque_noise_Nm");
  ExpectError([&] { codegen::ReadRobot(Write("r.toml", with("a_m = 0.5", "a_m = nan"))); }, "joint[2].a_m");
  ExpectError([&] { codegen::ReadRobot(Write("r.toml", with("gear_ratio = 50.0", "gearratio = 50.0"))); }, "gearratio");
  ExpectError([&] { codegen::ReadRobot(Write("r.toml", with("type = \"revolute\"", "type = \"helical\""))); }, "type");
  ExpectError(
      [&] {
        codegen::Model(codegen::ReadRobot(Write("r.toml", good + "\n[[effect]]\nname = \"gremlin\"\njoints = [1]\n")),
                       Records());
      },
      "gremlin");
  ExpectError([&] { codegen::ReadRobot(Write("r.toml", good + "\n[[effect]]\nname = \"stribeck\"\njoints = [9]\n")); },
              "joints");
}

TEST(Robot, StandardDh_GivesTheSameArmAsItsModifiedRows) {
  // kuka_kr300 is written in standard DH; the same product of transforms, row by row, must come out of the shifted
  // rows.
  const codegen::Robot r = codegen::ReadRobot("codegen/robots/kuka_kr300.toml");
  EXPECT_DOUBLE_EQ(r.joint[0].kinematics.a_m, 0);
  EXPECT_DOUBLE_EQ(r.joint[1].kinematics.a_m, 0.350);
  EXPECT_DOUBLE_EQ(r.joint[2].kinematics.a_m, 1.150);
  EXPECT_NEAR(r.joint[1].kinematics.alpha_rad, M_PI / 2, 1e-15);
  EXPECT_DOUBLE_EQ(r.joint[0].kinematics.d_m, -0.675);
}

}  // namespace
}  // namespace armcal::tests
