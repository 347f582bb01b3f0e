// calibration - weighted least squares over a few rows, without a prior, for many changes of the columns.
#include "host_sim/identify/calibration/column_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "host_sim/identify/calibration/prior.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
constexpr int kPasses = 3;       // the weights settle within them
constexpr double kRidge = 1e-9;  // of a scaled column: a direction that the rows do not show stays at zero
constexpr double kLeast = 1e-8;  // share of variance left below which a fit is exact

MatrixXd GramOf(const MatrixXd& A) {
  MatrixXd gram = MatrixXd::Zero(A.cols(), A.cols());
  gram.selfadjointView<Eigen::Lower>().rankUpdate(A.transpose());
  return gram.selfadjointView<Eigen::Lower>();
}
}  // namespace

ColumnChange::ColumnChange(int joints) : q(joints), q_scale(joints, 1), tau_sign(joints, 1) {
  std::iota(q.begin(), q.end(), 0);
  tau = q;
}

bool ColumnChange::same_motion(const ColumnChange& other) const {
  return q == other.q && q_scale == other.q_scale && pace == other.pace;
}

codegen::Signals ColumnChange::Moved(const codegen::Signals& signals) const {
  codegen::Signals out = signals;
  for (std::size_t j = 0; j < q.size(); ++j) {
    const auto to = static_cast<Eigen::Index>(j);
    out.q.col(to) = q_scale[j] * signals.q.col(q[j]);
    out.qd.col(to) = q_scale[j] * pace * signals.qd.col(q[j]);
    out.qdd.col(to) = q_scale[j] * pace * pace * signals.qdd.col(q[j]);
  }
  return out;
}

ColumnFit::ColumnFit(const codegen::Model& model, const std::vector<const Dataset*>& data, int rows) : model_(model) {
  std::vector<std::pair<const Dataset*, int>> usable;
  for (const Dataset* d : data)
    for (int k = 0; k < d->samples(); ++k)
      if (d->used.row(k).any()) usable.emplace_back(d, k);
  const std::size_t step = std::max<std::size_t>(1, usable.size() / static_cast<std::size_t>(rows));
  const auto count = static_cast<Eigen::Index>((usable.size() + step - 1) / step);
  const int n = model.joints();
  signals_.t = VectorXd::LinSpaced(count, 0, 0.01 * static_cast<double>(count));  // memory, if any, only sees order
  for (MatrixXd* m : {&signals_.q, &signals_.qd, &signals_.qdd, &tau_}) m->resize(count, n);
  const bool temperature = std::all_of(data.begin(), data.end(), [n](const auto* d) { return d->s.temp.cols() == n; });
  if (temperature) signals_.temp.resize(count, n);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto& [d, k] = usable[static_cast<std::size_t>(i) * step];
    signals_.q.row(i) = d->s.q.row(k), signals_.qd.row(i) = d->s.qd.row(k), signals_.qdd.row(i) = d->s.qdd.row(k);
    tau_.row(i) = d->tau.row(k);
    if (temperature) signals_.temp.row(i) = d->s.temp.row(k);
  }
  for (int j = 0; j < n; ++j) {
    const bool rests = std::none_of(data.begin(), data.end(), [j](const Dataset* d) { return d->used.col(j).any(); });
    const double spread = std::sqrt((tau_.col(j).array() - tau_.col(j).mean()).square().mean());
    braked_.push_back(rests && spread < kBraked * model.robot().joint[static_cast<std::size_t>(j)].torque_limit_Nm);
  }
}

ColumnFit::Motion ColumnFit::Move(const ColumnChange& change) const {
  const std::vector<double> committed(static_cast<std::size_t>(model_.columns()), 0);
  std::vector<MatrixXd> row;
  model_.Regressor(change.Moved(signals_), committed, MeanUnknowns(model_), row);
  Motion motion;
  for (int j = 0; j < joints(); ++j) {
    std::vector<int> column;
    for (int c = 0; c < model_.columns(); ++c)
      if (!model_.rows()[static_cast<std::size_t>(j)][static_cast<std::size_t>(c)].IsZero()) column.push_back(c);
    motion.A.push_back(row[static_cast<std::size_t>(j)](Eigen::all, column));
    motion.gram.push_back(GramOf(motion.A.back()));
    motion.column.push_back(std::move(column));
  }
  motion.columns = model_.columns();
  return motion;
}

void ColumnFit::Motion::Remove(int joint, const std::vector<int>& columns_of_the_model) {
  const auto at = static_cast<std::size_t>(joint);
  std::vector<int> kept, places;
  for (std::size_t c = 0; c < column[at].size(); ++c) {
    if (std::find(columns_of_the_model.begin(), columns_of_the_model.end(), column[at][c]) !=
        columns_of_the_model.end())
      continue;
    kept.push_back(column[at][c]), places.push_back(static_cast<int>(c));
  }
  A[at] = A[at](Eigen::all, places).eval();
  gram[at] = GramOf(A[at]);
  column[at] = kept;
}

void ColumnFit::Motion::Add(int joint, const MatrixXd& columns_of_that_row) {
  const auto at = static_cast<std::size_t>(joint);
  const Eigen::Index before = A[at].cols();
  A[at].conservativeResize(Eigen::NoChange, before + columns_of_that_row.cols());
  A[at].rightCols(columns_of_that_row.cols()) = columns_of_that_row;
  gram[at] = GramOf(A[at]);
  for (Eigen::Index c = 0; c < columns_of_that_row.cols(); ++c) column[at].push_back(columns++);
}

ColumnFitResult ColumnFit::Fit(const Motion& motion, const ColumnChange& change) const {
  const int n = joints(), columns = motion.columns;
  std::vector<VectorXd> right, tau;
  ColumnFitResult out;
  out.spread.resize(n), out.left.resize(n);
  for (int j = 0; j < n; ++j) {
    const auto at = static_cast<std::size_t>(j);
    tau.push_back(change.tau_sign[at] * tau_.col(change.tau[at]));
    right.push_back(motion.A[at].transpose() * tau.back());
    out.spread[j] = std::sqrt((tau.back().array() - tau.back().mean()).square().mean());
  }
  const auto braked = [&](int j) { return braked_[static_cast<std::size_t>(change.tau[static_cast<std::size_t>(j)])]; };
  VectorXd least = VectorXd::Constant(n, 1e-12);  // of sigma
  for (int j = 0; j < n; ++j)
    if (braked(j)) least[j] = model_.robot().joint[static_cast<std::size_t>(j)].torque_limit_Nm;
  VectorXd sigma = out.spread.cwiseMax(least);
  MatrixXd H(columns, columns);
  VectorXd scale;
  Eigen::LDLT<MatrixXd> factor;
  for (int pass = 0; pass < kPasses; ++pass) {
    VectorXd g = VectorXd::Zero(columns);
    H.setZero();
    for (int j = 0; j < n; ++j) {
      const auto at = static_cast<std::size_t>(j);
      const double weight = 1 / (sigma[j] * sigma[j]);
      H(motion.column[at], motion.column[at]) += weight * motion.gram[at];
      g(motion.column[at]) += weight * right[at];
    }
    scale = H.diagonal().cwiseSqrt();
    for (double& s : scale) s = s > 0 ? 1 / s : 0;
    MatrixXd scaled = scale.asDiagonal() * H * scale.asDiagonal();
    scaled.diagonal().array() += kRidge;
    factor.compute(scaled);
    out.x = scale.cwiseProduct(factor.solve(VectorXd(scale.cwiseProduct(g))));
    for (int j = 0; j < n; ++j) {
      const auto at = static_cast<std::size_t>(j);
      const VectorXd left = tau[at] - motion.A[at] * out.x(motion.column[at]);
      out.left[j] = std::sqrt(left.squaredNorm() / static_cast<double>(rows()));
      sigma[j] = std::max(out.left[j], std::sqrt(kLeast) * out.spread[j] + least[j]);
    }
  }
  for (int j = 0; j < n; ++j)
    if (out.spread[j] > 0 && !braked(j)) out.log_left += 2 * std::log(sigma[j] / out.spread[j]);
  out.covariance =
      scale.asDiagonal() * factor.solve(MatrixXd(MatrixXd::Identity(columns, columns))) * scale.asDiagonal();
  return out;
}

}  // namespace armcal::calibration
