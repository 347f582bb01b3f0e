// diagnosis - gains, cross-validation and likelihood in whitened rows.
#include "host_sim/diagnosis/metric.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// A column may survive the base fit with a tiny part of itself (a balancer spring leaves 0.4 %); below this it is
// round-off.
constexpr double kVisible = 2e-7;

// g' S^+ g with S = C'C - B' base^-1 B, directions judged against the columns' own size.
Gain SolveGain(const Eigen::LLT<MatrixXd>& base, const Projection& p) {
  const int k = static_cast<int>(p.g.size());
  const VectorXd &g = p.g, norm2 = p.gram.diagonal();
  const MatrixXd S = p.gram - p.B.transpose() * base.solve(p.B);
  Gain out;
  out.amplitude = VectorXd::Zero(k), out.sd = VectorXd::Zero(k);
  VectorXd scale(k);
  for (int i = 0; i < k; ++i) scale[i] = norm2[i] > 0 ? 1 / std::sqrt(norm2[i]) : 0;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(scale.asDiagonal() * S * scale.asDiagonal()));
  const VectorXd projected = eigen.eigenvectors().transpose() * scale.cwiseProduct(g);
  VectorXd inverse = VectorXd::Zero(k);
  for (int i = 0; i < k; ++i) {
    if (eigen.eigenvalues()[i] < kVisible) continue;
    inverse[i] = 1 / eigen.eigenvalues()[i];
    out.gain += projected[i] * projected[i] * inverse[i];
    ++out.rank;
  }
  const MatrixXd V = scale.asDiagonal() * eigen.eigenvectors();
  out.amplitude = V * inverse.cwiseProduct(projected);
  out.sd = (V * inverse.asDiagonal() * V.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
  return out;
}

MatrixXd WhitenAll(const NoiseModel& noise, const RowIndex& rows, const MatrixXd& m) {
  MatrixXd out(m.rows(), m.cols());
  for (int c = 0; c < m.cols(); ++c) out.col(c) = Whiten(noise, rows, m.col(c));
  return out;
}

MatrixXd SelfProduct(const MatrixXd& m) {
  MatrixXd out = MatrixXd::Zero(m.cols(), m.cols());
  out.selfadjointView<Eigen::Lower>().rankUpdate(m.transpose());
  out.triangularView<Eigen::StrictlyUpper>() = out.transpose();
  return out;
}

}  // namespace

void Metric::WhitenJoint(int j) {
  const auto& columns = rows_.columns[j];
  map_[j].resize(static_cast<Eigen::Index>(columns.size()), rows_.L.cols());
  for (std::size_t i = 0; i < columns.size(); ++i) map_[j].row(i) = rows_.L.row(columns[i]);
  q_[j] = WhitenAll(noise_[j], rows_.index[j], rows_.design[j]);
  y_[j] = Whiten(noise_[j], rows_.index[j], rows_.target[j]);
  gram_[j] = SelfProduct(q_[j]);
  right_[j] = q_[j].transpose() * y_[j];
}

void Metric::Solve() {
  const int n = rows_.joints(), d = rows_.coordinates();
  MatrixXd hessian = prior() * MatrixXd::Identity(d, d);
  VectorXd right = VectorXd::Zero(d);
  for (int j = 0; j < n; ++j) {
    hessian += map_[j].transpose() * gram_[j] * map_[j];
    right += map_[j].transpose() * right_[j];
  }
  factor_.compute(hessian);
  z_ = factor_.solve(right);
  for (int j = 0; j < n; ++j) residual_[j] = y_[j] - q_[j] * (map_[j] * z_);
  bounded_sd_.resize(static_cast<Eigen::Index>(rows_.bounded.size()));
  for (std::size_t k = 0; k < rows_.bounded.size(); ++k) {
    const VectorXd row = rows_.L.row(rows_.bounded[k].coordinate).transpose();
    bounded_sd_[static_cast<Eigen::Index>(k)] = std::sqrt(std::max(0.0, row.dot(factor_.solve(row))));
  }
}

Metric::Metric(const BaseRows& rows, std::vector<NoiseModel> noise) : rows_(rows), noise_(std::move(noise)) {
  const std::size_t n = rows.index.size();
  map_.resize(n), q_.resize(n), y_.resize(n), gram_.resize(n), right_.resize(n), residual_.resize(n);
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
    for (int i = 0; i < k; ++i)  // column by column: a product of so few columns would spend its time copying q
      p.B.col(i) += map_[j].transpose() * (q_[j].transpose() * w.col(i));
    p.g += w.transpose() * residual_[j];
  }
  return p;
}

Gain Metric::Try(const Projection& p) const {
  Gain gain = SolveGain(factor_, p);
  gain.z = z_ - factor_.solve(p.B * gain.amplitude);
  return gain;
}

VectorXd Metric::OutOfFold(const Columns& c, int blocks, int folds) const {
  const int n = rows_.joints(), d = rows_.coordinates(), k = c.count();
  std::vector<MatrixXd> gram(folds, MatrixXd::Zero(d + k, d + k));  // of each fold's own rows
  std::vector<VectorXd> right(folds, VectorXd::Zero(d + k));
  std::vector<MatrixXd> extended(n), map(n);
  std::vector<std::vector<std::pair<int, int>>> fold_rows(static_cast<std::size_t>(folds * n));  // row ranges
  for (int j = 0; j < n; ++j) {
    const auto at = std::find(c.joints.begin(), c.joints.end(), j);
    const int r = static_cast<int>(q_[j].cols()), extra = at == c.joints.end() ? 0 : k;
    const int rows = static_cast<int>(q_[j].rows());
    extended[j].resize(rows, r + extra);
    extended[j].leftCols(r) = q_[j];
    if (extra) extended[j].rightCols(k) = WhitenedColumns(c, static_cast<int>(at - c.joints.begin()));
    map[j] = MatrixXd::Zero(r + extra, d + k);
    map[j].topLeftCorner(r, d) = map_[j];
    map[j].bottomRightCorner(extra, extra).setIdentity();
    std::vector<MatrixXd> own(folds, MatrixXd::Zero(r + extra, r + extra));
    for (int b = 0; b < blocks; ++b) {
      const int begin = static_cast<int>(static_cast<long>(rows) * b / blocks),
                end = static_cast<int>(static_cast<long>(rows) * (b + 1) / blocks);
      if (begin == end) continue;
      const MatrixXd part = extended[j].middleRows(begin, end - begin);
      own[b % folds] += SelfProduct(part);
      right[b % folds] += map[j].transpose() * (part.transpose() * y_[j].segment(begin, end - begin));
      fold_rows[static_cast<std::size_t>((b % folds) * n + j)].emplace_back(begin, end);
    }
    for (int f = 0; f < folds; ++f) gram[f] += map[j].transpose() * own[f] * map[j];
  }
  MatrixXd total = MatrixXd::Zero(d + k, d + k);
  VectorXd total_right = VectorXd::Zero(d + k), error = VectorXd::Zero(folds);
  for (int f = 0; f < folds; ++f) total += gram[f], total_right += right[f];
  MatrixXd ridge = MatrixXd::Zero(d + k, d + k);
  ridge.topLeftCorner(d, d).diagonal().setConstant(prior());
  ridge.bottomRightCorner(k, k).diagonal() = 1e-9 * total.bottomRightCorner(k, k).diagonal();
  for (int f = 0; f < folds; ++f) {
    const VectorXd x = MatrixXd(total - gram[f] + ridge).ldlt().solve(total_right - right[f]);
    for (int j = 0; j < n; ++j) {
      const VectorXd local = map[j] * x;
      for (const auto& [begin, end] : fold_rows[static_cast<std::size_t>(f * n + j)])
        error[f] +=
            (y_[j].segment(begin, end - begin) - extended[j].middleRows(begin, end - begin) * local).squaredNorm();
    }
  }
  return error;
}

double Metric::RefittedDeviance(const Columns& c, std::vector<NoiseModel>* all_noise) const {
  const int d = rows_.coordinates(), k = c.count();
  // The noise that this metric's own fit leaves; then one fit under that noise, and what it leaves.
  VectorXd x = VectorXd::Zero(d + k);
  x.head(d) = z_;
  if (k > 0) {
    const Projection p = Project(c);
    x.tail(k) = SolveGain(factor_, p).amplitude;
    x.head(d) -= factor_.solve(p.B * x.tail(k));
  }
  std::vector<NoiseModel> noise(c.joints.size());
  const auto refit_noise = [&] {
    double deviance = 0;
    for (std::size_t r = 0; r < c.joints.size(); ++r) {
      const int j = c.joints[r];
      VectorXd e = rows_.target[j] - rows_.design[j] * (map_[j] * x.head(d));
      if (k > 0) e -= c.block[r] * x.tail(k);
      noise[r] = FitNoise(rows_.index[j], e);
      deviance += 2 * WhitenedRows(noise[r], rows_.index[j]) * std::log(noise[r].innovation);
    }
    return deviance;
  };
  refit_noise();
  MatrixXd h = MatrixXd::Zero(d + k, d + k);
  VectorXd b = VectorXd::Zero(d + k);
  h.topLeftCorner(d, d).diagonal().setConstant(prior());
  for (int j = 0; j < rows_.joints(); ++j) {
    const auto at = std::find(c.joints.begin(), c.joints.end(), j);
    if (at == c.joints.end()) {
      h.topLeftCorner(d, d) += map_[j].transpose() * gram_[j] * map_[j];
      b.head(d) += map_[j].transpose() * right_[j];
      continue;
    }
    const std::size_t r = static_cast<std::size_t>(at - c.joints.begin());
    const int own = static_cast<int>(q_[j].cols());
    MatrixXd w(rows_.design[j].rows(), own + k);
    w.leftCols(own) = WhitenAll(noise[r], rows_.index[j], rows_.design[j]);
    w.rightCols(k) = WhitenAll(noise[r], rows_.index[j], c.block[r]);
    MatrixXd map = MatrixXd::Zero(own + k, d + k);
    map.topLeftCorner(own, d) = map_[j];
    map.bottomRightCorner(k, k).setIdentity();
    h += map.transpose() * SelfProduct(w) * map;
    b += map.transpose() * (w.transpose() * Whiten(noise[r], rows_.index[j], rows_.target[j]));
  }
  if (k > 0) h.bottomRightCorner(k, k).diagonal() *= 1 + 1e-9;
  x = h.ldlt().solve(b);
  const double deviance = refit_noise();
  if (all_noise) {
    *all_noise = noise_;
    for (std::size_t r = 0; r < c.joints.size(); ++r) (*all_noise)[c.joints[r]] = noise[r];
  }
  return deviance;
}

std::pair<double, double> Metric::Imitates(const Columns& other, const Columns& fitted, const VectorXd& a) const {
  std::vector<VectorXd> trace(rows_.index.size());
  VectorXd onto = VectorXd::Zero(rows_.coordinates());
  double own = 0;
  for (std::size_t r = 0; r < fitted.joints.size(); ++r) {
    const int j = fitted.joints[r];
    trace[j] = WhitenedColumns(fitted, static_cast<int>(r)) * a;
    own += trace[j].squaredNorm();
    onto += map_[j].transpose() * (q_[j].transpose() * trace[j]);
  }
  const VectorXd z = factor_.solve(onto);
  own -= onto.dot(z);
  Projection p = Project(other);
  p.g = -p.B.transpose() * z;
  for (std::size_t r = 0; r < other.joints.size(); ++r) {
    const int j = other.joints[r];
    if (trace[j].size()) p.g += WhitenedColumns(other, static_cast<int>(r)).transpose() * trace[j];
  }
  return {SolveGain(factor_, p).gain, own};
}

MatrixXd Metric::Covariance() const {
  return factor_.solve(MatrixXd::Identity(rows_.coordinates(), rows_.coordinates()));
}

}  // namespace armcal::diagnosis
