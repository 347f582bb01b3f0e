// calibration - checks logs against each other and against the arm's kinematics, without link data.
#pragma once

#include <string>
#include <vector>

#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::calibration {

// What one exchange or change of sign would gain.
struct ColumnGain {
  std::string what;                  // "columns q2 and q3 seem to be exchanged"
  double gain = 0;                   // fall of the sum over joints of the log of the share of variance left
  double as_given = 0, changed = 0;  // share of the torque's spread that the fit leaves, geometric mean over joints
};

// The change of columns that a fit with free bodies likes best: two q, two tau or both exchanged, the sign of a q, a
// tau or both, time 10 or 100 times as fast or as slow. Up to three such changes one after another. gain 0: none gains,
// or a torque fits worse under it.
ColumnGain BestColumnChange(const codegen::Model& model, const std::vector<const Dataset*>& data);

// Faults that friction does not show and under which these logs fit as well, in words: signs of a position with its
// torque, exchanged joints, time in another unit. Faults that no log of the arm can show are in untold.hpp.
std::vector<std::string> EquallyGood(const codegen::Model& model, const std::vector<const Dataset*>& data);

// Fits the declared model with free bodies and returns what is worth a line: joints of which the model explains
// nothing, friction that feeds energy. InputError, one line that names the log: columns are exchanged, have the wrong
// sign or another time; a torque is noise; a joint's friction would drive it; a position rests while its torque shows
// motion. The logs are one arm's; one that does not fit the others is looked at alone.
std::vector<std::string> CheckColumns(const codegen::Model& model, const std::vector<const Dataset*>& data);

}  // namespace armcal::calibration
