// calibration - fits a payload to each half of a run, beside what else may differ between two runs, and judges it on
// the other half.
#include "host_sim/identify/calibration/carried.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

#include "host_sim/identify/calibration/band.hpp"
#include "host_sim/identify/calibration/barrier_fit.hpp"
#include "host_sim/identify/calibration/channel.hpp"
#include "host_sim/identify/calibration/payload.hpp"

namespace armcal::calibration {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kFriction = 0.3;     // by which a joint's friction may differ between two runs: warm or cold gears
constexpr double kGain = 0.03;        // the same of a torque constant: warm or cold magnets
constexpr double kWideResidual = 10;  // a prior that says nothing: one column alone may make so many times the residual
constexpr double kFarthest_m = 2;     // of a load's centre from the flange
constexpr double kNamed = 15;         // score of each half; odds of e^7 to one
// Of the errors on the other half: geometric mean over the joints, and of one joint that gains. Wrong friction and
// magnets that warm up gained 8 % at most in 20 draws.
constexpr double kWorthIt = 0.9, kJointGains = 0.95;
constexpr double kOtherSign = 2;  // standard deviations that such a mass may be on the other side of zero
constexpr int kNoiseRounds = 6;   // of noise, prior and load; three settle
constexpr int kFewestRows = 20;   // of a joint in one half

// One joint's rows of one half: residual, and the columns [what may differ between runs, load].
struct Rows {
  MatrixXd A;
  VectorXd r;
};

// The rows that the dataset asks to be fitted, of samples [begin, end).
class Picker {
 public:
  Picker(const Dataset& d, int j, int begin, int end) : average_(d.averaged(j) ? &d.average[at(j)] : nullptr) {
    if (!average_) {
      for (int k = begin; k < end; ++k)
        if (d.used(k, j)) row_.push_back(k);
      return;
    }
    for (Index row = 0; row < average_->outerSize(); ++row) {
      bool inside = true;
      for (Average::InnerIterator e(*average_, row); e; ++e) inside = inside && e.col() >= begin && e.col() < end;
      if (inside) row_.push_back(row);
    }
  }
  MatrixXd operator()(const MatrixXd& samples) const {
    return average_ ? MatrixXd((*average_ * samples)(row_, Eigen::all)) : MatrixXd(samples(row_, Eigen::all));
  }

 private:
  using Average = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  static std::size_t at(int j) { return static_cast<std::size_t>(j); }
  const Average* average_;
  std::vector<Index> row_;
};

double MeanSquare(const VectorXd& v) { return v.size() ? v.squaredNorm() / static_cast<double>(v.size()) : 0; }

// Minimum of the weighted residuals plus the prior. `with`: the load is fitted, too.
struct Estimate {
  VectorXd x;           // of [what may differ, load]
  MatrixXd covariance;  // counts residuals that are not white
  MatrixXd share;       // [size x joints] of x: what each joint's residual alone gives; they sum up to x
  VectorXd variance;    // [n] of a row, times what makes up for residuals that are not white
};

class LoadOfRun {
 public:
  LoadOfRun(const codegen::Model& model, const Fit& fit, const VectorXd& sigma, const Dataset& run,
            const MatrixXd& residual)
      : n_(model.joints()),
        differ_(static_cast<int>(fit.active.size()) + n_),
        size_(differ_ + kLoadParameters),
        sigma_(sigma) {
    Eigen::Matrix4d flange = Eigen::Matrix4d::Identity();
    flange.topLeftCorner<3, 3>() =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(model.robot().tool_rotation.data());
    flange.topRightCorner<3, 1>() = Eigen::Map<const Eigen::Vector3d>(model.robot().tool_xyz_m.data());
    const MatrixXd to_link = BodyMap(flange);
    std::vector<MatrixXd> columns, body;
    model.Regressor(run.s, {fit.x.data(), static_cast<std::size_t>(model.columns())}, fit.eta, columns);
    model.BodyColumns(run.s, n_ - 1, body);
    prior_ = MatrixXd::Zero(size_, size_);
    const auto active = static_cast<Index>(fit.active.size());
    prior_.topLeftCorner(active, active) = fit.covariance(fit.active, fit.active);
    begin_second_ = run.samples() / 2;
    for (int j = 0; j < n_; ++j) {
      MatrixXd A = MatrixXd::Zero(run.samples(), size_);
      const auto at = static_cast<std::size_t>(j);
      const VectorXd model_torque = columns[at] * fit.x.head(model.columns());
      for (Index a = 0; a < active; ++a) {
        const int c = fit.active[static_cast<std::size_t>(a)];
        if (c < model.columns()) A.col(a) = columns[at].col(c);
        else if (c == model.columns() + j) A.col(a) = model_torque;
      }
      // Not the measured torque: its noise is that of the residual, so a gain of one would cancel it.
      A.col(active + j) = run.tau.col(j) - residual.col(j);
      A.rightCols(kLoadParameters) = (1 + fit.x[model.columns() + j]) * (body[at] * to_link);
      for (Index c = 0; c < size_; ++c)
        if (c < active || c >= differ_) A.col(c) = ThroughChannel(run, j, AsSaved(run, j, A.col(c)));
      for (int half = 0; half < 2; ++half) {
        const Picker pick(run, j, half == 0 ? 0 : begin_second_, half == 0 ? begin_second_ : run.samples());
        rows_[static_cast<std::size_t>(half)].push_back({pick(A), pick(residual.col(j))});
      }
      prior_(active + j, active + j) = kGain * kGain;
      LetFrictionDiffer(model, fit, j, A, run);
    }
  }

  int begin_second() const { return begin_second_; }

  // halves: which rows are fitted. with: with a load. same_gains: torque constants are those of the training runs. A
  // change of all of them looks much like a load, so a load must be seen beside it; but its size is then mostly prior.
  Estimate Solve(const std::vector<int>& halves, bool with, bool same_gains = false) const {
    const int size = with ? size_ : differ_;
    std::vector<MatrixXd> gram(static_cast<std::size_t>(n_), MatrixXd::Zero(size, size));
    MatrixXd right = MatrixXd::Zero(size, n_);
    VectorXd count = VectorXd::Zero(n_);
    for (const int half : halves)
      for (int j = 0; j < n_; ++j) {
        const Rows& own = rows(half, j);
        gram[static_cast<std::size_t>(j)] += own.A.leftCols(size).transpose() * own.A.leftCols(size);
        right.col(j) += own.A.leftCols(size).transpose() * own.r;
        count[j] += static_cast<double>(own.r.size());
      }
    Estimate out;
    out.variance = sigma_.cwiseAbs2();
    MatrixXd prior = prior_.topLeftCorner(size, size);
    if (same_gains) prior.diagonal().segment(differ_ - n_, n_).setZero();
    if (with) Widen(gram, halves, prior);
    for (int round = 0; round < kNoiseRounds; ++round) {
      const MatrixXd L = CovarianceRoot(prior);
      MatrixXd H = MatrixXd::Zero(size, size);
      for (int j = 0; j < n_; ++j) H += gram[static_cast<std::size_t>(j)] / out.variance[j];
      const Eigen::LLT<MatrixXd> factor(MatrixXd(L.transpose() * H * L + MatrixXd::Identity(size, size)));
      const MatrixXd weighted = right * out.variance.cwiseInverse().asDiagonal();
      out.share = L * factor.solve(MatrixXd(L.transpose() * weighted));
      out.x = out.share.rowwise().sum();
      out.covariance = L * factor.solve(MatrixXd(L.transpose()));
      for (int j = 0; j < n_; ++j) {
        if (count[j] < kFewestRows) continue;
        double sum = 0, inflation = 0;
        for (const int half : halves) {
          const VectorXd left = rows(half, j).r - rows(half, j).A.leftCols(size) * out.x;
          sum += left.squaredNorm();
          inflation += VarianceInflation(left, Eigen::VectorXi::Ones(left.size())) / static_cast<double>(halves.size());
        }
        out.variance[j] = std::max(sum / count[j], sigma_[j] * sigma_[j]) * inflation;
      }
      // The load's mass is known after the first round. It says where the load may be.
      if (with)
        for (int i = 1; i < kLoadParameters; ++i) prior(differ_ + i, differ_ + i) = LoadVariance(i, out.x[differ_]);
    }
    return out;
  }

  // Mean square of what is left of a half, [n]; -1 where a joint has hardly a row.
  VectorXd Left(int half, const Estimate& e) const {
    VectorXd out(n_);
    for (int j = 0; j < n_; ++j) {
      const Rows& own = rows(half, j);
      out[j] = own.r.size() < kFewestRows ? -1 : MeanSquare(own.r - own.A.leftCols(e.x.size()) * e.x);
    }
    return out;
  }
  // How many white rows tell as much as this half's.
  double Independent(int half, int j, const Estimate& e) const {
    const Rows& own = rows(half, j);
    const VectorXd left = own.r - own.A.leftCols(e.x.size()) * e.x;
    return static_cast<double>(left.size()) / VarianceInflation(left, Eigen::VectorXi::Ones(left.size()));
  }
  VectorXd Load(const Estimate& e) const { return e.x.tail(kLoadParameters); }
  double MassSd(const Estimate& e) const { return std::sqrt(std::max(0.0, e.covariance(differ_, differ_))); }
  // What each joint's torque gives of the mass.
  VectorXd MassShares(const Estimate& e) const { return e.share.row(differ_); }

 private:
  const Rows& rows(int half, int j) const { return rows_[static_cast<std::size_t>(half)][static_cast<std::size_t>(j)]; }
  static VectorXd AsSaved(const Dataset& run, int j, const VectorXd& column) {
    if (run.saved_Hz.size() == 0 || !std::isfinite(run.saved_Hz[j])) return column;
    MatrixXd all = MatrixXd::Zero(run.samples(), run.joints());
    all.col(j) = column;
    return calibration::AsSaved(run, std::move(all)).col(j);
  }
  // Of the torque that joint j's own columns make together, each of them may change by kFriction.
  void LetFrictionDiffer(const codegen::Model& model, const Fit& fit, int j, const MatrixXd& A, const Dataset& run) {
    const Picker pick(run, j, 0, run.samples());
    VectorXd friction = VectorXd::Zero(run.samples());
    std::vector<Index> own;
    for (std::size_t a = 0; a < fit.active.size(); ++a)
      if (const int c = fit.active[a]; c < model.front() && model.column_joint(c) == j) {
        own.push_back(static_cast<Index>(a));
        friction += fit.x[c] * A.col(own.back());
      }
    const double size = MeanSquare(pick(friction));
    for (const Index a : own)
      if (const double column = MeanSquare(pick(A.col(a))); column > 0)
        prior_(a, a) += kFriction * kFriction * size / column;
  }
  void Widen(const std::vector<MatrixXd>& gram, const std::vector<int>& halves, MatrixXd& prior) const {
    for (int i = 0; i < kLoadParameters; ++i) {
      double size = 0;
      for (int j = 0; j < n_; ++j) {
        double square = 0;
        for (const int half : halves) square += rows(half, j).r.squaredNorm();
        if (const double own = gram[static_cast<std::size_t>(j)](differ_ + i, differ_ + i); own > 0)
          size = std::max(size, square / own);
      }
      prior(differ_ + i, differ_ + i) = kWideResidual * kWideResidual * size;
    }
  }

  int n_, differ_, size_;
  VectorXd sigma_;
  int begin_second_ = 0;
  std::array<std::vector<Rows>, 2> rows_;
  MatrixXd prior_;
};

// What the load fitted to the other half is worth on this half.
struct Worth {
  double score = 0, factor = 1;  // factor: of the errors, geometric mean over the joints
  int joints = 0;                // that gain
};
Worth OnOtherHalf(const LoadOfRun& run, int half, const Estimate& without, const Estimate& with) {
  const VectorXd before = run.Left(half, without), after = run.Left(half, with);
  Worth out;
  double sum = 0;
  int count = 0;
  for (int j = 0; j < before.size(); ++j) {
    if (before[j] <= 0 || after[j] <= 0) continue;
    const double gain = std::log(before[j] / after[j]);
    out.score += gain * run.Independent(half, j, with);
    out.joints += gain > -2 * std::log(kJointGains);
    sum += 0.5 * gain, ++count;
  }
  if (count > 0) out.factor = std::exp(-sum / count);
  return out;
}

}  // namespace

VectorXd Carried::Coordinates(const codegen::Model& model, int which) const {
  Eigen::Matrix4d flange = Eigen::Matrix4d::Identity();
  flange.topLeftCorner<3, 3>() =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(model.robot().tool_rotation.data());
  flange.topRightCorner<3, 1>() = Eigen::Map<const Eigen::Vector3d>(model.robot().tool_xyz_m.data());
  VectorXd out = VectorXd::Zero(model.columns() + model.joints());
  out.segment(model.front(), model.rigid()) = model.base_map().middleCols(11 * (model.joints() - 1), kLoadParameters) *
                                              (BodyMap(flange) * half[static_cast<std::size_t>(which)]);
  return out;
}

Carried FindCarried(const codegen::Model& model, const Fit& fit, const VectorXd& sigma, const Dataset& data,
                    const MatrixXd& residual, double tolerance) {
  Carried out;
  if (model.joints() < 2) return out;  // one joint cannot tell a payload from its own body
  const LoadOfRun run(model, fit, sigma, data, residual);
  out.begin_second = run.begin_second();
  out.joints = model.joints();
  // With torque constants that may have changed, too. These leave little of the mass determined.
  std::array<Estimate, 2> beside_gains;
  for (int half = 0; half < 2; ++half) {
    const auto at = static_cast<std::size_t>(half), other = static_cast<std::size_t>(1 - half);
    const Estimate without = run.Solve({half}, false), with = run.Solve({half}, true);
    const Estimate load = run.Solve({half}, true, true);
    out.half[at] = run.Load(load), out.half_sd_kg[at] = run.MassSd(load);
    beside_gains[at] = with;
    const Worth worth = OnOtherHalf(run, 1 - half, without, with);
    out.score[other] = worth.score, out.factor[other] = worth.factor;
    out.joints = std::min(out.joints, worth.joints);
  }
  const Estimate all = run.Solve({0, 1}, true, true);
  out.load = run.Load(all);
  out.mass_kg = out.load[0];
  out.sd_kg = std::max(run.MassSd(all), 0.5 * std::abs(out.half[0][0] - out.half[1][0]));
  const VectorXd share = run.MassShares(all);
  double spread = 2 * out.sd_kg;
  out.tolerance_stated = true;
  for (int j = 0; j < model.joints(); ++j) {
    const double own = model.robot().joint[static_cast<std::size_t>(j)].motor.torque_constant_tolerance;
    const double used = tolerance > 0 ? tolerance : own > 0 ? own : kUnstatedTolerance;
    out.tolerance_stated = out.tolerance_stated && (tolerance > 0 || own > 0);
    out.tolerance = std::max(out.tolerance, used);
    spread += used * std::abs(share[j]);
  }
  out.interval_kg = {out.mass_kg - spread, out.mass_kg + spread};
  const Eigen::Vector3d centre_m = out.load.segment<3>(1) / out.mass_kg;
  out.named = std::min(out.score[0], out.score[1]) > kNamed && std::max(out.factor[0], out.factor[1]) < kWorthIt &&
              out.joints > 1 && std::abs(out.mass_kg) > kMassSeen * out.sd_kg && centre_m.norm() < kFarthest_m;
  const double sign = out.mass_kg > 0 ? 1 : -1;
  for (const int half : {0, 1}) {
    const Estimate& beside = beside_gains[static_cast<std::size_t>(half)];
    out.named = out.named && sign * out.half[static_cast<std::size_t>(half)][0] > 0 &&
                sign * run.Load(beside)[0] > -kOtherSign * run.MassSd(beside);
  }
  return out;
}

}  // namespace armcal::calibration
