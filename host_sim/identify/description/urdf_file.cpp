// description - writes identified inertials, damping and friction into a URDF that is given.
#include <fmt/format.h>

#include <map>

#include "codegen/src/io/faults.hpp"
#include "codegen/src/robot/urdf.hpp"
#include "host_sim/identify/description/file_text.hpp"
#include "host_sim/identify/description/moving_body.hpp"
#include "host_sim/identify/description/xml_edits.hpp"

namespace armcal::description {

namespace {

using codegen::Body;

std::vector<XmlContent> InertialOf(const Body& b) {
  const Eigen::Matrix3d& I = b.inertia;
  return {{"origin", {{"xyz", Exact(b.center)}, {"rpy", "0 0 0"}}},
          {"mass", {{"value", Exact(b.mass)}}},
          {"inertia",
           {{"ixx", Exact(I(0, 0))},
            {"ixy", Exact(I(0, 1))},
            {"ixz", Exact(I(0, 2))},
            {"iyy", Exact(I(1, 1))},
            {"iyz", Exact(I(1, 2))},
            {"izz", Exact(I(2, 2))}}}};
}

void SetInertial(XmlEdits& edits, const XmlElement& link, const Body& body) {
  const XmlElement* inertial = link.Find("inertial");
  std::string added;
  for (const XmlContent& c : InertialOf(body)) {
    const XmlElement* child = inertial ? inertial->Find(c.element) : nullptr;
    if (child) edits.SetAttributes(*child, c);
    else added += "\n      " + c.Text();
  }
  if (!inertial) edits.SetChild(link, "inertial", "<inertial>" + added + "\n    </inertial>");
  else if (!added.empty()) edits.Insert(*inertial, added);
}

void SetDynamics(XmlEdits& edits, const XmlElement& joint, const DescribedJoint& own) {
  const XmlContent content{"dynamics", {{"damping", Exact(own.viscous_Nmsprad)}, {"friction", Exact(own.coulomb_Nm)}}};
  if (const XmlElement* dynamics = joint.Find("dynamics")) edits.SetAttributes(*dynamics, content);
  else edits.SetChild(joint, "dynamics", content.Text());
}

const XmlElement& Named(const XmlEdits& edits, const std::string& element, const std::string& name,
                        const std::string& file) {
  for (const XmlElement& e : edits.root().child)
    if (e.name == element && e.name_attribute == name) return e;
  throw io::InputError(file + ": " + element + " \"" + name + "\": not found as an element of its own");
}

void RequireSameChain(const DescribedArm& arm, const codegen::UrdfChain& chain, const std::string& file) {
  bool same = chain.joint.size() == arm.joint.size();
  for (std::size_t j = 0; same && j < chain.joint.size(); ++j) {
    const codegen::JointKinematics &a = chain.joint[j].kinematics, &b = arm.robot.joint[j].kinematics;
    same = chain.joint[j].name == arm.robot.joint[j].name && a.type == b.type &&
           std::abs(a.alpha_rad - b.alpha_rad) + std::abs(a.a_m - b.a_m) + std::abs(a.d_m - b.d_m) +
                   std::abs(a.theta_rad - b.theta_rad) <
               1e-9;
  }
  if (!same)
    throw io::InputError(file + ": expected the arm of robot " + arm.robot.name +
                         ": the same moving joints, names and axes");
}

}  // namespace

Description ToGivenUrdf(const DescribedArm& arm, const std::string& urdf, bool merge) {
  codegen::UrdfChoice choice = arm.robot.urdf;
  if (!urdf.empty()) choice.path = urdf;
  if (choice.path.empty())
    throw io::InputError(arm.robot.path + ": names no URDF, expected --into FILE, the URDF of this arm");
  const std::string file = choice.path.string();
  const codegen::UrdfChain chain = codegen::ReadUrdf(choice);
  RequireSameChain(arm, chain, file);
  const std::string text = codegen::UrdfText(choice.path);
  XmlEdits edits(file, text);
  const auto link = [&](const std::string& name) -> const XmlElement& { return Named(edits, "link", name, file); };
  io::Faults faults;
  Description d;
  std::map<std::string, std::vector<std::string>> kept;  // other attributes of <dynamics>, and whose
  for (std::size_t j = 0; j < arm.joint.size(); ++j) {
    FileJoint own;
    for (const auto& part : chain.part[j]) own.part.push_back({part.link, part.pose, part.body});
    std::vector<std::string> gave;
    for (std::size_t k = 1; k < own.part.size(); ++k) {
      const FilePart& part = own.part[k];
      const bool weightless = codegen::HasInertiaOnly(part.body);
      if (weightless) d.left_out.push_back("inertial of " + part.link + ": it has no mass");
      if (merge && part.body.mass > 0) gave.push_back(part.link);
      if (weightless || (merge && part.body.mass > 0)) edits.SetChild(link(part.link), "inertial", "");
    }
    const Body rest = RestOf(arm.joint[j].body, Eigen::Isometry3d::Identity(), own, merge);
    if (const std::string why = WhyNoRest(rest, own, file); !why.empty()) faults.Add(why);
    SetInertial(edits, link(own.part[0].link), rest);
    const XmlElement& joint = Named(edits, "joint", arm.robot.joint[j].name, file);
    SetDynamics(edits, joint, arm.joint[j]);
    if (const XmlElement* given = joint.Find("dynamics"))
      for (const XmlAttribute& a : given->attribute)
        if (a.name != "damping" && a.name != "friction") kept[a.name].push_back(arm.robot.joint[j].name);
    if (!gave.empty())
      d.left_out.push_back(fmt::format("inertials of {}: they are in {}", fmt::join(gave, ", "), own.part[0].link));
  }
  faults.ThrowIfAny();
  d.text = edits.Apply();
  for (const auto& [attribute, joints] : kept)
    d.left_out.push_back(
        fmt::format("{} of <dynamics>: the file's own value stays in {}", attribute, fmt::join(joints, ", ")));
  for (const std::string& line : NotInUrdf(arm)) d.left_out.push_back(line);
  return d;
}

}  // namespace armcal::description
