// description - an arm with its parameters, as other programs describe it: bodies, friction, and what else there is.
#pragma once

#include <string>
#include <vector>

#include "host_sim/identify/calibration/given.hpp"

namespace armcal::description {

struct Value {
  std::string name, unit;
  double value = 0;
};

// One joint and the body that it moves, in the DH frame of the joint.
struct DescribedJoint {
  codegen::Link body;
  double rotor_kgm2 = 0;                       // on the joint's side; kg for a slide
  double coulomb_Nm = 0, viscous_Nmsprad = 0;  // N, N s/m for a slide
  double torque_scale = 1;                     // true torque = this times what the drive says
};

struct DescribedArm {
  codegen::Robot robot;  // names, kinematics, limits; its own bodies and friction do not count
  std::string source;    // what the values come from
  std::uint32_t schema = 0;
  std::vector<DescribedJoint> joint;
  std::vector<Value> effect;  // all other parameters, zeros left out
};

// Throws io::InputError: `given` has base parameters only; a body that cannot exist.
DescribedArm Describe(const codegen::Model& model, const calibration::Given& given, const std::string& source);

// A complete description, and what the format cannot hold, a line each.
struct Description {
  std::string text;
  std::vector<std::string> left_out;
};

Description ToSdf(const DescribedArm& arm);
Description ToMjcf(const DescribedArm& arm);
Description ToYaml(const DescribedArm& arm);
Description ToHeader(const DescribedArm& arm);

// The same values written into a file that is given: inertials, friction and rotor inertia of the moving links and
// joints are replaced, and every other byte stays as it was. Joints are found by their names. Links that are fixed to a
// moving link keep their inertials, and the moving link gets what is left of the identified body; merge: the moving
// link gets all of it, and the fixed links lose their inertials. Joints that are not the arm's are held. Throws
// io::InputError: another kind of file, another arm, a rest that cannot exist. urdf: empty: the one that the robot file
// names.
Description ToGivenUrdf(const DescribedArm& arm, const std::string& urdf, bool merge);
// file: the name for errors. Link frames are the file's own: the arm is found by the axes of its joints.
Description ToGivenSdf(const DescribedArm& arm, const std::string& file, const std::string& text);
Description ToGivenMjcf(const DescribedArm& arm, const std::string& file, const std::string& text, bool merge);

}  // namespace armcal::description
