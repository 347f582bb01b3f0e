// tests - the catalogue as a whole, and what a bad record or robot gets.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>

#include "codegen/src/generator/model.hpp"
#include "codegen/src/io/input_error.hpp"
#include "tests/unit/codegen/effect_run.hpp"

namespace armcal::tests {
namespace {

// Every kind that a report may name, and the laws of the survey.
const char* const kKinds[] = {"coulomb_asymmetry",
                              "torque_offset",
                              "viscous_asymmetry",
                              "stribeck",
                              "viscous_quadratic",
                              "viscous_cubic",
                              "viscous_cuberoot",
                              "load_friction",
                              "load_linear",
                              "temp_viscous",
                              "temp_coulomb",
                              "time_varying_viscous",
                              "time_varying_coulomb",
                              "torque_drift",
                              "torque_ripple",
                              "meshing_friction",
                              "cross_ripple",
                              "gravity_spring",
                              "cable_pack",
                              "position_torque",
                              "position_friction",
                              "position_viscous",
                              "presliding_dahl",
                              "presliding_lugre",
                              "backlash",
                              "backlash_load",
                              "wrist_coupling",
                              "coupled_friction",
                              "velocity_product",
                              "payload_step",
                              "rotor_inertia",
                              "base_tilt",
                              "belt_elasticity",
                              "belt_load",
                              "torque_saturation",
                              "torque_gain_error",
                              "time_delay",
                              "external_contact",
                              "coulomb_viscous",
                              "friction_exponential",
                              "friction_sech_tanh",
                              "stribeck_basis",
                              "friction_table",
                              "curve_speed",
                              "curve_friction",
                              "curve_load",
                              "curve_load_friction",
                              "curve_temp_friction",
                              "curve_cross_position",
                              "curve_cross_friction",
                              "curve_cross_speed",
                              "hysteresis",
                              "hysteresis_loops",
                              "joint_compliance",
                              "curve_cross_load",
                              "curve_load_viscous",
                              "curve_two_positions",
                              "flange_hose",
                              "flange_contact"};

TEST(Catalogue, HasARecordForEveryKind_AndNoOther) {
  std::set<std::string> expected(std::begin(kKinds), std::end(kKinds)), found;
  for (const auto& [name, record] : Records()) found.insert(name);
  EXPECT_EQ(found, expected);
}

// What a record declares is what its expressions do: inputs, estimate, memory.
TEST(Catalogue, EveryRecord_ReadsWhatItDeclares) {
  for (const auto& [name, record] : Records()) {
    EffectRun run(name, JointsFor(record));
    bool estimate = false;
    for (const codegen::InputId& input : run.graph().inputs()) {
      const codegen::QuantityInfo* info = codegen::FindQuantity(input.quantity);
      if (info == nullptr) continue;  // a parameter or a state
      EXPECT_TRUE(record.inputs.contains(input.quantity)) << name << " reads " << info->declared;
      estimate |= info->of_estimate;
    }
    EXPECT_EQ(record.depends_on_estimate, estimate) << name;
    if (record.effect_class != codegen::EffectClass::kSensor) {
      EXPECT_EQ(record.effect_class == codegen::EffectClass::kStateful, !run.graph().states().empty()) << name;
    }
  }
}

TEST(Catalogue, EveryRecord_NamesRealThings) {
  const std::set<std::string> needs = {"moving", "low_speed", "high_speed", "temp_span", "load_span"};
  for (const auto& [name, record] : Records()) {
    for (const std::string& other : record.confusable_with)
      EXPECT_TRUE(Records().contains(other)) << name << ": " << other;
    for (const std::string& need : record.needs) EXPECT_TRUE(needs.contains(need)) << name << ": " << need;
    if (!record.replaces.empty()) {
      EXPECT_TRUE(Records().at(record.replaces).friction_law) << name;
    }
    EXPECT_FALSE(record.title.empty() || record.source.empty() || record.signals.empty()) << name;
    if (record.effect_class != codegen::EffectClass::kSensor) continue;
    bool known = false;
    for (const auto& p : record.linear) known |= p.name == record.apply.by;
    for (const auto& p : record.nonlinear) known |= p.name == record.apply.by;
    EXPECT_TRUE(known) << name << ": " << record.apply.by;
  }
}

// Bounds, defaults and prior widths on every joint of every arm that is checked in, prismatic and wide ones too.
TEST(Catalogue, EveryRecord_FitsEveryArm) {
  for (const char* arm : {"er20_like", "kuka_kr300", "emps", "two_link"}) {
    const codegen::Robot robot = codegen::ReadRobot(std::string("codegen/robots/") + arm + ".toml");
    for (const auto& [name, record] : Records())
      for (const auto& joints : codegen::JointSets(record, robot.joints())) {
        codegen::Graph g;
        const auto e = codegen::Instantiate(g, record, robot, joints, codegen::QuantitiesAsInputs(g));
        for (const auto& c : e.columns) EXPECT_GT(c.sd, 0) << arm << " " << c.name;
        for (const auto& u : e.unknowns) {
          EXPECT_LT(u.lower, u.upper) << arm << " " << u.name;
          EXPECT_TRUE(!u.logarithmic || u.lower > 0) << arm << " " << u.name;
        }
      }
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

// What a verdict says about an effect is in its record, wherever there is something to say.
TEST_F(BadFile, RecordWithoutItsWords_IsRefusedWithItsKey) {
  const auto read = [&](const std::string& words) {
    return [this, words] {
      codegen::ReadEffect(Write("x.toml", "name = \"x\"\ntitle = \"x\"\nscope = \"joint\"\n" + words +
                                              "[[linear]]\nname = \"a\"\nunit = \"N*m\"\nrows = { j = \"1\" }\n"));
    };
  };
  const std::string run = "class = \"run_state\"\n", of_the_arm = "class = \"static\"\n";
  ExpectError(read(run), "remedy");
  ExpectError(read(run + "remedy = \"wait\"\non_target = true\n"), "on_target");
  ExpectError(read(of_the_arm + "remedy = \"wait\"\n"), "remedy");
  ExpectError(read(of_the_arm + "on_target = false\n"), "remedy");
  ExpectError(read(of_the_arm + "confusable_with = [\"stribeck\"]\n"), "separate");
  EXPECT_NO_THROW(read(run + "remedy = \"wait\"\n")());
  EXPECT_NO_THROW(read(of_the_arm + "on_target = false\nremedy = \"wait\"\n")());
}

TEST_F(BadFile, Record_IsRefusedWithFileAndKey) {
  const std::string head = "name = \"x\"\ntitle = \"x\"\nclass = \"static\"\nscope = \"joint\"\n";
  ExpectError([&] { codegen::ReadEffect(Write("x.toml", head)); }, "linear");
  ExpectError([&] { codegen::ReadEffect(Write("x.toml", head + "colour = 1\n")); }, "colour");
  ExpectError([&] { codegen::ReadEffect(Write("x.toml", "name = \"y\"\n")); }, "name");
  ExpectError([&] { codegen::ReadEffect(Write("x.toml", head + "inputs = [\"torque\"]\n")); }, "inputs");
  // Flags are in no sample of the model: neither drive nor diagnosis could evaluate them.
  ExpectError([&] { codegen::ReadEffect(Write("x.toml", head + "inputs = [\"flag\"]\n")); },
              "inputs: expected one of q, ");
  ExpectError([&] { codegen::ReadEffect(Write("x.toml", "name = \n")); }, "line 1");
  const auto record = codegen::ReadEffect(
      Write("x.toml", head + "[[linear]]\nname = \"a\"\nunit = \"N*m\"\nrows = { j = \"qd*frequency\" }\n"));
  codegen::Graph g;
  const codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
  ExpectError([&] { codegen::Instantiate(g, record, robot, {0}, codegen::QuantitiesAsInputs(g)); }, "column 4");
}

// Each wrong in one way; the message names what was expected instead.
TEST_F(BadFile, RecordWithMemoryOrSensor_IsRefusedWithItsKey) {
  const codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
  const auto record = [](const std::string& kind, const std::string& rest, const std::string& column) {
    return "name = \"x\"\ntitle = \"x\"\nclass = \"" + kind + "\"\nscope = \"joint\"\n" + rest +
           "\n[[linear]]\nname = \"a\"\nunit = \"N*m\"\nrows = { j = \"" + column + "\" }\n";
  };
  const auto state = [](const std::string& initial, const std::string& step, const std::string& settled) {
    return "[[nonlinear]]\nname = \"T\"\nunit = \"s\"\nlower = 1\nupper = 3\ninitial = 2\n[[state]]\nname = \"z\"\n" +
           ("unit = \"1\"\ninitial = \"" + initial) + "\"\nstep = \"" + step + "\"\nsettled = \"" + settled + "\"\n";
  };
  const auto use = [&](const std::string& text) {
    return [&, text] {
      const auto r = codegen::ReadEffect(Write("x.toml", text));
      codegen::Graph g;
      codegen::Instantiate(g, r, robot, {0}, codegen::QuantitiesAsInputs(g));
    };
  };
  EXPECT_NO_THROW(use(record("stateful", state("q", "z + qd*dt/T", "t - 3"), "z"))());
  ExpectError(use(record("static", state("q", "z + qd", "t"), "z")), "class");
  ExpectError(use(record("static", "", "previous(q)")), "stateful");
  ExpectError(use(record("stateful", state("T", "z + qd", "t"), "z")), "initial");
  ExpectError(use(record("stateful", state("0", "z + speed", "t"), "z")), "state z, step");
  ExpectError(use(record("stateful", state("0", "z +", "t"), "z")), "column 4");
  ExpectError(use(record("stateful", state("0", "z", "t +"), "z")), "settled");
  ExpectError(use(record("stateful", "[[state]]\nname = \"z\"\nunit = \"1\"\n", "z")), "step");
  ExpectError(use(record("static", "", "tau_model")), "tau_model");
  ExpectError(use(record("sensor", "", "tau_model")), "apply");
  ExpectError(use(record("static", "apply = { how = \"gain\", by = \"a\" }\n", "1")), "apply");
  ExpectError(use(record("sensor", "apply = { how = \"guess\", by = \"a\" }\n", "1")), "gain, delay, censor");
  ExpectError(use(record("static", "search = { how = \"luck\" }\n", "1")), "search");
  ExpectError(use(record("dynamic", "", "1")), "class");
  ExpectError(use(record("static", "let = [\"qd = abs(qd)\"]\n", "qd")), "let qd: it reads itself");
  ExpectError(use(record("static", "let = [\"u = v\", \"v = u + 1\"]\n", "u")), "it reads itself");
  EXPECT_NO_THROW(use(record("static", "let = [\"u = v*v\", \"v = abs(qd)\"]\n", "u + v"))());
  const std::string scale = "[[nonlinear]]\nname = \"T\"\nunit = \"s\"\nlower = 1\nupper = 3\ninitial = 2\nscale = ";
  ExpectError(use(record("static", scale + "\"logarithmic\"", "qd*T")), "scale: expected one of linear, log");
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
