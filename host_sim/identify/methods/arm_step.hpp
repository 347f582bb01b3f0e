// methods - moves an arm by one short step under torques of your choice.
//
// The arm is M(q) qdd + V(q, qd) + G(q) + friction and effects = tau, from the model's own expressions. A step is
// implicit in the sign of friction (Moreau's time stepping): a joint's speed after a step is the one at which all
// torques balance, or zero where friction can hold it. So the sign needs no smoothing, and a joint at rest stays there.
#pragma once

#include "host_sim/identify/methods/effect_point.hpp"

namespace armcal::calibration {

// Holds scratch: one object a thread.
class ArmStep {
 public:
  // InputError for a model with memory: see EffectPoint.
  explicit ArmStep(const codegen::Model& model);

  void SetParameters(const Eigen::VectorXd& z) { z_ = z; }  // z = [p, eta]
  // Mass matrix, Coriolis and gravity torque at q and qd. Call it for the middle of the step.
  void SetDynamics(const Eigen::VectorXd& q, const Eigen::VectorXd& qd);

  // Friction and effects, each joint in both directions. `speed`: its size is taken, at least kSlowest v_min.
  // A column that reads another joint's speed gets that speed with the sign of `speed` if the model has such columns.
  struct Instant {
    double t = 0;
    Eigen::VectorXd q, speed, qdd, temp;  // temp may be empty
  };
  void SetFriction(const Instant& at);

  // The speed after h under the torque law - kp (q + h (before + qd) / 2) - kd qd. Writes qd and returns the torque.
  struct Law {
    const Eigen::VectorXd &torque, &kp, &kd;
  };
  Eigen::VectorXd Step(double h, const Law& law, const Eigen::VectorXd& q, const Eigen::VectorXd& before,
                       Eigen::VectorXd& qd);
  // The same under a torque that does not depend on the motion.
  void Step(double h, const Eigen::VectorXd& torque, const Eigen::VectorXd& before, Eigen::VectorXd& qd);
  // The same where a joint that moves keeps the friction of its direction, even if its speed changes sign: who looks
  // for the instant of the turn finds it on the straight line from `before` to qd.
  void Slide(double h, const Eigen::VectorXd& torque, const Eigen::VectorXd& before, Eigen::VectorXd& qd);

 private:
  void Balance(const Eigen::VectorXd& right, const Eigen::VectorXd& forward, const Eigen::VectorXd& backward,
               Eigen::VectorXd& qd) const;

  const codegen::Model& model_;
  EffectPoint effects_;
  codegen::Graph graph_;
  codegen::Tape dynamics_;   // M (upper triangle, by column), V, G
  std::vector<int> source_;  // of each input: joint, n + joint, 2 n + base parameter
  bool crossed_ = false;     // a joint's friction or effect reads another joint's speed
  std::vector<double> input_, scratch_, value_;
  Eigen::VectorXd z_, bias_, forward_, backward_;
  Eigen::MatrixXd mass_, A_;
};

}  // namespace armcal::calibration
