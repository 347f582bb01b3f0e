// excitation - the model that a search looks at: the robot, and effects to look for that the robot does not declare.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "host_sim/identify/excitation/criterion.hpp"
#include "host_sim/identify/excitation/observation.hpp"

namespace armcal::excitation {

class Target {
 public:
  // The robot's own parameters, all of them.
  Target(const codegen::Robot& robot, const codegen::Catalogue& records, Criterion::Kind kind);
  // The motion is to tell these effects from each other and from all else. An effect is named "record" (every joint),
  // "record:2" or "record:1-2". found: effects whose nonlinear parameters are known; the others take those of the robot
  // or of the record. InputError: there is no such record or joint, or motion alone does not show the effect.
  Target(codegen::Robot robot, const codegen::Catalogue& records, const std::vector<std::string>& effects,
         const std::vector<codegen::EffectUse>& found = {});
  // Every parameter of friction, and a Stribeck term on every joint, so that the motion has low speeds, too.
  static Target Friction(const codegen::Robot& robot, const codegen::Catalogue& records);

  const Observation& observation() const { return *observation_; }
  const Criterion& criterion() const { return criterion_; }

 private:
  std::unique_ptr<codegen::Model> model_;
  std::unique_ptr<Observation> observation_;
  Criterion criterion_;
};

// True if some motion within the limits of speed and acceleration tells these effects from each other and from all
// else.
bool CanSeparate(const codegen::Robot& robot, const codegen::Catalogue& records,
                 const std::vector<std::string>& effects, const std::vector<codegen::EffectUse>& found = {});

// "cond(K)", ...
const char* Name(Criterion::Kind kind);

}  // namespace armcal::excitation
