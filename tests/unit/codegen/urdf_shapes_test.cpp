// tests - collision shapes of a URDF and of a robot file: where they are, against KDL; and how their meshes are found.
#include <gtest/gtest.h>

#include <cstdlib>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/tree.hpp>
#include <kdl_parser/kdl_parser.hpp>

#include "codegen/src/robot/frames.hpp"
#include "codegen/src/robot/import_urdf.hpp"
#include "codegen/src/robot/mesh_path.hpp"
#include "codegen/src/robot/robot.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::tests {
namespace {

namespace fs = std::filesystem;
using codegen::Shape;
using Eigen::Isometry3d;
using Eigen::Vector3d;

// Two turns and a slide, a flange that is fixed, and a shape on each link.
const std::string kArm = R"(<robot name="r">
<link name="root"><collision><origin xyz="0.1 0.2 0.3" rpy="0.3 0 0"/><geometry><box size="0.1 0.2 0.3"/></geometry></collision></link>
<link name="a"><inertial><mass value="3"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
<collision><origin xyz="0.01 0.02 0.03" rpy="0.1 0.2 0.3"/><geometry><cylinder radius="0.05" length="0.4"/></geometry></collision></link>
<link name="b"><inertial><mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.12" iyz="0" izz="0.1"/></inertial>
<collision><origin xyz="0 0.02 0.2" rpy="1 0 -0.3"/><geometry><sphere radius="0.07"/></geometry></collision></link>
<link name="c"><inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.13"/></inertial></link>
<link name="flange"><collision><origin xyz="0 0 0.1" rpy="0 0.5 0"/><geometry><mesh filename="package://arm_description/meshes/f.stl" scale="0.001 0.001 0.002"/></geometry></collision></link>
<joint name="ra" type="revolute"><parent link="root"/><child link="a"/><origin xyz="0.1 0 0.4" rpy="0.2 0.1 0.4"/><axis xyz="0 0.6 0.8"/><limit lower="-2" upper="2" effort="50" velocity="2"/></joint>
<joint name="rb" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.3 0 0.1" rpy="0 0.7 0"/><axis xyz="1 0 0"/><limit lower="-2" upper="2" effort="50" velocity="2"/></joint>
<joint name="pc" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="0 0.1 0.3" rpy="0.4 0 1"/><axis xyz="0 0 -1"/><limit lower="0" upper="0.5" effort="50" velocity="2"/></joint>
<joint name="ff" type="fixed"><parent link="c"/><child link="flange"/><origin xyz="0.05 0 0" rpy="0 0 0.6"/></joint>
</robot>)";

std::string AroundUrdf(const std::string& more) {
  std::string text =
      "name = \"arm\"\nsource = \"test\"\ngravity_mps2 = [0.0, 0.0, -9.81]\nurdf = \"arm.urdf\"\n" + more;
  for (const char* name : {"ra", "rb"})
    text += std::string("[[joint]]\nname = \"") + name +
            "\"\nacceleration_limit_radps2 = 1.0\ntorque_noise_Nm = 1.0\nv_min_radps = 0.01\n";
  return text + "[[joint]]\nname = \"pc\"\nacceleration_limit_mps2 = 1.0\ntorque_noise_N = 1.0\nv_min_mps = 0.01\n";
}

Isometry3d PoseOf(const Vector3d& xyz, double roll, double pitch, double yaw) {
  const KDL::Rotation R = KDL::Rotation::RPY(roll, pitch, yaw);
  Isometry3d T = Isometry3d::Identity();
  for (int k = 0; k < 9; ++k) T.linear()(k / 3, k % 3) = R(k / 3, k % 3);
  T.translation() = xyz;
  return T;
}

// Of a link in the root link's frame, by KDL.
Isometry3d ByKdl(const std::string& link, const std::vector<double>& q) {
  KDL::Tree tree;
  EXPECT_TRUE(kdl_parser::treeFromString(kArm, tree));
  KDL::Chain chain;
  if (!tree.getChain("root", link, chain)) return Isometry3d::Identity();
  KDL::JntArray positions(chain.getNrOfJoints());
  for (unsigned j = 0; j < chain.getNrOfJoints(); ++j) positions(j) = q[j];
  KDL::Frame frame;
  KDL::ChainFkSolverPos_recursive(chain).JntToCart(positions, frame);
  Isometry3d T = Isometry3d::Identity();
  for (int k = 0; k < 9; ++k) T.linear()(k / 3, k % 3) = frame.M(k / 3, k % 3);
  T.translation() = Vector3d(frame.p.x(), frame.p.y(), frame.p.z());
  return T;
}

// Of a shape in the base frame, by the robot's DH rows.
Isometry3d ByRows(const codegen::Robot& robot, const Shape& shape, const std::vector<double>& q) {
  Isometry3d T = Isometry3d::Identity();
  for (int k = 0; k < shape.body; ++k) {
    if (k == 0) T = codegen::ToPose(robot.base_xyz_m, robot.base_rotation);
    T = T * codegen::ModifiedDh(robot.joint[k].kinematics, q[k]);
  }
  return T * codegen::ToPose(shape.xyz_m, shape.rotation);
}

TEST(UrdfShapes, AreWhereKdlHasTheirLinks) {
  const files::test::TemporaryFolder folder;
  folder.Write("arm.urdf", kArm);
  // A base frame that is turned and raised, and a capsule in the place of the ball.
  const codegen::Robot robot = codegen::ReadRobot(folder.Write(
      "arm.toml",
      AroundUrdf("base_frame = { xyz_m = [0.0, 0.0, 2.0], rpy_deg = [0.0, 0.0, 90.0] }\n"
                 "[[capsule]]\nlink = \"b\"\nfrom_m = [0.1, 0.0, 0.0]\nto_m = [0.1, 0.3, 0.4]\nradius_m = 0.06\n")));
  const Isometry3d base = PoseOf({0, 0, 2}, 0, 0, std::acos(-1) / 2);
  const std::map<std::string, Isometry3d> in_link = {{"root", PoseOf({0.1, 0.2, 0.3}, 0.3, 0, 0)},
                                                     {"a", PoseOf({0.01, 0.02, 0.03}, 0.1, 0.2, 0.3)},
                                                     {"flange", PoseOf({0, 0, 0.1}, 0, 0.5, 0)}};
  ASSERT_EQ(robot.shape.size(), 4U);
  for (const std::vector<double>& q : {std::vector<double>{0, 0, 0}, {0.4, -1.1, 0.2}, {-1.7, 0.6, 0.45}})
    for (const Shape& shape : robot.shape) {
      const Isometry3d found = ByRows(robot, shape, q), link = base * ByKdl(shape.link, q);
      if (shape.link == "b") {
        const Vector3d half(0, 0, shape.size_m[1] / 2);
        EXPECT_LT((found * half - link * Vector3d(0.1, 0.3, 0.4)).norm(), 1e-9);
        EXPECT_LT((found * -half - link * Vector3d(0.1, 0, 0)).norm(), 1e-9);
        EXPECT_EQ(shape.size_m[0], 0.06);
        EXPECT_EQ(shape.body, 2);
        continue;
      }
      EXPECT_LT((found.matrix() - (link * in_link.at(shape.link)).matrix()).cwiseAbs().maxCoeff(), 1e-9) << shape.link;
    }
  EXPECT_EQ(robot.shape[0].body, 0);
  EXPECT_EQ(robot.shape[1].kind, Shape::Kind::kCylinder);
  EXPECT_EQ(robot.shape[1].size_m, (std::array<double, 3>{0.05, 0.4, 0}));
  EXPECT_EQ(robot.shape[2].body, 3);
  EXPECT_EQ(robot.shape[2].size_m, (std::array<double, 3>{0.001, 0.001, 0.002}));
  EXPECT_TRUE(robot.shape[2].file.empty());
}

TEST(UrdfShapes, FaultsOfCapsules_AreNamedTogether) {
  const files::test::TemporaryFolder folder;
  folder.Write("arm.urdf", kArm);
  const std::string error = files::test::ErrorOf([&] {
    codegen::ReadRobot(folder.Write(
        "arm.toml",
        AroundUrdf("[[capsule]]\nlink = \"flang\"\nfrom_m = [1.0, 0.0]\nto_m = [0, 0, 0]\nradius_m = 0\n"
                   "[[capsule]]\nlink = \"a\"\nfrom_m = [100.0, 0, 0]\nto_m = [0, 0, 0]\nradius_m = 60.0\n")));
  });
  for (const char* part : {"capsule[1].link", "the nearest is flange", "capsule[1].from_m", "capsule[1].radius_m",
                           "capsule[2].from_m", "millimetres"})
    EXPECT_NE(error.find(part), std::string::npos) << error;
}

TEST(MeshFile, IsLookedForWhereThePageSays) {
  const files::test::TemporaryFolder folder;
  const fs::path top = folder / "ws";
  for (const char* place : {"above/arm_description/urdf", "above/arm_description/meshes", "given/meshes",
                            "ros/arm_description/meshes", "ament/share/arm_description/meshes"})
    fs::create_directories(top / place);
  const fs::path urdf = top / "above/arm_description/urdf/arm.urdf", mesh = "meshes/f.stl";
  const auto put = [&](const fs::path& path) { std::ofstream(path) << "solid"; };
  const std::string name = "package://arm_description/meshes/f.stl";
  using Packages = std::map<std::string, fs::path>;
  unsetenv("ROS_PACKAGE_PATH"), unsetenv("AMENT_PREFIX_PATH");
  EXPECT_EQ(codegen::MeshFile(name, urdf, {}), fs::path());
  put(top / "above/arm_description" / mesh);
  EXPECT_EQ(codegen::MeshFile(name, urdf, {}), top / "above/arm_description" / mesh);
  put(top / "ament/share/arm_description" / mesh);
  setenv("AMENT_PREFIX_PATH", ("/nothing:" + (top / "ament").string()).c_str(), 1);
  EXPECT_EQ(codegen::MeshFile(name, urdf, {}), top / "ament/share/arm_description" / mesh);
  put(top / "ros/arm_description" / mesh);
  setenv("ROS_PACKAGE_PATH", (top / "ros").c_str(), 1);
  EXPECT_EQ(codegen::MeshFile(name, urdf, {}), top / "ros/arm_description" / mesh);
  EXPECT_EQ(codegen::MeshFile(name, urdf, Packages{{"arm_description", top / "given"}}), fs::path())
      << "what is given counts alone";
  put(top / "given" / mesh);
  EXPECT_EQ(codegen::MeshFile(name, urdf, Packages{{"arm_description", top / "given"}}), top / "given" / mesh);
  unsetenv("ROS_PACKAGE_PATH"), unsetenv("AMENT_PREFIX_PATH");
  EXPECT_EQ(codegen::MeshFile("../meshes/f.stl", urdf, {}), top / "above/arm_description" / mesh);
  EXPECT_EQ(codegen::MeshFile("file://" + (top / "given" / mesh).string(), urdf, {}), top / "given" / mesh);
  EXPECT_EQ(codegen::MeshFile("file://nothing", urdf, {}), fs::path());
  EXPECT_EQ(codegen::MeshFile("package://", urdf, {}), fs::path());
}

TEST(Import, WritesWhereThePackagesLie_AndNamesMeshesThatAreNotThere) {
  const files::test::TemporaryFolder folder;
  const fs::path urdf = folder.Write("arm.urdf", kArm);
  const auto said = [](const codegen::ImportedRobot& imported) {
    std::string all;
    for (const std::string& line : imported.said) all += line + "\n";
    return all;
  };
  EXPECT_NE(said(codegen::ImportUrdf({urdf, "", {}, {}}, "arm", folder / "arm.toml"))
                .find("--package arm_description=FOLDER"),
            std::string::npos);
  fs::create_directories(folder / "desc/meshes");
  std::ofstream(folder / "desc/meshes/f.stl") << "solid";
  const auto imported =
      codegen::ImportUrdf({urdf, "", {}, {{"arm_description", folder / "desc"}}}, "arm", folder / "arm.toml");
  EXPECT_EQ(said(imported).find("--package"), std::string::npos);
  const codegen::Robot robot = codegen::ReadRobot(folder.Write("arm.toml", imported.text));
  EXPECT_EQ(robot.shape.back().file, folder / "desc/meshes/f.stl");
}

// The robot file may lie anywhere beside the URDF, and its name becomes a C++ name.
TEST(Import, FindsTheUrdfFromTheRobotFilesOwnFolder) {
  const files::test::TemporaryFolder folder;
  fs::create_directories(folder / "here"), fs::create_directories(folder / "robots/mine");
  const fs::path urdf = folder.Write("here/arm.urdf", kArm);
  const auto begin = fs::current_path();
  fs::current_path(folder / "here");
  for (const char* file : {"arm.toml", "../robots/arm.toml", "../robots/mine/arm.toml", "./../here/arm.toml"}) {
    const codegen::ImportedRobot imported = codegen::ImportUrdf({"arm.urdf", "", {}, {}}, "7dof-arm", file);
    std::ofstream(file) << imported.text;
    EXPECT_EQ(codegen::ReadRobot(file).name, "arm_7dof_arm") << file;
  }
  fs::current_path(begin);
}

}  // namespace
}  // namespace armcal::tests
