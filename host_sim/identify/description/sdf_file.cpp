// description - SDF: a file that is written whole, and values written into one that is given.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numbers>

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
using Eigen::Vector3d;

std::string Pose(const Isometry3d& T) {
  return Exact(Vector3d(T.translation())) + " " + Exact(ToRollPitchYaw(T.linear()));
}

std::string Element(const std::string& name, const std::string& text) {
  return fmt::format("<{0}>{1}</{0}>", name, text);
}

// <pose>, <mass> and <inertia> of an <inertial>: name and content. quaternion: the rotation of the pose is one.
std::vector<std::pair<std::string, std::string>> InertialElements(const Body& body, bool quaternion = false) {
  std::string inertia;
  const auto component = codegen::ToLink(body).inertia_kgm2;
  for (std::size_t k = 0; k < component.size(); ++k) inertia += Element(kInertiaName[k], Exact(component[k]));
  return {{"pose", Exact(body.center) + (quaternion ? " 0 0 0 1" : " 0 0 0")},
          {"mass", Exact(body.mass)},
          {"inertia", inertia}};
}

// The pose of the link's <inertial> gives its rotation as a quaternion.
bool HasQuaternion(const XmlElement& link, const std::string& text) {
  const XmlElement* inertial = link.Find("inertial");
  const XmlElement* pose = inertial == nullptr ? nullptr : inertial->Find("pose");
  const XmlAttribute* format = pose == nullptr ? nullptr : pose->Attribute("rotation_format");
  return format != nullptr && text.substr(format->begin, format->end - format->begin) == "quat_xyzw";
}

// The links and joints of the model that has the arm's joints.
class GivenSdf {
 public:
  GivenSdf(const DescribedArm& arm, const std::string& file, const std::string& text, const XmlElement& root)
      : file_(file), text_(text) {
    if (root.name != "sdf") throw io::InputError(file + ": expected SDF, a file that begins with <sdf>");
    FindModel(root, arm.robot.joint.front().name);
    for (const XmlElement& e : model_->child)
      if (e.name == "link" || e.name == "joint" || e.name == "frame") named_[e.name_attribute] = &e;
    for (const Joint& joint : arm.robot.joint) {
      const auto known = named_.find(joint.name);
      if (known == named_.end() || known->second->name != "joint")
        throw io::InputError(fmt::format("{}: no joint \"{}\"; expected the joints of robot {}, the model has {}", file,
                                         joint.name, arm.robot.name, fmt::join(JointNames(), ", ")));
      ReadJoint(*known->second);
    }
    for (std::size_t j = 0; j < arm.joint.size(); ++j) Gather(ChildText(*element_[j], "child"), j);
  }

  const XmlElement& joint(std::size_t j) const { return *element_[j]; }
  const XmlElement& link(std::size_t j) const { return *named_.at(joint_[j].part[0].link); }
  const std::vector<FileJoint>& joints() const { return joint_; }

 private:
  std::string Text(const XmlElement& e) const { return text_.substr(e.inside, e.close - e.inside); }
  // Of the child element, without space around; `otherwise` if there is none.
  std::string ChildText(const XmlElement& e, const std::string& child, const std::string& otherwise = "") const {
    const XmlElement* const found = e.Find(child);
    if (!found) return otherwise;
    const std::string text = Text(*found);
    const std::size_t begin = text.find_first_not_of(" \t\r\n"), end = text.find_last_not_of(" \t\r\n");
    return begin == text.npos ? "" : text.substr(begin, end - begin + 1);
  }
  std::string AttributeOf(const XmlElement& e, const std::string& name, const std::string& otherwise) const {
    const XmlAttribute* const a = e.Attribute(name);
    return a ? text_.substr(a->begin, a->end - a->begin) : otherwise;
  }
  std::string Where(const XmlElement& e) const {
    return fmt::format("{}: <{}> \"{}\"", file_, e.name, e.name_attribute);
  }

  // The first <model>, at any depth of worlds, with a joint of this name.
  void FindModel(const XmlElement& e, const std::string& joint) {
    const XmlElement* only = nullptr;
    for (const XmlElement& child : e.child) {
      if (child.name == "world") FindModel(child, joint);
      if (child.name != "model" || model_) continue;
      only = &child;
      for (const XmlElement& inner : child.child)
        if (inner.name == "joint" && inner.name_attribute == joint) model_ = &child;
    }
    if (model_) return;
    if (e.name != "sdf") return;
    if (!only) throw io::InputError(file_ + ": expected a <model> with joint \"" + joint + "\"");
    model_ = only;  // the missing joint is named with those that are there
  }
  std::vector<std::string> JointNames() const {
    std::vector<std::string> out;
    for (const XmlElement& e : model_->child)
      if (e.name == "joint") out.push_back(e.name_attribute);
    return out;
  }

  // What stands in <pose>, or identity.
  Isometry3d OwnPose(const XmlElement& e) const {
    Isometry3d T = Isometry3d::Identity();
    const XmlElement* const pose = e.Find("pose");
    if (!pose || Text(*pose).find_first_not_of(" \t\r\n") == std::string::npos) return T;
    const bool quaternion = AttributeOf(*pose, "rotation_format", "euler_rpy") == "quat_xyzw";
    const auto v = Numbers(Text(*pose), quaternion ? 7 : 6, Where(e) + ": pose");
    T.translation() = Vector3d(v.data());
    if (quaternion) {
      T.linear() = Eigen::Quaterniond(v[6], v[3], v[4], v[5]).normalized().toRotationMatrix();
      return T;
    }
    const double unit = AttributeOf(*pose, "degrees", "false") == "true" ? std::numbers::pi / 180 : 1;
    T.linear() = codegen::RollPitchYaw(unit * Vector3d(v.data() + 3));
    return T;
  }
  // Of a link, joint or frame, in the model, all joints at zero.
  Isometry3d PoseOf(const std::string& name, int depth = 0) const {
    if (name == "__model__" || name == "world") return Isometry3d::Identity();
    const auto known = named_.find(name);
    if (known == named_.end())
      throw io::InputError(
          fmt::format("{}: no link or frame \"{}\" in model \"{}\"; expected one model without <include>", file_, name,
                      model_->name_attribute));
    if (depth > static_cast<int>(named_.size()))
      throw io::InputError(Where(*known->second) + ": its pose leads to itself");
    const XmlElement& e = *known->second;
    std::string base = "__model__";
    if (e.name == "joint") base = ChildText(e, "child");
    if (e.name == "frame") base = AttributeOf(e, "attached_to", base);
    const XmlElement* const pose = e.Find("pose");
    if (pose) base = AttributeOf(*pose, "relative_to", base);
    return PoseOf(base, depth + 1) * OwnPose(e);
  }
  void ReadJoint(const XmlElement& e) {
    const std::string type = AttributeOf(e, "type", "");
    if (type != "revolute" && type != "continuous" && type != "prismatic")
      throw io::InputError(Where(e) + ": expected type revolute, continuous or prismatic, not \"" + type + "\"");
    const XmlElement* const axis = e.Find("axis");
    if (!axis) throw io::InputError(Where(e) + ": expected an <axis>");
    const XmlElement* const xyz = axis->Find("xyz");
    const Isometry3d T = PoseOf(e.name_attribute);
    std::string in = xyz ? AttributeOf(*xyz, "expressed_in", "") : "";
    const std::string in_model = ChildText(*axis, "use_parent_model_frame");  // of old versions
    if (in_model == "1" || in_model == "true") in = "__model__";
    const Vector3d v = xyz ? Three(Text(*xyz), Where(e) + ": axis") : Vector3d::UnitZ();
    joint_.push_back(
        {T.translation(), ((in.empty() ? T : PoseOf(in)).linear() * v).normalized(), type == "prismatic", {}});
    element_.push_back(&e);
  }
  // The link, and all that hangs on it but for the arm's joints.
  void Gather(const std::string& name, std::size_t j) {
    const Isometry3d pose = PoseOf(name);
    const XmlElement& link = *named_.at(name);
    if (joint_[j].part.size() > named_.size()) throw io::InputError(Where(link) + ": its joints make a loop");
    joint_[j].part.push_back({name, pose, BodyOf(link)});
    for (const XmlElement& e : model_->child)
      if (e.name == "joint" && ChildText(e, "parent") == name &&
          std::find(element_.begin(), element_.end(), &e) == element_.end())
        Gather(ChildText(e, "child"), j);
  }
  Body BodyOf(const XmlElement& link) const {
    const XmlElement* const inertial = link.Find("inertial");
    Body body{1, Vector3d::Zero(), Eigen::Matrix3d::Identity()};  // what SDF says of a link that says nothing
    if (!inertial) return body;
    const auto number = [this, &link](const XmlElement& e, const std::string& key, double otherwise) {
      return e.Find(key) ? Numbers(ChildText(e, key), 1, Where(link) + ": " + key)[0] : otherwise;
    };
    body.mass = number(*inertial, "mass", 1);
    if (const XmlElement* const I = inertial->Find("inertia"))
      body.inertia = codegen::Symmetric(number(*I, "ixx", 1), number(*I, "ixy", 0), number(*I, "ixz", 0),
                                        number(*I, "iyy", 1), number(*I, "iyz", 0), number(*I, "izz", 1));
    return codegen::Moved(OwnPose(*inertial), body);
  }

  std::string file_;
  const std::string& text_;
  const XmlElement* model_ = nullptr;
  std::map<std::string, const XmlElement*> named_;
  std::vector<const XmlElement*> element_;  // the arm's joints
  std::vector<FileJoint> joint_;
};

}  // namespace

Description ToSdf(const DescribedArm& arm) {
  const codegen::Robot& robot = arm.robot;
  Description d;
  d.text = "<?xml version=\"1.0\"?>\n" + XmlComment(Remark(arm)) + "\n<sdf version=\"1.8\">\n";
  d.text += fmt::format("  <model name=\"{}\">\n    <static>false</static>\n    <link name=\"base\">\n", robot.name);
  d.text += "      <inertial><mass>1</mass></inertial>\n    </link>\n";
  d.text += "    <joint name=\"base_to_world\" type=\"fixed\"><parent>world</parent><child>base</child></joint>\n";
  for (std::size_t j = 0; j < arm.joint.size(); ++j) {
    const Joint& joint = robot.joint[j];
    const std::string parent = j == 0 ? "base" : LinkName(robot, j - 1);
    d.text += fmt::format("    <link name=\"{}\">\n      <pose relative_to=\"{}\">{}</pose>\n      <inertial>\n",
                          XmlText(LinkName(robot, j)), XmlText(parent), Pose(FrameOf(robot, j)));
    for (const auto& [name, content] : InertialElements(codegen::ToBody(arm.joint[j].body)))
      d.text += "        " + Element(name, content) + "\n";
    d.text += fmt::format("      </inertial>\n    </link>\n    <joint name=\"{}\" type=\"{}\">\n", XmlText(joint.name),
                          Slides(joint) ? "prismatic" : "revolute");
    d.text +=
        fmt::format("      <parent>{}</parent>\n      <child>{}</child>\n      <axis>\n        <xyz>0 0 1</xyz>\n",
                    XmlText(parent), XmlText(LinkName(robot, j)));
    d.text += fmt::format(
        "        <limit><lower>{}</lower><upper>{}</upper><effort>{}</effort><velocity>{}</velocity></limit>\n",
        Exact(joint.position_limit_rad[0]), Exact(joint.position_limit_rad[1]), Exact(joint.torque_limit_Nm),
        Exact(joint.speed_limit_radps));
    d.text += fmt::format("        <dynamics><damping>{}</damping><friction>{}</friction></dynamics>\n",
                          Exact(arm.joint[j].viscous_Nmsprad), Exact(arm.joint[j].coulomb_Nm));
    d.text += "      </axis>\n    </joint>\n";
  }
  d.text += "  </model>\n</sdf>\n";
  d.left_out = NotInUrdf(arm);
  return d;
}

Description ToGivenSdf(const DescribedArm& arm, const std::string& file, const std::string& text) {
  XmlEdits edits(file, text);
  const GivenSdf given(arm, file, text, edits.root());
  const Isometry3d base = BaseInFile(arm, given.joints(), file);
  io::Faults faults;
  Description d;
  for (std::size_t j = 0; j < arm.joint.size(); ++j) {
    const FileJoint& joint = given.joints()[j];
    const Body rest = RestOf(arm.joint[j].body, base * PoseAtZero(arm.robot, j), joint, false);
    if (const std::string why = WhyNoRest(rest, joint, file, "mend what these weigh in the file"); !why.empty())
      faults.Add(why);
    edits.SetChildren(given.link(j), "inertial", InertialElements(rest, HasQuaternion(given.link(j), text)));
    edits.SetChildren(*given.joint(j).Find("axis"), "dynamics",
                      {{"damping", Exact(arm.joint[j].viscous_Nmsprad)}, {"friction", Exact(arm.joint[j].coulomb_Nm)}});
  }
  faults.ThrowIfAny();
  d.text = edits.Apply();
  d.left_out = NotInUrdf(arm);
  return d;
}

}  // namespace armcal::description
