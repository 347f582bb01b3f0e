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

// g' S^+ g with directions judged against the columns' own size.
Gain SolveGain(const MatrixXd& S, const VectorXd& g, const VectorXd& norm2) {
  const int k = static_cast<int>(g.size());
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

}  // namespace

Metric::Metric(const BaseRows& rows, std::vector<NoiseModel> noise) : rows_(rows), noise_(std::move(noise)) {
  const int n = static_cast<int>(rows.index.size()), d = rows.coordinates();
  hessian_ = rows.informative ? MatrixXd(MatrixXd::Identity(d, d)) : MatrixXd(1e-9 * MatrixXd::Identity(d, d));
  VectorXd right = VectorXd::Zero(d);
  for (int j = 0; j < n; ++j) {
    q_.push_back(WhitenAll(noise_[j], rows.index[j], rows.design[j]));
    y_.push_back(Whiten(noise_[j], rows.index[j], rows.target[j]));
    gram_.push_back(q_[j].transpose() * q_[j]);
    hessian_ += gram_[j];
    right += q_[j].transpose() * y_[j];
  }
  factor_.compute(hessian_);
  z_ = factor_.solve(right);
  for (int j = 0; j < n; ++j) residual_.push_back(y_[j] - q_[j] * z_);
}

VectorXd Metric::RawResidual(int j) const { return rows_.target[j] - rows_.design[j] * z_; }

MatrixXd Metric::WhitenedColumns(const Columns& c, int r) const {
  return WhitenAll(noise_[c.joints[r]], rows_.index[c.joints[r]], c.block[r]);
}

Gain Metric::Try(const Columns& c) const {
  const int k = c.count();
  MatrixXd S = MatrixXd::Zero(k, k), B = MatrixXd::Zero(rows_.coordinates(), k);
  VectorXd g = VectorXd::Zero(k);
  for (std::size_t r = 0; r < c.joints.size(); ++r) {
    const MatrixXd w = WhitenedColumns(c, static_cast<int>(r));
    S += w.transpose() * w;
    B += q_[c.joints[r]].transpose() * w;
    g += w.transpose() * residual_[c.joints[r]];
  }
  const VectorXd norm2 = S.diagonal();
  S -= B.transpose() * factor_.solve(B);
  return SolveGain(S, g, norm2);
}

VectorXd Metric::CrossValidate(const Columns& c, int blocks, int folds) const {
  const int n = static_cast<int>(rows_.index.size()), d = rows_.coordinates(), k = c.count();
  std::vector<MatrixXd> gram(folds, MatrixXd::Zero(d + k, d + k));  // of each fold's own rows
  std::vector<VectorXd> right(folds, VectorXd::Zero(d + k));
  VectorXd improvement = VectorXd::Zero(folds);
  std::vector<MatrixXd> extended(n);
  std::vector<std::vector<std::pair<int, int>>> fold_rows(folds * n);  // row ranges
  for (int j = 0; j < n; ++j) {
    const auto at = std::find(c.joints.begin(), c.joints.end(), j);
    extended[j] = MatrixXd::Zero(q_[j].rows(), d + k);
    extended[j].leftCols(d) = q_[j];
    if (at != c.joints.end()) extended[j].rightCols(k) = WhitenedColumns(c, static_cast<int>(at - c.joints.begin()));
    const int rows = static_cast<int>(q_[j].rows());
    for (int b = 0; b < blocks; ++b) {
      const int begin = static_cast<int>(static_cast<long>(rows) * b / blocks),
                end = static_cast<int>(static_cast<long>(rows) * (b + 1) / blocks);
      if (begin == end) continue;
      const auto part = extended[j].middleRows(begin, end - begin);
      gram[b % folds] += part.transpose() * part;
      right[b % folds] += part.transpose() * y_[j].segment(begin, end - begin);
      fold_rows[(b % folds) * n + j].emplace_back(begin, end);
    }
  }
  MatrixXd total = MatrixXd::Zero(d + k, d + k);
  VectorXd total_right = VectorXd::Zero(d + k);
  for (int f = 0; f < folds; ++f) total += gram[f], total_right += right[f];
  MatrixXd prior = MatrixXd::Zero(d + k, d + k);
  prior.topLeftCorner(d, d).diagonal().setConstant(rows_.informative ? 1 : 1e-9);
  prior.bottomRightCorner(k, k).diagonal() = 1e-9 * total.bottomRightCorner(k, k).diagonal();
  for (int f = 0; f < folds; ++f) {
    const MatrixXd H = total - gram[f] + prior;
    const VectorXd g = total_right - right[f];
    const VectorXd with = H.ldlt().solve(g);
    const VectorXd without = H.topLeftCorner(d, d).ldlt().solve(g.head(d));
    for (int j = 0; j < n; ++j)
      for (const auto& [begin, end] : fold_rows[f * n + j]) {
        const auto part = extended[j].middleRows(begin, end - begin);
        const auto y = y_[j].segment(begin, end - begin);
        improvement[f] += (y - part.leftCols(d) * without).squaredNorm() - (y - part * with).squaredNorm();
      }
  }
  return improvement;
}

double Metric::RefittedDeviance(const Columns& c, std::vector<NoiseModel>* all_noise) const {
  const int d = rows_.coordinates(), k = c.count();
  const auto place = [&](int j) {
    return static_cast<int>(std::find(c.joints.begin(), c.joints.end(), j) - c.joints.begin());
  };
  MatrixXd H = MatrixXd::Zero(d + k, d + k);
  H.topLeftCorner(d, d).diagonal().setConstant(rows_.informative ? 1 : 1e-9);
  VectorXd g = VectorXd::Zero(d + k);
  const int n = static_cast<int>(rows_.index.size());
  for (int j = 0; j < n; ++j)
    if (place(j) == static_cast<int>(c.joints.size()))
      H.topLeftCorner(d, d) += gram_[j], g.head(d) += q_[j].transpose() * y_[j];
  // Its own joints: white first, then with the noise that is left.
  std::vector<NoiseModel> noise;
  for (const int j : c.joints) noise.push_back(NoiseModel{VectorXd::Zero(kArOrder), noise_[j].innovation});
  double deviance = 0;
  VectorXd x;
  for (int pass = 0; pass < 3; ++pass) {
    MatrixXd h = H;
    VectorXd b = g;
    for (std::size_t r = 0; r < c.joints.size(); ++r) {
      const int j = c.joints[r];
      MatrixXd w(rows_.design[j].rows(), d + k);
      // the base's whitened rows are known already if the noise is still the metric's
      w.leftCols(d) = WhitenAll(noise[r], rows_.index[j], rows_.design[j]);
      w.rightCols(k) = WhitenAll(noise[r], rows_.index[j], c.block[r]);
      h += w.transpose() * w;
      b += w.transpose() * Whiten(noise[r], rows_.index[j], rows_.target[j]);
    }
    if (k > 0) h.bottomRightCorner(k, k).diagonal() *= 1 + 1e-9;
    x = h.ldlt().solve(b);
    deviance = 0;
    for (std::size_t r = 0; r < c.joints.size(); ++r) {
      const int j = c.joints[r];
      VectorXd e = rows_.target[j] - rows_.design[j] * x.head(d);
      if (k > 0) e -= c.block[r] * x.tail(k);
      noise[r] = FitNoise(rows_.index[j], e);
      deviance += 2 * WhitenedRows(noise[r], rows_.index[j]) * std::log(noise[r].innovation);
    }
  }
  if (all_noise) {
    *all_noise = noise_;
    for (std::size_t r = 0; r < c.joints.size(); ++r) (*all_noise)[c.joints[r]] = noise[r];
  }
  return deviance;
}

std::pair<double, double> Metric::Imitates(const Columns& other, const Columns& fitted, const VectorXd& a) const {
  const int n = static_cast<int>(rows_.index.size()), k = other.count();
  std::vector<VectorXd> trace(n);
  VectorXd onto = VectorXd::Zero(rows_.coordinates());
  double own = 0;
  for (std::size_t r = 0; r < fitted.joints.size(); ++r) {
    const int j = fitted.joints[r];
    trace[j] = WhitenedColumns(fitted, static_cast<int>(r)) * a;
    own += trace[j].squaredNorm();
    onto += q_[j].transpose() * trace[j];
  }
  const VectorXd z = factor_.solve(onto);
  own -= onto.dot(z);
  MatrixXd S = MatrixXd::Zero(k, k), B = MatrixXd::Zero(rows_.coordinates(), k);
  VectorXd g = VectorXd::Zero(k);
  for (std::size_t r = 0; r < other.joints.size(); ++r) {
    const int j = other.joints[r];
    const MatrixXd w = WhitenedColumns(other, static_cast<int>(r));
    S += w.transpose() * w;
    B += q_[j].transpose() * w;
    g -= w.transpose() * (q_[j] * z);
    if (trace[j].size()) g += w.transpose() * trace[j];
  }
  const VectorXd norm2 = S.diagonal();
  S -= B.transpose() * factor_.solve(B);
  return {SolveGain(S, g, norm2).gain, own};
}

MatrixXd Metric::Covariance() const {
  return factor_.solve(MatrixXd::Identity(rows_.coordinates(), rows_.coordinates()));
}

}  // namespace armcal::diagnosis
