// description - MJCF, MuJoCo's format: a file that is written whole, and values written into one that is given.
#include <fmt/format.h>

#include <cctype>
#include <map>
#include <numbers>
#include <optional>

#include "codegen/src/io/faults.hpp"
#include "codegen/src/robot/frames.hpp"
#include "host_sim/identify/description/file_text.hpp"
#include "host_sim/identify/description/moving_body.hpp"
#include "host_sim/identify/description/xml_edits.hpp"

namespace armcal::description {

namespace {

using codegen::Body;
using codegen::Joint;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

std::string QuaternionText(const Quaterniond& q) {
  return fmt::format("{} {} {} {}", Exact(q.w()), Exact(q.x()), Exact(q.y()), Exact(q.z()));
}

// MuJoCo finds the principal axes of a full inertia to eight digits only, so it is given them.
XmlContent Inertial(const Body& body) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(body.inertia);
  Matrix3d axes = principal.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) *= -1;
  return {"inertial",
          {{"pos", Exact(body.center)},
           {"quat", QuaternionText(Quaterniond(axes))},
           {"mass", Exact(body.mass)},
           {"diaginertia", Exact(Vector3d(principal.eigenvalues()))}}};
}

XmlContent JointValues(const DescribedJoint& own) {
  return {"joint",
          {{"armature", Exact(own.rotor_kgm2)},
           {"damping", Exact(own.viscous_Nmsprad)},
           {"frictionloss", Exact(own.coulomb_Nm)}}};
}

// The bodies and joints of a given file. A joint stands at its reference position there, which the arm's zero need not
// be: `ref` says what the position is then.
class GivenMjcf {
 public:
  GivenMjcf(const DescribedArm& arm, const std::string& file, const std::string& text, const XmlElement& root)
      : file_(file),
        text_(text),
        root_(root),
        joint_(arm.joint.size()),
        body_(arm.joint.size()),
        found_(arm.joint.size()),
        class_(arm.joint.size()) {
    if (root_.name != "mujoco") throw io::InputError(file + ": expected MJCF, a file that begins with <mujoco>");
    for (std::size_t j = 0; j < arm.joint.size(); ++j) number_[arm.robot.joint[j].name] = j;
    for (const XmlElement& section : root_.child) ReadSection(section);
    for (const XmlElement& section : root_.child)
      if (section.name == "worldbody") Walk(section, {Isometry3d::Identity(), "main", {}});
    std::string missing;
    for (std::size_t j = 0; j < found_.size(); ++j)
      if (!found_[j]) missing += (missing.empty() ? "\"" : ", \"") + arm.robot.joint[j].name + "\"";
    if (!missing.empty())
      throw io::InputError(fmt::format("{}: no joint {}; expected the joints of robot {}, the file has {}", file,
                                       missing, arm.robot.name, fmt::join(names_, ", ")));
  }

  const XmlElement& joint(std::size_t j) const { return *found_[j]; }
  const XmlElement& body(std::size_t j) const { return *body_[j].front(); }
  const std::vector<const XmlElement*>& bodies(std::size_t j) const { return body_[j]; }
  const std::vector<FileJoint>& joints() const { return joint_; }
  const Vector3d& gravity() const { return gravity_; }
  double Stiffness(std::size_t j) const { return Values(*found_[j], class_[j]).Number("stiffness", 0); }

 private:
  // Attributes of an element, with what its class says where it says nothing.
  struct Attributes {
    std::map<std::string, std::string> text;
    std::string where;

    bool Has(const std::string& name) const { return text.contains(name); }
    const std::string& Text(const std::string& name) const { return text.at(name); }
    double Number(const std::string& name, double otherwise) const {
      return Has(name) ? Numbers(Text(name), 1, where + ": " + name)[0] : otherwise;
    }
    Vector3d Vector(const std::string& name, const Vector3d& otherwise) const {
      return Has(name) ? Three(Text(name), where + ": " + name) : otherwise;
    }
    std::vector<double> Several(const std::string& name, std::size_t count) const {
      return Numbers(Text(name), count, where + ": " + name);
    }
  };
  // Where a walk stands: the frame, the class of elements without one, the joint of the arm that moves all this.
  struct Place {
    Isometry3d pose;
    std::string childclass;
    std::optional<std::size_t> carrier;
  };

  std::string Text(const XmlAttribute& a) const { return text_.substr(a.begin, a.end - a.begin); }
  std::string Text(const XmlElement& e, const std::string& name, const std::string& otherwise) const {
    const XmlAttribute* const a = e.Attribute(name);
    return a ? Text(*a) : otherwise;
  }
  [[noreturn]] void Refuse(const XmlElement& e, const std::string& what) const {
    throw io::InputError(fmt::format("{}: <{}>{}: {}", file_, e.name,
                                     e.name_attribute.empty() ? "" : " \"" + e.name_attribute + "\"", what));
  }
  Attributes Values(const XmlElement& e, const std::string& childclass) const {
    Attributes out;
    out.where = fmt::format("{}: <{}>{}", file_, e.name, e.name_attribute.empty() ? "" : " " + e.name_attribute);
    if (e.name == "joint" || e.name == "geom") {
      const std::string own = Text(e, "class", childclass);
      const auto known = classes_.find(own);
      if (known == classes_.end() && own != "main") Refuse(e, "no class \"" + own + "\"");
      if (known != classes_.end())
        if (const auto values = known->second.find(e.name); values != known->second.end()) out.text = values->second;
    }
    for (const XmlAttribute& a : e.attribute) out.text[a.name] = Text(a);
    return out;
  }

  void ReadSection(const XmlElement& section) {
    if (section.name == "include") Refuse(section, "expected one whole file; MuJoCo writes one (mj_saveLastXML)");
    if (section.name == "default") ReadClasses(section, "main", {});
    if (section.name == "option")
      if (const XmlAttribute* g = section.Attribute("gravity")) gravity_ = Three(Text(*g), file_ + ": gravity");
    if (section.name != "compiler") return;
    degrees_ = Text(section, "angle", degrees_ ? "degree" : "radian") == "degree";
    eulerseq_ = Text(section, "eulerseq", eulerseq_);
    if (eulerseq_.size() != 3 || eulerseq_.find_first_not_of("xyzXYZ") != eulerseq_.npos)
      Refuse(section, "eulerseq: expected three letters of x, y and z, not \"" + eulerseq_ + "\"");
    if (Text(section, "inertiafromgeom", "auto") == "true")
      Refuse(section, "inertiafromgeom=\"true\": no <inertial> counts; expected \"auto\"");
    for (const char* key : {"settotalmass", "boundmass", "boundinertia"})
      if (const XmlAttribute* a = section.Attribute(key); a && Numbers(Text(*a), 1, file_ + ": " + key)[0] > 0)
        Refuse(section, std::string(key) + " changes what an <inertial> says; expected none");
  }
  void ReadClasses(const XmlElement& e, const std::string& name,
                   std::map<std::string, std::map<std::string, std::string>> values) {
    for (const XmlElement& child : e.child)
      if (child.name == "joint" || child.name == "geom")
        for (const XmlAttribute& a : child.attribute) values[child.name][a.name] = Text(a);
    const std::string own = Text(e, "class", name);
    classes_[own] = values;
    if (name == "main") classes_["main"] = values;
    for (const XmlElement& child : e.child)
      if (child.name == "default") ReadClasses(child, "", values);
  }

  double Angle(double value) const { return degrees_ ? value * std::numbers::pi / 180 : value; }
  Matrix3d Orientation(const Attributes& a) const {
    if (a.Has("quat")) {
      const auto q = a.Several("quat", 4);
      return Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
    }
    if (a.Has("axisangle")) {
      const auto v = a.Several("axisangle", 4);
      return Eigen::AngleAxisd(Angle(v[3]), Vector3d(v.data()).normalized()).toRotationMatrix();
    }
    if (a.Has("xyaxes")) {
      const auto v = a.Several("xyaxes", 6);
      Matrix3d R;
      R.col(0) = Vector3d(v.data()).normalized();
      const Vector3d y(v.data() + 3);
      R.col(1) = (y - R.col(0) * R.col(0).dot(y)).normalized();
      R.col(2) = R.col(0).cross(R.col(1));
      return R;
    }
    if (a.Has("zaxis")) return codegen::TurnFromZ(a.Vector("zaxis", Vector3d::UnitZ()));
    Matrix3d R = Matrix3d::Identity();
    if (!a.Has("euler")) return R;
    const Vector3d angle = a.Vector("euler", Vector3d::Zero());
    for (std::size_t k = 0; k < 3; ++k) {  // small letters: about the axes as they have been turned
      const char letter = eulerseq_.at(k);
      const Vector3d axis = Vector3d::Unit(std::tolower(static_cast<unsigned char>(letter)) - 'x');
      const Matrix3d turn = Eigen::AngleAxisd(Angle(angle[static_cast<Eigen::Index>(k)]), axis).toRotationMatrix();
      R = std::islower(static_cast<unsigned char>(letter)) ? Matrix3d(R * turn) : Matrix3d(turn * R);
    }
    return R;
  }
  Isometry3d PoseOf(const Attributes& a) const {
    Isometry3d T = Isometry3d::Identity();
    T.linear() = Orientation(a), T.translation() = a.Vector("pos", Vector3d::Zero());
    return T;
  }
  Body BodyOf(const Attributes& a) const {
    Body body{a.Number("mass", 0), Vector3d::Zero(), Matrix3d::Zero()};
    if (a.Has("fullinertia")) {
      const auto I = a.Several("fullinertia", 6);
      body.inertia = codegen::Symmetric(I[0], I[3], I[4], I[1], I[5], I[2]);
    } else {
      body.inertia = a.Vector("diaginertia", Vector3d::Zero()).asDiagonal();
    }
    return codegen::Moved(PoseOf(a), body);
  }

  void Walk(const XmlElement& e, const Place& at) {
    for (const XmlElement& child : e.child) {
      if (child.name == "body") {
        ReadBody(child, at);
      } else if (child.name == "frame") {
        Walk(child,
             {at.pose * PoseOf(Values(child, at.childclass)), Text(child, "childclass", at.childclass), at.carrier});
      } else if (at.carrier && (child.name == "replicate" || child.name == "composite" || child.name == "attach")) {
        Refuse(child, "is not read as a part of the arm; MuJoCo writes it out (mj_saveLastXML)");
      }
    }
  }
  void ReadBody(const XmlElement& body, const Place& at) {
    Place place{at.pose * PoseOf(Values(body, "main")), Text(body, "childclass", at.childclass), at.carrier};
    int joints = 0;
    for (const XmlElement& e : body.child) joints += e.name == "joint";
    for (const XmlElement& e : body.child) {
      if (e.name != "joint") continue;
      names_.push_back(e.name_attribute.empty() ? "(no name)" : e.name_attribute);
      const auto known = number_.find(e.name_attribute);
      if (known == number_.end()) continue;
      if (joints > 1) Refuse(body, "has several joints; expected one joint a body");
      place.carrier = known->second;
      ReadJoint(e, known->second, place);
    }
    if (place.carrier) AddPart(body, place);
    Walk(body, place);
  }
  // Turns the place from the reference position to the arm's zero.
  void ReadJoint(const XmlElement& e, std::size_t j, Place& place) {
    const Attributes a = Values(e, place.childclass);
    const std::string type = a.Has("type") ? a.Text("type") : "hinge";
    if (type != "hinge" && type != "slide") Refuse(e, "expected a hinge or a slide, not a " + type);
    FileJoint& joint = joint_[j];
    const Vector3d point = a.Vector("pos", Vector3d::Zero()), axis = a.Vector("axis", Vector3d::UnitZ()).normalized();
    joint.slides = type == "slide";
    joint.point = place.pose * point, joint.axis = place.pose.linear() * axis;
    const double ref = a.Number("ref", 0);
    if (joint.slides) place.pose.translate(-ref * axis);
    else
      place.pose = place.pose * Eigen::Translation3d(point) * Eigen::AngleAxisd(-Angle(ref), axis) *
                   Eigen::Translation3d(-point);
    found_[j] = &e, class_[j] = place.childclass;
  }
  void AddPart(const XmlElement& body, const Place& place) {
    const XmlElement* const inertial = body.Find("inertial");
    const bool own = joint_[*place.carrier].part.empty();
    if (!inertial && !own && HasWeight(body, place.childclass))
      Refuse(body, "its mass follows from its geoms; expected an <inertial> in it");
    const Body weighs = inertial ? BodyOf(Values(*inertial, "main")) : Body{};
    joint_[*place.carrier].part.push_back({body.name_attribute, place.pose, weighs});
    body_[*place.carrier].push_back(&body);
  }
  bool HasWeight(const XmlElement& body, const std::string& childclass) const {
    for (const XmlElement& e : body.child) {
      if (e.name == "frame" && HasWeight(e, Text(e, "childclass", childclass))) return true;
      if (e.name != "geom") continue;
      const Attributes a = Values(e, childclass);
      if (a.Number("mass", 1) > 0 && (a.Has("mass") || a.Number("density", 1000) > 0)) return true;
    }
    return false;
  }

  std::string file_;
  const std::string& text_;
  const XmlElement& root_;
  bool degrees_ = true;
  std::string eulerseq_ = "xyz";
  Vector3d gravity_{0, 0, -9.81};
  std::map<std::string, std::map<std::string, std::map<std::string, std::string>>>
      classes_;  // class, element, attribute
  std::map<std::string, std::size_t> number_;
  std::vector<std::string> names_;
  std::vector<FileJoint> joint_;
  std::vector<std::vector<const XmlElement*>> body_;  // of each joint
  std::vector<const XmlElement*> found_;
  std::vector<std::string> class_;
};

}  // namespace

Description ToMjcf(const DescribedArm& arm) {
  const codegen::Robot& robot = arm.robot;
  const auto& g = robot.gravity_mps2;
  Description d;
  d.text = XmlComment(Remark(arm)) + fmt::format("\n<mujoco model=\"{}\">\n", robot.name);
  d.text += "  <compiler angle=\"radian\" autolimits=\"true\"/>\n";
  d.text += fmt::format("  <option gravity=\"{} {} {}\"/>\n  <worldbody>\n", Exact(g[0]), Exact(g[1]), Exact(g[2]));
  std::string indent = "    ";
  for (std::size_t j = 0; j < arm.joint.size(); ++j, indent += "  ") {
    const Joint& joint = robot.joint[j];
    const DescribedJoint& own = arm.joint[j];
    const Isometry3d T = FrameOf(robot, j);
    d.text += fmt::format("{}<body name=\"{}\" pos=\"{}\" quat=\"{}\">\n", indent, XmlText(LinkName(robot, j)),
                          Exact(Vector3d(T.translation())), QuaternionText(Quaterniond(T.linear())));
    d.text += fmt::format("{}  {}\n", indent, Inertial(codegen::ToBody(own.body)).Text());
    XmlContent content{"joint",
                       {{"name", XmlText(joint.name)},
                        {"type", Slides(joint) ? "slide" : "hinge"},
                        {"axis", "0 0 1"},
                        {"range", Exact(joint.position_limit_rad[0]) + " " + Exact(joint.position_limit_rad[1])}}};
    for (const auto& value : JointValues(own).attribute) content.attribute.push_back(value);
    d.text += fmt::format("{}  {}\n", indent, content.Text());
  }
  for (std::size_t j = 0; j < arm.joint.size(); ++j) {
    indent.resize(indent.size() - 2);
    d.text += indent + "</body>\n";
  }
  d.text += "  </worldbody>\n  <actuator>\n";
  for (const Joint& joint : robot.joint)
    d.text += fmt::format("    <motor name=\"{0}_motor\" joint=\"{0}\" ctrlrange=\"{1} {2}\"/>\n", XmlText(joint.name),
                          Exact(-joint.torque_limit_Nm), Exact(joint.torque_limit_Nm));
  d.text += "  </actuator>\n</mujoco>\n";
  d.left_out = Effects(arm);
  for (const Joint& joint : robot.joint)
    d.left_out.push_back(fmt::format("speed limit of {} = {:.6g} {}", joint.name, joint.speed_limit_radps,
                                     Slides(joint) ? "m/s" : "rad/s"));
  return d;
}

namespace {

bool HasJoint(const XmlElement& body) { return body.Find("joint") != nullptr || body.Find("freejoint") != nullptr; }

}  // namespace

Description ToGivenMjcf(const DescribedArm& arm, const std::string& file, const std::string& text, bool merge) {
  XmlEdits edits(file, text);
  const GivenMjcf given(arm, file, text, edits.root());
  const Isometry3d base = BaseInFile(arm, given.joints(), file);
  io::Faults faults;
  Description d;
  for (std::size_t j = 0; j < arm.joint.size(); ++j) {
    const FileJoint& joint = given.joints()[j];
    FileJoint kept = joint;  // merged: the link, and what has a joint of its own, because MuJoCo needs its mass
    for (std::size_t k = kept.part.size(); merge && --k > 0;)
      if (!HasJoint(*given.bodies(j)[k])) kept.part.erase(kept.part.begin() + static_cast<std::ptrdiff_t>(k));
    const Body rest = RestOf(arm.joint[j].body, base * PoseAtZero(arm.robot, j), kept, false);
    if (const std::string why = WhyNoRest(rest, kept, file); !why.empty()) faults.Add(why);
    edits.SetChild(given.body(j), "inertial", Inertial(rest).Text());
    edits.SetAttributes(given.joint(j), JointValues(arm.joint[j]));
    for (std::size_t k = 1; merge && k < joint.part.size(); ++k) {
      if (!(joint.part[k].body.mass > 0) || HasJoint(*given.bodies(j)[k])) continue;
      edits.SetChild(*given.bodies(j)[k], "inertial", Inertial(Body{}).Text());
      d.left_out.push_back(fmt::format("inertial of {}: it is in {}", joint.part[k].link, joint.part[0].link));
    }
    if (given.Stiffness(j) != 0)
      d.left_out.push_back(fmt::format("stiffness: the file's own value stays in {}", arm.robot.joint[j].name));
  }
  faults.ThrowIfAny();
  d.text = edits.Apply();
  for (const std::string& line : Effects(arm)) d.left_out.push_back(line);
  const Vector3d gravity = base.linear() * Vector3d(arm.robot.gravity_mps2.data());
  if ((gravity - given.gravity()).norm() > 0.05)
    d.left_out.push_back(
        fmt::format("the mounting: gravity of the file is {} m/s^2, of the robot file {} in the same axes",
                    Exact(given.gravity()), Exact(gravity)));
  return d;
}

}  // namespace armcal::description
