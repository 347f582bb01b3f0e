// calibration - the drives' gains and the load at the flange, from runs with and without it; knows no file.
//
// One equation a joint over both kinds of log (the load's columns are those of the last link, turned into the flange):
//   gain_j tau_j = Y_j x + P_j load     tau: measured torque; load: m, m c, I about the flange's origin; zero without
// Without the load the gains have a common factor that nothing fixes; a mass that is known fixes it (M. Gautier,
// S. Briot, Global identification of drive gains parameters of robots using a known payload mass, 2011). The errors are
// in tau alone, because Y is derived from smoothed positions: a mixed total least squares problem, the minimum of
//   sum_j |gain_j tau_j - Y_j x - P_j load|^2 / (gain_j sigma_j)^2,
// reached by Gauss and Newton's steps in 1 / gain, in which its rows are measured torque minus predicted torque.
// Friction is taken to be the same in both runs; a run that warms the gears up first makes it so. Columns that depend
// on the estimate are taken at the robot file's values.
#pragma once

#include <vector>

#include "codegen/src/robot/payload.hpp"
#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::calibration {

struct LoadLogs {
  std::vector<const Dataset*> without, with;
};

struct DriveGain {
  double value = 1, sd = 0;  // true torque = value x measured torque; value x torque constant is the true constant
  bool determined = false;   // false: the logs say less than the torque constant's tolerance does
};

// The gains of all joints from a load of known mass; its centre and inertia are found with them where they are not
// known. Nothing is taken from the robot file's bodies. InputError: no load is seen, or a gain is not above zero.
std::vector<DriveGain> FindDriveGains(const codegen::Model& model, const LoadLogs& logs, const codegen::Payload& known);

struct Load {
  Eigen::VectorXd body;          // [10] m, c, I about the centre (xx xy xz yy yz zz), flange axes
  Eigen::VectorXd sd;            // [10]
  std::vector<bool> determined;  // [10] false: rests on what any load is like (see payload.cpp)
  bool was_physical = true;      // least squares alone already gave a body that can exist
};

// A load that nobody knows, with the torque constants' tolerance as a prior on the gains, and the robot file's bodies
// as one where there are some. The body returned can exist. InputError: no load is seen.
Load FindLoad(const codegen::Model& model, const LoadLogs& logs);

}  // namespace armcal::calibration
