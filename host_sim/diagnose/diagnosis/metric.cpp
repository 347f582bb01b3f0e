// diagnosis - the base in whitened rows and what columns gain on it.
#include "host_sim/diagnose/diagnosis/metric.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "host_sim/diagnose/diagnosis/metric_parts.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

void BaseRows::Multiply(int j, Eigen::Index from) {
  gram.resize(design.size()), right.resize(design.size());
  const Eigen::Index size = design[j].cols(), added = size - from;
  const auto fresh = design[j].rightCols(added);
  gram[j].conservativeResize(size, size), right[j].conservativeResize(size);
  gram[j].bottomLeftCorner(added, from).noalias() = fresh.transpose() * design[j].leftCols(from);
  gram[j].topRightCorner(from, added) = gram[j].bottomLeftCorner(added, from).transpose();
  gram[j].bottomRightCorner(added, added) = SelfProduct(fresh);
  right[j].tail(added).noalias() = fresh.transpose() * target[j];
}

void Metric::WhitenJoint(int j) {
  const auto& columns = rows_.columns[j];
  map_[j].resize(static_cast<Eigen::Index>(columns.size()), rows_.L.cols());
  for (std::size_t i = 0; i < columns.size(); ++i) map_[j].row(i) = rows_.L.row(columns[i]);
  y_[j] = Whiten(noise_[j], rows_.index[j], rows_.target[j]);
  if (IsWhite(noise_[j])) {
    const double scale = 1 / noise_[j].innovation;
    q_map_[j] = scale * map_[j];
    gram_[j] = q_map_[j].transpose() * rows_.gram[j] * q_map_[j];
    right_[j] = q_map_[j].transpose() * (scale * rows_.right[j]);
    return;
  }
  coloured_[j] = WhitenAll(noise_[j], rows_.index[j], rows_.design[j]);
  q_map_[j] = map_[j];
  gram_[j] = map_[j].transpose() * SelfProduct(coloured_[j]) * map_[j];
  right_[j] = map_[j].transpose() * (coloured_[j].transpose() * y_[j]);
}

void Metric::Solve() {
  const int n = rows_.joints(), d = rows_.coordinates();
  MatrixXd hessian = prior_;
  VectorXd right = VectorXd::Zero(d);
  for (int j = 0; j < n; ++j) {
    hessian += gram_[j];
    right += right_[j];
  }
  factor_.compute(hessian);
  z_ = factor_.solve(right);
  for (int j = 0; j < n; ++j) residual_[j] = y_[j] - q(j) * (q_map_[j] * z_);
  bounded_sd_.resize(static_cast<Eigen::Index>(rows_.bounded.size()));
  for (std::size_t k = 0; k < rows_.bounded.size(); ++k) {
    const VectorXd row = rows_.L.row(rows_.bounded[k].coordinate).transpose();
    bounded_sd_[static_cast<Eigen::Index>(k)] = std::sqrt(std::max(0.0, row.dot(factor_.solve(row))));
  }
}

MatrixXd Metric::PriorPrecision() const {
  const MatrixXd own = (rows_.informative ? 1 : 1e-9) * MatrixXd::Identity(rows_.coordinates(), rows_.coordinates());
  return rows_.precision.size() == 0 ? own : MatrixXd(own + rows_.L.transpose() * rows_.precision * rows_.L);
}

Metric::Metric(const BaseRows& rows, std::vector<NoiseModel> noise)
    : rows_(rows), noise_(std::move(noise)), prior_(PriorPrecision()) {
  const std::size_t n = rows.index.size();
  map_.resize(n), q_map_.resize(n), coloured_.resize(n), y_.resize(n), gram_.resize(n), right_.resize(n),
      residual_.resize(n);
  for (int j = 0; j < rows.joints(); ++j) WhitenJoint(j);
  Solve();
}

bool Metric::InBounds(const Gain& g, const std::vector<int>& joints) const {
  for (std::size_t k = 0; k < rows_.bounded.size(); ++k) {
    const Bounded& b = rows_.bounded[k];
    if (std::find(joints.begin(), joints.end(), b.joint) == joints.end()) continue;
    const double x = rows_.mean[b.coordinate] + rows_.L.row(b.coordinate).dot(g.z);
    const double slack = 2 * bounded_sd_[static_cast<Eigen::Index>(k)];
    if (x < b.lower - slack || x > b.upper + slack) return false;
  }
  return true;
}

VectorXd Metric::RawResidual(int j) const { return rows_.target[j] - rows_.design[j] * (map_[j] * z_); }

VectorXd Metric::ResidualWith(const Columns& c, int j) const {
  const Gain g = Try(c);
  VectorXd e = rows_.target[j] - rows_.design[j] * (map_[j] * g.z);
  const auto at = std::find(c.joints.begin(), c.joints.end(), j);
  if (at != c.joints.end()) e -= c.block[static_cast<std::size_t>(at - c.joints.begin())] * g.amplitude;
  return e;
}

MatrixXd Metric::WhitenedColumns(const Columns& c, int r) const {
  return WhitenAll(noise_[c.joints[r]], rows_.index[c.joints[r]], c.block[r]);
}

Projection Metric::Project(const Columns& c) const {
  const int k = c.count();
  Projection p{MatrixXd::Zero(k, k), MatrixXd::Zero(rows_.coordinates(), k), VectorXd::Zero(k)};
  for (std::size_t r = 0; r < c.joints.size(); ++r) {
    const int j = c.joints[r];
    const MatrixXd w = WhitenedColumns(c, static_cast<int>(r));
    p.gram += SelfProduct(w);
    p.B += q_map_[j].transpose() * TallProduct(q(j), w);
    p.g += w.transpose() * residual_[j];
  }
  return p;
}

Gain Metric::Try(const Projection& p) const {
  Gain gain = SolveGain(factor_, p);
  gain.z = z_ - factor_.solve(p.B * gain.amplitude);
  return gain;
}

double Metric::CurveEvidence(const Projection& p, MatrixXd* precision) const {
  const int k = static_cast<int>(p.g.size());
  const MatrixXd S = p.gram - p.B.transpose() * factor_.solve(p.B);
  double best = 0;
  for (const double length : {0.1, 1.5}) {  // in knots: coefficients of their own, or neighbours alike
    MatrixXd alike(k, k);
    for (int i = 0; i < k; ++i)
      for (int m = 0; m < k; ++m) alike(i, m) = std::exp(-0.5 * std::pow((i - m) / length, 2)) + 1e-4 * (i == m);
    const Eigen::LLT<MatrixXd> factor(alike);
    const MatrixXd root = factor.matrixL();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(root.transpose() * S * root));
    const VectorXd seen = eigen.eigenvalues().cwiseMax(0),
                   u = eigen.eigenvectors().transpose() * (root.transpose() * p.g);
    if (seen[k - 1] <= 0) return 0;
    for (int doubled = 0; doubled < 34; ++doubled) {
      const double size2 = std::ldexp(0.1 / seen[k - 1], doubled);
      double evidence = 0;
      for (int i = 0; i < k; ++i) evidence += u[i] * u[i] * size2 / (1 + size2 * seen[i]) - std::log1p(size2 * seen[i]);
      if (evidence <= best) continue;
      best = evidence;
      if (precision) *precision = factor.solve(MatrixXd::Identity(k, k)) / size2;
    }
  }
  return best;
}

}  // namespace armcal::diagnosis
