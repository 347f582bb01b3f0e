// survey - what somebody may believe before any data: set parameters off by a chance that a seed decides; knows no
// method.
#pragma once

#include <cstdint>

#include "host_sim/study/survey/arm.hpp"

namespace armcal::survey {

// How far the CAD values lie from the truth. kWorst: each entry times 1 + width or 1 - width; kUniform: anywhere
// between.
struct PriorError {
  enum Kind { kWorst, kUniform } kind = kUniform;
  double width = 0.2;
};
std::string PriorName(const PriorError& error);  // "uniform +-20 %"
// Relative standard deviation of such an error: what a method is told.
double RelativeDeviation(const PriorError& error);

// The robot as CAD knows it: m, c, I about the centre of every link, its friction and effects' means, each off by the
// error. A body that cannot exist is drawn again. Its [prior] deviations are those of the error, without floors.
codegen::Robot DrawPrior(const codegen::Robot& truth, const PriorError& error, std::uint64_t seed);

// A truth for (4): qs log-uniform in 0.05 .. 0.2 rad/s, Fs / Fc in 1.1 .. 1.5, per joint.
Stribeck DrawStribeck(int joints, std::uint64_t seed);
// The middle of that range: what is believed before the draw.
Stribeck BelievedStribeck(int joints);

}  // namespace armcal::survey
