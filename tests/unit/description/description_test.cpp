// description tests - exported files against KDL: the torque of what is read from them is that of the identified
// bodies.
#include <gtest/gtest.h>
#include <tinyxml2.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iomanip>
#include <kdl/tree.hpp>
#include <kdl/treeidsolver_recursive_newton_euler.hpp>
#include <kdl_parser/kdl_parser.hpp>
#include <random>
#include <regex>
#include <sstream>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/robot/urdf.hpp"
#include "host_sim/identify/description/described_arm.hpp"
#include "tests/unit/codegen/kdl_arm.hpp"

namespace armcal::description {
namespace {

namespace fs = std::filesystem;

// A hand that is fixed to the last link, a finger that moves on it, a slide, right angles, comments, odd spacing.
const char* const kUrdf = R"(<?xml version="1.0"?>
<!-- an arm <link name="up"> of our own -->
<robot name="odd">
  <link name="base"><inertial><mass value="7"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name='up'   >
    <visual><geometry><box size="1 2 3"/></geometry></visual>
    <inertial>
      <origin xyz="0.01 -0.03 0.1" rpy="0.1 0.2 0.3"/><mass value="4.2"/>
      <inertia ixx="0.04" ixy="0.001" ixz="0.002" iyy="0.038" iyz="-0.003" izz="0.015"/>
    </inertial>
  </link>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="up"/><origin xyz="0.1 0 0.4"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="80" velocity="2"/>
    <dynamics damping="0.003" friction="0"/>   <safety_controller k_velocity="10"/>
  </joint>
  <link name="arm"><inertial><mass value="3"/><origin xyz="0.2 0 0.02"/><inertia ixx="0.01" ixy="0" ixz="0.001" iyy="0.05" iyz="0" izz="0.05"/></inertial></link>
  <joint name="lift" type="revolute"><parent link="up"/><child link="arm"/><origin xyz="0 0.1 0.3" rpy="-1.5707963267948966 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="60" velocity="2"/></joint>
  <link name="quill"><inertial><mass value="1.5"/><origin xyz="0 0 0.05"/><inertia ixx="0.008" ixy="0" ixz="0" iyy="0.008" iyz="0" izz="0.003"/></inertial></link>
  <joint name="push" type="prismatic"><parent link="arm"/><child link="quill"/><origin xyz="0.4 0 0" rpy="0 1.5707963267948966 0"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.3" effort="200" velocity="1"/></joint>
  <link name="hand"><inertial><mass value="0.8"/><origin xyz="0.01 0.02 0.1" rpy="0 0 0.4"/><inertia ixx="0.002" ixy="0" ixz="0" iyy="0.0022" iyz="0" izz="0.001"/></inertial></link>
  <joint name="to_hand" type="fixed"><parent link="quill"/><child link="hand"/><origin xyz="0 0 0.1" rpy="0.3 0.2 0.7"/></joint>
  <link name="finger"><inertial><mass value="0.2"/><origin xyz="0.01 0 0.02"/><inertia ixx="0.0002" ixy="0" ixz="0" iyy="0.0002" iyz="0" izz="0.0001"/></inertial></link>
  <joint name="grip" type="prismatic"><parent link="hand"/><child link="finger"/><origin xyz="0 0.02 0.1"/><axis xyz="0 1 0"/>
    <limit lower="0.01" upper="0.05" effort="20" velocity="1"/></joint>
</robot>
)";

const char* const kRobot = R"(name = "odd"
source = "test"
urdf = "arm.urdf"
tip = "hand"
fixed = { grip = 0.03 }
gravity_mps2 = [0.0, 0.0, -9.81]
[[joint]]
name = "turn"
acceleration_limit_radps2 = 10.0
torque_noise_Nm = 0.1
v_min_radps = 0.01
[[joint]]
name = "lift"
acceleration_limit_radps2 = 10.0
torque_noise_Nm = 0.1
v_min_radps = 0.01
[[joint]]
name = "push"
acceleration_limit_mps2 = 5.0
torque_noise_N = 0.1
v_min_mps = 0.01
[[effect]]
name = "stribeck"
joints = [2]
mean = { dFs = 0.7 }
)";

const codegen::Catalogue& Records() {
  static const codegen::Catalogue records = codegen::ReadCatalogue("codegen/effects");
  return records;
}

class Export : public testing::Test {
 protected:
  Export() : folder_(fs::temp_directory_path() / ("armcal_description_" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
    Write("arm.urdf", kUrdf), Write("arm.toml", kRobot);
    model_ = std::make_unique<codegen::Model>(codegen::ReadRobot(folder_ / "arm.toml"), Records());
    given_ = calibration::GivenByRobot(*model_);
    // An identified arm: every body parameter about the centre is another, and so are friction and rotors.
    for (int j = 0; j < 3; ++j) {
      Eigen::VectorXd c = calibration::ToCentre(given_.bodies.segment(11 * j, 10));
      c[0] *= 1.13, c[1] += 0.004, c[2] -= 0.003, c[3] += 0.005, c.tail(6) *= 1.07;
      given_.bodies.segment(11 * j, 10) = calibration::ToOrigin(c);
      given_.bodies[11 * j + 10] = 0.3 + 0.1 * j;
    }
    for (int c = 0; c < model_->columns(); ++c)
      if (!model_->is_rigid(c) && model_->column_name(c).size() == 3) given_.x[c] = 1.25 + 0.125 * c;
    arm_ = Describe(*model_, given_, "table.toml");
  }
  ~Export() override { fs::remove_all(folder_); }

  void Write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }

  // Torque of the identified bodies by KDL, from the robot's DH rows.
  Eigen::MatrixXd Expected(bool moving) {
    Eigen::VectorXd bodies = given_.bodies;
    for (int j = 0; j < 3; ++j) bodies[11 * j + 10] = 0;
    tests::KdlArm kdl(model_->robot(), bodies);
    Eigen::MatrixXd out(kStates, 3);
    for (int k = 0; k < kStates; ++k) {
      const Eigen::MatrixXd s = State(k, moving);
      out.row(k) = kdl.Torque(s.col(0), s.col(1), s.col(2));
    }
    return out;
  }
  // Of a KDL tree whose joints have these names; others stand at `held`.
  static Eigen::MatrixXd Torques(const KDL::Tree& tree, const std::map<std::string, double>& held, bool moving) {
    std::map<std::string, unsigned> at;
    for (const auto& [name, s] : tree.getSegments()) at[s.segment.getJoint().getName()] = s.q_nr;
    const unsigned n = tree.getNrOfJoints();
    KDL::TreeIdSolver_RNE solver(tree, KDL::Vector(0, 0, -9.81));
    Eigen::MatrixXd out(kStates, 3);
    for (int k = 0; k < kStates; ++k) {
      const Eigen::MatrixXd s = State(k, moving);
      KDL::JntArray q(n), qd(n), qdd(n), tau(n);
      for (const auto& [name, position] : held) q(at.at(name)) = position;
      const char* const name[] = {"turn", "lift", "push"};
      for (int j = 0; j < 3; ++j)
        q(at.at(name[j])) = s(j, 0), qd(at.at(name[j])) = s(j, 1), qdd(at.at(name[j])) = s(j, 2);
      EXPECT_GE(solver.CartToJnt(q, qd, qdd, {}, tau), 0);
      for (int j = 0; j < 3; ++j) out(k, j) = tau(at.at(name[j]));
    }
    return out;
  }
  static double Relative(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
    return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
  }
  static Eigen::MatrixXd State(int k, bool moving) {
    std::mt19937_64 random(static_cast<std::uint64_t>(k) + 5);
    std::uniform_real_distribution<double> uniform(-1, 1);
    Eigen::MatrixXd s(3, 3);
    for (double& v : s.reshaped()) v = uniform(random);
    if (!moving) s.rightCols(2).setZero();
    return s;
  }
  static constexpr int kStates = 50;

  fs::path folder_;
  std::unique_ptr<codegen::Model> model_;
  calibration::Given given_;
  DescribedArm arm_;
};

KDL::Tree Tree(const std::string& urdf) {
  KDL::Tree tree;
  EXPECT_TRUE(kdl_parser::treeFromString(urdf, tree));
  return tree;
}

TEST_F(Export, ToGivenUrdf_HasTheTorqueOfTheIdentifiedBodies_ReadByOthersAndByUs) {
  for (const bool merge : {false, true}) {
    SCOPED_TRACE(merge);
    const Description d = ToGivenUrdf(arm_, "", merge);
    EXPECT_LT(Relative(Torques(Tree(d.text), {{"grip", 0.03}}, true), Expected(true)), 1e-9);
    Write("arm.urdf", d.text);
    const codegen::Robot again = codegen::ReadRobot(folder_ / "arm.toml");
    Write("arm.urdf", kUrdf);
    for (std::size_t j = 0; j < 3; ++j) {
      EXPECT_NEAR(again.joint[j].link.mass_kg, arm_.joint[j].body.mass_kg, 1e-12);
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(again.joint[j].link.center_m[k], arm_.joint[j].body.center_m[k], 1e-11);
      for (std::size_t k = 0; k < 6; ++k)
        EXPECT_NEAR(again.joint[j].link.inertia_kgm2[k], arm_.joint[j].body.inertia_kgm2[k], 1e-11);
      EXPECT_EQ(again.joint[j].nominal.at("Fc"), arm_.joint[j].coulomb_Nm);
      EXPECT_EQ(again.joint[j].nominal.at("Fv"), arm_.joint[j].viscous_Nmsprad);
    }
  }
}

// The hand's and the finger's inertials are what they were, and so is every byte but those of three links and joints.
TEST_F(Export, ToGivenUrdf_ChangesNothingElse) {
  const auto without = [](std::string text) {
    for (const char* link : {"up", "arm", "quill"}) {
      text = std::regex_replace(text, std::regex(std::string("(<link name=['\"]") + link + "['\"] *)/>"), "$1></link>");
      text = std::regex_replace(text,
                                std::regex(std::string("(<link name=['\"]") + link +
                                           "['\"] *>(?:(?!</link>)[^])*?)\\s*<inertial>[^]*?</inertial>"),
                                "$1");
      text = std::regex_replace(text, std::regex(std::string("(<link name=['\"]") + link + "['\"] *>)\\s*</link>"),
                                "$1</link>");
    }
    return std::regex_replace(text, std::regex("\\s*<dynamics[^>]*>"), "");
  };
  const std::string now = ToGivenUrdf(arm_, "", false).text;
  EXPECT_EQ(without(now), without(kUrdf));
  const auto parsed = [](const std::string& text) {
    const KDL::Tree tree = Tree(text);
    return std::pair(tree.getSegment("hand")->second.segment.getInertia().getMass(),
                     tree.getSegment("finger")->second.segment.getInertia().getMass());
  };
  EXPECT_EQ(parsed(now), parsed(kUrdf));
}

// Within the elements that change, too: comments, other elements and other attributes stay.
TEST_F(Export, ToGivenUrdf_ChangesOnlyTheValuesOfTheElementsItKnows) {
  std::string text = kUrdf;
  const auto put = [&text](const std::string& old, const std::string& with) {
    ASSERT_NE(text.find(old), text.npos) << old;
    text.replace(text.find(old), old.size(), with);
  };
  put("<dynamics damping=\"0.003\" friction=\"0\"/>",
      "<dynamics mu='16' damping = '0.003' stiffness=\"7\" ><!-- of a bench --><own/></dynamics>");
  put("<mass value=\"4.2\"/>",
      "<!-- <mass value=\"9\"/> weighed -->  <mass unit=\"kg\" value='4.2'/><vendor x=\"1\"/>");
  Write("arm.urdf", text);
  const Description d = ToGivenUrdf(arm_, "", false);
  for (const char* kept : {"mu='16' damping = '", "stiffness=\"7\" ><!-- of a bench --><own/></dynamics>",
                           "<!-- <mass value=\"9\"/> weighed -->  <mass unit=\"kg\" value='", "'/><vendor x=\"1\"/>"})
    EXPECT_NE(d.text.find(kept), d.text.npos) << kept;
  EXPECT_EQ(d.text.find("'0.003'"), d.text.npos);
  for (const char* attribute : {"mu", "stiffness"})
    EXPECT_EQ(std::count(d.left_out.begin(), d.left_out.end(),
                         std::string(attribute) + " of <dynamics>: the file's own value stays in turn"),
              1);
  EXPECT_LT(Relative(Torques(Tree(d.text), {{"grip", 0.03}}, true), Expected(true)), 1e-9);
}

TEST_F(Export, ToGivenUrdf_WhereTheRestCannotExist_AsksForMerge) {
  given_.bodies[22] = 0.5;  // lighter than hand and finger
  Eigen::VectorXd c = calibration::ToCentre(given_.bodies.segment(22, 10));
  c << 0.5, 0, 0, 0.1, 0.01, 0, 0, 0.01, 0, 0.01;
  given_.bodies.segment(22, 10) = calibration::ToOrigin(c);
  arm_ = Describe(*model_, given_, "table.toml");
  try {
    ToGivenUrdf(arm_, "", false);
    FAIL() << "accepted";
  } catch (const io::InputError& e) {
    const std::string line = e.what();
    EXPECT_NE(line.find("link \"quill\" without hand, finger: expected a mass above zero"), line.npos) << line;
    EXPECT_NE(line.find("--merge"), line.npos) << line;
  }
  std::string bare = kUrdf;  // a link without anything in it
  const auto begin = bare.find("<link name=\"quill\">"), end = bare.find("</link>", begin) + 7;
  Write("arm.urdf", bare.replace(begin, end - begin, "<link name=\"quill\"/>"));
  EXPECT_LT(Relative(Torques(Tree(ToGivenUrdf(arm_, "", true).text), {{"grip", 0.03}}, true), Expected(true)), 1e-9);
}

TEST_F(Export, OfAnotherArmsUrdf_IsRefused) {
  std::string other = kUrdf;
  other.replace(other.find("0.4 0 0\" rpy"), 3, "0.5");
  Write("other.urdf", other);
  EXPECT_THROW(ToGivenUrdf(arm_, (folder_ / "other.urdf").string(), false), io::InputError);
  arm_.robot.urdf.path.clear();
  EXPECT_THROW(ToGivenUrdf(arm_, "", false), io::InputError);
}

TEST_F(Export, SaysWhatAFormatCannotHold) {
  const auto holds = [](const Description& d, const std::string& what) {
    return std::any_of(d.left_out.begin(), d.left_out.end(),
                       [&](const std::string& line) { return line.find(what) != line.npos; });
  };
  for (const Description& d : {ToGivenUrdf(arm_, "", false), ToSdf(arm_)}) {
    EXPECT_TRUE(holds(d, "rotor inertia of lift = 0.4 kg*m^2"));
    EXPECT_TRUE(holds(d, "stribeck.dFs2 = 0.7"));
  }
  EXPECT_FALSE(holds(ToMjcf(arm_), "rotor"));
  EXPECT_TRUE(holds(ToMjcf(arm_), "stribeck.dFs2 = 0.7"));
  EXPECT_TRUE(ToYaml(arm_).left_out.empty());
  EXPECT_TRUE(ToHeader(arm_).left_out.empty());
}

std::vector<double> Numbers(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<double>(in), {}};
}
KDL::Vector Vector(const std::vector<double>& v, std::size_t at = 0) { return {v[at], v[at + 1], v[at + 2]}; }
KDL::Joint AxisZ(const std::string& name, bool slide) {
  return KDL::Joint(name, slide ? KDL::Joint::TransZ : KDL::Joint::RotZ);
}

KDL::Frame FrameOf(const tinyxml2::XMLElement* e) {
  const auto of = [e](const char* name, const char* none) {
    return Numbers(e->Attribute(name) ? e->Attribute(name) : none);
  };
  const auto quat = of("quat", "1 0 0 0");
  return {KDL::Rotation::Quaternion(quat[1], quat[2], quat[3], quat[0]), Vector(of("pos", "0 0 0"))};
}

// Reads what the test needs of MJCF, by itself: nested bodies with one joint or none, all attributes written out.
void AddBody(const tinyxml2::XMLElement* body, const std::string& parent, KDL::Tree& tree) {
  const std::string name = body->Attribute("name");
  tree.addSegment(KDL::Segment(name + "_place", KDL::Joint(KDL::Joint::None), FrameOf(body)), parent);
  KDL::RigidBodyInertia own = KDL::RigidBodyInertia::Zero();
  if (const auto* inertial = body->FirstChildElement("inertial")) {
    const auto d = Numbers(inertial->Attribute("diaginertia"));
    own = FrameOf(inertial) * KDL::RigidBodyInertia(inertial->DoubleAttribute("mass"), KDL::Vector::Zero(),
                                                    KDL::RotationalInertia(d[0], d[1], d[2]));
  }
  KDL::Joint joint(KDL::Joint::None);
  if (const auto* j = body->FirstChildElement("joint"))
    joint = KDL::Joint(j->Attribute("name"), Vector(Numbers(j->Attribute("pos") ? j->Attribute("pos") : "0 0 0")),
                       Vector(Numbers(j->Attribute("axis"))),
                       std::string(j->Attribute("type")) == "slide" ? KDL::Joint::TransAxis : KDL::Joint::RotAxis);
  tree.addSegment(KDL::Segment(name, joint, KDL::Frame::Identity(), own), name + "_place");
  for (const auto* b = body->FirstChildElement("body"); b; b = b->NextSiblingElement("body")) AddBody(b, name, tree);
}

// The same arm as the URDF's in another one's hands: elsewhere, turned, with other link frames and zeros, and with all
// that a simulation has beside.
const char* const kMjcf = R"(<?xml version="1.0"?>
<!-- <joint name="turn"/> of our own -->
<mujoco model="odd">
  <compiler angle="degree" eulerseq="XYZ" meshdir="m"/>
  <default><joint axis="0 1 0" damping="9"/><geom mass="3"/>
    <default class="tool"><joint axis="0 0 1"/><geom mass="0"/></default>
  </default>
  <worldbody>
    <light pos="0 0 3"/>
    <body name="pedestal" pos="1 2 0.5" quat="0.70710678118654752 0 0 0.70710678118654752">
      <geom type="box" size="1 1 1"/>
      <body name="up" pos="0.1 0 0" quat="1 0 0 0"><joint name='turn' type="hinge" axis='0 0 2' stiffness="2"/>
        <inertial pos="1 1 1" mass="99" fullinertia="1 1 1 0 0 0"/>
        <geom type="capsule" size="0.1 0.2"/>
        <body name="arm" pos="0 0.3 0.7"><joint name="lift" type="hinge" pos="0 -0.2 0"/>
          <body name="quill" pos="0.4 -0.2 0" quat="0.5 0.5 0.5 0.5" childclass="tool">
            <!-- the tool --><joint name="push" type="slide"/>
            <body name="hand" pos="0 0 0.1" euler="17.188733853924695 11.459155902616466 220.107045659157624">
              <geom type="sphere" size="1"/>
              <inertial pos="0.01 0.02 0.1" quat="0.98006657784124163 0 0 0.19866933079506122" mass="0.8" diaginertia="0.002 0.0022 0.001"/>
              <body name="finger" pos="0 0.05 0.1"><joint name="grip" type="slide" axis="0 1 0" ref="0.05"/>
                <inertial mass="0.2" pos="0.01 0 0.02" fullinertia="0.0002 0.0002 0.0001 0 0 0"/></body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="turn"/></actuator>
</mujoco>
)";

TEST_F(Export, ToMjcf_HasTheTorqueArmatureAndFriction) {
  tinyxml2::XMLDocument doc;
  ASSERT_EQ(doc.Parse(ToMjcf(arm_).text.c_str()), tinyxml2::XML_SUCCESS);
  const auto* world = doc.RootElement()->FirstChildElement("worldbody");
  KDL::Tree tree("world");
  AddBody(world->FirstChildElement("body"), "world", tree);
  EXPECT_LT(Relative(Torques(tree, {}, true), Expected(true)), 1e-9);
  EXPECT_LT(Relative(Torques(tree, {}, false), Expected(false)), 1e-9);  // gravity
  const auto* body = world->FirstChildElement("body");
  for (std::size_t j = 0; j < 3; ++j, body = body->FirstChildElement("body")) {
    const auto* joint = body->FirstChildElement("joint");
    EXPECT_EQ(joint->DoubleAttribute("armature"), arm_.joint[j].rotor_kgm2);
    EXPECT_EQ(joint->DoubleAttribute("damping"), arm_.joint[j].viscous_Nmsprad);
    EXPECT_EQ(joint->DoubleAttribute("frictionloss"), arm_.joint[j].coulomb_Nm);
    EXPECT_GT(arm_.joint[j].coulomb_Nm, 1);
  }
}

// The tree of kMjcf. What its classes and its units say is written out, for the reader of the test.
KDL::Tree GivenTree(std::string text) {
  const std::pair<const char*, const char*> written_out[] = {
      {"name=\"lift\"", "name=\"lift\" axis=\"0 1 0\""},
      {"name=\"push\"", "name=\"push\" axis=\"0 0 1\""},
      {"euler=\"[^\"]*\"", ""},
      {"fullinertia=\"0.0002[^\"]*\"", "diaginertia=\"0.0002 0.0002 0.0001\""}};
  double x = 0, y = 0, z = 0, w = 1;
  KDL::Rotation::RPY(0.3, 0.2, 0.7 + M_PI).GetQuaternion(x, y, z, w);
  for (const auto& [old, with] : written_out) {
    const bool turned = std::string(old).starts_with("euler");
    std::ostringstream quat;
    quat << std::setprecision(17) << "quat=\"" << w << " " << x << " " << y << " " << z << "\"";
    text = std::regex_replace(text, std::regex(old), turned ? quat.str() : with);
  }
  tinyxml2::XMLDocument doc;
  EXPECT_EQ(doc.Parse(text.c_str()), tinyxml2::XML_SUCCESS);
  KDL::Tree tree("world");
  AddBody(doc.RootElement()->FirstChildElement("worldbody")->FirstChildElement("body"), "world", tree);
  return tree;
}

TEST_F(Export, ToGivenMjcf_HasTheTorqueOfTheIdentifiedBodies_InTheFilesOwnFrames) {
  for (const bool merge : {false, true}) {
    SCOPED_TRACE(merge);
    const KDL::Tree tree = GivenTree(ToGivenMjcf(arm_, "m.xml", kMjcf, merge).text);
    EXPECT_LT(Relative(Torques(tree, {}, true), Expected(true)), 1e-9);
    const double hand = tree.getSegment("hand")->second.segment.getInertia().getMass();
    EXPECT_EQ(hand, merge ? 0.0 : 0.8);
    EXPECT_GT(tree.getSegment("finger")->second.segment.getInertia().getMass(), 0);  // MuJoCo moves it
  }
}

TEST_F(Export, ToGivenMjcf_ChangesNothingElse) {
  const auto without = [](std::string text) {
    text = std::regex_replace(text, std::regex("<inertial[^>]*>"), "<inertial/>");
    text = std::regex_replace(text, std::regex("\\s*<inertial/>(?!</body>\\s*</body>)"), "");  // but the finger's
    for (const char* attribute : {"armature", "damping", "frictionloss"})
      text = std::regex_replace(text, std::regex(std::string(" ") + attribute + "=\"(?!9\")[^\"]*\""), "");
    return text;
  };
  const Description d = ToGivenMjcf(arm_, "m.xml", kMjcf, false);
  EXPECT_EQ(without(d.text), without(kMjcf));
  EXPECT_NE(d.text.find("<inertial mass=\"0.2\" pos=\"0.01 0 0.02\" fullinertia"), d.text.npos);
  tinyxml2::XMLDocument doc;
  ASSERT_EQ(doc.Parse(d.text.c_str()), tinyxml2::XML_SUCCESS);
  const auto* body = doc.RootElement()->FirstChildElement("worldbody")->FirstChildElement("body");
  for (std::size_t j = 0; j < 3; ++j) {
    body = body->FirstChildElement("body");
    const auto* joint = body->FirstChildElement("joint");
    EXPECT_EQ(joint->DoubleAttribute("armature"), arm_.joint[j].rotor_kgm2);
    EXPECT_EQ(joint->DoubleAttribute("damping"), arm_.joint[j].viscous_Nmsprad);
    EXPECT_EQ(joint->DoubleAttribute("frictionloss"), arm_.joint[j].coulomb_Nm);
  }
  EXPECT_EQ(std::count(d.left_out.begin(), d.left_out.end(), "stiffness: the file's own value stays in turn"), 1);
}

TEST_F(Export, ToGivenMjcf_RefusesWhatItCannotWriteInto) {
  const auto changed = [](const std::string& old, const std::string& with) {
    std::string text = kMjcf;
    EXPECT_NE(text.find(old), text.npos) << old;
    return text.replace(text.find(old), old.size(), with);
  };
  const std::pair<std::string, const char*> cases[] = {
      {changed("name=\"lift\"", "name=\"elbow\""), "no joint \"lift\""},
      {changed("pos=\"0 -0.2 0\"/>", "pos=\"0.1 -0.2 0\"/>"), "m away from the arm's"},
      {changed("axis='0 0 2'", "axis='0 0 -2'"), "3.14 rad away"},
      {changed("name=\"push\" type=\"slide\"", "name=\"push\" type=\"hinge\""), "joint \"push\": turns"},
      {changed("<geom type=\"sphere\" size=\"1\"/>\n              <inertial",
               "<geom type=\"sphere\" mass=\"1\"/><other"),
       "its mass follows from its geoms"},
      {changed("meshdir=\"m\"", "inertiafromgeom=\"true\""), "inertiafromgeom"},
      {changed("meshdir=\"m\"", "settotalmass=\"4\""), "settotalmass"},
      {changed("\"XYZ\"", "\"XY\""), "eulerseq"},
      {changed("<light pos=\"0 0 3\"/>", "<light>"), "<light> without its end tag"},
      {changed("<actuator>", "<include file=\"x.xml\"/><actuator>"), "one whole file"},
      {changed("mass=\"0.8\"", "mass=\"heavy\""), "expected 1 numbers"},
      {changed("mass=\"0.8\"", "mass=\"80\""), "link \"quill\" without hand, finger: expected a mass above zero"},
      {"<robot/>", "expected MJCF"}};
  for (const auto& [text, expected] : cases) {
    try {
      ToGivenMjcf(arm_, "m.xml", text, false);
      ADD_FAILURE() << "accepted: " << expected;
    } catch (const io::InputError& e) {
      EXPECT_NE(std::string(e.what()).find(expected), std::string::npos) << e.what();
      EXPECT_EQ(std::string(e.what()).rfind("m.xml: ", 0), 0u) << e.what();
    }
  }
  EXPECT_NO_THROW(
      ToGivenMjcf(arm_, "m.xml", changed("size=\"1\"/>\n              <inertial", "size=\"1\"/><other"), false));
}

TEST_F(Export, ToGivenSdf_WritesTheValuesOfAFileThatHadOthers) {
  const std::string whole = ToSdf(arm_).text;
  std::string given = std::regex_replace(whole, std::regex("<mass>[^1][^<]*</mass>"), "<mass>\n  99 </mass>");
  given = std::regex_replace(given, std::regex("<ixx>[^<]*</ixx>"), "<!-- of the maker --><ixx>7</ixx>");
  given = std::regex_replace(given, std::regex("<damping>[^<]*</damping>"), "<damping/>");
  const std::string now = ToGivenSdf(arm_, "m.sdf", given).text;
  EXPECT_EQ(now, whole);
  const std::string turned = std::regex_replace(whole, std::regex("(<inertial>\\s*)<pose>([^<]*) 0 0 0</pose>"),
                                                "$1<pose rotation_format='quat_xyzw'>0 0 0 0 0 0 1</pose>");
  ASSERT_NE(turned, whole);
  EXPECT_EQ(ToGivenSdf(arm_, "m.sdf", turned).text,
            std::regex_replace(whole, std::regex("(<inertial>\\s*)<pose>([^<]*) 0 0 0</pose>"),
                               "$1<pose rotation_format='quat_xyzw'>$2 0 0 0 1</pose>"));
  for (const auto& [old, with, expected] : std::vector<std::array<const char*, 3>>{
           {"<joint name=\"lift\"", "<joint name=\"elbow\"", "no joint \"lift\""},
           {"<xyz>0 0 1</xyz>", "<xyz>0 1 1</xyz>", "rad away"},
           {"relative_to=\"turn_link\"", "relative_to=\"lift_link\"", "leads to itself"},
           {"relative_to=\"turn_link\"", "relative_to=\"other\"", "no link or frame \"other\""},
           {"<mass>1</mass>", "<mass>1</wrong>", "end tag"},
           {"type=\"prismatic\"", "type=\"screw\"", "not \"screw\""}}) {
    std::string text = whole;
    ASSERT_NE(text.find(old), text.npos) << old;
    text.replace(text.find(old), std::string(old).size(), with);
    try {
      ToGivenSdf(arm_, "m.sdf", text);
      ADD_FAILURE() << "accepted: " << expected;
    } catch (const io::InputError& e) {
      EXPECT_NE(std::string(e.what()).find(expected), std::string::npos) << e.what();
    }
  }
}

TEST_F(Export, ToSdf_HasTheTorqueAndFriction) {
  tinyxml2::XMLDocument doc;
  ASSERT_EQ(doc.Parse(ToSdf(arm_).text.c_str()), tinyxml2::XML_SUCCESS);
  const auto* model = doc.RootElement()->FirstChildElement("model");
  KDL::Tree tree("base");
  std::map<std::string, const tinyxml2::XMLElement*> joint_of;
  for (const auto* j = model->FirstChildElement("joint"); j; j = j->NextSiblingElement("joint"))
    joint_of[j->FirstChildElement("child")->GetText()] = j;
  int moving = 0;
  for (const auto* l = model->FirstChildElement("link"); l; l = l->NextSiblingElement("link")) {
    const std::string name = l->Attribute("name");
    if (name == "base") continue;
    const auto* joint = joint_of.at(name);
    const auto* pose = l->FirstChildElement("pose");
    EXPECT_STREQ(pose->Attribute("relative_to"), joint->FirstChildElement("parent")->GetText());
    const auto p = Numbers(pose->GetText());
    tree.addSegment(KDL::Segment(name + "_place", KDL::Joint(KDL::Joint::None),
                                 KDL::Frame(KDL::Rotation::RPY(p[3], p[4], p[5]), Vector(p))),
                    pose->Attribute("relative_to"));
    const auto* inertial = l->FirstChildElement("inertial");
    const auto* I = inertial->FirstChildElement("inertia");
    const auto in = [&](const char* key) { return I->FirstChildElement(key)->DoubleText(); };
    const KDL::RigidBodyInertia own(
        inertial->FirstChildElement("mass")->DoubleText(),
        Vector(Numbers(inertial->FirstChildElement("pose")->GetText())),
        KDL::RotationalInertia(in("ixx"), in("iyy"), in("izz"), in("ixy"), in("ixz"), in("iyz")));
    tree.addSegment(
        KDL::Segment(name, AxisZ(joint->Attribute("name"), joint->Attribute("type") == std::string("prismatic")),
                     KDL::Frame::Identity(), own),
        name + "_place");
    const auto* dynamics = joint->FirstChildElement("axis")->FirstChildElement("dynamics");
    EXPECT_EQ(dynamics->FirstChildElement("damping")->DoubleText(), arm_.joint[moving].viscous_Nmsprad);
    EXPECT_EQ(dynamics->FirstChildElement("friction")->DoubleText(), arm_.joint[moving++].coulomb_Nm);
  }
  ASSERT_EQ(moving, 3);
  EXPECT_LT(Relative(Torques(tree, {}, true), Expected(true)), 1e-9);
}

// Every number is there, with all its digits.
TEST_F(Export, ToYamlAndToHeader_HoldEveryValue) {
  const std::string yaml = ToYaml(arm_).text, header = ToHeader(arm_).text;
  const auto has = [](const std::string& text, const std::string& key, double value) {
    std::smatch found;
    EXPECT_TRUE(std::regex_search(text, found, std::regex(key + "[ :(]+([-+.0-9e]+)"))) << key;
    return !found.empty() && std::stod(found[1]) == value;
  };
  EXPECT_TRUE(has(header, "#define ODD_M2", arm_.joint[1].body.mass_kg));
  EXPECT_TRUE(has(header, "#define ODD_IYZ1", arm_.joint[0].body.inertia_kgm2[4]));
  EXPECT_TRUE(has(header, "#define ODD_IA3", 0.5));
  EXPECT_TRUE(has(header, "#define ODD_STRIBECK_DFS2", 0.7));
  EXPECT_NE(header.find("_SCHEMA 0x"), header.npos);
  EXPECT_TRUE(has(yaml, "mass_kg", arm_.joint[0].body.mass_kg));
  EXPECT_TRUE(has(yaml, "rotor_inertia_kg", 0.5));
  EXPECT_TRUE(has(yaml, "coulomb_N", arm_.joint[2].coulomb_Nm));
  EXPECT_TRUE(has(yaml, "stribeck.dFs2\", value", 0.7));
  Write("p.c", "#include \"p.h\"\nint main(void) { return ODD_M1 > 0 && ODD_JOINTS == 3 ? 0 : 1; }\n");
  Write("p.h", header);
  const std::string at = folder_.string();
  EXPECT_EQ(std::system(("cc -std=c99 -Wall -Werror -o " + at + "/p " + at + "/p.c && " + at + "/p").c_str()), 0);
}

TEST_F(Export, OfBaseParametersOnly_IsRefused) {
  given_.bodies.resize(0);
  EXPECT_THROW(Describe(*model_, given_, "fit.json"), io::InputError);
}

}  // namespace
}  // namespace armcal::description
