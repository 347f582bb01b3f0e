// plant - computes the rigid-body dynamics of the links by KDL.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <kdl/chain.hpp>
#include <kdl/chaindynparam.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>
#include <kdl/chainjnttojacsolver.hpp>

#include "host_sim/machine/plant/robot_file.hpp"

namespace armcal::plant {

// A body and the pose of the frame that it is given in, seen from the last link frame.
struct AttachedBody {
  Body body;
  KDL::Frame frame;
};

// The chain of links. Shapes [n]; joint units. Not copyable: KDL's solvers keep a reference to the chain.
class Dynamics {
 public:
  // gravity: base frame, so that a tilted base is a turned gravity.
  Dynamics(const RobotFile& robot, const std::vector<Body>& bodies, const KDL::Vector& gravity_mps2,
           const std::optional<AttachedBody>& payload = std::nullopt);
  Dynamics(const Dynamics&) = delete;
  Dynamics& operator=(const Dynamics&) = delete;

  // mass [n x n] and bias [n] of tau = mass qdd + bias (Coriolis, centrifugal, gravity). Links only, no rotors.
  void MassAndBias(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, Eigen::MatrixXd& mass, Eigen::VectorXd& bias);

  // Inverse dynamics, recursive Newton-Euler.
  Eigen::VectorXd Torque(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& qdd);

  // Where a point of a link is in the base frame, and the rows of its Jacobian: its speed is jacobian * qd, [3 x n].
  // The point is in the axes of the link, counted from 0.
  KDL::Vector Place(const Eigen::VectorXd& q, int link, const KDL::Vector& point, Eigen::MatrixXd& jacobian);

 private:
  KDL::Chain chain_;
  KDL::ChainDynParam mass_solver_;
  KDL::ChainIdSolver_RNE torque_solver_;
  KDL::ChainFkSolverPos_recursive place_solver_;
  KDL::ChainJntToJacSolver jacobian_solver_;
  KDL::Jacobian jacobian_;
  KDL::Wrenches no_wrench_;
  KDL::JntArray q_, qd_, qdd_, torque_;
  KDL::JntSpaceInertiaMatrix mass_;
};

}  // namespace armcal::plant
