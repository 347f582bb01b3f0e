// calibration - the two fits with a log-det barrier: Levenberg-Marquardt for an arm, Newton's method for one body.
#include "host_sim/identify/calibration/barrier_fit.hpp"
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/prior.hpp"

namespace armcal::calibration {

using Eigen::Matrix4d;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Three sets of coordinates. t = [bodies about centres, x] is the table's. y = [bodies about origins, x]: the data term
// is quadratic in y where it is in x, and d y / d t is block diagonal. x's rigid places are unused in both. u holds the
// free entries of t in units of the prior.
class TableFit {
 public:
  explicit TableFit(const BarrierProblem& problem)
      : problem_(problem), model_(*problem.model), n_(model_.joints()), body_(11 * n_) {
    const int size = body_ + static_cast<int>(problem.x.size());
    start_.resize(size), scale_.setZero(size), weight_.setOnes(size);
    for (int j = 0; j < n_; ++j) {
      start_.segment(11 * j, 10) = ToCentre(problem.bodies.segment(11 * j, 10));
      start_[11 * j + 10] = problem.bodies[11 * j + 10];
    }
    start_.tail(problem.x.size()) = problem.x;
    scale_.head(body_) = problem.bodies_sd;
    for (int c = 0; c < problem.x.size(); ++c) {
      if (c < model_.columns() && model_.is_rigid(c)) continue;
      const bool wide = std::isinf(problem.x_sd[c]);
      scale_[body_ + c] = wide ? std::max(1e-3, std::abs(problem.x[c])) : problem.x_sd[c];
      weight_[body_ + c] = wide ? 0 : 1;
    }
    for (int k = 0; k < size; ++k)
      if (scale_[k] > 0) free_.push_back(k);
    if (problem.quadratic) {
      at_ = problem.data(problem.x, true);
      ToBodies(at_);
    }
  }

  int free() const { return static_cast<int>(free_.size()); }
  VectorXd Table(const VectorXd& u) const {
    VectorXd t = start_;
    for (int i = 0; i < free(); ++i) t[free_[i]] += scale_[free_[i]] * u[i];
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
  // A step that would carry a coordinate past its range ends there.
  VectorXd Within(const VectorXd& u) const {
    if (problem_.lower.size() == 0) return u;
    VectorXd cut = u;
    for (int i = 0; i < free(); ++i)
      if (const int c = free_[i] - body_; c >= 0)
        cut[i] = (std::clamp(start_[free_[i]] + scale_[free_[i]] * u[i], problem_.lower[c], problem_.upper[c]) -
                  start_[free_[i]]) /
                 scale_[free_[i]];
    return cut;
  }
  // Infinity outside the cone.
  double Cost(const VectorXd& u, double eps) const {
    const VectorXd t = Table(u), bodies = Bodies(t);
    double cost = 0;
    for (int i = 0; i < free(); ++i) cost += 0.5 * weight_[free_[i]] * u[i] * u[i];
    for (int j = 0; j < n_; ++j) {
      const Eigen::LLT<Matrix4d> factor(PseudoInertia(&bodies[11 * j]));
      if (factor.info() != Eigen::Success || bodies[11 * j] <= 0) return INFINITY;
      cost -= 0.5 * eps * 2 * Matrix4d(factor.matrixL()).diagonal().array().log().sum();
      if (scale_[11 * j + 10] <= 0) continue;  // a rotor that is known, or not there
      if (bodies[11 * j + 10] <= 0) return INFINITY;
      cost -= 0.5 * eps * std::log(bodies[11 * j + 10]);
    }
    const VectorXd x = X(t);
    for (const Limit& limit : problem_.limits) {
      const double left = Left(limit, bodies, x);
      if (!(left > 0)) return INFINITY;
      cost -= 0.5 * eps * std::log(left);
    }
    if (!problem_.quadratic) return cost + problem_.data(x, false).cost;
    const VectorXd d = Shift(bodies, x);
    return cost + at_.gradient.dot(d) + 0.5 * d.dot(at_.hessian * d);
  }
  void Derivatives(const VectorXd& u, double eps, VectorXd& gradient, MatrixXd& hessian) const {
    const VectorXd t = Table(u), bodies = Bodies(t), x = X(t);
    VectorXd gy;
    MatrixXd linearised;
    if (problem_.quadratic) {
      gy = at_.gradient + at_.hessian * Shift(bodies, x);
    } else {
      DataTerm here = problem_.data(x, true);
      ToBodies(here);
      gy = std::move(here.gradient);
      linearised = std::move(here.hessian);
    }
    VectorXd gt = gy;
    MatrixXd ht = problem_.quadratic ? at_.hessian : linearised;
    for (const Limit& limit : problem_.limits) {
      VectorXd slope(start_.size());
      slope << limit.bodies, limit.x;
      slope /= Left(limit, bodies, x);
      gt -= 0.5 * eps * slope;
      ht += 0.5 * eps * slope * slope.transpose();
    }
    std::vector<MatrixXd> J(static_cast<std::size_t>(n_));
    for (int j = 0; j < n_; ++j) {
      J[j] = OriginJacobian(t.segment(11 * j, 10));
      gt.segment(11 * j, 10) = (J[j].transpose() * gt.segment(11 * j, 10)).eval();
      ht.middleRows(11 * j, 10) = (J[j].transpose() * ht.middleRows(11 * j, 10)).eval();
    }
    for (int j = 0; j < n_; ++j) ht.middleCols(11 * j, 10) = (ht.middleCols(11 * j, 10) * J[j]).eval();
    for (int j = 0; j < n_; ++j) {
      const Matrix4d inverse = PseudoInertia(&bodies[11 * j]).inverse();
      Matrix4d product[10];  // J^-1 dJ/dt_a
      for (int a = 0; a < 10; ++a) product[a] = inverse * PseudoInertia(J[j].col(a).data());
      for (int a = 0; a < 10; ++a) {
        gt[11 * j + a] -= 0.5 * eps * product[a].trace();
        for (int b = 0; b < 10; ++b)
          ht(11 * j + a, 11 * j + b) += 0.5 * eps * product[a].cwiseProduct(product[b].transpose()).sum();
      }
      const int rotor = 11 * j + 10;
      if (scale_[rotor] > 0) {
        gt[rotor] -= 0.5 * eps / bodies[rotor];
        ht(rotor, rotor) += 0.5 * eps / (bodies[rotor] * bodies[rotor]);
      }
    }
    gradient.resize(free());
    hessian.resize(free(), free());
    for (int i = 0; i < free(); ++i) {
      const int a = free_[i];
      gradient[i] = scale_[a] * gt[a] + weight_[a] * u[i];
      for (int k = 0; k < free(); ++k) hessian(i, k) = scale_[a] * ht(a, free_[k]) * scale_[free_[k]];
      hessian(i, i) += weight_[a];
    }
  }
  // Posterior at the end: deviations of the bodies' table coordinates, covariance of x.
  void Posterior(const VectorXd& u, const MatrixXd& hessian, BarrierFit& fit) const {
    const MatrixXd P = hessian.ldlt().solve(MatrixXd(MatrixXd::Identity(free(), free())));
    const VectorXd t = Table(u);
    fit.bodies_sd = VectorXd::Zero(body_);
    MatrixXd spread = MatrixXd::Zero(start_.size(), free());  // d t / d u, then d y / d u
    for (int i = 0; i < free(); ++i) {
      spread(free_[i], i) = scale_[free_[i]];
      if (free_[i] < body_) fit.bodies_sd[free_[i]] = scale_[free_[i]] * std::sqrt(std::max(0.0, P(i, i)));
    }
    for (int j = 0; j < n_; ++j)
      spread.middleRows(11 * j, 10) = (OriginJacobian(t.segment(11 * j, 10)) * spread.middleRows(11 * j, 10)).eval();
    MatrixXd dx = spread.bottomRows(start_.size() - body_);
    dx.middleRows(model_.front(), model_.rigid()) = model_.base_map() * spread.topRows(body_);
    fit.covariance = dx * P * dx.transpose();
  }

 private:
  static double Left(const Limit& limit, const VectorXd& bodies, const VectorXd& x) {
    return limit.base + limit.bodies.dot(bodies) + limit.x.dot(x);
  }
  // y minus the y of the prior.
  VectorXd Shift(const VectorXd& bodies, const VectorXd& x) const {
    VectorXd d(start_.size());
    d.head(body_) = bodies - problem_.bodies;
    d.tail(x.size()) = x - problem_.x;
    d.segment(body_ + model_.front(), model_.rigid()).setZero();
    return d;
  }
  // From x to y: the rigid part of x is base_map times the bodies.
  void ToBodies(DataTerm& term) const {
    const int size = static_cast<int>(problem_.x.size());
    MatrixXd E = MatrixXd::Zero(size, body_ + size);  // d x / d y
    E.rightCols(size).setIdentity();
    E.middleRows(model_.front(), model_.rigid()).rightCols(size).setZero();
    E.block(model_.front(), 0, model_.rigid(), body_) = model_.base_map();
    term.gradient = (E.transpose() * term.gradient).eval();
    term.hessian = (E.transpose() * term.hessian * E).eval();
  }

  const BarrierProblem& problem_;
  const codegen::Model& model_;
  int n_, body_;
  VectorXd start_, scale_, weight_;
  DataTerm at_;  // quadratic: in y about the prior
  std::vector<int> free_;
};

}  // namespace

namespace {

// Of one weight of the barrier. Ten do where logs are short. Two minutes of a log leave a narrow curved valley where
// CAD values are far off, since torque knows m c and the prior c; then steps are short.
constexpr int kSteps = 1000;

}  // namespace

BarrierFit FitWithBarrier(const BarrierProblem& problem) {
  const TableFit fit(problem);
  VectorXd u = VectorXd::Zero(fit.free()), gradient;
  MatrixXd hessian;
  BarrierFit out;
  const auto stopped = [&] { return problem.stop && problem.stop->load(std::memory_order_relaxed); };
  for (const double eps : {1.0, 0.1, 0.01}) {
    double damping = 1e-9, cost = fit.Cost(u, eps);
    out.converged = false;
    for (int k = 0; k < kSteps && !out.converged && !stopped(); ++k, ++out.iterations) {
      fit.Derivatives(u, eps, gradient, hessian);
      bool stepped = false;
      for (int attempt = 0; attempt < 12 && !stepped; ++attempt) {
        MatrixXd damped = hessian;
        damped.diagonal() *= 1 + damping;
        const VectorXd step = fit.Within(u - damped.llt().solve(gradient)) - u;
        const double next = fit.Cost(u + step, eps);
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
  fit.Derivatives(u, 0, gradient, hessian);
  const VectorXd t = fit.Table(u);
  out.bodies = fit.Bodies(t);
  out.x = fit.X(t);
  fit.Posterior(u, hessian, out);
  return out;
}

void RequirePhysicalPrior(const codegen::Model& model) {
  if (!model.robot().has_prior)
    throw io::InputError(model.robot().name +
                         ": prior = \"none\": standard parameters need a prior; only base parameters can be given");
  const VectorXd mean = BodyMean(model);
  for (int j = 0; j < model.joints(); ++j)
    if (!IsPhysical(mean.segment(11 * j, 11)))
      throw io::InputError(model.robot().path + ": joint[" + std::to_string(j + 1) +
                           "].link: expected a body that can exist " +
                           "(positive mass, inertia that a distribution of mass can have)");
}

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
  // The barrier first weighs as much as the data, and in the end hardly anything: so few Newton steps are needed.
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
