// judged set - holds the forms of set II: effects from physics, most of which no record holds exactly.
#pragma once

#include "tests/judged/effects.hpp"

namespace armcal::judged {

// One form. `e` comes with everything empty; a maker draws it.
struct Form {
  const char* name;
  bool recorded;     // false: no record has its cause, only its joint and signals can be said
  bool report_only;  // nothing was tuned on it
  std::function<void(const Arm& arm, plant::Random& random, Effect& e)> make;
};

// Of one joint without memory; of one joint with memory; of several joints, the flange or the base.
const std::vector<Form>& JointForms();
const std::vector<Form>& MemoryForms();
const std::vector<Form>& ArmForms();

// All of them, in an order that mixes the kinds.
std::vector<Form> AllForms(bool report);
// The form made: kind is the form's name unless a record holds it exactly.
Effect DrawForm(const Form& form, const Arm& arm, plant::Random& random);

// How a gear passes torque on: from the deflection (link minus motor, rad) and its rate to the torque on the link.
using GearLaw = std::function<double(double deflection_rad, double rate_radps)>;
// A joint whose logged position is the motor's: the link behind the gear swings, falls through a gap, ... One-axis
// dynamics with the inertia of the whole arm about this joint at each pose; what the arm then needs goes to all joints.
// It starts at rest where the gear holds the first sample's load.
Eigen::MatrixXd BehindGear(const Arm& arm, const Motion& m, const Eigen::MatrixXd& links, int joint,
                           const std::function<GearLaw(double inertia_kgm2)>& law);

}  // namespace armcal::judged
