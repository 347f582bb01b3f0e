// end-to-end tests - draws a scenario with one undeclared effect of each kind that the simulated drive knows.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host_sim/data/trajectory/trajectory.hpp"
#include "host_sim/machine/plant/arm.hpp"

namespace armcal::tests {

inline const std::string kDrawnArm = "codegen/robots/er20_like.toml";

inline constexpr double kUnscaled = 0;

struct DrawnKind {
  std::string kind;
  // Names that one log of 40 s cannot tell from the kind, and itself. Empty: the declared model takes it up, so nothing
  // is to be said. With free bodies and friction that holds for a wrong gain of one joint, too: 14 to 24 % on joints 3
  // and 5 leave no more than noise.
  std::vector<std::string> names;
  std::vector<int> joints;  // from 1, one of which is drawn; empty: it has none
  // The effect's keys behind `kind` and `joint`; a larger `strength` is a larger effect.
  std::function<std::string(plant::Random& random, int joint, double strength)> keys;
  // Where it may be named beside its own joint: it is one cause that shows in several.
  bool any_joint = false;
  double smallest = 3, largest = 6;  // of its size; kUnscaled: its keys draw it as large as it is
};

const std::vector<DrawnKind>& DrawnKinds();

struct DrawnScenario {
  std::string text;
  int joint = 0;    // from 1; 0: none
  double size = 0;  // RMS of its own torque, averaged over a sample, over the noise of one sample; of the joint where
                    // it is largest
};

// Its size along the motion is drawn evenly between the kind's bounds. Equal seeds give equal scenarios.
DrawnScenario DrawScenario(const DrawnKind& kind, std::uint64_t seed, const trajectory::TrajectorySpline& motion);

}  // namespace armcal::tests
