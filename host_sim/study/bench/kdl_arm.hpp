// bench - the yardstick that Debian has: one inverse-dynamics call of Orocos KDL for the same arm.
#pragma once

#include <memory>
#include <vector>

#include <kdl/chain.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>

namespace armcal::bench {
namespace {

// One joint as the robot file has it: modified DH (Craig).
struct JointShape {
  double alpha_rad, a_m, d_m, theta_rad;
  bool prismatic;
};

// bodies: 11 a link as in the parameter table: m, m c, I about the link origin (xx xy xz yy yz zz), rotor.
class KdlArm {
 public:
  KdlArm(const std::vector<JointShape>& joints, const double* gravity_mps2, const double* bodies)
      : n_(static_cast<unsigned>(joints.size())), torque_(n_) {
    const auto before = [&](unsigned j) {
      return KDL::Frame::DH_Craig1989(joints[j].a_m, joints[j].alpha_rad, joints[j].d_m, joints[j].theta_rad);
    };
    // KDL's segment is a joint and the tip behind it; DH has the fixed part in front of the joint. So the fixed part of
    // the next joint is this segment's tip, in which KDL wants the body: no segment more than the arm has joints.
    if (const KDL::Frame first = before(0); !KDL::Equal(first, KDL::Frame::Identity()))
      chain_.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), first));
    for (unsigned j = 0; j < n_; ++j) {
      const double* b = bodies + 11 * j;
      const KDL::Vector c(b[1] / b[0], b[2] / b[0], b[3] / b[0]);
      const KDL::RotationalInertia origin(b[4], b[7], b[9], b[5], b[6], b[8]);
      const KDL::RotationalInertia centre = KDL::RigidBodyInertia(-b[0], c).getRotationalInertia() + origin;
      const KDL::Frame tip = j + 1 < n_ ? before(j + 1) : KDL::Frame::Identity();
      chain_.addSegment(KDL::Segment(KDL::Joint(joints[j].prismatic ? KDL::Joint::TransZ : KDL::Joint::RotZ), tip,
                                     tip.Inverse() * KDL::RigidBodyInertia(b[0], c, centre)));
      rotor_.push_back(b[10]);
    }
    none_.assign(chain_.getNrOfSegments(), KDL::Wrench::Zero());
    solver_ = std::make_unique<KDL::ChainIdSolver_RNE>(chain_,
                                                       KDL::Vector(gravity_mps2[0], gravity_mps2[1], gravity_mps2[2]));
  }

  void Add(const double* q, const double* qd, const double* qdd) {
    State s{KDL::JntArray(n_), KDL::JntArray(n_), KDL::JntArray(n_)};
    for (unsigned j = 0; j < n_; ++j) s.q(j) = q[j], s.qd(j) = qd[j], s.qdd(j) = qdd[j];
    state_.push_back(s);
  }
  std::size_t states() const { return state_.size(); }
  // What is timed: one call, nothing else.
  [[gnu::noinline]] const KDL::JntArray& Call(std::size_t k) {
    solver_->CartToJnt(state_[k].q, state_[k].qd, state_[k].qdd, none_, torque_);
    return torque_;
  }
  double torque(std::size_t k, unsigned j) { return Call(k)(j) + rotor_[j] * state_[k].qdd(j); }

 private:
  struct State {
    KDL::JntArray q, qd, qdd;
  };
  unsigned n_;
  KDL::Chain chain_;
  KDL::Wrenches none_;
  KDL::JntArray torque_;
  std::vector<double> rotor_;
  std::vector<State> state_;
  std::unique_ptr<KDL::ChainIdSolver_RNE> solver_;
};

}  // namespace
}  // namespace armcal::bench
