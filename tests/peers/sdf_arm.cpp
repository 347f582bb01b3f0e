// peers - libsdformat as a reader and as a writer of SDF, for exports_test.py.
//
//   sdf_arm convert IN.urdf OUT.sdf     a URDF as libsdformat understands it
//   sdf_arm read FILE.sdf               the links and joints of the file's model as JSON, poses in the model's frame
#include <cstdio>
#include <fstream>
#include <iostream>
#include <sdf/sdf.hh>

namespace {

int Report(const sdf::Errors& errors) {
  for (const sdf::Error& e : errors) std::cerr << e << "\n";
  return errors.empty() ? 0 : 1;
}

void Print(const ignition::math::Pose3d& pose) {
  const auto& p = pose.Pos();
  const auto& q = pose.Rot();
  std::printf("[%.17g, %.17g, %.17g, %.17g, %.17g, %.17g, %.17g]", p.X(), p.Y(), p.Z(), q.W(), q.X(), q.Y(), q.Z());
}

int Read(const char* file) {
  sdf::Root root;
  if (const int failed = Report(root.Load(file))) return failed;
  const sdf::Model& model = *root.Model();
  sdf::Errors errors;
  const auto add = [&errors](const sdf::Errors& more) { errors.insert(errors.end(), more.begin(), more.end()); };
  std::printf("{\"link\": [");
  for (std::uint64_t k = 0; k < model.LinkCount(); ++k) {
    const sdf::Link& link = *model.LinkByIndex(k);
    ignition::math::Pose3d pose;
    add(link.SemanticPose().Resolve(pose));
    const auto& inertial = link.Inertial();
    const auto I = inertial.MassMatrix().Moi();
    std::printf("%s{\"name\": \"%s\", \"pose\": ", k ? ",\n" : "", link.Name().c_str());
    Print(pose);
    std::printf(", \"mass\": %.17g, \"inertial_pose\": ", inertial.MassMatrix().Mass());
    Print(inertial.Pose());
    std::printf(", \"inertia\": [%.17g, %.17g, %.17g, %.17g, %.17g, %.17g]}", I(0, 0), I(0, 1), I(0, 2), I(1, 1),
                I(1, 2), I(2, 2));
  }
  std::printf("],\n\"joint\": [");
  for (std::uint64_t k = 0; k < model.JointCount(); ++k) {
    const sdf::Joint& joint = *model.JointByIndex(k);
    ignition::math::Pose3d pose;
    add(joint.SemanticPose().Resolve(pose, "__model__"));
    ignition::math::Vector3d axis;
    const sdf::JointAxis* const own = joint.Axis();
    if (own) add(own->ResolveXyz(axis, "__model__"));
    std::printf("%s{\"name\": \"%s\", \"parent\": \"%s\", \"child\": \"%s\", \"slides\": %s, \"fixed\": %s, \"pose\": ",
                k ? ",\n" : "", joint.Name().c_str(), joint.ParentLinkName().c_str(), joint.ChildLinkName().c_str(),
                joint.Type() == sdf::JointType::PRISMATIC ? "true" : "false",
                joint.Type() == sdf::JointType::FIXED ? "true" : "false");
    Print(pose);
    std::printf(", \"axis\": [%.17g, %.17g, %.17g], \"damping\": %.17g, \"friction\": %.17g}", axis.X(), axis.Y(),
                axis.Z(), own ? own->Damping() : 0.0, own ? own->Friction() : 0.0);
  }
  std::printf("]}\n");
  return Report(errors);
}

int Convert(const char* in, const char* out) {
  const sdf::SDFPtr sdf(new sdf::SDF());
  sdf::init(sdf);
  sdf::Errors errors;
  if (!sdf::readFile(in, sdf, errors)) return Report(errors) + 1;
  std::ofstream(out) << sdf->ToString();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string verb = argc > 1 ? argv[1] : "";
  if (verb == "read" && argc == 3) return Read(argv[2]);
  if (verb == "convert" && argc == 4) return Convert(argv[2], argv[3]);
  std::cerr << "sdf_arm: expected convert IN.urdf OUT.sdf, or read FILE.sdf\n";
  return 2;
}
