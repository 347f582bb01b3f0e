// diagnosis - fits the base model in whitened rows, computes what columns gain on it, and checks such a gain.
#include "host_sim/diagnose/diagnosis/metric.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <map>

#include "codegen/src/io/watch.hpp"
#include "host_sim/identify/calibration/tall_product.hpp"

namespace armcal::diagnosis {

using calibration::SelfProduct, calibration::TallProduct;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// A column may survive the base fit with a tiny part of itself (a balancer spring leaves 0.4 %); below this it is
// round-off.
constexpr double kVisible = 2e-7;

// First row of a block of time among so many rows.
int BlockBegin(int rows, int blocks, int b) { return static_cast<int>(static_cast<long>(rows) * b / blocks); }

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

}  // namespace

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
  coloured_[j] = WhitenColumns(noise_[j], rows_.index[j], rows_.design[j]);
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
  const MatrixXd own = MatrixXd::Identity(rows_.coordinates(), rows_.coordinates());
  return rows_.precision.size() == 0 ? own : MatrixXd(own + rows_.L.transpose() * rows_.precision * rows_.L);
}

Metric::Metric(const BaseRows& rows, std::vector<NoiseModel> noise)
    : rows_(rows), noise_(std::move(noise)), prior_(PriorPrecision()) {
  const std::size_t n = rows.index.size();
  map_.resize(n), q_map_.resize(n), coloured_.resize(n), y_.resize(n), gram_.resize(n), right_.resize(n),
      residual_.resize(n);
  for (int j = 0; j < rows.joints(); ++j) {
    io::CancellationPoint();
    WhitenJoint(j);
  }
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
  return WhitenColumns(noise_[c.joints[r]], rows_.index[c.joints[r]], c.block[r]);
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
  gain.z = z_ - factor_.solve(VectorXd(p.B * gain.amplitude));
  return gain;
}

CurveOdds Metric::OddsOf(const Projection& p, int inner) const {
  return {p.gram - p.B.transpose() * factor_.solve(p.B), p.g, inner};
}

VectorXd Metric::FoldGains(const Columns& c, int blocks, int folds, const MatrixXd& precision) const {
  const int n = rows_.joints(), d = rows_.coordinates(), k = c.count();
  std::vector<MatrixXd> gram(folds, MatrixXd::Zero(d + k, d + k));  // of each fold's own rows
  std::vector<VectorXd> right(folds, VectorXd::Zero(d + k));
  std::vector<MatrixXd> extended(n), map(n);
  // [fold][joint] row ranges
  std::vector<std::vector<std::vector<std::pair<int, int>>>> fold_rows(folds);
  for (auto& joints : fold_rows) joints.resize(n);
  for (int j = 0; j < n; ++j) {
    const auto at = std::find(c.joints.begin(), c.joints.end(), j);
    const int r = static_cast<int>(q(j).cols()), extra = at == c.joints.end() ? 0 : k;
    const int rows = static_cast<int>(q(j).rows());
    extended[j].resize(rows, r + extra);
    extended[j].leftCols(r) = q(j);
    if (extra) extended[j].rightCols(k) = WhitenedColumns(c, static_cast<int>(at - c.joints.begin()));
    map[j] = MatrixXd::Zero(r + extra, d + k);
    map[j].topLeftCorner(r, d) = q_map_[j];
    map[j].bottomRightCorner(extra, extra).setIdentity();
    std::vector<MatrixXd> own(folds, MatrixXd::Zero(r + extra, r + extra));
    for (int b = 0; b < blocks; ++b) {
      const int begin = BlockBegin(rows, blocks, b), end = BlockBegin(rows, blocks, b + 1);
      if (begin == end) continue;
      const MatrixXd part = extended[j].middleRows(begin, end - begin);
      own[b % folds] += SelfProduct(part);
      right[b % folds] += map[j].transpose() * (part.transpose() * y_[j].segment(begin, end - begin));
      fold_rows[b % folds][j].emplace_back(begin, end);
    }
    for (int f = 0; f < folds; ++f) gram[f] += map[j].transpose() * own[f] * map[j];
  }
  MatrixXd total = MatrixXd::Zero(d + k, d + k);
  VectorXd total_right = VectorXd::Zero(d + k), gain = VectorXd::Zero(folds);
  for (int f = 0; f < folds; ++f) total += gram[f], total_right += right[f];
  MatrixXd ridge = MatrixXd::Zero(d + k, d + k);
  ridge.topLeftCorner(d, d) = prior_;
  ridge.bottomRightCorner(k, k).diagonal() = 1e-9 * total.bottomRightCorner(k, k).diagonal();
  if (precision.size()) ridge.bottomRightCorner(k, k) += precision;
  for (int f = 0; f < folds; ++f) {
    const MatrixXd others = total - gram[f] + ridge;
    const VectorXd others_right = total_right - right[f], with = others.ldlt().solve(others_right),
                   without = others.topLeftCorner(d, d).ldlt().solve(VectorXd(others_right.head(d)));
    for (int j = 0; j < n; ++j) {
      const VectorXd own = q_map_[j] * without, extended_own = map[j] * with;
      for (const auto& [begin, end] : fold_rows[f][j]) {
        const int rows = end - begin;
        const auto y = y_[j].segment(begin, rows);
        gain[f] += (y - q(j).middleRows(begin, rows) * own).squaredNorm() -
                   (y - extended[j].middleRows(begin, rows) * extended_own).squaredNorm();
      }
    }
  }
  return gain;
}

double Metric::LargestFold(const Columns& c, const VectorXd& a, int blocks, int folds) const {
  VectorXd own = VectorXd::Zero(folds);
  for (std::size_t r = 0; r < c.joints.size(); ++r) {
    const VectorXd trace = WhitenedColumns(c, static_cast<int>(r)) * a;
    const int rows = static_cast<int>(trace.size());
    for (int b = 0; b < blocks; ++b) {
      const int begin = BlockBegin(rows, blocks, b), end = BlockBegin(rows, blocks, b + 1);
      own[b % folds] += trace.segment(begin, end - begin).squaredNorm();
    }
  }
  return own.maxCoeff() / std::max(own.sum(), 1e-300);
}

double Metric::RefittedDeviance(const Columns& c, std::vector<NoiseModel>* all_noise) const {
  const int d = rows_.coordinates(), k = c.count();
  // The noise that this metric's own fit leaves; then one fit under that noise, and what it leaves.
  VectorXd x = VectorXd::Zero(d + k);
  x.head(d) = z_;
  if (k > 0) {
    const Projection p = Project(c);
    x.tail(k) = SolveGain(factor_, p).amplitude;
    x.head(d) -= factor_.solve(VectorXd(p.B * x.tail(k)));
  }
  std::vector<NoiseModel> noise(c.joints.size());
  const auto refit_noise = [&] {
    double deviance = 0;
    for (std::size_t r = 0; r < c.joints.size(); ++r) {
      const int j = c.joints[r];
      VectorXd e = rows_.target[j] - rows_.design[j] * (map_[j] * x.head(d));
      if (k > 0) e -= c.block[r] * x.tail(k);
      noise[r] = FitNoise(rows_.index[j], e);
      deviance += Deviance(noise[r], rows_.index[j]);
    }
    return deviance;
  };
  refit_noise();
  MatrixXd h = MatrixXd::Zero(d + k, d + k);
  VectorXd b = VectorXd::Zero(d + k);
  h.topLeftCorner(d, d) = prior_;
  for (int j = 0; j < rows_.joints(); ++j) {
    const auto at = std::find(c.joints.begin(), c.joints.end(), j);
    if (at == c.joints.end()) {
      h.topLeftCorner(d, d) += gram_[j];
      b.head(d) += right_[j];
      continue;
    }
    const std::size_t r = static_cast<std::size_t>(at - c.joints.begin());
    const int own = static_cast<int>(q(j).cols());
    MatrixXd w(rows_.design[j].rows(), own + k);
    w.leftCols(own) = WhitenColumns(noise[r], rows_.index[j], rows_.design[j]);
    w.rightCols(k) = WhitenColumns(noise[r], rows_.index[j], c.block[r]);
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
    onto += q_map_[j].transpose() * (q(j).transpose() * trace[j]);
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

MatrixXd Metric::RobustCovariance(const Columns& c, double block_s, const std::vector<const VectorXd*>& time) const {
  const int d = rows_.coordinates(), k = c.count();
  const Projection p = Project(c);
  MatrixXd hessian(d + k, d + k);
  hessian.topLeftCorner(d, d) = factor_.reconstructedMatrix();
  hessian.topRightCorner(d, k) = p.B, hessian.bottomLeftCorner(k, d) = p.B.transpose();
  hessian.bottomRightCorner(k, k) = p.gram;
  std::map<std::pair<int, long>, VectorXd> score;  // of each block of time, all joints
  for (int j = 0; j < rows_.joints(); ++j) {
    const auto at = std::find(c.joints.begin(), c.joints.end(), j);
    const MatrixXd own =
        at == c.joints.end() ? MatrixXd() : WhitenedColumns(c, static_cast<int>(at - c.joints.begin()));
    const RowIndex& index = rows_.index[j];
    const auto block = [&](int i) {
      return std::pair(index.dataset[i], std::lround(std::floor((*time[index.dataset[i]])[index.sample[i]] / block_s)));
    };
    for (int first = 0, last = 0; first < index.size(); first = last) {
      while (last < index.size() && block(last) == block(first)) ++last;
      VectorXd& sum = score.try_emplace(block(first), VectorXd::Zero(d + k)).first->second;
      const auto residual = residual_[j].segment(first, last - first);
      sum.head(d) += q_map_[j].transpose() * (q(j).middleRows(first, last - first).transpose() * residual);
      if (own.size()) sum.tail(k) += own.middleRows(first, last - first).transpose() * residual;
    }
  }
  MatrixXd spread = MatrixXd::Zero(d + k, d + k);
  spread.topLeftCorner(d, d) = prior_;
  for (const auto& [block, s] : score) spread += s * s.transpose();
  VectorXd scale(d + k);
  for (int i = 0; i < d + k; ++i) scale[i] = hessian(i, i) > 0 ? 1 / std::sqrt(hessian(i, i)) : 0;
  const MatrixXd scaled = scale.asDiagonal() * hessian * scale.asDiagonal() + 1e-9 * MatrixXd::Identity(d + k, d + k);
  const MatrixXd inverse = scale.asDiagonal() * scaled.ldlt().solve(MatrixXd(scale.asDiagonal()));
  return inverse * spread * inverse;
}

}  // namespace armcal::diagnosis
