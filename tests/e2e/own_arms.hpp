// end-to-end tests - three arms as URDFs, none of them sold: a SCARA, a gantry, and one with a gripper and a camera.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tests/e2e/urdf_arm.hpp"

namespace armcal::tests {

struct ImportedArm {
  std::string urdf;  // declared
  std::string truth;
  std::vector<std::string> moving;
  std::vector<UrdfJoint> joints;
  std::vector<TrueDrive> drive;
  std::map<std::string, double> held;
};

inline std::string Robot(const std::string& inside) { return "<robot name=\"own arm\">\n" + inside + "</robot>\n"; }

// scale: of the masses of the true arm.
inline std::string Serial(const std::vector<UrdfJoint>& joints, const std::vector<std::string>& names, double scale) {
  std::string text = LinkText("base", 0, "", "");
  for (std::size_t j = 0; j < joints.size(); ++j)
    text += LinkText(joints[j].child, joints[j].mass * scale, joints[j].center, joints[j].inertia) +
            JointText(names[j], joints[j], "<dynamics damping=\"0.003\"/>");
  return text;
}

inline ImportedArm Scara() {
  ImportedArm arm;
  arm.moving = {"turn_1", "turn_2", "quill", "tool"};
  arm.joints = {{"revolute", "base", "s1", "xyz=\"0 0 0.4\"", "0 0 1", -2.2, 2.2, 60, 6, 6, "0.15 0.01 0.02",
                 "0.03 0 0.001 0.09 0 0.1"},
                {"revolute", "s1", "s2", "xyz=\"0.325 0 0\"", "0 0 1", -2.5, 2.5, 30, 8, 4, "0.12 -0.01 0.03",
                 "0.02 0 0.001 0.05 0 0.06"},
                {"prismatic", "s2", "s3", "xyz=\"0.275 0 0\"", "0 0 -1", 0, 0.18, 200, 1, 1.2, "0.002 0.001 0.1",
                 "0.006 0 0 0.006 0 0.001"},
                {"revolute", "s3", "s4", "xyz=\"0 0 0.1\"", "0 0 -1", -6, 6, 5, 20, 0.6, "0.02 0.01 0.02",
                 "0.001 0 0 0.0012 0 0.0008"}};
  arm.drive = {{1.5, 0.8, 0.3, 0.15}, {0.8, 0.4, 0.15, 0.08}, {8, 20, 3, 0.6}, {0.1, 0.01, 0.002, 0.02}};
  arm.urdf = Robot(Serial(arm.joints, arm.moving, 1)), arm.truth = Robot(Serial(arm.joints, arm.moving, 1.1));
  return arm;
}

inline ImportedArm Gantry() {
  ImportedArm arm;
  arm.moving = {"along", "across", "down", "turn"};
  arm.joints = {
      {"prismatic", "base", "g1", "xyz=\"0 0 2\"", "1 0 0", 0, 4, 900, 1.5, 60, "0 0.6 0", "9 0 0 4 0 8"},
      {"prismatic", "g1", "g2", "xyz=\"0 0 0\"", "0 1 0", 0, 1.2, 500, 1.2, 22, "0 0 0.1", "0.8 0 0 0.9 0 0.5"},
      {"prismatic", "g2", "g3", "xyz=\"0 0 0\"", "0 0 -1", 0, 0.8, 400, 0.8, 9, "0 0 -0.2", "0.3 0 0 0.32 0 0.05"},
      {"revolute", "g3", "g4", "xyz=\"0 0 0.3\"", "0 1 0", -2, 2, 20, 3, 2, "0.08 0.01 0.03",
       "0.01 0 0 0.015 0 0.012"}};
  arm.drive = {{30, 40, 10, 3}, {15, 25, 5, 2}, {9, 20, 2, 1}, {0.5, 0.3, 0.05, 0.05}};
  arm.urdf = Robot(Serial(arm.joints, arm.moving, 1)), arm.truth = Robot(Serial(arm.joints, arm.moving, 0.92));
  return arm;
}

// Five axes, a hand with two fingers of which one mimics the other, and a camera on a joint of its own.
inline ImportedArm WithGripper() {
  ImportedArm arm;
  arm.joints = SevenJoints();
  arm.joints.resize(5);
  for (int j = 1; j <= 5; ++j) arm.moving.push_back("joint" + std::to_string(j));
  arm.drive = {
      {1.2, 2.0, 0.6, 0.2}, {1.0, 1.8, 0.6, 0.2}, {0.8, 1.5, 0.5, 0.2}, {0.7, 1.2, 0.5, 0.2}, {0.4, 0.5, 0.2, 0.1}};
  const std::string box = "0.001 0 0 0.0012 0 0.0009", zero = "0 0 0";
  const UrdfJoint hand{"fixed", "a5", "hand", "xyz=\"0 0 0.1\" rpy=\"0 0 0.7854\"", "0 0 1", 0, 0, 0, 0, 0, "", ""};
  const UrdfJoint left{"prismatic", "hand", "left", "xyz=\"0 0 0.06\"", "0 1 0", 0.01, 0.04, 20, 0.2, 0, "", ""};
  const UrdfJoint right{"prismatic", "hand", "right", "xyz=\"0 0 0.06\"", "0 -1 0", 0.01, 0.04, 20, 0.2, 0, "", ""};
  const UrdfJoint pan{"revolute", "a2", "camera", "xyz=\"0 -0.2 0.1\"", "0 1 0", -1, 1, 2, 2, 0, "", ""};
  const std::string more =
      LinkText("hand", 0.7, "0 0 0.04", box) + LinkText("left", 0.1, "0.01 0 0.02", "0.0001 0 0 0.0001 0 0.00012") +
      LinkText("right", 0.1, "-0.01 0 0.02", "0.0001 0 0 0.00011 0 0.0001") +
      LinkText("camera", 0.3, "0.02 0 0", "0.0003 0 0 0.0003 0 0.0004") + JointText("to_hand", hand, "") +
      JointText("finger_left", left, "") + JointText("finger_right", right, "<mimic joint=\"finger_left\"/>") +
      JointText("camera_pan", pan, "");
  arm.urdf = Robot(Serial(arm.joints, arm.moving, 1) + more),
  arm.truth = Robot(Serial(arm.joints, arm.moving, 1.1) + more);
  arm.held = {{"finger_left", 0.01}, {"finger_right", 0.01}, {"camera_pan", 0}};
  return arm;
}

}  // namespace armcal::tests
