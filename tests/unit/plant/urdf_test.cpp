// plant - tests that the arm of a URDF moves as KDL's own reader of URDFs says, gripper and all.
#include <kdl/treeidsolver_recursive_newton_euler.hpp>
#include <kdl_parser/kdl_parser.hpp>
#include <random>

#include "tests/unit/plant/bench.hpp"

namespace armcal::plant {
namespace {

using namespace bench;

std::string Link(const std::string& name, double mass, const std::string& origin, const std::string& inertia) {
  return "<link name=\"" + name + "\"><inertial><origin " + origin + "/><mass value=\"" + std::to_string(mass) +
         "\"/><inertia " + inertia + "/></inertial></link>\n";
}

std::string Joint(const std::string& name, const std::string& type, const std::string& parent, const std::string& child,
                  const std::string& inside) {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent + "\"/><child link=\"" + child +
         "\"/>" + inside + "</joint>\n";
}

// A turn, a slide along a slanting axis and a turn; a flange, and two fingers of which one mimics the other.
// `frame`: the inertial of a link that is fixed to the flange.
std::string Urdf(const std::string& frame = "") {
  const std::string round = "ixx=\"0.02\" ixy=\"0.001\" ixz=\"-0.002\" iyy=\"0.03\" iyz=\"0.0015\" izz=\"0.025\"";
  const auto limit = [](const std::string& range) { return "<limit " + range + " effort=\"50\" velocity=\"3\"/>"; };
  return "<!-- <xacro:arm/> --><robot name=\"r\"><link name=\"base\"/>\n" +
         Link("l1", 5, "xyz=\"0.05 0.02 0.1\" rpy=\"0.3 -0.2 0.5\"", round) +
         Link("l2", 3, "xyz=\"0.1 0 -0.05\" rpy=\"1 0.5 0\"", round) + Link("l3", 2, "xyz=\"0 0.08 0.02\"", round) +
         Link("flange", 0.4, "xyz=\"0.01 0 0.03\"", round) + Link("f1", 0.2, "xyz=\"0.02 0 0\"", round) +
         Link("f2", 0.3, "xyz=\"0 0.02 0\"", round) +
         Joint("j1", "revolute", "base", "l1",
               "<origin xyz=\"0 0 0.3\" rpy=\"0.4 0 0.1\"/><axis xyz=\"0 0.6 0.8\"/>" +
                   limit("lower=\"-2\" upper=\"2\"")) +
         Joint("j2", "prismatic", "l1", "l2",
               "<origin xyz=\"0.2 0 0.1\" rpy=\"0 0.7 0\"/><axis xyz=\"1 1 0\"/>" +
                   limit("lower=\"0.1\" upper=\"0.6\"")) +
         Joint("j3", "continuous", "l2", "l3", "<origin xyz=\"0 0.1 0.3\" rpy=\"0.2 0.3 -1\"/><axis xyz=\"0 0 -1\"/>") +
         "<link name=\"frame\">" + frame + "</link>" + Joint("to_frame", "fixed", "flange", "frame", "") +
         Joint("to_flange", "fixed", "l3", "flange", "<origin xyz=\"0 0 0.1\" rpy=\"0 0 0.9\"/>") +
         Joint("finger", "prismatic", "flange", "f1",
               "<origin xyz=\"0 0 0.05\"/><axis xyz=\"0 1 0\"/>" + limit("lower=\"0.01\" upper=\"0.04\"")) +
         Joint("other", "revolute", "flange", "f2",
               "<origin xyz=\"0 0 0.06\"/><axis xyz=\"1 0 0\"/>" + limit("lower=\"-1\" upper=\"1\"") +
                   "<mimic joint=\"finger\" multiplier=\"-20\" offset=\"0.1\"/>") +
         "</robot>\n";
}

// In its URDF the frame has an inertia and no mass, so it has no body.
// first_joint: further keys of it.
std::string RobotOf(const std::string& head, const std::string& first_joint = "") {
  WriteText("arm.urdf",
            Urdf("<inertial><mass value=\"0\"/><inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" iyy=\"0.1\" iyz=\"0\" "
                 "izz=\"0.1\"/></inertial>"));
  std::string text =
      "name = \"test_arm\"\nsource = \"t\"\nurdf = \"arm.urdf\"\ngravity_mps2 = [1.0, 0.5, -9.7]\n" + head;
  // Another order than the URDF's: tables are found by name.
  text +=
      "[[joint]]\nname = \"j2\"\ntorque_noise_N = 0.5\nposition_limit_m = [0.2, 0.5]\n"
      "[[joint]]\nname = \"j1\"\ntorque_noise_Nm = 0.1\ncoulomb_Nm = 0.7\n" +
      first_joint +
      "[[joint]]\nname = \"j3\"\ntorque_noise_Nm = 0.1\ntorque_limit_Nm = 20.0\nspeed_limit_degps = 90.0\n";
  return WriteText("urdf_robot.toml", text);
}

// The arm of the robot file against KDL's own tree of the URDF, whose first finger stands at `finger`.
void ExpectToMoveAsKdlSays(const RobotFile& robot, double finger) {
  ASSERT_EQ(robot.joints(), 3);
  EXPECT_EQ(robot.joint[1].name, "j2");
  std::vector<Body> bodies;
  for (const JointData& joint : robot.joint) bodies.push_back(joint.body);
  Dynamics dynamics(robot, bodies, robot.gravity_mps2);
  KDL::Tree tree;
  ASSERT_TRUE(kdl_parser::treeFromString(Urdf(), tree));
  KDL::TreeIdSolver_RNE solver(tree, robot.gravity_mps2);
  std::map<std::string, unsigned> place;
  for (const auto& [name, segment] : tree.getSegments()) place[segment.segment.getJoint().getName()] = segment.q_nr;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-2, 2);
  for (int k = 0; k < 50; ++k) {
    KDL::JntArray q(tree.getNrOfJoints()), v(q.rows()), a(q.rows()), tau(q.rows());
    q(place.at("finger")) = finger, q(place.at("other")) = -20 * finger + 0.1;
    Eigen::Vector3d own[3];
    for (int j = 0; j < 3; ++j) {
      const unsigned at = place.at(robot.joint[static_cast<std::size_t>(j)].name);
      own[0][j] = q(at) = uniform(random), own[1][j] = v(at) = uniform(random), own[2][j] = a(at) = uniform(random);
    }
    ASSERT_GE(solver.CartToJnt(q, v, a, {}, tau), 0);
    const Eigen::VectorXd torque = dynamics.Torque(own[0], own[1], own[2]);
    for (int j = 0; j < 3; ++j)  // round-off of torques to 100 N m
      EXPECT_NEAR(torque[j], tau(place.at(robot.joint[static_cast<std::size_t>(j)].name)), 1e-10);
  }
}

TEST(UrdfPlant, MovesAsKdlsOwnReaderSays) {
  ExpectToMoveAsKdlSays(ReadRobotFile(RobotOf("fixed = { finger = 0.03 }\n")), 0.03);
}

TEST(UrdfPlant, HoldsAJointAtTheLimitNextToZero) {
  ExpectToMoveAsKdlSays(ReadRobotFile(RobotOf("")), 0.01);  // 0.01 to 0.04 m
}

TEST(UrdfPlant, TakesLimitsAndFrictionOfTheFileBeforeThoseOfTheUrdf) {
  const RobotFile robot = ReadRobotFile(RobotOf(""));
  EXPECT_EQ(robot.joint[0].torque_limit_Nm, 50);
  EXPECT_EQ(robot.joint[2].torque_limit_Nm, 20);
  EXPECT_NEAR(robot.joint[2].speed_limit_radps, std::numbers::pi / 2, 1e-12);
  EXPECT_TRUE(robot.joint[0].coulomb_stated);
  EXPECT_FALSE(robot.joint[1].coulomb_stated);
  Arm arm(MakeScenario("[truth]\nunstated_share = 0.05\nfriction_spread = 0\n"), RobotOf(""));
  EXPECT_EQ(arm.q()[1], 0.2);  // the limit next to zero
  const Truth& truth = arm.truth();
  EXPECT_EQ(truth.coulomb_Nm[0], 0.7);  // stated
  EXPECT_NEAR(truth.coulomb_Nm[1], 0.05 * 50, 0.5 * 0.05 * 50);
  EXPECT_GT(truth.rotor_inertia_kgm2[2], 0);
  // Without a motor: 2^23 counts a turn, 1e7 counts a metre.
  EXPECT_NEAR(2 * std::numbers::pi / robot.joint[1].counts_per_turn, 1e-7, 1e-20);
  EXPECT_EQ(robot.joint[0].counts_per_turn, 8388608);
}

// The first joint is so weak that it cannot hold the arm at zero.
TEST(UrdfPlant, StartsWhereTheMotorsCanHoldTheArm) {
  const Eigen::Vector3d rest = Eigen::Vector3d::Zero(), zero(0, 0.2, 0);
  const auto gravity = [&](const RobotFile& robot, const Eigen::VectorXd& q) -> Eigen::VectorXd {
    std::vector<Body> bodies;
    for (const JointData& joint : robot.joint) bodies.push_back(joint.body);
    return Dynamics(robot, bodies, robot.gravity_mps2).Torque(q, rest, rest);
  };
  const double limit = 0.8 * std::abs(gravity(ReadRobotFile(RobotOf("")), zero)[0]);
  ASSERT_GT(limit, 1);
  const std::string path = RobotOf("", "torque_limit_Nm = " + std::to_string(limit) + "\n");
  const Arm arm(MakeScenario("[truth]\ninertial_spread = 0\n"), path);
  const RobotFile robot = ReadRobotFile(path);
  EXPECT_GT((arm.q() - zero).norm(), 0.1);
  const Eigen::VectorXd torque = gravity(robot, arm.q());
  for (int j = 0; j < 3; ++j) EXPECT_LT(std::abs(torque[j]), robot.joint[static_cast<std::size_t>(j)].torque_limit_Nm);
}

}  // namespace
}  // namespace armcal::plant
