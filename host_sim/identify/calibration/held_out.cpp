// calibration - compares a held-out log's samples, trajectory and range with those of the training logs.
#include "host_sim/identify/calibration/held_out.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "codegen/src/io/watch.hpp"
#include "host_sim/identify/calibration/prior.hpp"

namespace armcal::calibration {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kRepeats = 0.5;  // of the held-out log
constexpr double kOutsideShare = 0.05;
constexpr double kLeverage = 4;  // a standard deviation twice as large
constexpr double kRoom = 0.05;   // of a range
constexpr int kSameRun = 10;     // torques one after the other: that many are equal in one measurement only
constexpr double kRate_Hz = 40, kWindow_s = 2, kStep_s = 1;
constexpr double kApart = 0.03;    // of a joint's standard deviation: a controller repeats far better
constexpr double kRoughly = 0.25;  // the same before the shift is refined
constexpr double kLively = 0.2;    // of the log's RMS speed: a window at rest repeats any other
constexpr double kMoves = 0.01;    // of the samples
constexpr double kInPhase = 0.95;  // correlation: a tenth of one joint's motion is its own

// Joints that move at all in the log.
std::vector<int> Moving(const Dataset& d) {
  std::vector<int> out;
  for (int j = 0; j < d.joints(); ++j)
    if (d.moving.col(j).cast<double>().mean() > kMoves) out.push_back(j);
  return out;
}

// The share of the held-out log's stretches of kSameRun torques that stand in the training log, too.
double SameSamples(const Dataset& train, const Dataset& test) {
  const auto stretch = [](const Dataset& d, int k) {
    std::vector<double> out;
    for (int i = 0; i < kSameRun; ++i)
      for (int j = 0; j < d.joints(); ++j) out.push_back(d.tau(k + i, j));
    return out;
  };
  if (train.samples() < kSameRun || test.samples() < kSameRun || train.joints() != test.joints()) return 0;
  std::set<std::vector<double>> asked;  // a few hundred stretches of the held-out log
  const int step = std::max(1, test.samples() / 300);
  for (int k = 0; k + kSameRun <= test.samples(); k += step) asked.insert(stretch(test, k));
  std::set<double> first;  // most samples of the training log begin none of them
  for (const auto& a : asked) first.insert(a[0]);
  std::set<std::vector<double>> found;
  for (int k = 0; k + kSameRun <= train.samples(); ++k)
    if (first.contains(train.tau(k, 0)))
      if (const auto own = stretch(train, k); asked.contains(own)) found.insert(own);
  return static_cast<double>(found.size()) / static_cast<double>(asked.size());
}

// Positions and speeds of some joints at even times, positions over each joint's standard deviation in the held-out
// log.
struct Path {
  MatrixXd q, qd;  // [joints x samples]
};

Path Resample(const Dataset& d, const std::vector<int>& joints, const VectorXd& scale) {
  const double begin = d.s.t[0], end = d.s.t[d.samples() - 1];
  const auto count = static_cast<Index>((end - begin) * kRate_Hz);
  const auto n = static_cast<Index>(joints.size());
  Path out{MatrixXd(n, count), MatrixXd(n, count)};
  Index k = 0;
  for (Index i = 0; i < count; ++i) {
    const double time = begin + static_cast<double>(i) / kRate_Hz;
    while (k + 2 < d.samples() && d.s.t[k + 1] <= time) ++k;
    const double share = (time - d.s.t[k]) / (d.s.t[k + 1] - d.s.t[k]);
    for (Index a = 0; a < n; ++a) {
      const int j = joints[static_cast<std::size_t>(a)];
      out.q(a, i) = ((1 - share) * d.s.q(k, j) + share * d.s.q(k + 1, j)) / scale[a];
      out.qd(a, i) = ((1 - share) * d.s.qd(k, j) + share * d.s.qd(k + 1, j)) / scale[a];
    }
  }
  return out;
}

// Whether the window of `own` from `begin` is in `other`. The speed tells by how much less than a sample the shift is
// off.
bool IsIn(const Path& own, Index begin, Index length, const Path& other) {
  const auto joints = own.q.rows();
  const auto window = own.q.middleCols(begin, length);
  const double near = kRoughly * kRoughly * static_cast<double>(length);
  for (Index at = 0; at + length <= other.q.cols(); ++at) {
    double sum = 0;
    for (Index k = 0; k < length && sum < near; k += 4)
      sum += 4 * (window.col(k) - other.q.col(at + k)).cwiseAbs2().maxCoeff();
    if (sum >= near) continue;
    const MatrixXd off = window - other.q.middleCols(at, length);
    const auto speed = other.qd.middleCols(at, length);
    const double shift_s =
        std::clamp(off.cwiseProduct(speed).sum() / std::max(speed.squaredNorm(), 1e-300), -1 / kRate_Hz, 1 / kRate_Hz);
    const MatrixXd left = off - shift_s * speed;
    bool same = true;
    for (Index a = 0; a < joints; ++a)
      same = same && left.row(a).squaredNorm() < kApart * kApart * static_cast<double>(length);
    if (same) return true;
  }
  return false;
}

Repeated SameTrajectory(const std::vector<const Dataset*>& train, const Dataset& test) {
  const std::vector<int> joints = Moving(test);
  VectorXd scale(static_cast<Index>(joints.size()));
  for (Index a = 0; a < scale.size(); ++a) {
    const auto q = test.s.q.col(joints[static_cast<std::size_t>(a)]);
    scale[a] = std::max(std::sqrt((q.array() - q.mean()).square().mean()), 1e-12);
  }
  const Path own = Resample(test, joints, scale);
  const auto length = static_cast<Index>(kWindow_s * kRate_Hz), step = static_cast<Index>(kStep_s * kRate_Hz);
  const double lively =
      kLively * kLively * own.qd.squaredNorm() / static_cast<double>(std::max<Index>(1, own.qd.cols()));
  std::vector<Index> window;
  for (Index k = 0; k + length <= own.q.cols(); k += step)
    if (own.qd.middleCols(k, length).squaredNorm() > lively * static_cast<double>(length)) window.push_back(k);
  Repeated out;
  if (joints.empty() || window.empty()) return out;
  std::vector<char> found(window.size(), 0);
  double most = 0;
  for (const Dataset* log : train) {
    const Path other = Resample(*log, joints, scale);
    double here = 0;
    for (std::size_t w = 0; w < window.size(); ++w) {
      io::CancellationPoint();
      if (IsIn(own, window[w], length, other)) found[w] = 1, ++here;
    }
    if (here > most) most = here, out.source = log->source;
  }
  out.share = static_cast<double>(std::count(found.begin(), found.end(), 1)) / static_cast<double>(window.size());
  return out;
}

// Of two joints in some logs, each about its mean in each log: positions and speeds are proportional.
bool AreInPhase(const std::vector<const Dataset*>& logs, int a, int b) {
  const auto correlation = [&](const auto& column) {
    double ab = 0, aa = 0, bb = 0;
    for (const Dataset* d : logs) {
      const VectorXd x = column(*d, a), y = column(*d, b);
      const VectorXd dx = x.array() - x.mean(), dy = y.array() - y.mean();
      ab += dx.dot(dy), aa += dx.squaredNorm(), bb += dy.squaredNorm();
    }
    return std::abs(ab) / std::max(std::sqrt(aa * bb), 1e-300);
  };
  return correlation([](const Dataset& d, int j) { return VectorXd(d.s.q.col(j)); }) > kInPhase &&
         correlation([](const Dataset& d, int j) { return VectorXd(d.s.qd.col(j)); }) > kInPhase;
}

std::vector<HeldOutMotion::InPhase> FindInPhase(const std::vector<const Dataset*>& train, const Dataset& test) {
  std::vector<int> moving;
  for (int j = 0; j < test.joints(); ++j)
    if (std::any_of(train.begin(), train.end(),
                    [&](const Dataset* d) { return d->moving.col(j).cast<double>().mean() > kMoves; }))
      moving.push_back(j);
  std::vector<HeldOutMotion::InPhase> out;
  std::set<int> named;
  for (const int a : moving) {
    if (named.contains(a)) continue;
    HeldOutMotion::InPhase group{{a}, true};
    for (const int b : moving)
      if (b > a && !named.contains(b) && AreInPhase(train, a, b)) group.joints.push_back(b);
    if (group.joints.size() < 2) continue;
    for (const int b : group.joints) {
      named.insert(b);
      group.together = group.together && (b == a || AreInPhase({&test}, a, b));
    }
    out.push_back(group);
  }
  return out;
}

// The mean variance of each joint's torque, in units of its noise, on rows with these sums.
VectorXd Leverage(const Information& rows, const MatrixXd& covariance) {
  VectorXd out = VectorXd::Zero(static_cast<Index>(rows.gram.size()));
  for (std::size_t j = 0; j < rows.gram.size(); ++j)
    if (rows.rows[static_cast<Index>(j)] > 0)
      out[static_cast<Index>(j)] = rows.gram[j].cwiseProduct(covariance).sum() / rows.rows[static_cast<Index>(j)];
  return out;
}

std::vector<Outside> FindOutside(const codegen::Model& model, const Fit& fit, const std::vector<const Dataset*>& train,
                                 const Dataset& test) {
  const int n = model.joints();
  std::vector<Outside> out(n);
  for (int j = 0; j < n; ++j) {
    double low = std::numeric_limits<double>::infinity(), high = -low, slow = low, fast = -low;
    for (const Dataset* d : train) {
      low = std::min(low, d->s.q.col(j).minCoeff()), high = std::max(high, d->s.q.col(j).maxCoeff());
      slow = std::min(slow, d->s.qd.col(j).minCoeff()), fast = std::max(fast, d->s.qd.col(j).maxCoeff());
    }
    const double q_room = kRoom * (high - low), v_room = kRoom * (fast - slow);
    double moving = 0;
    for (int k = 0; k < test.samples(); ++k) {
      if (!test.moving(k, j)) continue;
      const double q = test.s.q(k, j), v = test.s.qd(k, j);
      ++moving;
      out[j].position += q < low - q_room || q > high + q_room;
      out[j].speed += v < slow - v_room || v > fast + v_room;
    }
    if (moving > 0) out[j].position /= moving, out[j].speed /= moving;
  }
  const Information there = Accumulate(model, test, fit.x.head(model.columns()), fit.eta);
  // A direction that no training row sees keeps its prior's variance: a log that moves along it leaves what training
  // has shown.
  MatrixXd covariance;
  SolveWithPrior(fit.information, fit.sigma.cwiseAbs2().cwiseInverse(), MakePrior(model), fit.active, &covariance);
  const VectorXd own = Leverage(fit.information, covariance), on_test = Leverage(there, covariance);
  for (int j = 0; j < n; ++j)
    if (own[j] > 0 || on_test[j] > 0) out[j].leverage = on_test[j] / own[j];  // infinity: training has no row of it
  return out;
}

}  // namespace

bool Outside::beyond() const { return position > kOutsideShare || speed > kOutsideShare || leverage > kLeverage; }

bool HeldOutMotion::repeats() const { return samples.share > kRepeats || trajectory.share > kRepeats; }

HeldOutMotion CompareMotion(const codegen::Model& model, const Fit& fit, const std::vector<const Dataset*>& train,
                            const Dataset& test) {
  HeldOutMotion out;
  for (const Dataset* log : train)
    if (const double share = SameSamples(*log, test); share > out.samples.share) out.samples = {share, log->source};
  out.trajectory = SameTrajectory(train, test);
  out.joint = FindOutside(model, fit, train, test);
  out.in_phase = FindInPhase(train, test);
  return out;
}

}  // namespace armcal::calibration
