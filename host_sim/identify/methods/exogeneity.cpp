// methods - the exogeneity test: instruments, the augmented regression of each joint, and the verdict over all joints.
#include "host_sim/identify/methods/exogeneity.hpp"
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/logs/butterworth.hpp"
#include "host_sim/data/logs/quintic_spline.hpp"
#include "host_sim/identify/calibration/channel.hpp"
#include "host_sim/identify/calibration/tall_product.hpp"
#include "host_sim/identify/methods/closed_loop.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Rows that follow each other.
struct Piece {
  Eigen::Index first, count;
};

// One joint's rows over all logs: regressors [N x k], instruments [N x k], torque [N], and the pieces without a gap.
struct JointRows {
  Eigen::MatrixXd X, Z;
  Eigen::VectorXd tau;
  std::vector<Piece> pieces;
};

constexpr int kOrder = 10;            // of the residual's autoregressive model
constexpr int kWeightRounds = 2;      // in which it is fitted again
constexpr double kSameColumn = 1e-5;  // share of a column's norm: a shorter direction repeats others
constexpr double kNegligible = 1e-3;  // the same for what instruments leave: so small a noise biases by its square
constexpr double kTold = 0.1;         // share of such a direction that must lie outside the columns; below, instruments
                                      // explain too little of it
constexpr double kExact = 1e-8;       // share of the torque: a smaller residual is rounding
constexpr double kRowsPerColumn = 3;

MatrixXd UnitColumns(const MatrixXd& M) {
  const VectorXd norm = M.colwise().norm().transpose().cwiseMax(1e-300);
  return M * norm.cwiseInverse().asDiagonal();
}

// The directions of M (columns of unit norm) that are longer than `floor`, as orthonormal columns.
MatrixXd Directions(const MatrixXd& M, double floor) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(SelfProduct(M));
  const auto keep = (eigen.eigenvalues().array() > floor * floor).count();
  return M * (eigen.eigenvectors().rightCols(keep) *
              eigen.eigenvalues().tail(keep).cwiseSqrt().cwiseInverse().asDiagonal());
}

// What the directions Q do not explain of Y. It is taken off twice, since directions from a long Gram matrix are
// orthogonal to six digits only.
MatrixXd Outside(const MatrixXd& Q, const MatrixXd& Y) {
  const MatrixXd once = Y - Q * (Q.transpose() * Y);
  return once - Q * (Q.transpose() * once);
}

// Coefficients a of e_k = sum a_i e_(k-i) + white (Yule and Walker).
VectorXd Autoregression(const VectorXd& e, const std::vector<Piece>& pieces) {
  VectorXd r = VectorXd::Zero(kOrder + 1);
  for (int lag = 0; lag <= kOrder; ++lag)
    for (const auto& [first, count] : pieces)
      if (count > lag) r[lag] += e.segment(first + lag, count - lag).dot(e.segment(first, count - lag));
  MatrixXd R(kOrder, kOrder);
  for (int i = 0; i < kOrder; ++i)
    for (int k = 0; k < kOrder; ++k) R(i, k) = r[std::abs(i - k)];
  R.diagonal().array() += 1e-9 * r[0];
  return R.ldlt().solve(VectorXd(r.tail(kOrder)));
}

// Rows minus what the model predicts of them; those with a whole past.
MatrixXd Whiten(const MatrixXd& M, const VectorXd& a, const std::vector<Piece>& pieces) {
  Eigen::Index rows = 0;
  for (const Piece& p : pieces) rows += std::max<Eigen::Index>(0, p.count - kOrder);
  MatrixXd out(rows, M.cols());
  Eigen::Index next = 0;
  for (const auto& [first, count] : pieces) {
    if (count <= kOrder) continue;
    auto white = out.middleRows(next, count - kOrder);
    white = M.middleRows(first + kOrder, count - kOrder);
    for (int i = 0; i < kOrder; ++i) white -= a[i] * M.middleRows(first + kOrder - 1 - i, count - kOrder);
    next += count - kOrder;
  }
  return out;
}

// Least squares of the last column on the first `columns`, from the Gram matrix of all.
struct LeastSquares {
  LeastSquares(const MatrixXd& gram, Eigen::Index columns) {
    const VectorXd unit = gram.diagonal().head(columns).cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(
        MatrixXd(unit.asDiagonal() * gram.topLeftCorner(columns, columns) * unit.asDiagonal()));
    rank = (eigen.eigenvalues().array() > kSameColumn * kSameColumn).count();
    const MatrixXd V = unit.asDiagonal() * eigen.eigenvectors().rightCols(rank);
    const VectorXd g = V.transpose() * gram.col(gram.cols() - 1).head(columns);
    const VectorXd y = g.cwiseQuotient(eigen.eigenvalues().tail(rank));
    x = V * y, explained = g.dot(y);
  }
  VectorXd x;
  Eigen::Index rank;
  double explained;  // of the last column's squares
};

// tau = X x + V g + e, whitened; V is what Z leaves of X. Gives F and p of g = 0, and how much x differs without V.
// Leaves `exogenous` as it is.
JointExogeneity AugmentedRegression(const JointRows& rows) {
  JointExogeneity out;
  const MatrixXd scaled = UnitColumns(rows.X), X = Directions(scaled, kSameColumn);
  MatrixXd V = Directions(Outside(Directions(UnitColumns(rows.Z), kSameColumn), scaled), kNegligible);
  if (V.cols() > 0) V = Directions(Outside(X, V), kTold);
  const auto k = X.cols(), q = V.cols();
  MatrixXd all(X.rows(), q + k + 1);  // the last k + 1 are the plain equation
  all << V, X, Outside(X, rows.tau);
  const auto plain_part = all.rightCols(k + 1);
  const VectorXd residual = all.rightCols(1);
  const auto samples = static_cast<double>(residual.size());
  out.left_Nm = residual.norm() / std::sqrt(samples);
  if (residual.norm() <= kExact * rows.tau.norm()) return out;
  // Least squares takes slow noise for slow columns, so its residual looks faster than the noise is. The solution of
  // the whitened rows does not (Cochrane and Orcutt).
  VectorXd a = Autoregression(residual, rows.pieces);
  for (int round = 0; round < kWeightRounds; ++round) {
    const MatrixXd white = Whiten(plain_part, a, rows.pieces);
    if (white.rows() <= k) return out;
    const LeastSquares fit(SelfProduct(white), k);
    a = Autoregression(residual - X * fit.x, rows.pieces);
  }
  const MatrixXd white = Whiten(all, a, rows.pieces);
  out.rows = static_cast<int>(white.rows());
  if (q == 0 || static_cast<double>(out.rows) < kRowsPerColumn * static_cast<double>(k + q)) return out;
  const MatrixXd gram = SelfProduct(white);
  const LeastSquares plain(gram.bottomRightCorner(k + 1, k + 1), k), augmented(gram, q + k);
  if (augmented.rank <= plain.rank) return out;
  const auto free = static_cast<double>(white.rows() - augmented.rank);
  out.restrictions = static_cast<int>(augmented.rank - plain.rank);
  out.F = std::max(0.0, augmented.explained - plain.explained) / out.restrictions /
          ((gram(q + k, q + k) - augmented.explained) / free);
  out.p = cdf(complement(boost::math::fisher_f(out.restrictions, free), out.F));
  out.bias_Nm = (X * (plain.x - augmented.x.tail(k))).norm() / std::sqrt(samples);
  return out;
}

constexpr double kLevel = 0.05;
constexpr double kMatters = 0.05;   // bias over residual; with enough rows a test finds biases that do not matter
constexpr double kSmoothed = 0.2;   // of the bandwidth
constexpr double kEnough_Hz = 100;  // of rows: motion and its noise lie below 60 Hz, and rows take time

std::vector<int> Present(const codegen::Model& model, int joint) {
  std::vector<int> present;
  for (const int c : MakePrior(model).active)
    if (c < model.columns() && !model.rows()[joint][c].IsZero()) present.push_back(c);
  return present;
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

// Every m-th sample. It is used if all m samples are.
Dataset Thinned(const Dataset& d, int m) {
  Dataset out = d;
  const auto rows = Eigen::seqN(0, d.samples() / m, m);
  out.s.t = d.s.t(rows), out.tau = d.tau(rows, Eigen::all);
  for (auto signal : {&codegen::Signals::q, &codegen::Signals::qd, &codegen::Signals::qdd, &codegen::Signals::temp})
    if ((d.s.*signal).size() > 0) out.s.*signal = (d.s.*signal)(rows, Eigen::all);
  out.used = d.used(rows, Eigen::all);
  for (int k = 1; k < m; ++k) out.used = out.used.cwiseMin(d.used(Eigen::seqN(k, d.samples() / m, m), Eigen::all));
  return out;
}

// Adds a joint's used rows of one log below those that are there.
void AddRows(const Dataset& data, const MatrixXd& measured, const MatrixXd& instrument, const std::vector<int>& columns,
             int joint, JointRows& rows) {
  std::vector<int> used;
  const auto before = rows.tau.size();
  for (int k = 0, run = 0; k < data.samples(); ++k) {
    run = data.used(k, joint) ? run + 1 : 0;
    if (run == 1) rows.pieces.push_back({before + static_cast<Eigen::Index>(used.size()), 0});
    if (run > 0) ++rows.pieces.back().count, used.push_back(k);
  }
  const auto after = before + static_cast<Eigen::Index>(used.size());
  rows.X.conservativeResize(after, static_cast<Eigen::Index>(columns.size()));
  rows.Z.conservativeResize(after, static_cast<Eigen::Index>(columns.size()));
  rows.tau.conservativeResize(after);
  rows.X.bottomRows(after - before) = measured(used, columns);
  rows.Z.bottomRows(after - before) = instrument(used, columns);
  rows.tau.tail(after - before) = data.tau.col(joint)(used);
}

Dataset AlongSpline(const Dataset& data, const MatrixXd& q) {
  Dataset out = data;
  const logs::QuinticSpline spline(data.s.t, q);
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
    // An effect with memory has to see every sample.
    const int every = model.states() > 0 ? 1 : std::max(1, static_cast<int>(data[l]->rate_Hz() / kEnough_Hz));
    const Dataset log = Thinned(*data[l], every);
    std::vector<MatrixXd> measured, instrument;
    model.Regressor(log.s, p, eta, measured);
    model.Regressor(Thinned(instruments[l], every).s, p, eta, instrument);
    PassThroughChannel(log, measured);
    PassThroughChannel(log, instrument);
    for (std::size_t j = 0; j < rows.size(); ++j)
      AddRows(log, measured[j], instrument[j], Present(model, static_cast<int>(j)), static_cast<int>(j), rows[j]);
  }
  Exogeneity out;
  for (const JointRows& r : rows) out.joint.push_back(r.tau.size() ? AugmentedRegression(r) : JointExogeneity{});
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
    const double rate = d->rate_Hz();
    MatrixXd q = d->s.q;
    for (int j = 0; j < d->joints(); ++j) {
      const double bandwidth = d->cutoff_Hz.size() > j ? d->cutoff_Hz[j] : 0.4 * rate;
      q.col(j) = logs::ZeroPhaseLowPass(q.col(j), kSmoothed * bandwidth, rate);
    }
    out.push_back(AlongSpline(*d, q));
  }
  return out;
}

namespace {

// Empty where the arm that the robot file describes does not follow its reference in simulation.
std::vector<Dataset> Simulated(const codegen::Model& model, const std::vector<Dataset>& data, const VectorXd& z) {
  if (model.robot().control.structure.empty() || model.states() > 0) return {};
  Problem problem = MakeProblem(model, Pointers(data));
  try {
    problem.closed_loop = MakeClosedLoop(model);
    return SimulatedInstruments(problem, z);
  } catch (const io::InputError&) {
    return {};  // then the reference itself serves
  }
}

}  // namespace

Exogeneity CheckExogeneity(const codegen::Model& model, const std::vector<Dataset>& data, const VectorXd& z,
                           Instruments best) {
  const bool commanded = HaveReferences(data);
  std::string kind = kSimulatedLoop;
  std::vector<Dataset> instruments;
  if (best == Instruments::kSimulated && commanded) instruments = Simulated(model, data, z);
  if (instruments.empty()) {
    kind = commanded ? kCommandedMotion : kSmoothedPositions;
    instruments = commanded ? ReferenceInstruments(Pointers(data)) : SmoothedInstruments(Pointers(data));
  }
  Exogeneity e = TestExogeneity(model, Pointers(data), instruments, z);
  e.instruments = kind;
  return e;
}

}  // namespace armcal::calibration
