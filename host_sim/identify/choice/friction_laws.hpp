// choice - friction laws as effects of a robot file: the survey's, and two that it does not have.
#pragma once

#include <string>
#include <vector>

#include "codegen/src/generator/model.hpp"

namespace armcal::choice {

struct FrictionLaw {
  std::string name;  // the record beside Coulomb and viscous friction, or in their place; these alone: coulomb_viscous
  std::string equation;  // of the survey: "(4)"; empty: not among its laws
  std::string title;
  int parameters = 0;  // of one joint
};

// By number of parameters; coulomb_viscous is the first. (9) is not among them: it reads the load of a payload whose
// mass and centre are declared, and that load has to change between runs.
std::vector<FrictionLaw> FrictionLaws(const codegen::Catalogue& records);

// The robot with the law of each joint, estimated. Its other effects stay. InputError: it declares one of the laws
// itself.
codegen::Robot WithLaws(const codegen::Robot& robot, const std::vector<FrictionLaw>& law_of_joint);

}  // namespace armcal::choice
