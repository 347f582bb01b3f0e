// methods - tests whether the noise of a log is in its regressors, too: a Durbin-Wu-Hausman test for each joint.
//
// Least squares is biased where the torque's error and the columns of Y share a cause. Such a cause is the noise of a
// derived speed or acceleration, or torque noise that came back through the controller.
// Instruments are the same columns along a motion without that noise. The part v of the columns that the instruments do
// not explain is added to the equation,
//   tau_j = Y_j x + v g + e,
// and the test asks whether g = 0. x is then the estimate by instrumental variables; the difference between its
// prediction and that of least squares is the bias. (A. Janot, P.-O. Vandanjon, M. Gautier, A revised Durbin-Wu-Hausman
// test for industrial robot identification, Control Engineering Practice 48, 2016.)
// e need not be white: an autoregressive model of the residual whitens the rows before the F statistic is formed.
// A torque that the model lacks can fail the test, too, if the motion's difference from the instruments varies with it.
#pragma once

#include <string>
#include <vector>

#include "host_sim/identify/methods/method.hpp"

namespace armcal::calibration {

struct JointExogeneity {
  int rows = 0, restrictions = 0;   // restrictions 0: too few rows, or the instruments say nothing
  double F = 0, p = 1;              // chance of an F this large without a common cause
  double bias_Nm = 0, left_Nm = 0;  // RMS of the torque by which the two estimates differ; of the residual
  bool exogenous = true;            // false: p fails Holm's rule at 5 % over all joints, and the bias matters
};

struct Exogeneity {
  std::string instruments;  // "simulated loop", ...; CheckExogeneity fills it in
  std::vector<JointExogeneity> joint;
  bool passed() const;
};

// instruments: the same logs along another motion, row by row. Each joint has its own parameters; there is no prior.
// Columns that depend on the estimate, and nonlinear effects, are taken at z = [columns, eta].
Exogeneity TestExogeneity(const codegen::Model& model, const std::vector<const Dataset*>& data,
                          const std::vector<Dataset>& instruments, const Eigen::VectorXd& z);

// Instruments, best first. Along the simulated loop at z: Problem::closed_loop; InputError where it runs away.
std::vector<Dataset> SimulatedInstruments(const Problem& problem, const Eigen::VectorXd& z);
// Along the commanded motion, which every log must have.
std::vector<Dataset> ReferenceInstruments(const std::vector<const Dataset*>& data);
// Along the measured motion below a fifth of its bandwidth, where little of the noise is left.
std::vector<Dataset> SmoothedInstruments(const std::vector<const Dataset*>& data);

// The values of Exogeneity::instruments.
inline constexpr const char* kSimulatedLoop = "simulated loop";
inline constexpr const char* kCommandedMotion = "commanded motion";
inline constexpr const char* kSmoothedPositions = "smoothed positions";

// The best instruments to try. A simulation takes seconds.
enum class Instruments { kSimulated, kCommanded };

// Takes the best instruments there are: from the simulated loop if the robot file has a control law and every log a
// reference, else from the reference, else from smoothed positions. z: [columns, eta].
Exogeneity CheckExogeneity(const codegen::Model& model, const std::vector<Dataset>& data, const Eigen::VectorXd& z,
                           Instruments best);

}  // namespace armcal::calibration
