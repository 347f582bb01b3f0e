// calibration - Newton's method on one body's ten parameters with a log-det barrier; knows no arm.
#include "host_sim/identify/calibration/body_barrier.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "host_sim/identify/calibration/prior.hpp"

namespace armcal::calibration {

using Eigen::Matrix4d;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kBody = 10;
constexpr double kWeight = 0.01;  // of the barrier in the end, in units of chi^2

VectorXd FromPseudoInertia(const Matrix4d& J) {
  const double trace = J.topLeftCorner<3, 3>().trace();
  VectorXd p(kBody);
  p << J(3, 3), J(0, 3), J(1, 3), J(2, 3), trace - J(0, 0), -J(0, 1), -J(0, 2), trace - J(1, 1), -J(1, 2),
      trace - J(2, 2);
  return p;
}

class Barrier {
 public:
  Barrier(const VectorXd& estimate, const MatrixXd& information) : estimate_(estimate), information_(information) {}

  // Infinity outside the cone.
  double Cost(const VectorXd& p, double eps) const {
    const Eigen::LLT<Matrix4d> factor(PseudoInertia(p.data()));
    if (factor.info() != Eigen::Success) return INFINITY;
    const VectorXd d = p - estimate_;
    return 0.5 * d.dot(information_ * d) - eps * Matrix4d(factor.matrixL()).diagonal().array().log().sum();
  }
  void Derivatives(const VectorXd& p, double eps, VectorXd& gradient, MatrixXd& hessian) const {
    gradient = information_ * (p - estimate_);
    hessian = information_;
    const Matrix4d inverse = PseudoInertia(p.data()).inverse();
    Matrix4d product[kBody];  // J^-1 dJ/dp_a
    for (int a = 0; a < kBody; ++a) product[a] = inverse * PseudoInertia(VectorXd::Unit(kBody, a).eval().data());
    for (int a = 0; a < kBody; ++a) {
      gradient[a] -= 0.5 * eps * product[a].trace();
      for (int b = 0; b < kBody; ++b)
        hessian(a, b) += 0.5 * eps * product[a].cwiseProduct(product[b].transpose()).sum();
    }
  }

 private:
  const VectorXd& estimate_;
  const MatrixXd& information_;
};

// Newton's steps, halved until they gain, at one weight of the barrier.
void Descend(const Barrier& barrier, double eps, VectorXd& p) {
  VectorXd gradient;
  MatrixXd hessian;
  for (int k = 0; k < 100; ++k) {
    barrier.Derivatives(p, eps, gradient, hessian);
    const VectorXd step = -hessian.ldlt().solve(gradient);
    const double decrease = -gradient.dot(step), cost = barrier.Cost(p, eps);
    int halved = 0;
    while (halved < 40 &&
           !(barrier.Cost(p + std::ldexp(1, -halved) * step, eps) < cost - 0.1 * std::ldexp(decrease, -halved)))
      ++halved;
    if (halved == 40) return;  // round-off: nothing left to gain
    p += std::ldexp(1, -halved) * step;
    if (decrease < 1e-9) return;  // in units of chi^2
  }
}

}  // namespace

VectorXd NearestBody(const VectorXd& estimate, const MatrixXd& information) {
  constexpr double kStartRadius_m = 0.1;  // of gyration; any will do
  VectorXd p = VectorXd::Zero(kBody);
  p[0] = std::max(std::abs(estimate[0]), 1e-6);
  p[4] = p[7] = p[9] = p[0] * kStartRadius_m * kStartRadius_m;
  const Barrier barrier(estimate, information);
  // From where the barrier weighs as much as the data down to where it hardly does: Newton's steps stay few all along.
  double eps = std::max(1.0, barrier.Cost(p, 0));
  while (eps > kWeight) {
    Descend(barrier, eps, p);
    eps *= 0.2;
  }
  Descend(barrier, kWeight, p);
  return p;
}

MatrixXd BodyMap(const Matrix4d& pose) {
  MatrixXd map(kBody, kBody);
  for (int k = 0; k < kBody; ++k)
    map.col(k) = FromPseudoInertia(pose * PseudoInertia(VectorXd::Unit(kBody, k).eval().data()) * pose.transpose());
  return map;
}

}  // namespace armcal::calibration
