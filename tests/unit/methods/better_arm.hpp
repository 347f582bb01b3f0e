// tests - arms, loops and judges for the methods beyond the survey's. Torque comes from KDL, friction is written by
// hand.
#pragma once

#include <Eigen/Eigenvalues>
#include <random>

#include "host_sim/identify/methods/closed_loop.hpp"
#include "host_sim/identify/methods/method.hpp"
#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::tests {

// Torque constants exact: gains are no unknowns of the methods.
inline codegen::Robot ExactGains(const std::string& name) {
  codegen::Robot robot = codegen::ReadRobot("codegen/robots/" + name + ".toml");
  for (auto& j : robot.joint) j.motor.torque_constant_tolerance = 0;
  return robot;
}

inline codegen::Robot TwoLinkWithControl() {
  codegen::Robot robot = ExactGains("two_link");
  robot.control = {"pd_feedforward", 1000, {4000, 1500}, {200, 60}};
  return robot;
}

// The robot's own problem with the noise that the synthetic arm makes.
inline calibration::Problem ProblemOf(const SyntheticArm& arm, std::vector<const calibration::Dataset*> train) {
  calibration::Problem p = calibration::MakeProblem(arm.model(), std::move(train));
  for (int j = 0; j < arm.model().joints(); ++j) p.sigma_Nm[j] = arm.noise_Nm(j);
  return p;
}

inline calibration::Solution LeastSquares(const calibration::Problem& p) {
  const calibration::Linearised at = calibration::Linearise(p, p.start);
  calibration::Solution s;
  s.z = calibration::SolveRegularised(p, at.A.transpose() * at.A, at.A.transpose() * (at.residual + at.A * p.start),
                                      &s.covariance);
  return s;
}

inline Eigen::VectorXd Truth(const SyntheticArm& arm) { return arm.truth().head(arm.model().columns()); }

// Moves the true arm in its loop along `reference` and measures: torque by KDL plus friction plus noise of
// noise_scale x the arm's, position plus Gaussian noise and central differences (exact signals for position_noise = 0).
inline calibration::Dataset Measured(const SyntheticArm& arm, const calibration::Dataset& reference,
                                     double position_noise_rad, double noise_scale, std::uint64_t seed) {
  const codegen::Model& model = arm.model();
  const int n = model.joints(), samples = reference.samples();
  calibration::LoopSimulator loop(model);
  const calibration::LoopRun run = loop.Run(reference.s.t, reference.s.q, Truth(arm));
  calibration::Dataset d = reference;
  d.source = "loop";
  d.reference = reference.s.q;
  d.s = run.s;
  KdlArm kdl(model.robot(), arm.bodies());
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  for (int k = 0; k < samples; ++k) {
    const Eigen::VectorXd rigid = kdl.Torque(run.s.q.row(k), run.s.qd.row(k), run.s.qdd.row(k));
    for (int j = 0; j < n; ++j) {
      const double qd = run.s.qd(k, j), sign = qd > 0 ? 1 : qd < 0 ? -1 : 0;
      d.tau(k, j) = rigid[j] + arm.Friction("Fc", j) * sign + arm.Friction("Fv", j) * qd +
                    noise_scale * arm.noise_Nm(j) * normal(random);
      // away from turns, where a sample's mean acceleration is not the one of its instant, and from the ends
      bool steady = k > 2 && k < samples - 3;
      for (int m = std::max(0, k - 2); m <= std::min(samples - 1, k + 2); ++m)
        steady = steady && run.s.qd(m, j) * qd > 0 && std::abs(run.s.qd(m, j)) > model.robot().joint[j].v_min_radps;
      d.moving(k, j) = d.used(k, j) = steady;
    }
  }
  if (position_noise_rad <= 0) return d;
  for (int j = 0; j < n; ++j)
    for (int k = 0; k < samples; ++k) d.s.q(k, j) += position_noise_rad * normal(random);
  const double h = d.s.t[1] - d.s.t[0];
  const Eigen::MatrixXd q = d.s.q;
  for (int k = 1; k + 1 < samples; ++k) {
    d.s.qd.row(k) = (q.row(k + 1) - q.row(k - 1)) / (2 * h);
    d.s.qdd.row(k) = (q.row(k + 1) - 2 * q.row(k) + q.row(k - 1)) / (h * h);
  }
  return d;
}

// Root mean square over `where` of the torque that the error of z makes, in standard deviations of the noise.
inline double TorqueError(const SyntheticArm& arm, const calibration::Dataset& where, const Eigen::VectorXd& z) {
  const Eigen::VectorXd error = z.head(arm.model().columns()) - Truth(arm);
  std::vector<Eigen::MatrixXd> row;
  arm.model().Regressor(where.s, {}, {}, row);
  double sum = 0;
  for (int j = 0; j < arm.model().joints(); ++j) sum += (row[j] * error / arm.noise_Nm(j)).squaredNorm();
  return std::sqrt(sum / (where.samples() * arm.model().joints()));
}

// Largest error in the method's own standard deviations, over the model's estimated coordinates.
inline double WorstDeviation(const SyntheticArm& arm, const calibration::Solution& s) {
  double worst = 0;
  const Eigen::VectorXd truth = Truth(arm);
  for (int c = 0; c < truth.size(); ++c)
    if (s.covariance(c, c) > 0) worst = std::max(worst, std::abs(s.z[c] - truth[c]) / std::sqrt(s.covariance(c, c)));
  return worst;
}

// By the definition: positive mass, principal moments about the centre positive and no larger than the other two's sum.
inline bool CanExist(const Eigen::VectorXd& bodies) {
  for (int j = 0; j < bodies.size() / 11; ++j) {
    const Eigen::VectorXd b = bodies.segment(11 * j, 11);
    if (!(b[0] > 0) || b[10] < 0) return false;
    const Eigen::Vector3d c = b.segment<3>(1) / b[0];
    Eigen::Matrix3d I;
    I << b[4], b[5], b[6], b[5], b[7], b[8], b[6], b[8], b[9];
    I -= b[0] * (c.squaredNorm() * Eigen::Matrix3d::Identity() - c * c.transpose());
    const Eigen::Vector3d moment = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(I).eigenvalues();
    if (moment[0] <= 0 || moment[2] > moment[0] + moment[1]) return false;
  }
  return true;
}

}  // namespace armcal::tests
