// methods - what methods that simulate the closed loop share; knows no single method.
#pragma once

#include <functional>
#include <vector>

#include "host_sim/identify/methods/method.hpp"

namespace armcal::calibration {

// The training logs with their signals replaced by those of a simulated arm.
class LoopLogs {
 public:
  // Simulates the arm of problem.start. InputError naming the method where the problem has no closed loop, or where
  // not even that arm can be simulated.
  LoopLogs(const Problem& problem, const char* method);

  // At problem.start + share (z - start): at z itself (1), or, where that arm does not follow the start's within a
  // tenth of each joint's motion (an estimate of noise may have a negative inertia), at the largest share tried that
  // does. Under one control law two arms take nearly the same path. The share never grows again from call to call: a
  // method that iterates would go back and forth between two shares.
  double Simulate(const Eigen::VectorXd& z);
  const std::vector<Dataset>& logs() const { return logs_; }  // of the last call

 private:
  bool Run(const Eigen::VectorXd& z);

  const Problem& problem_;
  std::vector<Dataset> start_, logs_;
  double share_ = 1;
};

// One round of a method: from the simulated logs at z to the next z, and its covariance.
using LoopRound =
    std::function<Eigen::VectorXd(const std::vector<Dataset>& simulated, const Eigen::VectorXd& z, Solution& solution)>;

// Simulates and takes a round until no coordinate changes by more than a fiftieth of its standard deviation.
Solution IterateOnLoop(const Problem& problem, const char* method, int most, const LoopRound& round);

}  // namespace armcal::calibration
