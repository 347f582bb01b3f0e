// calibration - finds the low-pass and the delay with which a log's torque was measured, and passes predictions
// through.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::calibration {

// A channel at the times of a log: all that does not depend on the torque. Exact with one low-pass, for a torque that
// is linear between samples.
class ChannelAt {
 public:
  ChannelAt(const Eigen::VectorXd& t, const JointChannel& channel);
  // Torques [N x columns] as the channel shows them.
  Eigen::MatrixXd Through(const Eigen::MatrixXd& torque) const;

 private:
  template <Eigen::Index kColumns>
  void LowPass(double* first) const;

  int passes_;  // of the low-pass
  bool is_late_;
  std::vector<Eigen::Index> before_;  // [N] the last sample before what a row shows
  Eigen::VectorXd share_;             // [N] how far that is on the way to the next sample
  Eigen::VectorXd rest_, ramp_;       // [N] of the step to this sample
};
Eigen::VectorXd ThroughChannel(const Eigen::VectorXd& t, const Eigen::VectorXd& torque, const JointChannel& channel);

// The channel of a joint of the log.
JointChannel ChannelOf(const Dataset& data, int joint);
// The same for a joint of a log, with the log's own channel; for all joints [N x n].
Eigen::VectorXd ThroughChannel(const Dataset& data, int joint, Eigen::VectorXd torque);
Eigen::MatrixXd ThroughChannel(const Dataset& data, Eigen::MatrixXd torque);
// The columns [N x columns] of each joint's row of the regressor, in place.
void PassThroughChannel(const Dataset& data, std::vector<Eigen::MatrixXd>& regressor);

// A row shows what its joint did late_s before. Does not use it if the joint was at rest or turned at about that time.
void UseWhatMoved(Dataset& data);

// The channel of all joints that leaves least where each joint's row of the regressor is fitted by itself, with
// parameters of its own: only motion and torque of that joint decide. Empty unless most of the joints that move show a
// low-pass, or delays that differ. One joint alone may have another cause, and a delay that all share is an effect
// (time_delay) that the search names.
TorqueChannel SeeChannel(const codegen::Model& model, const std::vector<const Dataset*>& logs);

}  // namespace armcal::calibration
