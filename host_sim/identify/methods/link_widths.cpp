// methods - finds the widths of the links' prior by maximum likelihood of the logs, and reads bodies out with them.
#include "host_sim/identify/methods/link_widths.hpp"
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "host_sim/identify/calibration/barrier_fit.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// What is believed of the widths before the logs: means and deviations of their logarithms. Absolute widths begin far
// below any that matters: where CAD is off by a share of each value, a trace of them would spoil the small values.
constexpr double kRelative = 0.15, kRelativeSpread = 1;
constexpr double kLinkSpread = 0.5;       // of one link about the mean of all
constexpr double kCenterOfRadius = 5e-4;  // a, over the links' RMS radius of gyration
constexpr double kInertiaOfTrace = 2e-4, kAbsoluteSpread = 1.5;
constexpr double kNotInLogs = 1e-9;  // share of the largest scaled eigenvalue below which logs see nothing

VectorXd Table(const VectorXd& bodies) {
  VectorXd t = bodies;
  for (int j = 0; j < bodies.size() / 11; ++j) t.segment(11 * j, 10) = ToCentre(bodies.segment(11 * j, 10));
  return t;
}

// The base parameters' distance from the CAD values in units of what the logs say: e = C (t - t_CAD) + unit noise, t
// the bodies about their centres.
struct Distance {
  VectorXd e;
  MatrixXd C;
};

// The logs' information on the base parameters. All other coordinates are integrated out under their prior.
Distance SeenByLogs(const codegen::Model& model, const Fit& fit, const Prior& prior) {
  const DataTerm data = LogsAbout(fit, prior.mean);
  std::vector<int> rigid, other;
  for (const int c : fit.active) (c < model.columns() && model.is_rigid(c) ? rigid : other).push_back(c);
  MatrixXd spread = data.hessian(other, other);
  for (std::size_t i = 0; i < other.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    spread(k, k) += 1 / std::max(1e-300, prior.covariance(other[i], other[i]));
  }
  const MatrixXd cross = data.hessian(other, rigid);
  const Eigen::LDLT<MatrixXd> factor(spread);
  const MatrixXd H = data.hessian(rigid, rigid) - cross.transpose() * factor.solve(cross);
  const VectorXd g = data.gradient(rigid) - cross.transpose() * factor.solve(VectorXd(data.gradient(other)));
  const VectorXd scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const MatrixXd unit = scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(unit * H * unit));
  const VectorXd& value = eigen.eigenvalues();
  const auto seen = (value.array() > kNotInLogs * value[value.size() - 1]).count();
  const VectorXd root = value.tail(seen).cwiseSqrt();
  const MatrixXd V = eigen.eigenvectors().rightCols(seen);
  MatrixXd B(rigid.size(), model.body_parameters());
  for (std::size_t i = 0; i < rigid.size(); ++i)
    B.row(static_cast<Eigen::Index>(i)) = model.base_map().row(rigid[i] - model.front());
  return {-(root.cwiseInverse().asDiagonal() * (V.transpose() * (unit * g))),
          root.asDiagonal() * V.transpose() * scale.asDiagonal() * B};
}

// The same, linear in bodies about their centres near `at`.
Distance Linear(Distance d, const VectorXd& cad, const VectorXd& at) {
  d.e -= d.C * (at - cad);
  for (int j = 0; j < at.size() / 11; ++j)
    d.C.middleCols(11 * j, 10) = (d.C.middleCols(11 * j, 10) * OriginJacobian(ToCentre(at.segment(11 * j, 10)))).eval();
  d.e += d.C * (Table(at) - Table(cad));
  return d;
}

// The widths' logarithms h = [w_1 .. w_n, a, r], and how likely they are.
class Evidence {
 public:
  Evidence(const codegen::Model& model) : n_(model.joints()), cad_(Table(BodyMean(model))), fixed_(cad_.size()) {
    double square = 0, mass = 0;
    for (int j = 0; j < n_; ++j) mass += cad_[11 * j], square += Trace(j) / 2;
    center_ = std::log(kCenterOfRadius * std::sqrt(square / mass));
    for (int k = 0; k < cad_.size(); ++k) {
      const codegen::TableParameter& p = model.table()[static_cast<std::size_t>(k)];
      fixed_[k] = p.state != "estimated" && p.state != "considered" ? 0 : k % 11 == 10 ? p.sd * p.sd : -1;
    }
  }

  // Variances of the bodies about their centres.
  VectorXd Variance(const VectorXd& h) const {
    VectorXd v = fixed_;
    const double a = std::exp(2 * h[n_]), r = std::exp(2 * h[n_ + 1]);
    for (int k = 0; k < v.size(); ++k) {
      if (v[k] >= 0) continue;
      const int j = k / 11, kind = k % 11;
      const double trace = Trace(j);
      v[k] = std::exp(2 * h[j]) * cad_[k] * cad_[k] + (kind == 0 ? 0 : kind < 4 ? a : r * trace * trace);
    }
    return v;
  }
  // Minus the logarithm of the likelihood and of what is believed before.
  double Cost(const Distance& d, const VectorXd& h) const {
    MatrixXd S = d.C * Variance(h).asDiagonal() * d.C.transpose();
    S.diagonal().array() += 1;
    const Eigen::LLT<MatrixXd> factor(S);
    const double mean = h.head(n_).mean();
    const auto square = [](double x) { return 0.5 * x * x; };
    return MatrixXd(factor.matrixL()).diagonal().array().log().sum() + 0.5 * d.e.dot(factor.solve(d.e)) +
           square((mean - std::log(kRelative)) / kRelativeSpread) +
           0.5 * ((h.head(n_).array() - mean) / kLinkSpread).square().sum() +
           square((h[n_] - center_) / kAbsoluteSpread) +
           square((h[n_ + 1] - std::log(kInertiaOfTrace)) / kAbsoluteSpread);
  }
  // The most likely ones. There is a minimum with absolute widths and one without, so both are tried.
  VectorXd Best(const Distance& d) const {
    VectorXd best;
    double least = INFINITY;
    for (const double absolute : {0.0, std::log(60.0)}) {
      VectorXd h = VectorXd::Constant(n_ + 2, std::log(absolute > 0 ? 0.03 : kRelative));
      h[n_] = center_ + absolute, h[n_ + 1] = std::log(kInertiaOfTrace) + absolute;
      if (const double cost = Descend(d, h); cost < least) least = cost, best = h;
    }
    return best;
  }

 private:
  double Trace(int j) const { return cad_[11 * j + 4] + cad_[11 * j + 7] + cad_[11 * j + 9]; }
  // Steps along all w together and along each coordinate; a step grows where it gains and shrinks where it does not.
  double Descend(const Distance& d, VectorXd& h) const {
    double cost = Cost(d, h);
    MatrixXd step = MatrixXd::Zero(n_ + 2, n_ + 3);
    step.leftCols(n_ + 2).setIdentity();
    step.col(n_ + 2).head(n_).setOnes();
    step *= 0.7;
    for (int pass = 0; pass < 60; ++pass) {
      const double before = cost;
      for (int k = 0; k < step.cols(); ++k) {
        double next = Cost(d, h + step.col(k));
        if (!(next < cost)) step.col(k) *= -1, next = Cost(d, h + step.col(k));
        if (next < cost) h += step.col(k), cost = next, step.col(k) *= 1.5;
        else step.col(k) *= 0.5;
      }
      if (before - cost < 1e-3 && step.cwiseAbs().maxCoeff() < 0.1) break;
    }
    return cost;
  }

  int n_;
  VectorXd cad_, fixed_;  // fixed_: variances that are no matter of the widths; -1: the others
  double center_ = 0;
};

}  // namespace

LinkWidths EstimateLinkWidths(const codegen::Model& model, const Fit& fit) {
  RequirePhysicalPrior(model);
  const int n = model.joints();
  const VectorXd cad = BodyMean(model);
  const Distance seen = SeenByLogs(model, fit, MakePrior(model));
  const Evidence evidence(model);
  LinkWidths widths;
  VectorXd at = cad;
  for (int pass = 0; pass < 3; ++pass) {
    const VectorXd h = evidence.Best(Linear(seen, cad, at));
    widths.relative = h.head(n).array().exp();
    widths.center_m = std::exp(h[n]), widths.inertia_of_trace = std::exp(h[n + 1]);
    widths.sd = evidence.Variance(h).cwiseSqrt();
    if (pass < 2) at = ReadOutWithWidths(model, fit, widths).bodies;
  }
  return widths;
}

PhysicalReadOut ReadOutWithWidths(const codegen::Model& model, const Fit& fit, const LinkWidths& widths,
                                  const std::vector<Limit>& limits) {
  RequirePhysicalPrior(model);
  const Prior prior = MakePrior(model);
  BarrierProblem problem;
  problem.model = &model;
  problem.bodies = BodyMean(model);
  problem.bodies_sd = VectorXd::Zero(problem.bodies.size());
  for (int k = 0; k < problem.bodies.size(); ++k)
    if (model.table()[static_cast<std::size_t>(k)].state == "estimated") problem.bodies_sd[k] = widths.sd[k];
  problem.x = prior.mean;
  problem.x_sd = VectorXd::Zero(prior.mean.size());
  for (const int c : fit.active) problem.x_sd[c] = std::sqrt(prior.covariance(c, c));
  problem.limits = limits;
  problem.data = [&](const VectorXd& x, bool) { return LogsAbout(fit, x); };
  BarrierFit found = FitWithBarrier(problem);
  return {std::move(found.bodies), std::move(found.bodies_sd), std::move(found.x), found.iterations, found.converged};
}

}  // namespace armcal::calibration
