// methods - simulates the arm under its control law with parameters of your choice, and logs along that motion.
//
// pd_feedforward: tau = tau_ff(reference) + kp (qref - q) + kd (qdref - qd), cut to the torque limits. The arm is
// M(q) qdd + V(q, qd) + G(q) + friction and effects = tau, from the model's own expressions.
//
// An arm without rotor inertia is very stiff: 0.003 kg m^2 against 8 N m of friction. So a step, half a control period
// long, is implicit in the control law, as it is in friction's sign (arm_step.hpp), and every gain is stable. The
// sampled law's delay of half a period is left out.
#pragma once

#include <string>
#include <vector>

#include "host_sim/identify/methods/arm_step.hpp"
#include "host_sim/identify/methods/method.hpp"

namespace armcal::calibration {

struct LoopSettings {
  Eigen::VectorXd feedforward;  // [z] the controller's own parameters; empty: the model's table (the CAD values)
  bool encoder = false;         // the controller reads position and its difference in encoder steps
};

// The motion at the sample times asked for. q_read: what the encoder reads (q itself without encoder).
struct LoopRun {
  codegen::Signals s;
  Eigen::MatrixXd q_read, tau;  // [N x n] rad, N m
  bool complete = true;         // false: the motion blew up; from there on NaN
};

class LoopSimulator {
 public:
  // InputError: no [control] in the robot file, another structure, or a model with memory.
  LoopSimulator(const codegen::Model& model, const LoopSettings& settings = {});

  // reference [N x n] at the times t, joined by a quintic spline; starts on it. z: the arm's parameters.
  LoopRun Run(const Eigen::VectorXd& t, const Eigen::MatrixXd& reference, const Eigen::VectorXd& z);

 private:
  Eigen::MatrixXd FeedForward(const codegen::Signals& reference) const;
  void Step(double h, const Eigen::VectorXd& law, const Eigen::VectorXd& kp, const Eigen::VectorXd& kd);

  const codegen::Model& model_;
  LoopSettings settings_;
  ArmStep arm_;
  Eigen::VectorXd kp_, kd_, limit_, resolution_;
  Eigen::VectorXd q_, qd_, qdd_, tau_;
};

// For Problem::closed_loop: one simulation a call, along the log's `reference`. InputError for a log without one.
ClosedLoop MakeClosedLoop(const codegen::Model& model, const LoopSettings& settings = {});

// The training logs with their signals replaced by those of a simulated arm.
class LoopLogs {
 public:
  // Simulates the arm of problem.start. InputError naming the method where the problem has no closed loop, or where
  // not even that arm can be simulated.
  LoopLogs(const Problem& problem, const char* method);

  // Simulates the arm of problem.start + share (z - start) and returns the share. It is 1 if the arm of z follows the
  // path of the start's arm within a tenth of each joint's motion; under one control law two arms take nearly the same
  // path. An estimate from noisy data may have a negative inertia and not follow. Then the share is the largest one
  // tried that does. It never grows from call to call, since an iteration would otherwise jump between two shares.
  double Simulate(const Eigen::VectorXd& z);
  const std::vector<Dataset>& logs() const { return logs_; }  // of the last call

 private:
  bool Run(const Eigen::VectorXd& z);

  const Problem& problem_;
  std::vector<Dataset> start_, logs_;
  double share_ = 1;
};

}  // namespace armcal::calibration
