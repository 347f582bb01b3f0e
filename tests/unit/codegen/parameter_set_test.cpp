// tests - which columns become filter coordinates: the user's choice, the way there and back, frames of the robot file.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/robot/frames.hpp"
#include "tests/unit/codegen/rigid_oracle.hpp"

namespace armcal::tests {
namespace {

namespace fs = std::filesystem;
using codegen::kBodyBlock;

std::string RobotText(const std::string& name) {
  std::ifstream in("codegen/robots/" + name + ".toml");
  std::ostringstream s;
  s << in.rdbuf();
  return s.str();
}
codegen::Robot ReadText(const std::string& text) {
  const fs::path path = fs::temp_directory_path() / ("armcal_parameters_" + std::to_string(getpid()) + ".toml");
  std::ofstream(path) << text;
  try {
    codegen::Robot robot = codegen::ReadRobot(path);
    fs::remove(path);
    return robot;
  } catch (...) {
    fs::remove(path);
    throw;
  }
}
std::string With(const std::string& name, const std::string& tables) {
  std::string text = RobotText(name);
  const bool top_level = tables[0] != '[';
  return text.insert(text.find(top_level ? "gravity_mps2" : "[[joint]]"), tables + "\n");
}

int Index(const std::string& name) {
  const int link = name.back() - '1';
  for (int k = 0; k < kBodyBlock; ++k)
    if (codegen::kBodyParameterName[k] == name.substr(0, name.size() - 1)) return kBodyBlock * link + k;
  return -1;
}
bool Has(const GraphArm& arm, const std::string& name) {
  const auto& c = arm.base().column;
  return std::find(c.begin(), c.end(), Index(name)) != c.end();
}

TEST(ParameterSet, PreferredParameters_EnterTheBaseAndTheTorqueStays) {
  const codegen::Robot plain = ReadText(RobotText("er20_like"));
  const codegen::Robot robot = ReadText(With("er20_like", "[parameters]\nprefer = [\"Iyy2\", \"mz4\", \"m6\"]"));
  const GraphArm before(plain), arm(robot);
  for (const char* name : {"Iyy2", "mz4", "m6"}) {
    EXPECT_FALSE(Has(before, name));
    EXPECT_TRUE(Has(arm, name));
  }
  EXPECT_EQ(arm.base().column.size(), before.base().column.size());
  EXPECT_LT(ErrorAgainstKdl(robot, arm.Torque(), 500, 41), 1e-11);  // an unusual base is worse conditioned
}

TEST(ParameterSet, OmittedParameters_AreTakenAsZero) {
  const codegen::Robot robot = ReadText(With("er20_like", "[parameters]\nomit = [\"my2\", \"my6\", \"mx3\"]"));
  const GraphArm arm(robot);
  for (const char* name : {"my2", "my6", "mx3"}) {
    EXPECT_FALSE(Has(arm, name));
    EXPECT_EQ(arm.base().map.col(Index(name)).cwiseAbs().maxCoeff(), 0);
  }
  std::mt19937_64 random(42);
  const codegen::Robot plain = ReadText(RobotText("er20_like"));
  const GraphArm whole(plain);
  for (int k = 0; k < 20; ++k) {
    VectorXd phi = StandardParameters(RandomBodies(6, random)), kept = phi;
    for (const char* name : {"my2", "my6", "mx3"}) kept[Index(name)] = 0;
    const State s = RandomState(6, random);
    const VectorXd expected = whole.Regressor(s) * (whole.base().map * kept);
    const VectorXd found = arm.Regressor(s) * (arm.base().map * phi);
    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-11 * expected.cwiseAbs().maxCoeff());
  }
}

TEST(ParameterSet, Standard_HoldsWhatTheTorqueDependsOnAboutTheFilesFrames) {
  const codegen::Robot robot = ReadText(With("er20_like", "[parameters]\nset = \"standard\""));
  const GraphArm arm(robot);
  EXPECT_GT(arm.base().column.size(), 50u);
  EXPECT_FALSE(Has(arm, "m1"));  // gravity along axis 1: nothing of link 1's mass is seen
  EXPECT_FALSE(Has(arm, "Ixx1"));
  EXPECT_TRUE(Has(arm, "m6"));
  for (int i = 0; i < arm.base().map.rows(); ++i)
    for (int c = 0; c < arm.base().map.cols(); ++c) EXPECT_EQ(arm.base().map(i, c), c == arm.base().column[i] ? 1 : 0);
}

TEST(ParameterSet, ThatNamesNothing_IsRefusedInOneLine) {
  const auto refusal = [](const std::string& tables) -> std::string {
    try {
      ReadText(With("er20_like", tables));
    } catch (const io::InputError& e) {
      return e.what();
    }
    return "accepted";
  };
  for (const auto& [tables, expected] : std::vector<std::pair<std::string, std::string>>{
           {"[parameters]\nprefer = [\"Iyy7\"]",
            "parameters.prefer: expected body parameters m1, mx1 ... Ia6, not \"Iyy7\""},
           {"[parameters]\nomit = [\"mass2\"]", "parameters.omit: expected body parameters"},
           {"[parameters]\nset = \"minimal\"", "parameters.set: expected \"base\" or \"standard\""},
           {"[parameters]\nprefers = [\"m1\"]", "parameters.prefers: unknown key"},
           {"tool_frame = { xyz = [0.0, 0.0, 0.1] }", "tool_frame.xyz: unknown key"}}) {
    const std::string message = refusal(tables);
    EXPECT_NE(message.find(expected), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
}

// A base that may tilt: gravity's direction is unknown, and rows for another direction make two more moments visible.
TEST(ExtraRows, OfGravityAlongX_MakeTwoMomentsOfLinkOneVisible) {
  codegen::Robot robot = ReadText(RobotText("er20_like")), tilted = robot;
  tilted.gravity_mps2 = {1, 0, 0};
  codegen::Graph graph;
  const auto rows = codegen::BodyRegressor(graph, robot), extra = codegen::BodyRegressor(graph, tilted, false);
  const auto plain = codegen::FindBaseParameters(graph, rows, robot);
  const auto more = codegen::FindBaseParameters(graph, rows, robot, extra);
  std::vector<int> added;
  std::set_difference(more.column.begin(), more.column.end(), plain.column.begin(), plain.column.end(),
                      std::back_inserter(added));
  EXPECT_EQ(added, (std::vector<int>{Index("mx1"), Index("my1")}));
}

TEST(BaseParameters, FromBodiesAndBack_KeepTheBaseAndMoveAsLittleAsPossible) {
  for (const char* name : {"er20_like", "puma560", "ur10", "kuka_lwr4", "two_link", "emps"}) {
    const GraphArm arm(ReadText(RobotText(name)));
    const auto& B = arm.base().map;
    std::mt19937_64 random(43);
    const int n = static_cast<int>(B.cols()) / kBodyBlock;
    const VectorXd truth = StandardParameters(RandomBodies(n, random));
    const VectorXd reference = StandardParameters(RandomBodies(n, random));
    const VectorXd found = codegen::BodiesFromBase(arm.base(), B * truth, reference);
    EXPECT_LT((B * found - B * truth).cwiseAbs().maxCoeff(), 1e-11) << name;
    // nearest: the step has no part that the base cannot see, so any other solution is farther away
    const VectorXd other = truth - reference, step = found - reference;
    EXPECT_LE(step.norm(), other.norm());
    EXPECT_NEAR(step.dot(other - step), 0, 1e-9) << name;
  }
}

// Position of the flange by the textbook product of standard DH transforms, and by the converted frames and tool frame.
TEST(StandardDh, ConvertedFramesAndTool_GiveTheTextbookFlange) {
  std::mt19937_64 random(44);
  std::uniform_real_distribution<double> u(-1, 1);
  const auto number = [&] { return std::to_string(u(random)); };
  for (int trial = 0; trial < 10; ++trial) {
    std::string text =
        "name = \"x\"\nsource = \"test\"\ngravity_mps2 = [0.0, 0.0, -9.81]\ndh = \"standard\"\nprior = \"none\"\n";
    const std::string tool_z = number();
    text += "tool_frame = { xyz_m = [0.1, 0.2, " + tool_z + "], rpy_deg = [90.0, 0.0, 30.0] }\n";
    const int n = 1 + trial % 7;
    std::vector<std::array<double, 4>> dh;
    std::vector<bool> prismatic;
    for (int j = 0; j < n; ++j) {
      const std::string a = number(), d = number(), alpha = number(), offset = number();
      prismatic.push_back(u(random) > 0.3);
      dh.push_back({std::stod(offset) * M_PI / 180, std::stod(d), std::stod(a), std::stod(alpha) * M_PI / 180});
      text += "[[joint]]\nname = \"j\"\nd_m = " + d + "\na_m = " + a + "\nalpha_deg = " + alpha +
              "\noffset_deg = " + offset;
      text +=
          prismatic[j]
              ? "\ntype = \"prismatic\"\nposition_limit_m = [-1.0, 1.0]\nspeed_limit_mps = 1.0\n"
                "acceleration_limit_mps2 = 1.0\ntorque_limit_N = 1.0\ntorque_noise_N = 1.0\nv_min_mps = 0.1\n"
              : "\ntype = \"revolute\"\nposition_limit_deg = [-9.0, 9.0]\nspeed_limit_degps = 1.0\n"
                "acceleration_limit_radps2 = 1.0\ntorque_limit_Nm = 1.0\ntorque_noise_Nm = 1.0\nv_min_radps = 0.1\n";
    }
    const codegen::Robot robot = ReadText(text);
    Eigen::Isometry3d expected = Eigen::Isometry3d::Identity(), found = expected;
    for (int j = 0; j < n; ++j) {
      const double q = u(random);
      const auto& [theta, d, a, alpha] = dh[j];
      expected = expected * Eigen::AngleAxisd(theta + (prismatic[j] ? 0 : q), Eigen::Vector3d::UnitZ()) *
                 Eigen::Translation3d(0, 0, d + (prismatic[j] ? q : 0)) * Eigen::Translation3d(a, 0, 0) *
                 Eigen::AngleAxisd(alpha, Eigen::Vector3d::UnitX());
      found = found * codegen::ModifiedDh(robot.joint[j].kinematics, q);
    }
    expected = expected * Eigen::Translation3d(0.1, 0.2, std::stod(tool_z)) *
               Eigen::AngleAxisd(M_PI / 6, Eigen::Vector3d::UnitZ()) *
               Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitX());
    Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();
    tool.translation() = Eigen::Vector3d(robot.tool_xyz_m.data());
    for (int k = 0; k < 9; ++k) tool.linear()(k / 3, k % 3) = robot.tool_rotation[k];
    EXPECT_LT(((found * tool).matrix() - expected.matrix()).cwiseAbs().maxCoeff(), 1e-12) << trial;
  }
}

TEST(BaseFrame, RotatedByQuarterTurns_IsExact) {
  const codegen::Robot robot =
      ReadText(With("two_link", "base_frame = { xyz_m = [1.0, 2.0, 3.0], rpy_deg = [180.0, 0.0, 90.0] }"));
  EXPECT_EQ(robot.base_rotation, (std::array<double, 9>{0, 1, 0, 1, 0, 0, 0, 0, -1}));
  EXPECT_EQ(robot.base_xyz_m, (std::array<double, 3>{1, 2, 3}));
}

}  // namespace
}  // namespace armcal::tests
