// calibration - fits each joint's torque through a low-pass and a delay, and asks most joints before it believes one.
#include "host_sim/identify/calibration/channel.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "host_sim/identify/calibration/prior.hpp"

namespace armcal::calibration {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
constexpr double kSameStep = 1e-9;  // relative: equal but for the rounding of time stamps

constexpr Index kRowsOfAJoint = 2500;  // of a joint: more do not move the result
constexpr double kLeastPivot = 1e-10;  // of a column's own square: directions that the log does not show
constexpr double kProbe_s = 0.005;     // lag whose column asks whether there is any
constexpr double kTakesAway = 0.04;    // of a joint's squared error: what a lag must take away
constexpr double kSureOfLag = 40;      // of chi^2
constexpr double kShowsLag = 10;       // of chi^2, at one joint, where the others are sure
constexpr double kMostJoints = 0.6;    // of those that move
constexpr double kFewRowsForLag = 200;
constexpr double kLongest_s = 0.25;
constexpr std::array<double, 6> kLags_s{0.004, 0.008, 0.016, 0.032, 0.064, 0.128};
constexpr std::array<double, 6> kDelays_s{0, 0.005, 0.01, 0.015, 0.02, 0.03};
constexpr double kDelayStep_s = 0.005;
constexpr int kHalvings = 6, kSweeps = 4;
constexpr int kMostLags = 2;
constexpr double kDelaysDiffer = 0.2;  // of the mean: delays that differ by less are one
constexpr double kBesideStep = 1.5;    // samples: a step between two samples leaves an error in both

// One joint's row of the declared model over all logs.
struct Row {
  int joint;
  std::vector<const Dataset*> logs;
  std::vector<MatrixXd> columns;  // of each log, all samples
  Index every = 1;                // of the rows that may be used, so many are skipped

  // Squared error of the best parameters with this channel, of `rows` rows. extra: one more column a log.
  double Left(const JointChannel& channel, Index& rows, VectorXd* best = nullptr,
              const std::vector<VectorXd>* extra = nullptr) const;
  bool Stands() const;
};

bool Row::Stands() const {
  Index used = 0;
  for (const Dataset* log : logs) used += log->used.col(joint).sum();
  return static_cast<double>(used) < kFewRowsForLag;
}

double Row::Left(const JointChannel& channel, Index& rows, VectorXd* best, const std::vector<VectorXd>* extra) const {
  const Index own = columns[0].cols(), size = own + (extra ? 1 : 0);
  MatrixXd gram = MatrixXd::Zero(size, size);
  VectorXd right = VectorXd::Zero(size);
  double square = 0;
  rows = 0;
  for (std::size_t l = 0; l < logs.size(); ++l) {
    const Dataset& log = *logs[l];
    const bool averaged = log.averaged(joint);
    MatrixXd A(log.samples(), size);
    A.leftCols(own) = ChannelAt(log.s.t, channel).Through(columns[l]);
    if (extra) A.col(own) = (*extra)[l];
    VectorXd y = log.tau.col(joint);
    if (averaged) {
      const auto& average = log.average[static_cast<std::size_t>(joint)];
      A = MatrixXd(average * A), y = VectorXd(average * y);
    } else {
      std::vector<Index> kept;
      for (Index k = 0, seen = 0; k < log.samples(); ++k)
        if (log.used(k, joint) && seen++ % every == 0) kept.push_back(k);
      A = MatrixXd(A(kept, Eigen::all)), y = VectorXd(y(kept));
    }
    gram.noalias() += A.transpose() * A;
    right.noalias() += A.transpose() * y;
    square += y.squaredNorm(), rows += y.size();
  }
  VectorXd scale = gram.diagonal().cwiseSqrt();
  for (double& s : scale) s = s > 0 ? 1 / s : 0;
  MatrixXd H = scale.asDiagonal() * gram * scale.asDiagonal();
  H.diagonal().array() += kLeastPivot;
  const VectorXd x = scale.asDiagonal() * Eigen::LDLT<MatrixXd>(H).solve(VectorXd(scale.asDiagonal() * right));
  if (best) *best = x;
  return std::max(1e-300, square - 2 * right.dot(x) + x.dot(gram * x));
}

// By how much squared error `with` explains the rows better than `without`.
double Chi2(double with, double without, Index rows) { return static_cast<double>(rows) * std::log(without / with); }

// Whether that is enough, and takes away enough of the error.
bool Clearly(double chi2, Index rows) {
  return chi2 > kSureOfLag && chi2 > -std::log(1 - kTakesAway) * static_cast<double>(rows);
}

// A column of a little lag on the prediction takes away a clear share of the error.
bool LooksLate(const Row& row) {
  Index rows = 0;
  VectorXd x;
  const double without = row.Left({}, rows, &x);
  std::vector<VectorXd> lag;
  for (std::size_t l = 0; l < row.logs.size(); ++l) {
    const VectorXd torque = row.columns[l] * x;
    lag.push_back(ThroughChannel(row.logs[l]->s.t, torque, {kProbe_s, 0, 1}) - torque);
  }
  return static_cast<double>(rows) > kFewRowsForLag &&
         Clearly(Chi2(row.Left({}, rows, nullptr, &lag), without, rows), rows);
}

struct Late {
  JointChannel filtered[kMostLags];  // with one low-pass, with two, ...
  double left[kMostLags];            // squared error with each
  JointChannel delayed;              // the delay if there is no low-pass
  double left_delayed = 0, left_without = 0;
  Index rows = 0;

  double of_delay() const { return Chi2(left_delayed, left_without, rows); }
  double of_lags(int lags) const { return Chi2(left[lags - 1], left_delayed, rows); }  // beyond that of a delay
  bool is_filtered(int lags) const { return filtered[lags - 1].lag_s > 0 && of_lags(lags) > kShowsLag; }
  bool is_delayed() const { return Clearly(of_delay(), rows); }
  bool may_be_delayed() const { return of_delay() > kShowsLag; }
};

Late Search(const Row& row) {
  Late out;
  const auto better = [&](const JointChannel& next, JointChannel& best, double& least) {
    const double left = row.Left(next, out.rows);
    if (left >= least) return false;
    least = left, best = next;
    return true;
  };
  out.left_delayed = out.left_without = row.Left({}, out.rows);
  for (const double late_s : kDelays_s) better({0, late_s, 1}, out.delayed, out.left_delayed);
  double step_s = kDelayStep_s;
  for (int k = 0; k < kHalvings; ++k, step_s /= 2)
    for (const double by_s : {-step_s, step_s})
      better({0, std::max(0.0, out.delayed.late_s + by_s), 1}, out.delayed, out.left_delayed);
  for (int lags = 1; lags <= kMostLags; ++lags) {
    JointChannel& best = out.filtered[lags - 1] = out.delayed;
    double& least = out.left[lags - 1] = out.left_delayed;
    for (const double lag_s : kLags_s)
      for (const double late_s : {kDelays_s[0], kDelays_s[2], kDelays_s[4]})
        better({lag_s / lags, late_s, lags}, best, least);
    // Slow motion shows the sum of lags and delay. How the sum is shared shows far less, so the steps go along it, too.
    double factor = 1.4;
    step_s = kDelayStep_s;
    for (int k = 0; k < kHalvings; ++k, factor = std::sqrt(factor), step_s /= 2)
      for (int sweep = 0, moved = 1; moved && sweep < kSweeps; ++sweep) {
        moved = 0;
        const auto step = [&](double by, double by_s) {
          const double lag_s = std::min(kLongest_s, best.lag_s * by);
          moved |= better({lag_s, std::max(0.0, best.late_s + by_s), lags}, best, least);
        };
        for (const double by : {factor, 1 / factor}) step(by, 0), step(by, lags * best.lag_s * (1 - by));
        for (const double by_s : {-step_s, step_s}) step(1, by_s);
      }
  }
  return out;
}

}  // namespace

ChannelAt::ChannelAt(const VectorXd& t, const JointChannel& channel)
    : passes_(channel.lag_s > 0 ? channel.lags : 0), is_late_(channel.late_s != 0 && t.size() > 1) {
  const Index samples = t.size(), last = samples - 1;
  if (is_late_) {
    before_.resize(static_cast<std::size_t>(samples));
    share_.resize(samples);
    Index k = 0;  // t[k] <= time < t[k + 1]
    for (Index i = 0; i < samples; ++i) {
      const double time = std::clamp(t[i] - channel.late_s, t[0], t[last]);
      k = std::min(k, std::max<Index>(0, last - 1));
      while (k + 1 < last && t[k + 1] <= time) ++k;
      while (k > 0 && t[k] > time) --k;
      before_[static_cast<std::size_t>(i)] = k;
      share_[i] = (time - t[k]) / (t[k + 1] - t[k]);
    }
  }
  if (passes_ == 0) return;
  rest_.resize(samples), ramp_.resize(samples);
  double step = 0, rest = 1, ramp = 0;
  for (Index i = 1; i < samples; ++i) {
    const double dt = t[i] - t[i - 1];
    if (std::abs(dt - step) > kSameStep * dt)
      step = dt, rest = std::exp(-dt / channel.lag_s), ramp = channel.lag_s / dt * (1 - rest);
    rest_[i] = rest, ramp_[i] = ramp;
  }
}

// A column's next value waits for its last one. So some columns go side by side.
template <Index kColumns>
void ChannelAt::LowPass(double* first) const {
  const Index samples = rest_.size();
  double z[kColumns], before[kColumns];
  for (Index c = 0; c < kColumns; ++c) z[c] = before[c] = first[c * samples];
  for (Index i = 1; i < samples; ++i) {
    const double rest = rest_[i], ramp = ramp_[i];
    for (Index c = 0; c < kColumns; ++c) {
      double& value = first[c * samples + i];
      z[c] = rest * z[c] + (ramp - rest) * before[c] + (1 - ramp) * value;
      before[c] = value;
      value = z[c];
    }
  }
}

MatrixXd ChannelAt::Through(const MatrixXd& torque) const {
  const Index samples = torque.rows();
  MatrixXd out = torque;
  for (Index c = 0; c < out.cols() && is_late_; ++c)
    for (Index i = 0; i < samples; ++i) {
      const Index k = before_[static_cast<std::size_t>(i)];
      out(i, c) = (1 - share_[i]) * torque(k, c) + share_[i] * torque(k + 1, c);
    }
  constexpr Index kTogether = 4;
  for (int pass = 0; pass < passes_; ++pass) {
    Index c = 0;
    for (; c + kTogether <= out.cols(); c += kTogether) LowPass<kTogether>(out.col(c).data());
    for (; c < out.cols(); ++c) LowPass<1>(out.col(c).data());
  }
  return out;
}

VectorXd ThroughChannel(const VectorXd& t, const VectorXd& torque, const JointChannel& channel) {
  return ChannelAt(t, channel).Through(torque);
}

JointChannel ChannelOf(const Dataset& data, int joint) {
  return data.channel.empty() ? JointChannel{} : data.channel[static_cast<std::size_t>(joint)];
}

VectorXd ThroughChannel(const Dataset& data, int joint, VectorXd torque) {
  const JointChannel channel = ChannelOf(data, joint);
  return channel.empty() ? torque : ThroughChannel(data.s.t, torque, channel);
}

MatrixXd ThroughChannel(const Dataset& data, MatrixXd torque) {
  for (Index j = 0; j < torque.cols() && !data.channel.empty(); ++j)
    torque.col(j) = ThroughChannel(data, static_cast<int>(j), torque.col(j));
  return torque;
}

void PassThroughChannel(const Dataset& data, std::vector<MatrixXd>& regressor) {
  for (std::size_t j = 0; j < regressor.size() && !data.channel.empty(); ++j) {
    if (data.channel[j].empty()) continue;
    regressor[j] = ChannelAt(data.s.t, data.channel[j]).Through(regressor[j]);
  }
}

void UseWhatMoved(Dataset& data) {
  const double step_s = 1 / data.rate_Hz(), beside_s = kBesideStep * step_s;
  for (std::size_t j = 0; j < data.channel.size(); ++j) {
    const double late_s = data.channel[j].late_s;
    const auto column = static_cast<Index>(j);
    if (late_s == 0 || data.averaged(static_cast<int>(j))) continue;
    Index first = 0;
    for (Index k = 0; k < data.samples(); ++k) {
      const double at_s = data.s.t[k] - late_s;
      while (first < k && data.s.t[first] < at_s - beside_s) ++first;
      for (Index i = first; i <= k && data.s.t[i] <= at_s + beside_s; ++i)
        if (!data.moving(i, column)) data.used(k, column) = 0;
    }
  }
}

TorqueChannel SeeChannel(const codegen::Model& model, const std::vector<const Dataset*>& logs) {
  const int n = model.joints();
  const VectorXd mean = MakePrior(model).mean.head(model.columns());
  const std::vector<double> eta = MeanUnknowns(model);
  std::vector<std::vector<MatrixXd>> regressor(logs.size());
  for (std::size_t l = 0; l < logs.size(); ++l)
    model.Regressor(logs[l]->s, {mean.data(), static_cast<std::size_t>(mean.size())}, eta, regressor[l]);
  std::vector<Row> rows;
  for (int j = 0; j < n; ++j) {
    Row row{j, logs, {}, 1};
    std::vector<int> present;
    for (int c = 0; c < model.columns(); ++c)
      if (!model.rows()[j][c].IsZero()) present.push_back(c);
    Index used = 0;
    for (std::size_t l = 0; l < logs.size(); ++l) {
      row.columns.push_back(regressor[l][static_cast<std::size_t>(j)](Eigen::all, present));
      used += logs[l]->used.col(j).sum();
    }
    row.every = std::max<Index>(1, used / kRowsOfAJoint);
    if (!row.Stands()) rows.push_back(std::move(row));
  }
  const auto most = [&](std::ptrdiff_t count) {
    return count >= 2 && static_cast<double>(count) >= kMostJoints * static_cast<double>(rows.size());
  };
  if (!most(std::count_if(rows.begin(), rows.end(), LooksLate))) return {};
  std::vector<Late> late;
  for (const Row& row : rows) late.push_back(Search(row));
  TorqueChannel out(static_cast<std::size_t>(n));
  const auto filtered = [&](int lags) {
    return std::count_if(late.begin(), late.end(), [&](const Late& l) { return l.is_filtered(lags); });
  };
  // All joints have the same electronics, so all have one order.
  const auto left = [&](int lags) {
    double sum = 0;
    for (const Late& l : late) sum += static_cast<double>(l.rows) * std::log(l.left[lags - 1]);
    return sum;
  };
  int lags = 1;
  for (int more = 2; more <= kMostLags; ++more)
    if (left(more) < left(lags)) lags = more;
  double gain = 0;
  Index used = 0;
  for (const Late& l : late) gain += l.of_lags(lags), used += l.rows;
  if (most(filtered(lags)) && Clearly(gain, used)) {
    for (std::size_t k = 0; k < rows.size(); ++k)
      if (late[k].is_filtered(lags)) out[static_cast<std::size_t>(rows[k].joint)] = late[k].filtered[lags - 1];
      else if (late[k].may_be_delayed()) out[static_cast<std::size_t>(rows[k].joint)] = late[k].delayed;
    return out;
  }
  if (!most(std::count_if(late.begin(), late.end(), [](const Late& l) { return l.is_delayed(); }))) return {};
  double mean_s = 0, apart_s = 0;
  for (const Late& l : late) mean_s += l.delayed.late_s / static_cast<double>(late.size());
  for (const Late& l : late) apart_s = std::max(apart_s, std::abs(l.delayed.late_s - mean_s));
  if (apart_s < kDelaysDiffer * mean_s) return {};
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (late[k].may_be_delayed()) out[static_cast<std::size_t>(rows[k].joint)] = late[k].delayed;
  return out;
}

}  // namespace armcal::calibration
