// excitation - the model that a search looks at: the robot's own, and effects that are to show although the robot does
// not have them. Knows no trajectory.
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
  // effects: to be told apart and from all else: "record" (every joint), "record:2", "record:1-2". found: uses whose
  // nonlinear parameters are known; those of the others are the robot's or the record's. InputError: no such record or
  // joints, or one whose column motion alone does not show.
  Target(codegen::Robot robot, const codegen::Catalogue& records, const std::vector<std::string>& effects,
         const std::vector<codegen::EffectUse>& found = {});
  // Every parameter of friction, and a Stribeck term on every joint: it shows where low speeds do.
  static Target Friction(const codegen::Robot& robot, const codegen::Catalogue& records);

  const Observation& observation() const { return *observation_; }
  const Criterion& criterion() const { return criterion_; }

 private:
  std::unique_ptr<codegen::Model> model_;
  std::unique_ptr<Observation> observation_;
  Criterion criterion_;
};

// Some motion within the limits of speed and acceleration tells these effects from each other and from all else.
bool CanSeparate(const codegen::Robot& robot, const codegen::Catalogue& records,
                 const std::vector<std::string>& effects, const std::vector<codegen::EffectUse>& found = {});

// "cond(K)", ...
const char* Name(Criterion::Kind kind);

}  // namespace armcal::excitation
