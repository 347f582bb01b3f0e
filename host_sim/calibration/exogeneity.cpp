// calibration - the augmented regression of one joint after the other; knows no file.
#include "host_sim/calibration/exogeneity.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <numeric>

#include "host_sim/calibration/methods/simulated_logs.hpp"
#include "host_sim/io/butterworth.hpp"
#include "host_sim/io/quintic_spline.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kLevel = 0.05;
constexpr int kOrder = 10;            // of the residual's autoregressive model
constexpr int kRounds = 2;            // of fitting it anew
constexpr double kSameColumn = 1e-5;  // share of a column's norm below which a direction of the columns repeats others
constexpr double kNegligible = 1e-3;  // ... of what instruments leave: noise so small biases by its square
constexpr double kTold = 0.1;         // share of such a direction that must lie outside the columns: below, instruments
                                      // explain so little of it that nothing can be said
constexpr double kMatters = 0.05;     // bias over residual; with rows enough any test finds less than any use would
constexpr double kSingular = 1e-8;    // of whitened columns, relative: the whitening may take a slow one away
constexpr double kRowsPerColumn = 3;
constexpr double kSmoothed = 0.2;  // of the bandwidth

// One joint's rows over all logs: regressors, instruments, torque, and how many used rows run up to each without a gap.
struct JointRows {
  MatrixXd X, Z;
  VectorXd tau;
  std::vector<int> run;
};

std::vector<int> Present(const codegen::Model& model, int joint) {
  std::vector<int> present;
  for (const int c : MakePrior(model).active)
    if (c < model.columns() && !model.rows()[joint][c].IsZero()) present.push_back(c);
  return present;
}

// The directions of M (columns of unit norm) that are longer than `floor`.
MatrixXd Directions(const MatrixXd& M, double floor) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(M.transpose() * M));
  const auto keep = (eigen.eigenvalues().array() > floor * floor).count();
  return M * eigen.eigenvectors().rightCols(keep);
}

// What the columns of A do not explain of Y.
MatrixXd Outside(const MatrixXd& A, const MatrixXd& Y) { return Y - A * A.completeOrthogonalDecomposition().solve(Y); }

// Coefficients a of e_k = sum a_i e_(k-i) + white, from the rows of unbroken runs (Yule and Walker).
VectorXd Autoregression(const VectorXd& e, const std::vector<int>& run) {
  VectorXd r = VectorXd::Zero(kOrder + 1);
  for (int lag = 0; lag <= kOrder; ++lag)
    for (std::size_t k = 0; k < run.size(); ++k)
      if (run[k] >= lag) r[lag] += e[static_cast<Eigen::Index>(k)] * e[static_cast<Eigen::Index>(k) - lag];
  MatrixXd R(kOrder, kOrder);
  for (int i = 0; i < kOrder; ++i)
    for (int k = 0; k < kOrder; ++k) R(i, k) = r[std::abs(i - k)];
  R.diagonal().array() += 1e-9 * r[0];
  return R.ldlt().solve(r.tail(kOrder));
}

// Rows minus what the model predicts of them; those with a whole past.
MatrixXd Whiten(const MatrixXd& M, const VectorXd& a, const std::vector<int>& run) {
  MatrixXd out(std::count_if(run.begin(), run.end(), [](int r) { return r >= kOrder; }), M.cols());
  Eigen::Index next = 0;
  for (std::size_t k = 0; k < run.size(); ++k) {
    if (run[k] < kOrder) continue;
    const auto row = static_cast<Eigen::Index>(k);
    out.row(next) = M.row(row);
    for (int i = 0; i < kOrder; ++i) out.row(next) -= a[i] * M.row(row - 1 - i);
    ++next;
  }
  return out;
}

JointExogeneity TestJoint(const JointRows& rows) {
  JointExogeneity out;
  const VectorXd norm = rows.X.colwise().norm().transpose().cwiseMax(1e-300);
  const MatrixXd scaled = rows.X * norm.cwiseInverse().asDiagonal();
  const MatrixXd X = Directions(scaled, kSameColumn);
  const MatrixXd left = Outside(rows.Z, scaled);
  MatrixXd V = Directions(left, kNegligible);
  if (V.cols() > 0) V = Directions(Outside(X, V.colwise().normalized()), kTold);
  const auto k = X.cols(), q = V.cols();
  MatrixXd all(X.rows(), k + q + 1);
  all << X, V, rows.tau;
  const VectorXd residual = Outside(X, rows.tau);
  MatrixXd white = Whiten(all, Autoregression(residual, rows.run), rows.run);
  // Least squares takes slow noise for slow columns, so that its residual looks faster than the noise is; the whitened
  // rows' solution does not (Cochrane and Orcutt).
  for (int round = 0; round < kRounds && white.rows() > k; ++round) {
    const VectorXd x = white.leftCols(k).householderQr().solve(white.rightCols(1)).col(0);
    white = Whiten(all, Autoregression(rows.tau - X * x, rows.run), rows.run);
  }
  out.left_Nm = residual.norm() / std::sqrt(static_cast<double>(residual.size()));
  out.rows = static_cast<int>(white.rows());
  if (q == 0 || static_cast<double>(out.rows) < kRowsPerColumn * static_cast<double>(k + q)) return out;
  const auto solve = [&](Eigen::Index columns) {
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> all_of;
    all_of.setThreshold(kSingular);
    return all_of.compute(white.leftCols(columns));
  };
  const VectorXd y = white.rightCols(1);
  const auto plain = solve(k), augmented = solve(k + q);
  const VectorXd least_squares = plain.solve(y), both = augmented.solve(y);
  const auto free = static_cast<double>(white.rows() - augmented.rank());
  const double remains = (y - white.leftCols(k + q) * both).squaredNorm();
  if (augmented.rank() <= plain.rank() || remains <= kSingular * kSingular * y.squaredNorm()) return out;  // no error
  out.restrictions = static_cast<int>(augmented.rank() - plain.rank());
  const double gained = (y - white.leftCols(k) * least_squares).squaredNorm() - remains;
  out.F = std::max(0.0, gained) / out.restrictions / (remains / free);
  out.p = cdf(complement(boost::math::fisher_f(out.restrictions, free), out.F));
  out.bias_Nm = (X * (least_squares - both.head(k))).norm() / std::sqrt(static_cast<double>(X.rows()));
  return out;
}

// The smallest p of m is judged at level / m, the next at level / (m - 1), ... until one is not small enough.
void JudgeByHolm(std::vector<JointExogeneity>& joint) {
  std::vector<JointExogeneity*> tested;
  for (JointExogeneity& j : joint)
    if (j.restrictions > 0) tested.push_back(&j);
  std::sort(tested.begin(), tested.end(), [](const auto* a, const auto* b) { return a->p < b->p; });
  for (std::size_t k = 0; k < tested.size() && tested[k]->p < kLevel / static_cast<double>(tested.size() - k); ++k)
    tested[k]->exogenous = tested[k]->bias_Nm < kMatters * tested[k]->left_Nm;
}

Dataset AlongSpline(const Dataset& data, const MatrixXd& q) {
  Dataset out = data;
  const io::QuinticSpline spline(data.s.t, q);
  out.s.q = spline.Evaluate(data.s.t, 0), out.s.qd = spline.Evaluate(data.s.t, 1);
  out.s.qdd = spline.Evaluate(data.s.t, 2);
  return out;
}

}  // namespace

bool Exogeneity::passed() const {
  return std::all_of(joint.begin(), joint.end(), [](const JointExogeneity& j) { return j.exogenous; });
}

Exogeneity TestExogeneity(const codegen::Model& model, const std::vector<const Dataset*>& data,
                          const std::vector<Dataset>& instruments, const VectorXd& z) {
  const std::span<const double> p{z.data(), static_cast<std::size_t>(model.columns())};
  const std::span<const double> eta{z.data() + model.columns(), static_cast<std::size_t>(model.nonlinear())};
  std::vector<JointRows> rows(static_cast<std::size_t>(model.joints()));
  for (std::size_t l = 0; l < data.size(); ++l) {
    std::vector<MatrixXd> measured, instrument;
    model.Regressor(data[l]->s, p, eta, measured);
    model.Regressor(instruments[l].s, p, eta, instrument);
    for (std::size_t j = 0; j < rows.size(); ++j) {
      const int joint = static_cast<int>(j);
      std::vector<int> used;
      for (int k = 0, run = 0; k < data[l]->samples(); ++k) {
        if (data[l]->used(k, joint)) used.push_back(k), rows[j].run.push_back(run++);
        else run = 0;
      }
      const std::vector<int> columns = Present(model, joint);
      const auto before = rows[j].tau.size(), after = before + static_cast<Eigen::Index>(used.size());
      rows[j].X.conservativeResize(after, static_cast<Eigen::Index>(columns.size()));
      rows[j].Z.conservativeResize(after, static_cast<Eigen::Index>(columns.size()));
      rows[j].tau.conservativeResize(after);
      rows[j].X.bottomRows(after - before) = measured[j](used, columns);
      rows[j].Z.bottomRows(after - before) = instrument[j](used, columns);
      rows[j].tau.tail(after - before) = data[l]->tau.col(joint)(used);
    }
  }
  Exogeneity out;
  for (const JointRows& r : rows) out.joint.push_back(r.tau.size() ? TestJoint(r) : JointExogeneity{});
  JudgeByHolm(out.joint);
  return out;
}

std::vector<Dataset> SimulatedInstruments(const Problem& problem, const VectorXd& z) {
  LoopLogs loop(problem, "exogeneity test");
  loop.Simulate(z);
  return loop.logs();
}

std::vector<Dataset> ReferenceInstruments(const std::vector<const Dataset*>& data) {
  std::vector<Dataset> out;
  for (const Dataset* d : data) out.push_back(AlongSpline(*d, d->reference));
  return out;
}

std::vector<Dataset> SmoothedInstruments(const std::vector<const Dataset*>& data) {
  std::vector<Dataset> out;
  for (const Dataset* d : data) {
    const double rate = (d->samples() - 1) / (d->s.t[d->samples() - 1] - d->s.t[0]);
    MatrixXd q = d->s.q;
    for (int j = 0; j < d->joints(); ++j) {
      const double bandwidth = d->cutoff_Hz.size() > j ? d->cutoff_Hz[j] : 0.4 * rate;
      q.col(j) = io::ZeroPhaseLowPass(q.col(j), kSmoothed * bandwidth, rate);
    }
    out.push_back(AlongSpline(*d, q));
  }
  return out;
}

}  // namespace armcal::calibration
