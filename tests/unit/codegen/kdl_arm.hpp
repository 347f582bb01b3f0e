// tests - an arm in Orocos KDL built from a robot file: the independent oracle for rigid dynamics.
#pragma once

#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>

#include "codegen/src/generator/rigid_body.hpp"
#include "codegen/src/robot/robot.hpp"

namespace armcal::tests {

// KDL's segment is "joint, then tip"; modified DH puts the joint at the end of a row, so each row's fixed part is the
// tip of the segment before. bodies: 11 per link (m, mc, I about the link origin, rotor). KDL wants the inertia about
// the centre.
class KdlArm {
 public:
  KdlArm(const codegen::Robot& robot, const Eigen::VectorXd& bodies) : n_(robot.joints()) {
    const auto& R = robot.base_rotation;
    base_ = {KDL::Rotation(R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8]),
             KDL::Vector(robot.base_xyz_m[0], robot.base_xyz_m[1], robot.base_xyz_m[2])};
    for (int j = 0; j < n_; ++j) rotor_.push_back(bodies[11 * j + 10]);
    const auto fixed = [&](int j) {
      const auto& k = robot.joint[j].kinematics;
      // theta and d offsets belong to the fixed part, too: rotations and shifts about the joint's own z commute with
      // the joint
      return KDL::Frame::DH_Craig1989(k.a_m, k.alpha_rad, k.d_m, k.theta_rad);
    };
    chain_.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), fixed(0)));
    for (int j = 0; j < n_; ++j) {
      const auto type =
          robot.joint[j].kinematics.type == codegen::JointType::kRevolute ? KDL::Joint::RotZ : KDL::Joint::TransZ;
      const double* b = bodies.data() + 11 * j;
      const double m = b[0];
      const KDL::Vector c(b[1] / m, b[2] / m, b[3] / m);
      const KDL::RotationalInertia origin(b[4], b[7], b[9], b[5], b[6], b[8]);
      // about the centre: Ic = Io - m (|c|^2 E - c c')
      const KDL::RotationalInertia centre(b[4] - m * (c.y() * c.y() + c.z() * c.z()),
                                          b[7] - m * (c.x() * c.x() + c.z() * c.z()),
                                          b[9] - m * (c.x() * c.x() + c.y() * c.y()), b[5] + m * c.x() * c.y(),
                                          b[6] + m * c.x() * c.z(), b[8] + m * c.y() * c.z());
      // the body belongs to the frame after the joint, before the next fixed part: its own segment
      chain_.addSegment(KDL::Segment(KDL::Joint(type), KDL::Frame::Identity(), KDL::RigidBodyInertia(m, c, centre)));
      if (j + 1 < n_) chain_.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), fixed(j + 1)));
    }
    double g[3] = {};
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 3; ++i) g[k] += R[3 * i + k] * robot.gravity_mps2[i];
    solver_ = std::make_unique<KDL::ChainIdSolver_RNE>(chain_, KDL::Vector(g[0], g[1], g[2]));
  }

  // The last link's frame seen from the robot file's base.
  KDL::Frame Flange(const Eigen::VectorXd& q) const {
    KDL::JntArray x(n_);
    for (int j = 0; j < n_; ++j) x(j) = q[j];
    KDL::Frame out;
    if (KDL::ChainFkSolverPos_recursive(chain_).JntToCart(x, out) < 0) throw std::runtime_error("KDL refused");
    return base_ * out;
  }

  KdlArm(const KdlArm&) = delete;  // the solver points at the chain
  KdlArm& operator=(const KdlArm&) = delete;

  Eigen::VectorXd Torque(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& qdd) {
    KDL::JntArray a(n_), v(n_), x(n_), tau(n_);
    for (int j = 0; j < n_; ++j) x(j) = q[j], v(j) = qd[j], a(j) = qdd[j];
    const KDL::Wrenches none(chain_.getNrOfSegments(), KDL::Wrench::Zero());
    if (solver_->CartToJnt(x, v, a, none, tau) < 0) throw std::runtime_error("KDL refused");
    Eigen::VectorXd out(n_);
    for (int j = 0; j < n_; ++j) out[j] = tau(j) + rotor_[j] * qdd[j];
    return out;
  }

 private:
  int n_;
  std::vector<double> rotor_;
  KDL::Chain chain_;
  KDL::Frame base_;
  std::unique_ptr<KDL::ChainIdSolver_RNE> solver_;
};

}  // namespace armcal::tests
