// generator - maps the deviations of the robot file, which are about the centres of mass, to the link origins.
#include "codegen/src/generator/robot_prior.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "codegen/src/generator/rigid_body.hpp"
#include "codegen/src/robot/body.hpp"

namespace armcal::codegen {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd ToCentre(const VectorXd& o) {
  VectorXd c = o;
  const double m = o[0];
  const double x = o[1] / m, y = o[2] / m, z = o[3] / m;
  c[1] = x, c[2] = y, c[3] = z;
  c[4] -= m * (y * y + z * z), c[5] += m * x * y, c[6] += m * x * z;
  c[7] -= m * (x * x + z * z), c[8] += m * y * z, c[9] -= m * (x * x + y * y);
  return c;
}

VectorXd ToOrigin(const VectorXd& c) {
  VectorXd o = c;
  const double m = c[0], x = c[1], y = c[2], z = c[3];
  o[1] = m * x, o[2] = m * y, o[3] = m * z;
  o[4] += m * (y * y + z * z), o[5] -= m * x * y, o[6] -= m * x * z;
  o[7] += m * (x * x + z * z), o[8] -= m * y * z, o[9] += m * (x * x + y * y);
  return o;
}

MatrixXd OriginJacobian(const VectorXd& c) {
  const double m = c[0], x = c[1], y = c[2], z = c[3];
  MatrixXd J = MatrixXd::Identity(10, 10);
  J.col(0) << 1, x, y, z, y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y;
  J.col(1) << 0, m, 0, 0, 0, -m * y, -m * z, 2 * m * x, 0, 2 * m * x;
  J.col(2) << 0, 0, m, 0, 2 * m * y, -m * x, 0, 0, -m * z, 2 * m * y;
  J.col(3) << 0, 0, 0, m, 2 * m * z, 0, -m * x, 2 * m * z, -m * y, 0;
  return J;
}

namespace {

constexpr double kNothingKnown = 1e3;  // deviation without a prior
constexpr double kNoShare = 1e-3;      // of a rotor's deviation: a base parameter that says less of it is left out

// A URDF's friction is a placeholder more often than not, and it has no word for a rotor. So these priors come from
// what the joint can give. A speed limit that is a placeholder, too, must not make them narrow.
constexpr double kFastest = 20, kFastestSlide = 5;          // rad/s, m/s; a limit above counts as this
constexpr double kCoulombShare = 0.1, kViscousShare = 0.3;  // of the torque limit: at rest, at the speed limit
constexpr double kRunUp_s = 0.2;  // in which the torque limit brings a rotor of one deviation to the speed limit
constexpr double kRotorMeanShare = 1e-3;  // of its deviation: above zero, as the barrier needs, and next to nothing

double SpeedFor(const Joint& j) {
  return std::min(j.speed_limit_radps, j.kinematics.type == JointType::kRevolute ? kFastest : kFastestSlide);
}
double WideRotor(const Joint& j) { return kRunUp_s * j.torque_limit_Nm / SpeedFor(j); }

double StatedRotor(const Joint& joint) {
  return joint.motor.gear_ratio * joint.motor.gear_ratio * joint.motor.rotor_inertia_kgm2;
}

// A prior needs bodies that can exist. Published figures are rounded, and some miss that by a little.
Link Possible(const Link& l) {
  const Body body = ToBody(l);
  return IsRounded(body) ? ToLink(NearestPossible(body)) : l;
}

// (m, c, I about the centre). Without a prior every link starts as a small ball: physical, and so wide that it says
// nothing.
VectorXd TableOf(const Robot& robot, const Joint& joint) {
  const Link l = robot.has_prior ? Possible(joint.link) : Link{1, {}, {0.01, 0, 0, 0.01, 0, 0.01}};
  VectorXd table(10);
  table << l.mass_kg, l.center_m[0], l.center_m[1], l.center_m[2], l.inertia_kgm2[0], l.inertia_kgm2[1],
      l.inertia_kgm2[2], l.inertia_kgm2[3], l.inertia_kgm2[4], l.inertia_kgm2[5];
  return table;
}

VectorXd DeviationOf(const Robot& r, const VectorXd& table) {
  if (!r.has_prior) return VectorXd::Constant(10, kNothingKnown);
  VectorXd sd = r.link_relative_sd * table.cwiseAbs();
  const double largest = std::max({table[4], table[7], table[9]});
  for (int k = 1; k < 4; ++k) sd[k] = std::max(sd[k], r.center_floor_m);
  for (int k = 4; k < 10; ++k) sd[k] = std::max(sd[k], r.inertia_floor_ratio * largest);
  return sd;
}

}  // namespace

double WideFriction(const Joint& j, const std::string& name) {
  return name == "Fv" ? kViscousShare * j.torque_limit_Nm / SpeedFor(j) : kCoulombShare * j.torque_limit_Nm;
}

BodyPrior MakeBodyPrior(const Robot& robot) {
  const int size = kBodyBlock * robot.joints();
  BodyPrior out{VectorXd(size), VectorXd(size), MatrixXd::Zero(size, size)};
  for (int j = 0; j < robot.joints(); ++j) {
    const Joint& joint = robot.joint[static_cast<std::size_t>(j)];
    const int at = kBodyBlock * j;
    const VectorXd table = TableOf(robot, joint), sd = DeviationOf(robot, table);
    const MatrixXd J = OriginJacobian(table);
    out.mean.segment(at, 10) = ToOrigin(table);
    out.deviation.segment(at, 10) = sd;
    out.covariance.block(at, at, 10, 10) = J * sd.cwiseAbs2().asDiagonal() * J.transpose();

    double rotor = StatedRotor(joint), rotor_sd = robot.has_prior ? robot.link_relative_sd * rotor : kNothingKnown;
    if (robot.has_prior && joint.wide.contains("Ia")) rotor_sd = WideRotor(joint), rotor = kRotorMeanShare * rotor_sd;
    out.mean[at + 10] = rotor;
    out.deviation[at + 10] = rotor_sd;
    out.covariance(at + 10, at + 10) = rotor_sd * rotor_sd;
  }
  return out;
}

MatrixXd ReadOut(const BodyPrior& prior, const MatrixXd& B) {
  const MatrixXd across = B * prior.covariance;
  return (across * B.transpose()).ldlt().solve(across).transpose();
}

std::vector<RotorInertia> MakeRotors(const Robot& robot, const BodyPrior& prior, const MatrixXd& B) {
  std::vector<RotorInertia> out;
  for (const Joint& joint : robot.joint) out.push_back({StatedRotor(joint), VectorXd::Zero(B.rows())});
  if (!robot.has_prior) return out;
  const MatrixXd gain = ReadOut(prior, B);
  const VectorXd base_mean = B * prior.mean, base_sd = (B * prior.covariance * B.transpose()).diagonal().cwiseSqrt();
  for (int j = 0; j < robot.joints(); ++j) {
    const int at = kBodyBlock * j + 10;
    RotorInertia& rotor = out[static_cast<std::size_t>(j)];
    for (int d = 0; d < B.rows(); ++d)
      if (std::abs(gain(at, d)) * base_sd[d] > kNoShare * prior.deviation[at]) rotor.share[d] = gain(at, d);
    rotor.rest = prior.mean[at] - rotor.share.dot(base_mean);
  }
  return out;
}

}  // namespace armcal::codegen
