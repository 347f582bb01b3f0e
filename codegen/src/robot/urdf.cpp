// robot - walks a URDF tree, merges fixed links and lays modified DH frames on the joint axes.
#include "codegen/src/robot/urdf.hpp"

#include <console_bridge/console.h>
#include <sys/wait.h>
#include <urdf_parser/urdf_parser.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <set>
#include <sstream>
#include <utility>

#include "codegen/src/io/require_file.hpp"
#include "codegen/src/io/xacro.hpp"
#include "codegen/src/robot/frames.hpp"
#include "codegen/src/robot/mesh_path.hpp"

namespace armcal::codegen {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kSameAngle = 1e-5;   // rad
constexpr double kSameLength = 1e-5;  // m; no arm is built more exactly
constexpr double kMostTurn = 20;      // rad; more are degrees, or stand for no limit
constexpr double kMostDegrees = 1000;
constexpr int kSameBodies = 3;  // moving links with one and the same inertia: not one is computed

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

std::string Number(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", v);
  return text;
}

bool IsMovable(const urdf::Joint& joint) {
  return joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS ||
         joint.type == urdf::Joint::PRISMATIC;
}

// Names of two or more, as a person lists them.
std::string List(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "\"" : ", \"") + name + "\"";
  return text;
}

Body BodyOf(const urdf::Link& link) {
  const auto& in = link.inertial;
  if (!in) return {};
  return Moved(Pose(in->origin),
               {in->mass, Vector3d::Zero(), Symmetric(in->ixx, in->ixy, in->ixz, in->iyy, in->iyz, in->izz)});
}

// The collision shapes of a link, seen from its frame.
std::vector<Shape> ShapesOf(const urdf::Link& link, const UrdfChoice& choice) {
  std::vector<Shape> shapes;
  for (const auto& collision : link.collision_array) {
    if (!collision || !collision->geometry) continue;
    Shape shape;
    shape.link = link.name;
    const urdf::Geometry& geometry = *collision->geometry;
    if (const auto* box = dynamic_cast<const urdf::Box*>(&geometry)) {
      shape.kind = Shape::Kind::kBox;
      shape.size_m = {box->dim.x, box->dim.y, box->dim.z};
    } else if (const auto* sphere = dynamic_cast<const urdf::Sphere*>(&geometry)) {
      shape.kind = Shape::Kind::kSphere;
      shape.size_m = {sphere->radius};
    } else if (const auto* cylinder = dynamic_cast<const urdf::Cylinder*>(&geometry)) {
      shape.kind = Shape::Kind::kCylinder;
      shape.size_m = {cylinder->radius, cylinder->length};
    } else if (const auto* mesh = dynamic_cast<const urdf::Mesh*>(&geometry)) {
      shape.kind = Shape::Kind::kMesh;
      shape.size_m = {mesh->scale.x, mesh->scale.y, mesh->scale.z};
      shape.mesh = mesh->filename;
      shape.file = MeshFile(mesh->filename, choice.path, choice.packages);
    } else {
      continue;
    }
    const Isometry3d pose = Pose(collision->origin);
    shape.xyz_m = Components(pose.translation()), shape.rotation = RowMajor(pose.linear());
    shapes.push_back(shape);
  }
  return shapes;
}

// Which joints of a URDF move the arm, and at what positions all others are held.
class Choice {
 public:
  Choice(const UrdfChoice& asked, const urdf::ModelInterface& model, io::Faults& faults)
      : file_(asked.path.string()), model_(model), faults_(faults) {
    for (const auto& [name, position] : asked.fixed) Hold(name, position);
    if (!asked.tip.empty()) EndAt(asked.tip);
    HoldMimics();
  }

  bool Moves(const urdf::Joint& joint) const { return joint.type != urdf::Joint::FIXED && !held_.contains(joint.name); }
  const std::map<std::string, double>& held() const { return held_; }

  // Faults of what is to move: a joint of another kind, a mimic joint.
  void Check() const {
    for (const auto& [name, joint] : model_.joints_) {
      if (!Moves(*joint)) continue;
      if (!IsMovable(*joint))
        Say(name, "revolute, continuous, prismatic or fixed; or hold it: fixed = { " + name + " = 0.0 }");
      else if (joint->mimic)
        Say(name,
            "no mimic: every joint of the arm has a drive of its own; hold the joint that it follows: fixed = { " +
                joint->mimic->joint_name + " = 0.0 }");
    }
  }
  // The nearest to zero that the limits allow.
  static double Rest(const urdf::Joint& joint) {
    const auto& limits = joint.limits;
    if (!limits || joint.type == urdf::Joint::CONTINUOUS || limits->lower > limits->upper) return 0;
    return std::clamp(0.0, limits->lower, limits->upper);
  }

 private:
  void Say(const std::string& joint, const std::string& expected) const {
    faults_.Add(file_ + ": joint \"" + joint + "\": expected " + expected);
  }
  void Hold(const std::string& name, double position) {
    const auto it = model_.joints_.find(name);
    if (it != model_.joints_.end()) {
      held_[name] = position;
      const auto& limits = it->second->limits;
      const bool limited = limits && it->second->type != urdf::Joint::CONTINUOUS && limits->lower < limits->upper;
      if (limited && (position < limits->lower || position > limits->upper))
        Say(name, "to be held within its limits, " + Number(limits->lower) + " to " + Number(limits->upper) +
                      ", not at " + Number(position));
      return;
    }
    std::vector<std::string> known;
    for (const auto& [other, joint] : model_.joints_) known.push_back(other);
    const std::string nearest = io::Nearest(name, known);
    Say(name, "a joint of the URDF to hold" + (nearest.empty() ? "" : "; the nearest is " + nearest));
  }
  void EndAt(const std::string& tip) {
    const auto end = model_.getLink(tip);
    if (!end) {
      std::vector<std::string> known;
      for (const auto& [other, link] : model_.links_) known.push_back(other);
      const std::string nearest = io::Nearest(tip, known);
      faults_.Add(file_ + ": link \"" + tip + "\": expected a link of the URDF as the tip" +
                  (nearest.empty() ? "" : "; the nearest is " + nearest));
      return;
    }
    std::set<std::string> path;
    for (auto link = end; link->parent_joint; link = link->getParent()) path.insert(link->parent_joint->name);
    for (const auto& [name, joint] : model_.joints_)
      if (joint->type != urdf::Joint::FIXED && !joint->mimic && !path.contains(name))
        held_.try_emplace(name, Rest(*joint));
  }
  void HoldMimics() {
    for (bool again = true; std::exchange(again, false);)
      for (const auto& [name, joint] : model_.joints_) {
        if (!joint->mimic || held_.contains(name)) continue;
        const auto source = held_.find(joint->mimic->joint_name);
        if (source == held_.end()) continue;
        held_[name] = joint->mimic->multiplier * source->second + joint->mimic->offset;
        again = true;
      }
  }

  std::string file_;
  const urdf::ModelInterface& model_;
  io::Faults& faults_;
  std::map<std::string, double> held_;
};

class Walk {
 public:
  Walk(const UrdfChoice& asked, const urdf::ModelInterface& model, const Choice& choice, io::Faults& faults)
      : asked_(asked), file_(asked.path.string()), model_(model), choice_(choice), faults_(faults) {
    Collect(*model.getRoot(), Isometry3d::Identity(), base_parts);
    while (next_) {
      const auto joint = std::exchange(next_, nullptr);
      Vector3d direction(joint->axis.x, joint->axis.y, joint->axis.z);
      if (direction.norm() < 1e-6) {
        if (IsMovable(*joint)) Say("joint", joint->name, "an axis that is not zero");
        direction = Vector3d::UnitZ();
      }
      axes.push_back(Axis{joint, at_.translation(), (at_.linear() * direction).normalized(), Body(), at_});
      parts.emplace_back();
      Collect(*model.getLink(joint->child_link_name), axes.back().link, parts.back());
      for (const UrdfPart& part : parts.back()) Merge(axes.back().body, Moved(part.pose, part.body));
    }
    if (axes.empty()) Say("link", model.getRoot()->name, "at least one movable joint after it");
  }

  std::vector<Axis> axes;
  std::vector<UrdfPart> base_parts;
  std::vector<std::vector<UrdfPart>> parts;  // of each axis; poses are seen from the root link
  std::vector<Shape> shapes;                 // of all links; poses are seen from the root link

 private:
  void Say(const char* what, const std::string& name, const std::string& expected) const {
    faults_.Add(file_ + ": " + what + " \"" + name + "\": expected " + expected);
  }

  Isometry3d AtPosition(const urdf::Joint& joint) const {
    Isometry3d T = Pose(joint.parent_to_joint_origin_transform);
    const auto held = choice_.held().find(joint.name);
    if (held == choice_.held().end() || !IsMovable(joint)) return T;
    const Vector3d axis = Vector3d(joint.axis.x, joint.axis.y, joint.axis.z).normalized();
    Isometry3d moved = Isometry3d::Identity();
    if (joint.type == urdf::Joint::PRISMATIC) moved.translation() = held->second * axis;
    else moved.linear() = Eigen::AngleAxisd(held->second, axis).toRotationMatrix();
    return held->second == 0 ? T : T * moved;
  }

  // A link and all that is fixed to it; the movable joint that follows goes to next_, its pose to at_.
  void Collect(const urdf::Link& link, const Isometry3d& pose, std::vector<UrdfPart>& parts_of) {
    parts_of.push_back({link.name, pose, BodyOf(link)});
    for (const Shape& shape : ShapesOf(link, asked_)) {
      shapes.push_back(codegen::Moved(pose, shape));
      shapes.back().body = static_cast<int>(axes.size());
    }
    for (const auto& joint : link.child_joints) {
      if (!choice_.Moves(*joint)) {
        Collect(*model_.getLink(joint->child_link_name), pose * AtPosition(*joint), parts_of);
      } else if (next_) {
        Say("joint", joint->name,
            "one chain, but it branches from \"" + next_->name + "\"; name the link at which the arm ends: tip = \"" +
                next_->child_link_name + "\" or \"" + joint->child_link_name + "\", or one beyond");
      } else {
        next_ = joint, at_ = pose * AtPosition(*joint);
      }
    }
  }

  const UrdfChoice& asked_;
  std::string file_;
  const urdf::ModelInterface& model_;
  const Choice& choice_;
  io::Faults& faults_;
  urdf::JointConstSharedPtr next_;
  Isometry3d at_;
};

void CheckLengths(const std::string& file, const urdf::ModelInterface& model, io::Faults& faults) {
  for (const auto& [name, joint] : model.joints_) {
    const std::string who = file + ": joint \"" + name + "\": expected ";
    const auto& p = joint->parent_to_joint_origin_transform.position;
    if (const double length = Vector3d(p.x, p.y, p.z).norm(); length > kLongest)
      faults.Add(who + "an origin in metres, not " + Number(length) + " (millimetres?)");
    const auto& limits = joint->limits;
    if (joint->type == urdf::Joint::PRISMATIC && limits && limits->upper < 1e6 &&
        limits->upper - limits->lower > kLongestTravel)
      faults.Add(who + "limits in metres, not " + Number(limits->lower) + " to " + Number(limits->upper) +
                 " (millimetres?)");
  }
}

// Of the parts that move: centres and inertias in millimetres, and bodies that cannot exist.
std::vector<std::string> FaultsOfBodies(const std::string& file, const std::vector<std::vector<UrdfPart>>& parts) {
  io::Faults faults;
  for (const auto& of_joint : parts)
    for (const auto& [link, pose, body] : of_joint) {
      if (body.mass == 0) continue;  // a frame
      const std::string who = file + ": link \"" + link + "\": expected ";
      if (body.center.norm() > kLongest)
        faults.Add(who + "a centre of mass in metres, not " + Number(body.center.norm()) + " (millimetres?)");
      const double square = body.mass > 0 ? 0.5 * body.inertia.trace() / body.mass : 0;
      if (square > kLongest * kLongest)
        faults.Add(who + "an inertia in kg m^2: this one would be " + Number(std::sqrt(square)) + " m wide (kg mm^2?)");
      if (body.inertia.isZero() && body.mass > 0) continue;  // a mass point; what it is fixed to may have the inertia
      if (const std::string missing = Impossible(body, kPublished); !missing.empty()) faults.Add(who + missing);
    }
  return faults.lines();
}

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

// The parser refuses a joint without <limit>. Zeros stand for what is not known, as in many URDFs.
std::string WithLimits(std::string text) {
  constexpr std::string_view kBegin = "<joint", kEnd = "</joint>", kComment = "-->";
  for (std::size_t at = 0; (at = text.find("<!--", at)) != text.npos;) {
    const std::size_t end = text.find(kComment, at);
    text.erase(at, end == text.npos ? end : end + kComment.size() - at);
  }
  for (std::size_t at = 0; (at = text.find(kBegin, at)) != text.npos;) {
    const std::size_t inside = text.find('>', at), end = text.find(kEnd, at);
    if (inside == text.npos || end == text.npos) break;
    const std::string tag = text.substr(at, inside - at), body = text.substr(inside, end - inside);
    at = inside;
    const bool moves = tag.find("revolute") != tag.npos || tag.find("prismatic") != tag.npos;
    if (tag.back() == '/' || !moves || body.find("<limit") != body.npos) continue;
    text.insert(end, "<limit lower=\"0\" upper=\"0\" effort=\"0\" velocity=\"0\"/>");
  }
  return text;
}

urdf::ModelInterfaceSharedPtr Parse(const std::filesystem::path& path) {
  const std::string text = UrdfText(path);
  if (const std::size_t first = text.find_first_not_of("\xEF\xBB\xBF \t\r\n"); first == text.npos || text[first] != '<')
    throw io::InputError(path.string() + ": expected a URDF, which is XML and begins with \"<\"");
  Complaints complaints;
  urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(WithLimits(text));
  if (!model || !model->getRoot())
    throw io::InputError(path.string() + ": expected a URDF robot" +
                         (complaints.first().empty() ? "" : " (" + complaints.first() + ")"));
  return model;
}

// Limits that are no angles in rad, and may be some in degrees.
bool AreDegrees(const urdf::Joint& joint) {
  const auto& limits = joint.limits;
  return joint.type == urdf::Joint::REVOLUTE && limits && limits->lower < limits->upper &&
         std::max(-limits->lower, limits->upper) > kMostTurn && std::max(-limits->lower, limits->upper) <= kMostDegrees;
}

std::string WhyUnlimited(const urdf::Joint& joint) {
  const auto& limits = joint.limits;
  if (joint.type == urdf::Joint::CONTINUOUS) return "it is continuous";
  if (!limits || (limits->lower == 0 && limits->upper == 0)) return "the URDF has none";
  const std::string found = "the URDF has " + Number(limits->lower) + " to " + Number(limits->upper);
  if (!(limits->lower < limits->upper)) return found;
  if (joint.type == urdf::Joint::REVOLUTE && std::max(-limits->lower, limits->upper) > kMostTurn)
    return found + " rad" + (AreDegrees(joint) ? " (degrees?)" : "");
  return "";
}

// The links that a joint moves and that share a body with two others.
std::vector<std::string> SameInertia(const std::vector<std::vector<UrdfPart>>& parts) {
  const auto same = [](const Body& a, const Body& b) {
    return a.mass == b.mass && a.center == b.center && a.inertia == b.inertia;
  };
  for (const auto& one : parts) {
    std::vector<std::string> names;
    for (const auto& other : parts)
      if (one.front().body.mass > 0 && same(one.front().body, other.front().body)) names.push_back(other.front().link);
    if (static_cast<int>(names.size()) >= kSameBodies) return names;
  }
  return {};
}

// The links at which chains end, with the number of joints that move on the way. `tip`: the last link that a joint
// moved. True: a joint moves below.
bool FindEnds(const urdf::ModelInterface& model, const Choice& choice, const urdf::Link& link, const std::string& tip,
              int joints, std::map<std::string, int>& ends) {
  bool goes_on = false;
  for (const auto& joint : link.child_joints) {
    const urdf::Link& child = *model.getLink(joint->child_link_name);
    const bool moves = choice.Moves(*joint);
    const bool below = FindEnds(model, choice, child, moves ? child.name : tip, joints + (moves ? 1 : 0), ends);
    goes_on |= moves || below;
  }
  if (!goes_on && joints > 0 && link.name == tip) ends[tip] = joints;
  return goes_on;
}

std::string Quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

constexpr int kNoProgram = 127;  // what a shell ends with

// What a command prints, and the code it ends with.
std::pair<std::string, int> OutputOf(const std::string& command) {
  std::string text;
  FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return {text, kNoProgram};
  std::array<char, 4096> block;
  for (std::size_t n = 0; (n = std::fread(block.data(), 1, block.size(), pipe)) > 0;) text.append(block.data(), n);
  const int status = pclose(pipe);
  return {text, WIFEXITED(status) ? WEXITSTATUS(status) : 1};
}

std::string LastLine(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const auto at = text.rfind('\n');
  return at == text.npos ? text : text.substr(at + 1);
}

}  // namespace

std::string UrdfText(const std::filesystem::path& path) {
  io::RequireFile(path);
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  const bool macros = path.extension() == ".xacro" || io::HoldsXacro(text.str());
  if (!macros) return text.str();
  const std::string xacro = "xacro " + Quoted(path.string());
  const auto [expanded, code] = OutputOf(xacro + " 2>/dev/null");
  if (code == 0 && !expanded.empty()) return expanded;
  if (code != kNoProgram)
    throw io::InputError(path.string() +
                         ": xacro cannot expand it: " + LastLine(OutputOf(xacro + " 2>&1 >/dev/null").first));
  std::filesystem::path urdf = path;
  if (path.extension() == ".xacro") urdf.replace_extension(path.stem().extension() == ".urdf" ? "" : ".urdf");
  else urdf.replace_filename("expanded.urdf");
  throw io::InputError(path.string() + ": a xacro file, expected a URDF; run this where ROS is: xacro " +
                       path.filename().string() + " > " + urdf.filename().string());
}

UrdfChain ReadUrdf(const UrdfChoice& asked) {
  const std::string file = asked.path.string();
  const urdf::ModelInterfaceSharedPtr model = Parse(asked.path);
  io::Faults faults;
  const Choice choice(asked, *model, faults);
  choice.Check();
  CheckLengths(file, *model, faults);
  const Walk walk(asked, *model, choice, faults);
  const std::vector<std::string> body_faults = FaultsOfBodies(file, walk.parts);
  if (!faults.lines().empty())
    for (const std::string& line : body_faults) faults.Add(line);  // all in one run
  faults.ThrowIfAny();
  std::vector<JointKinematics> kinematics;
  const std::vector<Frame> frames = LayFrames(walk.axes, kinematics);
  for (std::size_t i = 1; i < kinematics.size(); ++i)
    if (std::abs(kinematics[i].d_m) > kLongest)
      faults.Add(file + ": joint \"" + walk.axes[i].joint->name +
                 "\": its axis is nearly parallel to a neighbour's, so their common normal lies " +
                 Number(std::abs(kinematics[i].d_m)) + " m away; expected parallel axes (is pi rounded in an rpy?)");
  faults.ThrowIfAny();
  UrdfChain chain;
  chain.part = walk.parts;
  chain.base_part = walk.base_parts;
  chain.held = choice.held();
  chain.body_faults = body_faults;
  chain.same_inertia = SameInertia(walk.parts);
  for (std::size_t i = 0; i < walk.axes.size(); ++i) {
    const Axis& axis = walk.axes[i];
    Joint joint;
    joint.name = axis.joint->name;
    joint.kinematics = kinematics[i];
    const auto& limits = axis.joint->limits;
    chain.unlimited.push_back(WhyUnlimited(*axis.joint));
    const double unit = AreDegrees(*axis.joint) ? std::numbers::pi / 180 : 1;
    if (chain.unlimited.back().empty() || unit != 1)
      joint.position_limit_rad = {unit * limits->lower, unit * limits->upper};
    if (limits) joint.speed_limit_radps = limits->velocity, joint.torque_limit_Nm = limits->effort;
    if (const auto& d = axis.joint->dynamics) joint.nominal = {{"Fc", d->friction}, {"Fv", d->damping}};
    joint.wide = {"Fc", "Fv", "Ia"};
    const Isometry3d frame = frames[i].Pose();
    joint.link = ToLink(Moved(frame.inverse(), axis.body));
    for (UrdfPart& part : chain.part[i]) part.pose = frame.inverse() * part.pose;
    chain.joint.push_back(joint);
  }
  for (const Shape& shape : walk.shapes)
    chain.shape.push_back(
        shape.body == 0 ? shape
                        : codegen::Moved(frames[static_cast<std::size_t>(shape.body) - 1].Pose().inverse(), shape));
  chain.base = frames.front().Pose();
  chain.flange = chain.part.back().front().pose;
  for (const UrdfPart& part : chain.part.back())
    if (part.link == asked.tip) chain.flange = part.pose;
  return chain;
}

UrdfChoice ChooseChain(const UrdfChoice& asked, std::vector<std::string>& said) {
  const std::string file = asked.path.string();
  const urdf::ModelInterfaceSharedPtr model = Parse(asked.path);
  io::Faults faults;
  UrdfChoice chosen = asked;
  if (asked.tip.empty()) {
    for (const auto& [name, joint] : model->joints_) {
      if (!joint->mimic) continue;
      const auto source = model->joints_.find(joint->mimic->joint_name);
      if (source == model->joints_.end() || source->second->mimic) continue;
      if (chosen.fixed.try_emplace(source->first, Choice::Rest(*source->second)).second)
        said.push_back("joint \"" + source->first + "\" is held at " + Number(chosen.fixed[source->first]) +
                       ", for \"" + name + "\" mimics it");
    }
    const Choice choice(chosen, *model, faults);
    std::map<std::string, int> ends;
    FindEnds(*model, choice, *model->getRoot(), model->getRoot()->name, 0, ends);
    int most = 0;
    for (const auto& [tip, joints] : ends) most = std::max(most, joints);
    std::vector<std::string> longest, all;
    for (const auto& [tip, joints] : ends) {
      all.push_back(tip);
      if (joints == most) longest.push_back(tip);
    }
    if (longest.size() > 1)
      faults.Add(file +
                 ": expected one chain, but it branches; name the link at which the arm ends, or one before the "
                 "branch: --tip with one of " +
                 List(longest));
    faults.ThrowIfAny();
    if (ends.size() > 1) {
      chosen.tip = longest.front();
      said.push_back("the arm ends at link \"" + chosen.tip + "\", the longest of the chains to " + List(all));
    }
  }
  const Choice choice(chosen, *model, faults);
  faults.ThrowIfAny();
  for (const auto& [name, position] : choice.held()) {
    const urdf::Joint& joint = *model->joints_.at(name);
    if (joint.mimic || chosen.fixed.contains(name)) continue;
    chosen.fixed[name] = position;
    said.push_back("joint \"" + name + "\" is held at " + Number(position) + ": it does not lead to \"" + chosen.tip +
                   "\"");
  }
  return chosen;
}

}  // namespace armcal::codegen
