// calibration - finds the drives' gains and the load at the flange from runs with and without that load.
//
// Each joint has one equation over both kinds of log:
//   gain_j tau_j = Y_j x + P_j load
// tau is the measured torque. load holds m, m c and I about the flange's origin, and is zero in runs without it. P_j
// are the last link's columns, turned into the flange's frame. Without the load nothing fixes a factor that all gains
// share. A load of known mass does (M. Gautier, S. Briot, Global identification of drive gains parameters of robots
// using a known payload mass, 2011). The errors are in tau alone, because Y is derived from smoothed positions. So this
// is a mixed total least squares problem, the minimum of
//   sum_j |gain_j tau_j - Y_j x - P_j load|^2 / (gain_j sigma_j)^2.
// Gauss and Newton's steps in 1 / gain reach it; there a row is measured minus predicted torque.
// Friction must be the same in both runs: warm the gears up first. Columns that depend on the estimate are taken at the
// robot file's values.
#pragma once

#include <vector>

#include "codegen/src/robot/payload.hpp"
#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::calibration {

constexpr int kLoadParameters = 10;  // m, m c and I about the flange's origin
constexpr double kMassSeen = 4;      // standard deviations by which a mass must differ from zero

// Variance of a load's parameter i > 0 where nothing but its mass is known: it lies about half a metre from the flange.
double LoadVariance(int i, double mass_kg);

struct LoadLogs {
  std::vector<const Dataset*> without, with;
};

struct DriveGain {
  double value = 1, sd = 0;  // true torque = value x measured torque; value x torque constant is the true constant
  bool determined = false;   // false: the logs say less than the torque constant's tolerance does
};

// The gains of all joints from a load of known mass. Its centre and inertia are found, too, where they are not known.
// The robot file's bodies are not used. InputError: no load is seen, or a gain is not above zero.
std::vector<DriveGain> FindDriveGains(const codegen::Model& model, const LoadLogs& logs, const codegen::Payload& known);

struct Load {
  Eigen::VectorXd body;          // [10] m, c, I about the centre (xx xy xz yy yz zz), flange axes
  Eigen::VectorXd sd;            // [10]
  std::vector<bool> determined;  // [10] false: rests on the prior of any load (payload.cpp)
  bool was_physical = true;      // least squares alone gave a body that can exist

  // Half of the 95 % interval of parameter i. Mass and centre lie in their four intervals at once, and so does the
  // inertia in its six.
  double HalfWidth95(int i) const;
};

// An unknown load. The torque constants' tolerance is the prior of the gains; the robot file's bodies, if it has any,
// are the prior of the arm. The body returned can exist. InputError: no load is seen.
Load FindLoad(const codegen::Model& model, const LoadLogs& logs);

}  // namespace armcal::calibration
