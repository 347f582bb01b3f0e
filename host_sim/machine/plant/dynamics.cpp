// plant - builds KDL chains from DH rows or a URDF's places, and bodies about their centres.
#include "host_sim/machine/plant/dynamics.hpp"

namespace armcal::plant {
namespace {

// Each segment ends in its own link frame (its joint turns about, or slides along, an axis of that frame), so bodies
// are handed to KDL in the frame in which the robot file gives them.
KDL::Chain MakeChain(const RobotFile& robot, const std::vector<Body>& bodies,
                     const std::optional<AttachedBody>& payload) {
  KDL::Chain chain;
  KDL::Frame before = robot.base_frame;
  for (std::size_t k = 0; k < robot.joint.size(); ++k) {
    const JointData& joint = robot.joint[k];
    const KDL::Frame at_zero =
        before * (joint.place ? joint.place->frame
                              : KDL::Frame::DH_Craig1989(joint.a_m, joint.alpha_rad, joint.d_m, joint.theta_rad));
    const KDL::Vector axis = at_zero.M * (joint.place ? joint.place->axis : KDL::Vector(0, 0, 1));
    KDL::RigidBodyInertia inertia = ToKdl(bodies[k]);
    if (payload && k + 1 == robot.joint.size()) inertia = inertia + payload->frame * ToKdl(payload->body);
    const auto kind = joint.prismatic ? KDL::Joint::TransAxis : KDL::Joint::RotAxis;
    chain.addSegment(KDL::Segment(joint.name, KDL::Joint(joint.name, at_zero.p, axis, kind), at_zero, inertia));
    before = KDL::Frame::Identity();
  }
  return chain;
}

}  // namespace

Dynamics::Dynamics(const RobotFile& robot, const std::vector<Body>& bodies, const KDL::Vector& gravity_mps2,
                   const std::optional<AttachedBody>& payload)
    : chain_(MakeChain(robot, bodies, payload)),
      mass_solver_(chain_, gravity_mps2),
      torque_solver_(chain_, gravity_mps2),
      place_solver_(chain_),
      jacobian_solver_(chain_),
      jacobian_(chain_.getNrOfJoints()),
      no_wrench_(chain_.getNrOfSegments(), KDL::Wrench::Zero()),
      q_(chain_.getNrOfJoints()),
      qd_(chain_.getNrOfJoints()),
      qdd_(chain_.getNrOfJoints()),
      torque_(chain_.getNrOfJoints()),
      mass_(chain_.getNrOfJoints()) {}

void Dynamics::MassAndBias(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, Eigen::MatrixXd& mass,
                           Eigen::VectorXd& bias) {
  q_.data = q;
  qd_.data = qd;
  qdd_.data.setZero();
  mass_solver_.JntToMass(q_, mass_);
  torque_solver_.CartToJnt(q_, qd_, qdd_, no_wrench_, torque_);
  mass = mass_.data;
  bias = torque_.data;
}

Eigen::VectorXd Dynamics::Torque(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& qdd) {
  q_.data = q;
  qd_.data = qd;
  qdd_.data = qdd;
  torque_solver_.CartToJnt(q_, qd_, qdd_, no_wrench_, torque_);
  return torque_.data;
}

KDL::Vector Dynamics::Place(const Eigen::VectorXd& q, int link, const KDL::Vector& point, Eigen::MatrixXd& jacobian) {
  q_.data = q;
  KDL::Frame frame;
  place_solver_.JntToCart(q_, frame, link + 1);
  jacobian_.data.setZero();
  jacobian_solver_.JntToJac(q_, jacobian_, link + 1);
  jacobian_.changeRefPoint(frame.M * point);
  jacobian = jacobian_.data.topRows(3);
  return frame * point;
}

}  // namespace armcal::plant
