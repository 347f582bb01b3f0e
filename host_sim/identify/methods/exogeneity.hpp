// methods - is the noise of a log in its regressors, too? A Durbin-Wu-Hausman test, joint by joint; knows no file.
//
// Least squares is biased where the error of the torque and the columns of Y share a cause: noise of a derived speed or
// acceleration, or the torque's own noise that came back through the controller. Instruments are the same columns along
// a motion without that noise. What they leave of the columns, v, is added to the equation,
//   tau_j = Y_j x + v g + e,
// and g = 0 is what is tested; x is then the instrumental variables' estimate, and what it predicts other than least
// squares is the bias. (A. Janot, P.-O. Vandanjon, M. Gautier, A revised Durbin-Wu-Hausman test for industrial robot
// identification, Control Engineering Practice 48, 2016.) e need not be white: rows are whitened by an autoregressive
// model of the residual before the F statistic is formed. A torque that the model lacks can fail the test, too, where
// the motion differs from the instruments' in step with it.
#pragma once

#include <string>
#include <vector>

#include "host_sim/identify/methods/method.hpp"

namespace armcal::calibration {

struct JointExogeneity {
  int rows = 0, restrictions = 0;   // restrictions 0: too few rows, or instruments that say nothing
  double F = 0, p = 1;              // chance of an F this large without a common cause
  double bias_Nm = 0, left_Nm = 0;  // RMS of the torque by which the two estimates differ; of the residual
  bool exogenous = true;            // false: p by Holm's rule at 5 % over all joints, and a bias that matters
};

struct Exogeneity {
  std::string instruments;  // "simulated loop", ...; filled by who made them
  std::vector<JointExogeneity> joint;
  bool passed() const;
};

// instruments: the same logs along another motion, row by row. Each joint has its own parameters, no prior. z:
// [columns, eta], where columns that depend on the estimate and nonlinear effects are taken.
Exogeneity TestExogeneity(const codegen::Model& model, const std::vector<const Dataset*>& data,
                          const std::vector<Dataset>& instruments, const Eigen::VectorXd& z);

// Instruments, best first. Along the simulated loop at z: Problem::closed_loop; InputError where it runs away.
std::vector<Dataset> SimulatedInstruments(const Problem& problem, const Eigen::VectorXd& z);
// Along the commanded motion, which every log must have.
std::vector<Dataset> ReferenceInstruments(const std::vector<const Dataset*>& data);
// Along the measured motion below a fifth of its bandwidth: what is left of the noise there hardly counts.
std::vector<Dataset> SmoothedInstruments(const std::vector<const Dataset*>& data);

// What `Exogeneity::instruments` says.
inline constexpr const char* kSimulatedLoop = "simulated loop";
inline constexpr const char* kCommandedMotion = "commanded motion";
inline constexpr const char* kSmoothedPositions = "smoothed positions";

// The best instruments that are asked for; a simulation takes seconds.
enum class Instruments { kSimulated, kCommanded };

// Instruments from the simulated loop where the robot file has a control law and every log a reference, else from the
// reference, else from smoothed positions. z: [columns, eta].
Exogeneity CheckExogeneity(const codegen::Model& model, const std::vector<Dataset>& data, const Eigen::VectorXd& z,
                           Instruments best);

}  // namespace armcal::calibration
