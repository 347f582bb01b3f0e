// description - writes identified inertials, damping and friction into a URDF that is given.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/robot/urdf.hpp"
#include "host_sim/identify/description/described_arm.hpp"
#include "host_sim/identify/description/xml_places.hpp"

namespace armcal::description {

namespace {

using codegen::Body;

Eigen::Matrix3d AboutFrame(const Body& b) {
  return b.inertia + b.mass * (b.center.squaredNorm() * Eigen::Matrix3d::Identity() - b.center * b.center.transpose());
}

// The body without its parts, all in one frame; mass may come out zero or below.
Body Without(const Body& body, const std::vector<Body>& parts) {
  double mass = body.mass;
  Eigen::Vector3d first = body.mass * body.center;
  Eigen::Matrix3d second = AboutFrame(body);
  for (const Body& part : parts) mass -= part.mass, first -= part.mass * part.center, second -= AboutFrame(part);
  Body rest{mass, mass > 0 ? Eigen::Vector3d(first / mass) : Eigen::Vector3d::Zero(), second};
  const Body point{rest.mass, rest.center, Eigen::Matrix3d::Zero()};
  if (mass > 0) rest.inertia -= AboutFrame(point);
  return rest;
}

// What stands in an element: a name and its attributes.
struct Content {
  std::string element;
  std::vector<std::pair<std::string, std::string>> attribute;

  std::string Text() const {
    std::string text = "<" + element;
    for (const auto& [name, value] : attribute) text += fmt::format(" {}=\"{}\"", name, value);
    return text + "/>";
  }
};

std::vector<Content> InertialOf(const Body& b) {
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

std::string InertialText(const Body& b) {
  std::string text = "<inertial>\n";
  for (const Content& c : InertialOf(b)) text += "      " + c.Text() + "\n";
  return text + "    </inertial>";
}

// Changes of a text at places of the original; applied from the end.
class Edits {
 public:
  Edits(const std::string& file, const std::string& text) : file_(file), text_(text), root_(PlacesOf(file, text)) {}

  const XmlElement& Named(const std::string& element, const std::string& name) const {
    for (const XmlElement& e : root_.child)
      if (e.name == element && e.name_attribute == name) return e;
    throw io::InputError(file_ + ": " + element + " \"" + name + "\": not found as an element of its own");
  }
  // These attributes get these values. All else of the element stays.
  void SetAttributes(const XmlElement& e, const Content& content) {
    std::string added;
    for (const auto& [name, value] : content.attribute) {
      const auto same = [&name = name](const XmlAttribute& a) { return a.name == name; };
      const auto known = std::find_if(e.attribute.begin(), e.attribute.end(), same);
      if (known != e.attribute.end()) edit_.push_back({known->begin, known->end, value});
      else added += fmt::format(" {}=\"{}\"", name, value);
    }
    const std::size_t behind_name = e.begin + 1 + e.name.size();
    if (!added.empty()) edit_.push_back({behind_name, behind_name, added});
  }
  void SetInertial(const XmlElement& link, const Body& body) {
    const XmlElement* inertial = link.Find("inertial");
    if (!inertial || inertial->empty_tag) return SetChild(link, "inertial", InertialText(body));
    std::string added;
    for (const Content& c : InertialOf(body))
      if (const XmlElement* child = inertial->Find(c.element)) SetAttributes(*child, c);
      else added += "\n      " + c.Text();
    if (!added.empty()) edit_.push_back({inertial->inside, inertial->inside, added});
  }
  void SetDynamics(const XmlElement& joint, const Content& content) {
    if (const XmlElement* dynamics = joint.Find("dynamics")) SetAttributes(*dynamics, content);
    else SetChild(joint, "dynamics", content.Text());
  }
  // The child becomes `with`, or is added; empty: it is taken out.
  void SetChild(const XmlElement& parent, const std::string& child, const std::string& with) {
    const XmlElement* found = parent.Find(child);
    if (found) {
      std::size_t begin = found->begin;
      if (with.empty())  // with the space before it
        while (begin > 0 && (text_[begin - 1] == ' ' || text_[begin - 1] == '\t')) --begin;
      if (with.empty() && begin > 0 && text_[begin - 1] == '\n') --begin;
      edit_.push_back({begin, found->end, with});
    } else if (!with.empty() && parent.empty_tag) {
      const std::string tag = text_.substr(parent.begin, parent.end - parent.begin - 2);
      edit_.push_back({parent.begin, parent.end, tag + ">\n    " + with + "\n  </" + parent.name + ">"});
    } else if (!with.empty()) {
      edit_.push_back({parent.inside, parent.inside, "\n    " + with});
    }
  }
  std::string Apply() {
    std::sort(edit_.begin(), edit_.end(), [](const Edit& a, const Edit& b) { return a.begin > b.begin; });
    std::string out = text_;
    for (const Edit& e : edit_) out.replace(e.begin, e.end - e.begin, e.with);
    return out;
  }

 private:
  struct Edit {
    std::size_t begin, end;
    std::string with;
  };
  std::string file_;
  const std::string& text_;
  XmlElement root_;
  std::vector<Edit> edit_;
};

Body InDhFrame(const codegen::Link& link) {
  return {link.mass_kg, Eigen::Vector3d(link.center_m.data()), codegen::Symmetric(link.inertia_kgm2)};
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

Description ToUrdf(const DescribedArm& arm, const std::string& urdf, bool merge) {
  codegen::UrdfChoice choice = arm.robot.urdf;
  if (!urdf.empty()) choice.path = urdf;
  if (choice.path.empty())
    throw io::InputError(arm.robot.path + ": names no URDF, expected --urdf FILE, the URDF of this arm");
  const std::string file = choice.path.string();
  const codegen::UrdfChain chain = codegen::ReadUrdf(choice, codegen::UrdfBodies::kIgnored);
  RequireSameChain(arm, chain, file);
  const std::string text = codegen::UrdfText(choice.path);
  Edits edits(file, text);
  io::Faults faults;
  Description d;
  std::map<std::string, std::vector<std::string>> kept;  // other attributes of <dynamics>, and whose
  for (std::size_t j = 0; j < arm.joint.size(); ++j) {
    const auto& parts = chain.part[j];
    std::vector<Body> fixed;
    std::string names;
    for (std::size_t k = 1; k < parts.size(); ++k) {
      if (codegen::HasInertiaOnly(parts[k].body)) {
        edits.SetChild(edits.Named("link", parts[k].link), "inertial", "");
        d.left_out.push_back("inertial of " + parts[k].link + ": it has no mass");
      }
      if (!(parts[k].body.mass > 0)) continue;
      names += (names.empty() ? "" : ", ") + parts[k].link;
      if (!merge) fixed.push_back(codegen::Moved(parts[k].pose, parts[k].body));
      else edits.SetChild(edits.Named("link", parts[k].link), "inertial", "");
    }
    const Body rest = codegen::Moved(parts[0].pose.inverse(), Without(InDhFrame(arm.joint[j].body), fixed));
    if (const std::string missing = codegen::Impossible(rest); !missing.empty())
      faults.Add(file + ": link \"" + parts[0].link + "\" without " + names + ": expected " + missing +
                 "; --merge writes the whole body into it");
    edits.SetInertial(edits.Named("link", parts[0].link), rest);
    const XmlElement& joint = edits.Named("joint", arm.robot.joint[j].name);
    edits.SetDynamics(
        joint,
        {"dynamics", {{"damping", Exact(arm.joint[j].viscous_Nmsprad)}, {"friction", Exact(arm.joint[j].coulomb_Nm)}}});
    if (const XmlElement* given = joint.Find("dynamics"))
      for (const XmlAttribute& a : given->attribute)
        if (a.name != "damping" && a.name != "friction") kept[a.name].push_back(arm.robot.joint[j].name);
    if (merge && !names.empty())
      d.left_out.push_back(fmt::format("inertials of {}: they are in {}", names, parts[0].link));
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
