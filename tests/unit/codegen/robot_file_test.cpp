// codegen tests - faulty robot files: all faults of a file in one run, each with file, key or joint, and what to do.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/robot/robot.hpp"

namespace armcal::tests {
namespace {

namespace fs = std::filesystem;
using Change = std::pair<std::string, std::string>;  // text, what takes its place

const char* const kGood = R"(name = "pan_tilt"
source = "test"
gravity_mps2 = [0.0, 0.0, -9.81]
dh = "modified"
[[joint]]
name = "pan"
type = "revolute"
alpha_deg = 0.0
a_m = 0.0
d_m = 0.30
position_limit_deg = [-170.0, 170.0]
speed_limit_degps = 120.0
acceleration_limit_radps2 = 10.0
torque_limit_Nm = 20.0
torque_noise_Nm = 0.05
v_min_radps = 0.01
motor = { gear_ratio = 50.0, current_A_per_lsb = 0.001, torque_constant_NmpA = 0.05 }
encoder = { counts_per_turn = 65536 }
link = { mass_kg = 4.0, center_m = [0.0, 0.01, -0.05], inertia_kgm2 = [0.02, 0.0, 0.0, 0.02, 0.0, 0.01] }
[[joint]]
name = "slide"
type = "prismatic"
alpha_deg = 90.0
a_m = 0.1
d_m = 0.0
position_limit_m = [0.0, 0.5]
speed_limit_mps = 1.0
acceleration_limit_mps2 = 5.0
torque_limit_N = 300.0
torque_noise_N = 1.0
v_min_mps = 0.01
link = { mass_kg = 2.0, center_m = [0.1, 0.0, 0.0], inertia_kgm2 = [0.002, 0.0, 0.0, 0.006, 0.0, 0.006] }
)";

std::string UrdfBody(double mass) {
  return "<inertial><origin xyz=\"0.1 0 0\"/><mass value=\"" + std::to_string(mass) +
         "\"/><inertia ixx=\"0.02\" ixy=\"0\" ixz=\"0\" iyy=\"0.03\" iyz=\"0\" izz=\"0.02\"/></inertial>";
}
std::string UrdfJointText(const std::string& name, const std::string& parent, const std::string& child) {
  return "<joint name=\"" + name + "\" type=\"revolute\"><parent link=\"" + parent + "\"/><child link=\"" + child +
         "\"/><origin xyz=\"0 0 0.3\"/><axis xyz=\"0 1 0\"/><limit lower=\"-2\" upper=\"2\" effort=\"50\" "
         "velocity=\"3\"/></joint>\n";
}
std::string GoodUrdf() {
  std::string text = "<robot name=\"arm\"><link name=\"base\"/>\n";
  for (int k = 1; k <= 3; ++k)
    text +=
        "<link name=\"l" + std::to_string(k) + "\">" + UrdfBody(4 - k) + "</link>\n" +
        UrdfJointText("r" + std::to_string(k), k == 1 ? "base" : "l" + std::to_string(k - 1), "l" + std::to_string(k));
  return text + "</robot>";
}
std::string GoodUrdfRobot() {
  std::string text = "name = \"arm\"\nsource = \"test\"\ngravity_mps2 = [0.0, 0.0, -9.81]\nurdf = \"arm.urdf\"\n";
  for (int k = 1; k <= 3; ++k)
    text += "[[joint]]\nname = \"r" + std::to_string(k) +
            "\"\nacceleration_limit_radps2 = 10.0\ntorque_noise_Nm = 0.1\nv_min_radps = 0.01\n";
  return text;
}

class RobotFile : public testing::Test {
 protected:
  RobotFile() : folder_(fs::temp_directory_path() / ("armcal_robot_file_" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
  }
  ~RobotFile() override { fs::remove_all(folder_); }

  // The lines that reading it says; none: it is accepted.
  std::vector<std::string> Faults(const std::string& file) {
    std::vector<std::string> lines;
    try {
      codegen::ReadRobot(folder_ / file);
    } catch (const io::InputError& e) {
      std::istringstream text(e.what());
      for (std::string line; std::getline(text, line);) lines.push_back(line);
    }
    return lines;
  }
  void Write(const std::string& file, std::string text, const std::vector<Change>& changes) {
    for (const auto& [from, to] : changes) {
      const auto at = text.find(from);
      ASSERT_NE(at, text.npos) << from;
      text.replace(at, from.size(), to);
    }
    std::ofstream(folder_ / file) << text;
  }
  // Each expected text in a line of its own, and no line more.
  void Expect(const std::string& file, const std::vector<std::string>& expected) {
    const std::vector<std::string> lines = Faults(file);
    std::string all;
    for (const std::string& line : lines) all += line + "\n";
    EXPECT_EQ(lines.size(), expected.size()) << all;
    for (const std::string& text : expected) EXPECT_NE(all.find(text), all.npos) << text << "\nis not in\n" << all;
    for (const std::string& line : lines) EXPECT_EQ(line.find((folder_ / "").string()), 0u) << line;
  }

  fs::path folder_;
};

TEST_F(RobotFile, WithoutAFault_IsRead) {
  Write("good.toml", kGood, {});
  Write("arm.urdf", GoodUrdf(), {});
  Write("arm.toml", GoodUrdfRobot(), {});
  Expect("good.toml", {});
  Expect("arm.toml", {});
}

// The counts of an encoder may wrap: one position, two ways to write it.
TEST_F(RobotFile, AnEncodersZero_MayBeReadWithOrWithoutASign) {
  for (const char* zero : {"3000000000", "-1294967296"}) {
    Write("good.toml", kGood,
          {{"counts_per_turn = 65536", std::string("counts_per_turn = 65536, zero_counts = ") + zero}});
    EXPECT_EQ(codegen::ReadRobot(folder_ / "good.toml").joint[0].motor.zero_counts, -1294967296);
  }
}

TEST_F(RobotFile, OfDhRows_SaysAllFaultsAtOnce) {
  const std::vector<std::pair<std::vector<Change>, std::vector<std::string>>> cases = {
      {{{"name = \"pan_tilt\"\n", ""}}, {".toml: name: missing, expected a string"}},
      {{{"source = \"test\"\n", ""}, {"gravity_mps2 = [0.0, 0.0, -9.81]\n", ""}, {"torque_noise_Nm = 0.05\n", ""}},
       {": source: missing, expected a string", ": gravity_mps2: missing, expected 3 numbers",
        ": joint[1].torque_noise_Nm: missing, expected a number above zero"}},
      {{{"torque_noise_Nm", "torque_noize_Nm"}},
       {"joint[1].torque_noize_Nm: unknown key; the nearest is torque_noise_Nm"}},
      {{{"v_min_radps", "v_min"}}, {"joint[1].v_min: unknown key; the nearest is v_min_radps"}},
      {{{"gravity_mps2", "gravity_mps"}, {"v_min_mps", "vmin_mps"}},
       {"gravity_mps: unknown key; the nearest is gravity_mps2",
        "joint[2].vmin_mps: unknown key; the nearest is v_min_mps"}},
      {{{"[-170.0, 170.0]", "[170.0, -170.0]"}}, {"joint[1].position_limit_deg: expected [lower, upper] with lower"}},
      {{{"d_m = 0.30", "d_m = 300.0"}}, {"joint[1].d_m: expected metres (millimetres?)"}},
      {{{"[0.0, 0.5]", "[0.0, 500.0]"}}, {"joint[2].position_limit_m: expected metres (millimetres?)"}},
      {{{"[0.1, 0.0, 0.0]", "[100.0, 0.0, 0.0]"}}, {"joint[2].link.center_m: expected metres (millimetres?)"}},
      {{{"[0.02, 0.0, 0.0, 0.02, 0.0, 0.01]", "[0.02, 0.0, 0.0, 0.002, 0.0, 0.01]"},
        {"[0.002, 0.0, 0.0, 0.006, 0.0, 0.006]", "[-0.002, 0.0, 0.0, 0.006, 0.0, 0.006]"}},
       {"joint[1].link: expected principal moments of inertia of which none is as large as the sum",
        "joint[2].link: expected principal moments of inertia above zero, not -0.002"}},
      {{{"mass_kg = 4.0", "mass_kg = -4.0"}}, {"joint[1].link.mass_kg: expected a number above zero"}},
      {{{"[0.02, 0.0, 0.0, 0.02, 0.0, 0.01]", "[0.02, 0.02, 0.01]"}}, {"link.inertia_kgm2: expected 6 numbers"}},
      {{{"torque_limit_Nm = 20.0", "torque_limit_Nm = \"20\""}}, {"joint[1].torque_limit_Nm: expected a number above"}},
      {{{"a_m = 0.0", "a_m = inf"}}, {"joint[1].a_m: expected a finite number"}},
      {{{"\"revolute\"", "\"rotary\""}}, {"joint[1].type: expected \"revolute\" or \"prismatic\""}},
      {{{"speed_limit_degps = 120.0", "speed_limit_mps = 2.0"}},
       {"joint[1].speed_limit_mps: unknown key; the nearest is speed_limit_degps"}},
      {{{"gear_ratio = 50.0", "gear_ratio = 0.0"}, {"torque_constant_NmpA = 0.05", "rotor = 1e-4"}},
       {"joint[1].motor.gear_ratio: expected a ratio, not zero", "joint[1].motor.rotor: unknown key",
        "joint[1].motor.torque_constant_NmpA: missing, expected a number above zero"}},
      {{{"dh = \"modified\"\n", "dh = \"craig\"\n"}}, {"dh: expected \"modified\" or \"standard\""}},
      {{{"dh = \"modified\"\n", ""}, {"type = \"prismatic\"\n", "type = 3\n"}},
       {": dh: missing, expected a string", "joint[2].type: expected a string"}},
      {{{"dh = \"modified\"\n", "dh = \"modified\"\ntip = \"hand\"\n"}}, {"tip: expected urdf beside it"}},
      {{{"link = { mass_kg = 2.0,", "# link = { mass_kg = 2.0,"}}, {"joint[2].link: missing, expected a table"}},
      {{{"[[joint]]\nname = \"slide\"",
         "[[effect]]\nname = \"stribeck\"\njoints = [3]\nstate = \"on\"\n[[joint]]\nname = "
         "\"slide\""}},
       {"effect[1].state: expected \"estimated\"", "effect[1].joints: expected joint numbers 1..2"}},
      {{{"d_m = 0.30", "d_m = 0,30"}}, {".toml: line 10, column"}},
      {{{"counts_per_turn = 65536", "counts_per_turn = 65536, zero_counts = 5000000000"}},
       {"joint[1].encoder.zero_counts: expected an integer from -2147483648 to 4294967295"}},
      {{{"motor = {", "coulomb_Nm = -1.0\nviscous_Nmsprad = -2.0\nmotor = {"}},
       {"joint[1].coulomb_Nm: expected", "joint[1].viscous_Nmsprad: expected"}},
      {{{"dh = \"modified\"", "dh = \"modified\"\nsample_ticks = 8.9\ntitle = \"\"\"two\nlines\"\"\""}},
       {"sample_ticks: expected an integer from 1 to 64", "title: expected one line of text"}},
      {{{"dh = \"modified\"", "dh = \"modified\"\nprior = { link_relative_sd = -0.3 }"}},
       {"prior.link_relative_sd: expected"}},
  };
  int number = 0;
  for (const auto& [changes, expected] : cases) {
    SCOPED_TRACE(++number);
    Write("bad.toml", kGood, changes);
    Expect("bad.toml", expected);
  }
}

TEST_F(RobotFile, ThatNamesAUrdf_SaysAllFaultsOfBoth) {
  const std::string box = UrdfBody(2);

  struct Case {
    std::vector<Change> urdf, robot;
    std::vector<std::string> expected;
  };
  const std::string inertia = "ixx=\"0.02\" ixy=\"0\" ixz=\"0\" iyy=\"0.03\" iyz=\"0\" izz=\"0.02\"";
  const std::vector<Case> cases = {
      {{{UrdfBody(3), ""}, {UrdfBody(1), ""}},
       {},
       {"joint \"r1\": expected a link with mass after it; mend it, or write prior = \"none\" in",
        "joint \"r3\": expected a link with mass after it"}},
      {{{UrdfBody(3), box}, {UrdfBody(1), box}},
       {},
       {"links l1, l2, l3: expected inertias of their own, but they are the same: placeholders?"}},
      {{{"<origin xyz=\"0 0 0.3\"/>", "<origin xyz=\"0 0 300\"/>"},
        {"<origin xyz=\"0.1 0 0\"/>", "<origin xyz=\"100 0 0\"/>"}},
       {},
       {"joint \"r1\": expected an origin in metres, not 300", "link \"l1\": expected a centre of mass in metres"}},
      {{{inertia, "ixx=\"20000\" ixy=\"0\" ixz=\"0\" iyy=\"30000\" iyz=\"0\" izz=\"20000\""}},
       {},
       {"link \"l1\": expected an inertia in kg m^2: this one would be 108 m wide (kg mm^2?)"}},
      {{{inertia, "ixx=\"0.02\" ixy=\"0\" ixz=\"0\" iyy=\"0.05\" iyz=\"0\" izz=\"0.02\""},
        {inertia, "ixx=\"0.02\" ixy=\"0.1\" ixz=\"0\" iyy=\"0.03\" iyz=\"0\" izz=\"0.02\""}},
       {},
       {"link \"l1\": expected principal moments of inertia of which none is as large",
        "link \"l2\": expected principal moments of inertia above zero"}},
      {{{UrdfBody(2), UrdfBody(-2)}}, {}, {"link \"l2\": expected a mass above zero, not -2 kg"}},
      {{{UrdfJointText("r3", "l2", "l3"), UrdfJointText("r3", "l1", "l3")}},
       {},
       {"expected one chain, but it branches from \"r2\"; name the link at which the arm ends: tip = \"l2\" or "
        "\"l3\""}},
      {{{"<axis xyz=\"0 1 0\"/><limit", "<axis xyz=\"0 1 0\"/><mimic joint=\"r2\"/><limit"}},
       {},
       {"joint \"r1\": expected no mimic: every joint of the arm has a drive of its own; hold the joint that it "
        "follows"}},
      {{{"lower=\"-2\" upper=\"2\" effort=\"50\" velocity=\"3\"",
         "lower=\"0\" upper=\"0\" effort=\"0\" velocity=\"0\""},
        {"lower=\"-2\" upper=\"2\" effort=\"50\"", "lower=\"-170\" upper=\"170\" effort=\"50\""}},
       {},
       {"joint[1].position_limit_deg: missing, expected [lower, upper] in degrees, for the URDF has none",
        "joint[1].speed_limit_degps: missing", "joint[1].torque_limit_Nm: missing",
        "joint[2].position_limit_deg: missing, expected [lower, upper] in degrees, for the URDF has -170 to 170 rad"}},
      {{},
       {{"\"r2\"", "\"r_2\""}},
       {"joint[2].name: expected the name of a movable joint of the URDF, once; the nearest is r2"}},
      {{},
       {{"[[joint]]\nname = \"r2\"\nacceleration_limit_radps2 = 10.0\ntorque_noise_Nm = 0.1\nv_min_radps = 0.01\n", ""},
        {"v_min_radps", "v_min_rad"}},
       {"joint: expected a [[joint]] table with name = \"r2\"", "joint[1].v_min_rad: unknown key; the nearest is"}},
      {{},
       {{"urdf = \"arm.urdf\"", "urdf = \"arm.urdf\"\ntip = \"L3\""}},
       {"link \"L3\": expected a link of the URDF as the tip; the nearest is l3"}},
      {{},
       {{"urdf = \"arm.urdf\"", "urdf = \"arm.urdf\"\nfixed = { r4 = 0.0 }"}},
       {"joint \"r4\": expected a joint of the URDF to hold; the nearest is r"}},
      {{}, {{"arm.urdf", "arms.urdf"}, {"source = \"test\"\n", ""}}, {"arms.urdf: no such file", "source: missing"}},
      {{{"<robot name=\"arm\">", "<robot name=\"arm\"><xacro:include filename=\"a\"/>"}},
       {},
       {"arm.urdf: a xacro file, expected a URDF; run this where ROS is: xacro arm.urdf > expanded.urdf"}},
      {{{"</robot>", ""}}, {}, {"arm.urdf: expected a URDF robot"}},
  };
  int number = 0;
  for (const auto& c : cases) {
    SCOPED_TRACE(++number);
    Write("arm.urdf", GoodUrdf(), c.urdf);
    Write("arm.toml", GoodUrdfRobot(), c.robot);
    Expect("arm.toml", c.expected);
  }
}

TEST_F(RobotFile, ThatIsAnotherKindOfFile_SaysWhatToDo) {
  Write("arm.urdf", GoodUrdf(), {});
  Expect("arm.urdf", {"a URDF, expected a robot file; armcal makes one: armcal import"});
  Write("arm.urdf.xacro", GoodUrdf(), {});
  Expect("arm.urdf.xacro", {"arm.urdf.xacro -o arm.toml"});
  Write("table.toml", "robot = \"arm\"\nschema = 1\n[[parameter]]\nname = \"m1\"\n", {});
  Expect("table.toml", {": is a parameter table, expected a robot file; give this file as --table"});
  Write("map.toml", "joints = 1\nq = { column = \"q{}\", unit = \"rad\" }\n", {});
  Expect("map.toml", {": is a channel map, expected a robot file; give this file as --channels"});
}

// Joints that lead elsewhere are held: the arm is the chain to the tip, with all of them as parts of its bodies.
TEST_F(RobotFile, WithATip_HoldsWhatDoesNotLeadThere) {
  Write("arm.urdf", GoodUrdf(), {{UrdfJointText("r3", "l2", "l3"), UrdfJointText("r3", "l1", "l3")}});
  Write("arm.toml", GoodUrdfRobot(),
        {{"urdf = \"arm.urdf\"", "urdf = \"arm.urdf\"\ntip = \"l2\"\nfixed = { r3 = 1.0 }"},
         {"[[joint]]\nname = \"r3\"\nacceleration_limit_radps2 = 10.0\ntorque_noise_Nm = 0.1\nv_min_radps = 0.01\n",
          ""}});
  ASSERT_TRUE(Faults("arm.toml").empty()) << Faults("arm.toml")[0];
  const codegen::Robot robot = codegen::ReadRobot(folder_ / "arm.toml");
  ASSERT_EQ(robot.joints(), 2);
  EXPECT_NEAR(robot.joint[0].link.mass_kg, 4, 1e-12);  // l1 3 kg, l3 1 kg
  EXPECT_NEAR(robot.joint[1].link.mass_kg, 2, 1e-12);
}

}  // namespace
}  // namespace armcal::tests
