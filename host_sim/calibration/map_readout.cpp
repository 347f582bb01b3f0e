// calibration - the MAP read-out with log-det barrier; knows no log.
#include "host_sim/calibration/map_readout.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "host_sim/io/input_error.hpp"

namespace armcal::calibration {

using Eigen::Matrix4d;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

Matrix4d PseudoInertia(const VectorXd& b) {
  Matrix4d J;
  const double half = 0.5 * (b[4] + b[7] + b[9]);
  J << half - b[4], -b[5], -b[6], b[1], -b[5], half - b[7], -b[8], b[2], -b[6], -b[8], half - b[9], b[3], b[1], b[2],
      b[3], b[0];
  return J;
}

class Problem {
 public:
  Problem(const codegen::Model& model, const Fit& fit) : model_(model), n_(model.joints()), body_(11 * n_) {
    const Prior prior = MakePrior(model);
    const VectorXd mean = BodyMean(model);
    start_.resize(body_ + prior.mean.size());
    sd_.setZero(start_.size());
    for (int j = 0; j < n_; ++j) {
      start_.segment(11 * j, 10) = ToCentre(mean.segment(11 * j, 10));
      start_[11 * j + 10] = mean[11 * j + 10];
      for (int k = 0; k < 11; ++k)
        if (model.table()[11 * j + k].state == "estimated") sd_[11 * j + k] = model.table()[11 * j + k].sd;
    }
    start_.tail(prior.mean.size()) = prior.mean;  // its rigid part is not free: it follows from the bodies
    for (const int c : fit.active)
      if (c >= model.columns() || !model.is_rigid(c)) sd_[body_ + c] = std::sqrt(prior.covariance(c, c));
    H_ = MatrixXd::Zero(prior.mean.size(), prior.mean.size());
    g_ = VectorXd::Zero(prior.mean.size());
    for (int j = 0; j < n_; ++j) {
      const double weight = 1 / (fit.sigma[j] * fit.sigma[j] * fit.inflation[j]);
      H_ += weight * fit.information.gram[j];
      g_ += weight * fit.information.right[j];
    }
    for (int k = 0; k < start_.size(); ++k)
      if (sd_[k] > 0) free_.push_back(k);
  }

  int free() const { return static_cast<int>(free_.size()); }
  VectorXd Table(const VectorXd& u) const {
    VectorXd t = start_;
    for (int i = 0; i < free(); ++i) t[free_[i]] += sd_[free_[i]] * u[i];
    return t;
  }
  VectorXd Bodies(const VectorXd& t) const {
    VectorXd bodies(body_);
    for (int j = 0; j < n_; ++j) {
      bodies.segment(11 * j, 10) = ToOrigin(t.segment(11 * j, 10));
      bodies[11 * j + 10] = t[11 * j + 10];
    }
    return bodies;
  }
  VectorXd X(const VectorXd& t) const {
    VectorXd x = t.tail(start_.size() - body_);
    x.segment(model_.front(), model_.rigid()) = model_.base_map() * Bodies(t);
    return x;
  }
  // Infinity outside the cone.
  double Cost(const VectorXd& u, double eps) const {
    const VectorXd t = Table(u), bodies = Bodies(t), x = X(t);
    double cost = 0.5 * x.dot(H_ * x) - g_.dot(x) + 0.5 * u.squaredNorm();
    for (int j = 0; j < n_; ++j) {
      const Eigen::LLT<Matrix4d> factor(PseudoInertia(bodies.segment(11 * j, 10)));
      if (factor.info() != Eigen::Success || bodies[11 * j] <= 0) return INFINITY;
      cost -= 0.5 * eps * 2 * Matrix4d(factor.matrixL()).diagonal().array().log().sum();
      if (sd_[11 * j + 10] <= 0) continue;  // a rotor that is known, or not there
      if (bodies[11 * j + 10] <= 0) return INFINITY;
      cost -= 0.5 * eps * std::log(bodies[11 * j + 10]);
    }
    return cost;
  }
  void Derivatives(const VectorXd& u, double eps, VectorXd& gradient, MatrixXd& hessian) const {
    const VectorXd t = Table(u), bodies = Bodies(t), x = X(t);
    const int size = static_cast<int>(x.size());
    MatrixXd dx = MatrixXd::Zero(size, start_.size());  // d x / d t
    dx.rightCols(size).setIdentity();
    dx.middleRows(model_.front(), model_.rigid()).rightCols(size).setZero();
    MatrixXd J = MatrixXd::Identity(body_, body_);
    for (int j = 0; j < n_; ++j) J.block(11 * j, 11 * j, 10, 10) = OriginJacobian(t.segment(11 * j, 10));
    dx.block(model_.front(), 0, model_.rigid(), body_) = model_.base_map() * J;
    VectorXd gt = dx.transpose() * (H_ * x - g_);
    MatrixXd ht = dx.transpose() * H_ * dx;
    for (int j = 0; j < n_; ++j) {
      const Matrix4d inverse = PseudoInertia(bodies.segment(11 * j, 10)).inverse();
      Matrix4d product[10];  // J^-1 dJ/dt_a
      for (int a = 0; a < 10; ++a) product[a] = inverse * PseudoInertia(J.block(11 * j, 11 * j + a, 10, 1));
      for (int a = 0; a < 10; ++a) {
        gt[11 * j + a] -= 0.5 * eps * product[a].trace();
        for (int b = 0; b < 10; ++b) ht(11 * j + a, 11 * j + b) += 0.5 * eps * (product[a] * product[b]).trace();
      }
      const int rotor = 11 * j + 10;
      if (sd_[rotor] > 0) {
        gt[rotor] -= 0.5 * eps / bodies[rotor];
        ht(rotor, rotor) += 0.5 * eps / (bodies[rotor] * bodies[rotor]);
      }
    }
    gradient.resize(free());
    hessian.resize(free(), free());
    for (int i = 0; i < free(); ++i) {
      gradient[i] = sd_[free_[i]] * gt[free_[i]] + u[i];
      for (int k = 0; k < free(); ++k)
        hessian(i, k) = sd_[free_[i]] * ht(free_[i], free_[k]) * sd_[free_[k]] + (i == k);
    }
  }
  // Posterior standard deviations of the bodies' table coordinates.
  VectorXd Deviation(const MatrixXd& hessian) const {
    const MatrixXd P = hessian.llt().solve(MatrixXd::Identity(free(), free()));
    VectorXd sd = VectorXd::Zero(body_);
    for (int i = 0; i < free(); ++i)
      if (free_[i] < body_) sd[free_[i]] = sd_[free_[i]] * std::sqrt(std::max(0.0, P(i, i)));
    return sd;
  }

 private:
  const codegen::Model& model_;
  int n_, body_;
  VectorXd start_, sd_, g_;
  MatrixXd H_;
  std::vector<int> free_;
};

}  // namespace

PhysicalReadOut ReadOutPhysical(const codegen::Model& model, const Fit& fit) {
  if (!model.robot().has_prior)
    throw io::InputError(model.robot().name +
                         ": prior = \"none\": standard parameters need a prior; only base parameters can be given");
  const VectorXd mean = BodyMean(model);
  for (int j = 0; j < model.joints(); ++j)
    if (!IsPhysical(mean.segment(11 * j, 11)))
      throw io::InputError(model.robot().path + ": joint[" + std::to_string(j + 1) +
                           "].link: expected a body that can exist " +
                           "(positive mass, inertia that a distribution of mass can have)");
  const Problem problem(model, fit);
  VectorXd u = VectorXd::Zero(problem.free()), gradient;
  MatrixXd hessian;
  PhysicalReadOut out;
  for (const double eps : {1.0, 0.1, 0.01}) {
    double damping = 1e-9, cost = problem.Cost(u, eps);
    out.converged = false;
    for (int k = 0; k < 60 && !out.converged; ++k, ++out.iterations) {
      problem.Derivatives(u, eps, gradient, hessian);
      bool stepped = false;
      for (int attempt = 0; attempt < 12 && !stepped; ++attempt) {
        MatrixXd damped = hessian;
        damped.diagonal() *= 1 + damping;
        const VectorXd step = -damped.llt().solve(gradient);
        const double next = problem.Cost(u + step, eps);
        if (next < cost) {
          out.converged = -gradient.dot(step) < 1e-7;  // the decrease still to be had, in units of chi^2
          u += step;
          cost = next;
          damping = std::max(1e-12, damping / 10);
          stepped = true;
        } else {
          if (-gradient.dot(step) < 1e-9) break;  // round-off: nothing left to gain
          damping = std::max(1e-6, damping * 10);
        }
      }
      if (!stepped) out.converged = true;
    }
  }
  problem.Derivatives(u, 0, gradient, hessian);
  const VectorXd t = problem.Table(u);
  out.bodies = problem.Bodies(t);
  out.bodies_sd = problem.Deviation(hessian);
  out.x = problem.X(t);
  return out;
}

}  // namespace armcal::calibration
