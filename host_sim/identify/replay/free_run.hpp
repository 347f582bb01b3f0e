// replay - simulates an arm in open loop: from a logged torque and a state at the start, without any feedback.
//
// Between two samples the torque is a straight line, and a step takes its mean. A step is second order in its length
// and implicit in the sign of friction (methods/arm_step.hpp): a joint that friction can hold stands still. It is cut
// at the instant at which a joint stops. End stops are not part of a model: a motion beyond the position limits goes
// on.
#pragma once

#include <string>

#include "host_sim/data/logs/log.hpp"
#include "host_sim/identify/methods/arm_step.hpp"

namespace armcal::replay {

// What was measured, N samples of n joints: joint units, torque with known external torque, torque gains not applied.
struct Record {
  Eigen::VectorXd t;
  Eigen::MatrixXd q, torque, temp;  // temp: 0 x 0 if the log has none
  std::string source;
  int samples() const { return static_cast<int>(t.size()); }
};
Record MakeRecord(const logs::Log& log);

struct State {
  Eigen::VectorXd q, qd;  // [n]
};

// [p, eta], and the torque gain deviations [n]: measured torque = (1 + kappa) x torque.
struct Parameters {
  Eigen::VectorXd z, kappa;
};

class FreeRun {
 public:
  // InputError for a model with memory. step_s: a step is as many whole samples as fit into it, or the whole part of a
  // sample that does.
  FreeRun(const codegen::Model& model, double step_s);

  // Positions at the samples first, first + stride, ... of the log, from `start` at `first`: [count + 1 x n] for the
  // whole strides up to `last`. Rows after a runaway (1000 rad or m) are NaN.
  Eigen::MatrixXd Run(const Record& log, int first, int last, const State& start, const Parameters& p);
  int Stride(const Record& log) const;

 private:
  void Advance(double h, double t, const Eigen::VectorXd& torque, const Eigen::VectorXd& temp);

  const codegen::Model& model_;
  calibration::ArmStep arm_;
  double step_s_;
  Eigen::VectorXd q_, qd_, qdd_;
};

// State in the middle of the first `samples` samples: a parabola through their positions, by least squares.
// InputError: fewer than 3 samples, or more than the log has.
State StateFromFirst(const Record& log, int samples);

}  // namespace armcal::replay
