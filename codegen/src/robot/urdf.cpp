// robot - walks a URDF tree, merges fixed links and lays modified DH frames on the joint axes.
#include "codegen/src/robot/urdf.hpp"

#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <fstream>
#include <sstream>
#include <utility>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/robot/body.hpp"
#include "codegen/src/robot/frames.hpp"

namespace armcal::codegen {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kSameAngle = 1e-5;   // rad
constexpr double kSameLength = 1e-5;  // m; no arm is built more exactly

// At joint positions zero, seen from the root link.
struct Axis {
  urdf::JointConstSharedPtr joint;
  Vector3d point, direction;
  Body body;        // of the link that it moves
  Isometry3d link;  // that link's own frame
};

Matrix3d Rotation(const urdf::Rotation& r) {
  double x, y, z;
  r.getRPY(x, y, z);
  return RollPitchYaw({x, y, z});
}

Isometry3d Pose(const urdf::Pose& p) {
  Isometry3d T = Isometry3d::Identity();
  T.linear() = Rotation(p.rotation);
  T.translation() = Vector3d(p.position.x, p.position.y, p.position.z);
  return T;
}

class Walk {
 public:
  Walk(const std::string& file, const urdf::ModelInterface& model) : file_(file), model_(model) {
    Body base;
    Collect(*model.getRoot(), Isometry3d::Identity(), base);
    while (next_) {
      const auto joint = std::exchange(next_, nullptr);
      const Vector3d direction(joint->axis.x, joint->axis.y, joint->axis.z);
      if (direction.norm() < 1e-6) Fail("joint", joint->name, "an axis that is not zero");
      axes.push_back(Axis{joint, at_.translation(), (at_.linear() * direction).normalized(), Body(), at_});
      Collect(*model.getLink(joint->child_link_name), axes.back().link, axes.back().body);
    }
    if (axes.empty()) Fail("link", model.getRoot()->name, "at least one movable joint after it");
  }

  std::vector<Axis> axes;

 private:
  [[noreturn]] void Fail(const char* what, const std::string& name, const std::string& expected) const {
    throw io::InputError(file_ + ": " + what + " \"" + name + "\": expected " + expected);
  }

  // The body of a link and of all that is fixed to it; the movable joint that follows goes to next_, its pose to at_.
  void Collect(const urdf::Link& link, const Isometry3d& pose, Body& body) {
    if (const auto& inertial = link.inertial) {
      const Body own{
          inertial->mass, Vector3d::Zero(),
          Symmetric(inertial->ixx, inertial->ixy, inertial->ixz, inertial->iyy, inertial->iyz, inertial->izz)};
      Merge(body, Moved(pose * Pose(inertial->origin), own));
    }
    for (const auto& joint : link.child_joints) {
      const Isometry3d child = pose * Pose(joint->parent_to_joint_origin_transform);
      const auto type = joint->type;
      if (type == urdf::Joint::FIXED) {
        Collect(*model_.getLink(joint->child_link_name), child, body);
        continue;
      }
      if (type != urdf::Joint::REVOLUTE && type != urdf::Joint::CONTINUOUS && type != urdf::Joint::PRISMATIC)
        Fail("joint", joint->name, "revolute, continuous, prismatic or fixed");
      if (joint->mimic) Fail("joint", joint->name, "no mimic: every joint of the arm has a drive of its own");
      if (next_) Fail("joint", joint->name, "one chain, but it branches from \"" + next_->name + "\"");
      next_ = joint, at_ = child;
    }
  }

  std::string file_;
  const urdf::ModelInterface& model_;
  urdf::JointConstSharedPtr next_;
  Isometry3d at_;
};

// The axes of one frame at joint positions zero.
struct Frame {
  Vector3d origin, x, z;
  Isometry3d Pose() const {
    Isometry3d T = Isometry3d::Identity();
    T.linear() << x, z.cross(x), z;
    T.translation() = origin;
    return T;
  }
};

double Snapped(double angle_rad) {
  const double quarters = std::round(angle_rad / (std::numbers::pi / 2));
  const double exact = quarters * std::numbers::pi / 2 + 0.0;  // no negative zero
  return std::abs(angle_rad - exact) < kSameAngle ? exact : angle_rad;
}
// Twelve decimals: sums of the file's numbers without their round-off.
double Tidy(double length_m) { return std::abs(length_m) < kSameLength ? 0 : std::round(length_m * 1e12) / 1e12; }

double AngleAbout(const Vector3d& axis, const Vector3d& from, const Vector3d& to) {
  return Snapped(std::atan2(from.cross(to).dot(axis), from.dot(to)));
}

Vector3d AnyNormal(const Vector3d& z) {
  const Vector3d x = std::abs(z.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
  return (x - x.dot(z) * z).normalized();
}

// Craig's frames: z_i along axis i, x_i along the common normal from axis i to axis i + 1; where that leaves a choice,
// d_i = 0 and theta_i as near to zero as can be. Frame 0 is frame 1 at position zero.
std::vector<Frame> LayFrames(const std::vector<Axis>& axes, std::vector<JointKinematics>& kinematics) {
  std::vector<Frame> frames;
  Vector3d foot = axes[0].point;  // of the normal from the axis before
  Vector3d x_before = AnyNormal(axes[0].direction);
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const Vector3d& u = axes[i].direction;
    Frame f{foot, x_before, u};
    Vector3d next_foot = foot;
    if (i + 1 < axes.size()) {
      const Vector3d &v = axes[i + 1].direction, across = axes[i + 1].point - foot, normal = u.cross(v);
      if (normal.norm() < kSameAngle) {
        const Vector3d between = across - across.dot(u) * u;
        if (between.norm() > kSameLength) f.x = between.normalized();
        next_foot = foot + between;
      } else {  // foot + s u and point + t v are nearest to each other
        const double c = u.dot(v), s = (across.dot(u) - c * across.dot(v)) / (1 - c * c);
        const double t = (c * across.dot(u) - across.dot(v)) / (1 - c * c);
        f.origin = foot + s * u;
        next_foot = axes[i + 1].point + t * v;
        f.x = normal.normalized();
      }
      if (i > 0 && f.x.dot(x_before) < -1e-9) f.x = -f.x;
    }
    JointKinematics k;
    k.type = axes[i].joint->type == urdf::Joint::PRISMATIC ? JointType::kPrismatic : JointType::kRevolute;
    if (i > 0) {
      const Frame& before = frames.back();
      k.alpha_rad = AngleAbout(before.x, before.z, u);
      k.a_m = Tidy((foot - before.origin).dot(before.x));
      k.d_m = Tidy((f.origin - foot).dot(u));
      k.theta_rad = AngleAbout(u, before.x, f.x);
    }
    kinematics.push_back(k);
    frames.push_back(f);
    foot = next_foot, x_before = f.x;
  }
  return frames;
}

// The parser's complaints go into the error line instead of the terminal.
class Complaints : public console_bridge::OutputHandler {
 public:
  Complaints() { console_bridge::useOutputHandler(this); }
  ~Complaints() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel, const char*, int) override {
    if (first_.empty()) first_ = text.substr(0, text.find('\n'));
  }
  const std::string& first() const { return first_; }

 private:
  std::string first_;
};

}  // namespace

UrdfChain ReadUrdf(const std::filesystem::path& path) {
  std::ifstream in(path);
  if (!in) throw io::InputError(path.string() + ": no such file");
  std::ostringstream text;
  text << in.rdbuf();
  Complaints complaints;
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(text.str());
  if (!model || !model->getRoot())
    throw io::InputError(path.string() + ": expected a URDF robot" +
                         (complaints.first().empty() ? "" : " (" + complaints.first() + ")"));
  const Walk walk(path.string(), *model);
  std::vector<JointKinematics> kinematics;
  const std::vector<Frame> frames = LayFrames(walk.axes, kinematics);
  UrdfChain chain;
  for (std::size_t i = 0; i < walk.axes.size(); ++i) {
    const Axis& axis = walk.axes[i];
    Joint joint;
    joint.name = axis.joint->name;
    joint.kinematics = kinematics[i];
    const auto& limits = axis.joint->limits;
    const bool limited = limits && axis.joint->type != urdf::Joint::CONTINUOUS;
    if (limited) joint.position_limit_rad = {limits->lower, limits->upper};
    if (limits) joint.speed_limit_radps = limits->velocity, joint.torque_limit_Nm = limits->effort;
    if (const auto& d = axis.joint->dynamics) joint.nominal = {{"Fc", d->friction}, {"Fv", d->damping}};
    const Isometry3d frame = frames[i].Pose();
    joint.link = ToLink(Moved(frame.inverse(), axis.body));
    chain.joint.push_back(joint);
    chain.limited.push_back(limited);
  }
  chain.base = frames.front().Pose();
  chain.flange = frames.back().Pose().inverse() * walk.axes.back().link;
  return chain;
}

}  // namespace armcal::codegen
