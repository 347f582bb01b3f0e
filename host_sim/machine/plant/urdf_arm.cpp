// plant - walks a URDF from its root outward, and lumps what does not move into what does.
//
// urdfdom parses the file. Frames and bodies are KDL's: nothing here is shared with the generator's reader.
#include "host_sim/machine/plant/urdf_arm.hpp"

#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/xacro.hpp"

namespace armcal::plant {
namespace {

KDL::Frame ToKdl(const urdf::Pose& pose) {
  const urdf::Rotation& r = pose.rotation;
  return {KDL::Rotation::Quaternion(r.x, r.y, r.z, r.w), {pose.position.x, pose.position.y, pose.position.z}};
}

KDL::RigidBodyInertia BodyOf(const urdf::Link& link) {
  if (!link.inertial || link.inertial->mass == 0) return KDL::RigidBodyInertia::Zero();  // a frame
  const urdf::Inertial& in = *link.inertial;
  return ToKdl(in.origin) *
         KDL::RigidBodyInertia(in.mass, KDL::Vector::Zero(),
                               KDL::RotationalInertia(in.ixx, in.iyy, in.izz, in.ixy, in.ixz, in.iyz));
}

KDL::Vector AxisOf(const urdf::Joint& joint) {
  KDL::Vector axis(joint.axis.x, joint.axis.y, joint.axis.z);
  axis.Normalize();
  return axis;
}

class Walk {
 public:
  Walk(UrdfArm& arm, const urdf::ModelInterface& model) : arm_(arm), model_(model) {
    KDL::RigidBodyInertia base = KDL::RigidBodyInertia::Zero();  // does not move, so nobody asks for it
    Collect(*model.getRoot(), KDL::Frame::Identity(), base);
    while (next_) {
      const urdf::JointConstSharedPtr joint = std::exchange(next_, nullptr);
      JointData data;
      data.name = joint->name;
      data.prismatic = joint->type == urdf::Joint::PRISMATIC;
      data.place = UrdfPlace{at_, AxisOf(*joint)};
      if (const auto& limits = joint->limits) {
        if (joint->type != urdf::Joint::CONTINUOUS && limits->lower < limits->upper)
          data.lowest_rad = limits->lower, data.highest_rad = limits->upper;
        data.speed_limit_radps = limits->velocity, data.torque_limit_Nm = limits->effort;
      }
      if (joint->dynamics) data.coulomb_Nm = joint->dynamics->friction, data.viscous_Nmsprad = joint->dynamics->damping;
      KDL::RigidBodyInertia body = KDL::RigidBodyInertia::Zero();
      Collect(*model.getLink(joint->child_link_name), KDL::Frame::Identity(), body);
      if (!(body.getMass() > 0)) Fail(*joint, "a link with mass after it: a simulated arm needs bodies");
      data.body = FromKdl(body);
      arm_.joint.push_back(data);
    }
  }

 private:
  [[noreturn]] void Fail(const urdf::Joint& joint, const std::string& expected) const {
    throw io::InputError(arm_.file + ": joint \"" + joint.name + "\": expected " + expected);
  }

  double Position(const urdf::Joint& joint) const {
    if (const auto held = arm_.fixed.find(joint.name); held != arm_.fixed.end()) return held->second;
    if (joint.mimic) {
      const auto followed = model_.getJoint(joint.mimic->joint_name);
      if (!followed || followed->mimic) Fail(joint, "to mimic a joint that is held");
      return joint.mimic->multiplier * Position(*followed) + joint.mimic->offset;
    }
    const auto& limits = joint.limits;
    if (!limits || joint.type == urdf::Joint::CONTINUOUS || limits->lower > limits->upper) return 0;
    return std::clamp(0.0, limits->lower, limits->upper);
  }

  KDL::Frame Held(const urdf::Joint& joint) const {
    const KDL::Frame origin = ToKdl(joint.parent_to_joint_origin_transform);
    if (joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS)
      return origin * KDL::Frame(KDL::Rotation::Rot(AxisOf(joint), Position(joint)));
    if (joint.type == urdf::Joint::PRISMATIC) return origin * KDL::Frame(AxisOf(joint) * Position(joint));
    return origin;
  }

  // pose: of the link, seen from the link that carries it.
  void Collect(const urdf::Link& link, const KDL::Frame& pose, KDL::RigidBodyInertia& body) {
    body = body + pose * BodyOf(link);
    if (link.name == arm_.tip) arm_.flange = pose;
    for (const auto& joint : link.child_joints) {
      if (!arm_.moving.contains(joint->name)) {
        Collect(*model_.getLink(joint->child_link_name), pose * Held(*joint), body);
        continue;
      }
      if (next_) Fail(*joint, "one chain, but it branches from \"" + next_->name + "\"");
      next_ = joint, at_ = pose * ToKdl(joint->parent_to_joint_origin_transform);
    }
  }

  UrdfArm& arm_;
  const urdf::ModelInterface& model_;
  urdf::JointConstSharedPtr next_;
  KDL::Frame at_;
};

}  // namespace

void ReadUrdfArm(UrdfArm& arm) {
  std::ifstream in(arm.file);
  if (!in) throw io::InputError(arm.file + ": no such file");
  std::ostringstream text;
  text << in.rdbuf();
  if (io::HoldsXacro(text.str()))
    throw io::InputError(arm.file + ": a xacro file, expected a URDF to simulate; expand it: xacro " + arm.file +
                         " > arm.urdf");
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(text.str());
  if (!model || !model->getRoot()) throw io::InputError(arm.file + ": expected a URDF robot");
  Walk(arm, *model);
}

}  // namespace armcal::plant
