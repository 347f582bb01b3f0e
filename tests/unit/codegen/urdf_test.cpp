// tests - robots from URDF: the torque of the chain that kdl_parser makes of the same text; refusals in one line.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <kdl/tree.hpp>
#include <kdl_parser/kdl_parser.hpp>
#include <sstream>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/robot/urdf.hpp"
#include "tests/unit/codegen/rigid_oracle.hpp"

namespace armcal::tests {
namespace {

namespace fs = std::filesystem;

std::string FileText(const fs::path& path) {
  std::ifstream in(path);
  std::ostringstream s;
  s << in.rdbuf();
  return s.str();
}

class Urdf : public testing::Test {
 protected:
  Urdf() : folder_(fs::temp_directory_path() / ("armcal_urdf_" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
  }
  ~Urdf() override { fs::remove_all(folder_); }

  // A robot file around a URDF: what a URDF does not say, for each joint named.
  codegen::Robot Read(const std::string& urdf, const std::vector<std::string>& joints, const std::string& more = "") {
    std::ofstream(folder_ / "arm.urdf") << urdf;
    std::ofstream out(folder_ / "arm.toml");
    out << "name = \"arm\"\nsource = \"test\"\ngravity_mps2 = [0.0, 0.0, -9.81]\nurdf = \"arm.urdf\"\n"
        << more << "[prior]\nlink_relative_sd = 0.2\n";  // the bodies below are equal, and meant so
    for (const auto& j : joints)
      out << "[[joint]]\nname = \"" << j << "\"\n"
          << (j[0] == 'p' ? "acceleration_limit_mps2 = 1.0\ntorque_noise_N = 1.0\nv_min_mps = 0.01\n"
                          : "acceleration_limit_radps2 = 1.0\ntorque_noise_Nm = 1.0\nv_min_radps = 0.01\n")
          << (j[0] == 'c' ? "position_limit_deg = [-400.0, 400.0]\n" : "");
    out.close();
    return codegen::ReadRobot(folder_ / "arm.toml");
  }
  std::string Refusal(const std::string& urdf, const std::vector<std::string>& joints, const std::string& more = "") {
    try {
      Read(urdf, joints, more);
    } catch (const io::InputError& e) {
      return e.what();
    }
    return "accepted";
  }
  fs::path folder_;
};

KDL::Tree Parse(const std::string& urdf) {
  KDL::Tree tree;
  EXPECT_TRUE(kdl_parser::treeFromString(urdf, tree));
  return tree;
}
KDL::Chain ChainTo(const KDL::Tree& tree, const std::string& tip) {
  KDL::Chain chain;
  EXPECT_TRUE(tree.getChain(tree.getRootSegment()->first, tip, chain));
  return chain;
}

// Torque of the URDF's own bodies, by the generator and by kdl_parser's chain; relative to the largest.
double ErrorAgainstParser(const codegen::Robot& robot, const KDL::Chain& chain, int states) {
  const unsigned n = robot.joints();
  EXPECT_EQ(chain.getNrOfJoints(), n);
  KDL::ChainIdSolver_RNE solver(chain, KDL::Vector(0, 0, -9.81));
  const KDL::Wrenches none(chain.getNrOfSegments(), KDL::Wrench::Zero());
  const GraphArm arm(robot);
  const std::vector<Body> bodies = BodiesOf(robot);
  std::mt19937_64 random(31);
  double error = 0, scale = 0;
  for (int k = 0; k < states; ++k) {
    const State s = RandomState(robot.joints(), random);
    KDL::JntArray q(n), qd(n), qdd(n), tau(n);
    q.data = s.q, qd.data = s.qd, qdd.data = s.qdd;
    EXPECT_GE(solver.CartToJnt(q, qd, qdd, none, tau), 0);
    error = std::max(error, (arm.Torque()(s, bodies) - tau.data).cwiseAbs().maxCoeff());
    scale = std::max(scale, tau.data.cwiseAbs().maxCoeff());
  }
  return error / scale;
}

std::string Lwr() {
  const char* data = std::getenv("ARMCAL_DATA");
  const fs::path path = fs::path(data ? data : "../shared/data") / "measured/kuka_lwr4/kuka_lwr4.urdf";
  return fs::exists(path) ? FileText(path) : "";
}
std::vector<std::string> LwrJoints() {
  std::vector<std::string> names;
  for (int j = 0; j < 7; ++j) names.push_back("lwr_" + std::to_string(j) + "_joint");
  return names;
}

TEST_F(Urdf, OfTheLwr_EqualsTheChainOfKdlParser) {
  const std::string urdf = Lwr();
  if (urdf.empty()) GTEST_SKIP() << "kuka_lwr4.urdf is not there (ARMCAL_DATA)";
  EXPECT_LT(ErrorAgainstParser(Read(urdf, LwrJoints()), ChainTo(Parse(urdf), "lwr_7_link"), 10000), 1e-12);
}

TEST_F(Urdf, OfTheLwr_IsWhatTheCheckedInRobotSays) {
  const std::string urdf = Lwr();
  if (urdf.empty()) GTEST_SKIP() << "kuka_lwr4.urdf is not there (ARMCAL_DATA)";
  const codegen::Robot a = Read(urdf, LwrJoints()), b = codegen::ReadRobot("codegen/robots/kuka_lwr4.toml");
  const double round = 1e-12;  // both are printed with as many decimals; angles of limits in degrees
  for (int j = 0; j < 7; ++j) {
    const auto &x = a.joint[j], &y = b.joint[j];
    EXPECT_EQ(x.name, y.name);
    EXPECT_NEAR(x.kinematics.alpha_rad, y.kinematics.alpha_rad, round);
    EXPECT_NEAR(x.kinematics.a_m, y.kinematics.a_m, round);
    EXPECT_NEAR(x.kinematics.d_m, y.kinematics.d_m, round);
    EXPECT_NEAR(x.kinematics.theta_rad, y.kinematics.theta_rad, round);
    EXPECT_NEAR(x.link.mass_kg, y.link.mass_kg, round);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(x.link.center_m[k], y.link.center_m[k], round);
    for (int k = 0; k < 6; ++k) EXPECT_NEAR(x.link.inertia_kgm2[k], y.link.inertia_kgm2[k], round);
    for (int k = 0; k < 2; ++k) EXPECT_NEAR(x.position_limit_rad[k], y.position_limit_rad[k], 1e-10);
    EXPECT_NEAR(x.speed_limit_radps, y.speed_limit_radps, 1e-10);
    EXPECT_EQ(x.torque_limit_Nm, y.torque_limit_Nm);
    EXPECT_EQ(x.nominal, y.nominal);
  }
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(a.base_xyz_m[k], b.base_xyz_m[k], round);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(a.tool_xyz_m[k], b.tool_xyz_m[k], round);
  for (int k = 0; k < 9; ++k) EXPECT_NEAR(a.base_rotation[k], b.base_rotation[k], round);
}

std::string Inertial(double m, const char* origin, const char* inertia) {
  return "<inertial><mass value=\"" + std::to_string(m) + "\"/><origin " + origin + "/><inertia " + inertia +
         "/></inertial>";
}
std::string Link(const std::string& name, const std::string& inside = "") {
  return "<link name=\"" + name + "\">" + inside + "</link>";
}
std::string JointText(const std::string& name, const std::string& type, const std::string& parent,
                      const std::string& child, const char* origin, const char* axis, const std::string& more = "") {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent + "\"/><child link=\"" + child +
         "\"/><origin " + origin + "/><axis xyz=\"" + axis +
         "\"/><limit lower=\"-1.5\" upper=\"2\" effort=\"30\" velocity=\"2.5\"/>" + more + "</joint>";
}
std::string RobotText(const std::string& inside) { return "<robot name=\"arm\">" + inside + "</robot>"; }

const char* const kSkewed = "ixx=\"0.3\" ixy=\"0.02\" ixz=\"-0.03\" iyy=\"0.4\" iyz=\"0.01\" izz=\"0.35\"";

// Turned and shifted joints about odd axes, a slide, a flange and a camera that are fixed: nothing is aligned.
std::string OddArm() {
  const std::string body = Inertial(2.5, "xyz=\"0.1 -0.2 0.3\" rpy=\"0.3 -0.4 0.5\"", kSkewed);
  return RobotText(
      Link("world") + Link("base", body) +
      JointText("fix0", "fixed", "world", "base", "xyz=\"1 2 3\" rpy=\"0.2 0.3 -1\"", "0 0 1") + Link("l1", body) +
      JointText("r1", "revolute", "base", "l1", "xyz=\"0.1 0 0.4\" rpy=\"0.5 0 0.2\"", "0.3 -0.4 0.5") +
      Link("l2", body) + JointText("p2", "prismatic", "l1", "l2", "xyz=\"0 0.3 0.1\" rpy=\"0 1.2 0\"", "1 1 0") +
      Link("l3", body) + JointText("c3", "continuous", "l2", "l3", "xyz=\"0.2 0.1 0\" rpy=\"-0.7 0 0.4\"", "0 -1 0") +
      Link("camera", body) +
      JointText("fix1", "fixed", "l3", "camera", "xyz=\"0 0.1 0.2\" rpy=\"1 0.1 0.2\"", "0 0 1") + Link("l4", body) +
      JointText("r4", "revolute", "l3", "l4", "xyz=\"0.2 0 0.3\" rpy=\"0 0 0\"", "0 -1 0") +  // parallel to c3
      Link("l5", body) +
      JointText("r5", "revolute", "l4", "l5", "xyz=\"0 0.3 0\" rpy=\"0 0 0.3\"", "0 1 0") +  // on r4's line
      Link("tool", body) + JointText("fix2", "fixed", "l5", "tool", "xyz=\"0 0 0.2\" rpy=\"0 0.5 0\"", "0 0 1"));
}

TEST_F(Urdf, WithOddAxesFixedPartsAndASlide_EqualsTheChainOfKdlParser) {
  const codegen::Robot robot = Read(OddArm(), {"r1", "p2", "c3", "r4", "r5"});
  const KDL::Tree tree = Parse(OddArm());
  const KDL::Chain to_tool = ChainTo(tree, "tool");
  KDL::Chain chain;  // the chain to the tool passes the camera by; its body belongs to l3 all the same
  for (unsigned k = 0; k < to_tool.getNrOfSegments(); ++k) {
    KDL::Segment s = to_tool.getSegment(k);
    if (s.getName() == "l3") {
      const KDL::Segment camera = tree.getSegment("camera")->second.segment;
      s.setInertia(s.getInertia() + camera.getFrameToTip() * camera.getInertia());
    }
    chain.addSegment(s);
  }
  // lengths are kept to 12 decimals
  EXPECT_LT(ErrorAgainstParser(robot, chain, 500), 1e-10);
}

TEST_F(Urdf, Limits_ComeFromTheUrdfUnlessTheRobotFileSaysOtherwise) {
  const codegen::Robot robot = Read(OddArm(), {"r1", "p2", "c3", "r4", "r5"});
  EXPECT_EQ(robot.joint[0].position_limit_rad, (std::array<double, 2>{-1.5, 2}));
  EXPECT_EQ(robot.joint[1].kinematics.type, codegen::JointType::kPrismatic);
  EXPECT_EQ(robot.joint[1].speed_limit_radps, 2.5);
  EXPECT_EQ(robot.joint[4].torque_limit_Nm, 30);
  EXPECT_NEAR(robot.joint[2].position_limit_rad[1], 400 * M_PI / 180, 1e-12);
}

// What a base weighs does not matter, and a link without mass is a frame, whatever inertia somebody wrote for it.
TEST_F(Urdf, InertiasOfTheBaseAndOfFrames_DoNotCount) {
  const std::string kinematics = JointText("r1", "revolute", "base", "l1", "xyz=\"0 0 0.4\" rpy=\"0.3 0 1\"", "0 1 0") +
                                 JointText("r2", "revolute", "l1", "l2", "xyz=\"0.3 0 0.1\"", "1 0 0") +
                                 JointText("fix", "fixed", "l2", "tool", "xyz=\"0 0.1 0.2\"", "0 0 1");
  const std::string bodies = Link("l1", Inertial(2.5, "xyz=\"0.1 -0.2 0.3\"", kSkewed)) +
                             Link("l2", Inertial(1.5, "xyz=\"0.1 0.1 0\"", kSkewed));
  const char* const impossible = "ixx=\"0.1\" ixy=\"0\" ixz=\"0\" iyy=\"0.2\" iyz=\"0\" izz=\"9\"";
  const codegen::Robot robot = Read(RobotText(Link("base", Inertial(0, "xyz=\"-0.1 0 0\"", impossible)) + bodies +
                                              Link("tool", Inertial(0, "xyz=\"0 0 0\"", impossible)) + kinematics),
                                    {"r1", "r2"});
  const std::string plain = RobotText(Link("base") + bodies + Link("tool") + kinematics);
  EXPECT_LT(ErrorAgainstParser(robot, ChainTo(Parse(plain), "tool"), 200), 1e-10);
}

// xacro leaves the comments of its input in the URDF that it writes.
TEST_F(Urdf, MacrosInComments_AreNone) {
  const std::string comment = "<!-- made by xacro <xacro:property name=\"m\" value=\"1\"/>\n -->";
  EXPECT_EQ(Read(comment + OddArm() + comment, {"r1", "p2", "c3", "r4", "r5"}).joints(), 5);
  EXPECT_NE(Refusal(comment + RobotText(comment + "<xacro:arm/>"), {}).find("a xacro file"), std::string::npos);
  EXPECT_NE(Refusal(RobotText("<link name=\"${prefix}base\"/>"), {}).find("a xacro file"), std::string::npos);
}

// "1.5708" in a URDF means a right angle: the frames must come out exact, or every zero would cost operations.
TEST_F(Urdf, RoundedRightAngles_AreTakenAsExact) {
  const std::string body = Inertial(2.5, "xyz=\"0.1 -0.2 0.3\"", kSkewed);
  const codegen::Robot robot =
      Read(RobotText(Link("base") + Link("l1", body) +
                     JointText("r1", "revolute", "base", "l1", "xyz=\"0 0 0.4\"", "0 0 1") + Link("l2", body) +
                     JointText("r2", "revolute", "l1", "l2", "xyz=\"0 0 0.2\" rpy=\"1.5708 0 0\"", "0 0 1")),
           {"r1", "r2"});
  EXPECT_EQ(std::abs(robot.joint[1].kinematics.alpha_rad), M_PI / 2);
  EXPECT_EQ(robot.joint[1].kinematics.a_m, 0);
}

TEST_F(Urdf, FaultsOfItsBodiesAndOfTheRobotFile_AreSaidInOneRun) {
  const char* const flat = "ixx=\"0.1\" ixy=\"0\" ixz=\"0\" iyy=\"0.2\" iyz=\"0\" izz=\"9\"";
  const std::string error = Refusal(RobotText(Link("base") + Link("l1", Inertial(1, "xyz=\"0 0 0\"", flat)) +
                                              JointText("r1", "revolute", "base", "l1", "xyz=\"0 0 0\"", "0 0 1") +
                                              Link("l2", Inertial(1, "xyz=\"0 0 0\"", kSkewed)) +
                                              JointText("r2", "revolute", "l1", "l2", "xyz=\"0 0 0\"", "0 0 1")),
                                    {"r1"});
  EXPECT_NE(error.find("link \"l1\": expected principal moments of inertia"), std::string::npos) << error;
  EXPECT_NE(error.find("; mend it, or write prior = \"none\" in "), std::string::npos) << error;
  EXPECT_NE(error.find("joint: expected a [[joint]] table with name = \"r2\""), std::string::npos) << error;
  EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << error;
}

TEST_F(Urdf, ThatIsNoSerialArm_IsRefusedInOneLine) {
  const std::string body = Inertial(1, "xyz=\"0 0 0\"", kSkewed);
  const std::string start =
      Link("base") + Link("l1", body) + JointText("r1", "revolute", "base", "l1", "xyz=\"0 0 0\"", "0 0 1");
  const auto with = [&](const std::string& type, const std::string& more = "") {
    return RobotText(start + Link("l2", body) + JointText("r2", type, "l1", "l2", "xyz=\"0 0 0\"", "0 0 1", more));
  };
  const std::vector<std::pair<std::string, std::string>> refused = {
      {Refusal("<nothing", {}), "expected a URDF robot"},
      {Refusal(RobotText(Link("base")), {}), "link \"base\": expected at least one movable joint"},
      {Refusal(with("floating"), {"r1", "r2"}), "joint \"r2\": expected revolute, continuous, prismatic or fixed"},
      {Refusal(with("planar"), {"r1", "r2"}), "joint \"r2\": expected revolute, continuous, prismatic or fixed"},
      {Refusal(with("revolute", "<mimic joint=\"r1\"/>"), {"r1", "r2"}), "joint \"r2\": expected no mimic"},
      {Refusal(RobotText(start + Link("l2", body) + Link("l3", body) +
                         JointText("r2", "revolute", "l1", "l2", "xyz=\"0 0 0\"", "0 0 1") +
                         JointText("r3", "revolute", "l1", "l3", "xyz=\"0 0 0\"", "0 0 1")),
               {"r1", "r2", "r3"}),
       "expected one chain, but it branches"},
      {Refusal(with("revolute"), {"r1"}), "joint: expected a [[joint]] table with name = \"r2\""},
      {Refusal(with("revolute"), {"r1", "r2", "x"}), "expected the name of a movable joint of the URDF"},
      {Refusal(with("revolute"), {"r1", "r2"}, "dh = \"modified\"\n"), "dh: expected either dh or urdf"},
  };
  for (const auto& [message, expected] : refused) {
    EXPECT_NE(message.find(expected), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace armcal::tests
