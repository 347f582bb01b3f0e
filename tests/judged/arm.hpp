// judged set - holds an arm as it is and as its CAD file says, with torques by KDL.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "host_sim/machine/plant/dynamics.hpp"
#include "host_sim/machine/plant/random.hpp"

namespace armcal::judged {

inline constexpr double kPi = std::numbers::pi;

struct Motion {
  Eigen::VectorXd t;
  Eigen::MatrixXd q, qd, qdd, temp;  // [samples x joints]
  int samples() const { return static_cast<int>(t.size()); }
};

struct Arm {
  std::string name;
  plant::RobotFile robot;                   // kinematics and CAD bodies
  std::vector<plant::Body> bodies;          // as they are
  Eigen::VectorXd rotor, coulomb, viscous;  // as they are; kg m^2, N m, N m s/rad at the joint
  Eigen::VectorXd sigma_Nm;                 // torque noise
  Eigen::VectorXd q_low, q_high, speed, gear, torque_limit;
  int joints() const { return static_cast<int>(bodies.size()); }
};

// One of three sizes, its lengths, masses and friction drawn; CAD off by up to `cad_error`.
Arm DrawArm(plant::Random& random, double cad_error);
nlohmann::json RobotJson(const Arm& arm);

// Sums of sines with stretches of slow motion, within the arm's ranges and speeds; drawn.
Motion DrawMotion(const Arm& arm, double duration_s, double rate_Hz, plant::Random& random);
Motion Every(const Motion& motion, int step);

// Links only, [samples x joints]; gravity as the arm's own or turned.
Eigen::MatrixXd LinkTorque(const Arm& arm, const Motion& motion, const KDL::Vector& gravity);
Eigen::MatrixXd LinkTorque(const Arm& arm, const Motion& motion);
// What a body at the last link adds, in that link's frame.
Eigen::MatrixXd PayloadTorque(const Arm& arm, const Motion& motion, const plant::Body& payload);

// Links, rotors, Coulomb and viscous friction, as they are.
Eigen::MatrixXd DeclaredTorque(const Arm& arm, const Motion& motion, const Eigen::MatrixXd& links);

// All that the declared model can give, joint by joint: rows [samples x columns]; bodies, rotors, Coulomb, viscous.
std::vector<Eigen::MatrixXd> DeclaredRows(const Arm& arm, const Motion& motion, plant::Random& random);

// Coulomb's sign as the plant has it: a very steep tanh.
Eigen::ArrayXd Sign(const Eigen::ArrayXd& speed);

}  // namespace armcal::judged
