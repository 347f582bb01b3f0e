// judged set - holds what lies between an arm's torque and the log's column.
#pragma once

#include "tests/judged/arm.hpp"

namespace armcal::judged {

struct Channel {
  std::string name = "plain";
  // Per joint: two equal first-order lags of this pole, 0: none; and a delay. Empty: no joint has any.
  Eigen::VectorXd pole_Hz, delay_s;
  bool late() const { return pole_Hz.size() > 0; }
  double stamp_jitter = 0;   // standard deviation of a stamp over the step; the samples are even
  double sample_jitter = 0;  // the samples are taken off the even times, and the stamps say so
  int hold = 1;              // rows that repeat each sample
  int fed_joint = -1;        // its friction is fed back `fed` times by the drive: the channel shows the rest
  double fed = 0;
};

// A torque sampled every `step_s` as the channel passes it on. Exact for a torque that is linear between samples.
Eigen::VectorXd Passed(const Channel& channel, int joint, const Eigen::VectorXd& torque, double step_s);
Eigen::MatrixXd Passed(const Channel& channel, const Eigen::MatrixXd& torque, double step_s);

}  // namespace armcal::judged
