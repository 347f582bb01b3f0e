// generator - what a robot file says of bodies and friction before any log, and what base parameters say of the bodies.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "codegen/src/robot/robot.hpp"

namespace armcal::codegen {

// Bodies about their link origins (10 values) <-> (m, c, I about the centre), and the Jacobian d(origin)/d(table).
Eigen::VectorXd ToCentre(const Eigen::VectorXd& origin);
Eigen::VectorXd ToOrigin(const Eigen::VectorXd& centre);
Eigen::MatrixXd OriginJacobian(const Eigen::VectorXd& centre);

struct BodyPrior {
  Eigen::VectorXd mean;        // [11n] about the link origins
  Eigen::VectorXd deviation;   // [11n] of (m, c, I about the centre, Ia)
  Eigen::MatrixXd covariance;  // [11n x 11n] of `mean`
};
BodyPrior MakeBodyPrior(const Robot& robot);

// Deviation of a friction parameter that nobody stated. Shape: name "Fc" or "Fv"; N m or N, times s per unit.
double WideFriction(const Joint& joint, const std::string& name);

// The bodies' expectation for given base parameters: mean + [11n x rigid] * (base - base_map * mean).
Eigen::MatrixXd ReadOut(const BodyPrior& prior, const Eigen::MatrixXd& base_map);

// Inertia of one joint's rotor (kg m^2 or kg, joint side) for given base parameters: rest + share * base. Base
// parameters alone do not tell a rotor from its link; the prior does. Without one it is what the robot file states.
struct RotorInertia {
  double rest = 0;
  Eigen::VectorXd share;  // [rigid]
};
std::vector<RotorInertia> MakeRotors(const Robot& robot, const BodyPrior& prior, const Eigen::MatrixXd& base_map);

}  // namespace armcal::codegen
