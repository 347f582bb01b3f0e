// calibration - derives speeds and accelerations, decides which rows count, and delays a log's motion.
#include "host_sim/identify/calibration/dataset.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/logs/quintic_spline.hpp"
#include "host_sim/data/logs/steps.hpp"
#include "host_sim/identify/calibration/band.hpp"
#include "host_sim/identify/calibration/jolts.hpp"
#include "host_sim/identify/calibration/weighted_fit.hpp"

namespace armcal::calibration {

namespace {
constexpr double kUnscored_s = 0.5;  // the first and last half second of a log are not scored
constexpr int kFlagSaturated = 2, kFlagStale = 4;
// A joint that has just stopped or is about to turn may stick although its smoothed speed is above v_min. So rows this
// close to a slower or opposite speed are not fitted. The drive's signal path asks the same of its five averages.
constexpr int kTurn = 2;
constexpr double kWholeBand = 0.2;  // of the sample rate: averages down to it would hold two samples each
constexpr double kBelowEdge = 1.5;  // edge over band: what the two filters do differently at the edge is 7 dB down then
constexpr double kOfAPeriod = 10;   // samples of a period of the band that a thinned log keeps
constexpr double kAboveBand = 1.5;  // cut-off over band: the filter then takes 4 % of what is at the band's edge
constexpr double kBesideTurn = 1;   // periods of a filter's edge, from a turn on
constexpr int kFiner = 4;           // samples of a filtered log for each of its own
constexpr int kPoses = 8;           // at a single one an entry of the mass matrix may vanish

// Signals and masks for given inertias.
Dataset Derive(const codegen::Model& model, const logs::Log& log, const logs::Sensitivity& sensitivity,
               const logs::Bandwidth& bandwidth) {
  const int n = model.joints(), samples = static_cast<int>(log.samples());
  const logs::Derivatives derived = logs::DeriveSignals(log, sensitivity, bandwidth);
  Dataset d;
  d.source = log.source;
  d.s.t = log.t;
  d.s.q = derived.q, d.s.qd = derived.qd, d.s.qdd = derived.qdd;
  d.s.temp = log.temp;
  d.cutoff_Hz = derived.cutoff_Hz;
  d.band_Hz.setConstant(n, INFINITY), d.saved_Hz.setConstant(n, INFINITY);
  d.reference = log.qref;
  d.tau = log.tau;
  if (log.ext.cols() == n) d.tau += log.ext;  // an external force along +q does part of the motor's work
  d.moving.setZero(samples, n), d.used.setZero(samples, n), d.sound.setZero(samples, n), d.scored.setZero(samples);
  const auto turning = [&](int k, int j) {
    for (int m = std::max(0, k - kTurn); m <= std::min(samples - 1, k + kTurn); ++m)
      if (d.s.qd(m, j) * d.s.qd(k, j) <= 0 || std::abs(d.s.qd(m, j)) <= model.robot().joint[j].v_min_radps) return true;
    return false;
  };
  // A sign law that is smooth over more than v_min says that the joint does not stick. Then friction is a function of
  // speed at rest and near a turn, too.
  const auto sticks = [&robot = model.robot()](int j) {
    return robot.sign_law != "tanh" || robot.joint[j].v_min_radps > robot.sign_width_radps;
  };
  const double begin = log.t[0] + kUnscored_s, end = log.t[samples - 1] - kUnscored_s;
  for (int k = 0; k < samples; ++k) {
    d.scored[k] = log.t[k] >= begin && log.t[k] <= end;
    for (int j = 0; j < n; ++j) {
      d.moving(k, j) = std::abs(d.s.qd(k, j)) > model.robot().joint[j].v_min_radps;
      const bool flagged = log.flags.cols() == n && (log.flags(k, j) & (kFlagSaturated | kFlagStale));
      d.sound(k, j) = derived.settled[k] && !flagged;
      d.used(k, j) = d.sound(k, j) && (!sticks(j) || (d.moving(k, j) && !turning(k, j)));
    }
  }
  return d;
}

logs::Sensitivity SensitivityOf(const codegen::Model& model, const Eigen::MatrixXd& inertia) {
  const codegen::Robot& robot = model.robot();
  logs::Sensitivity out{inertia, Eigen::VectorXd(model.joints())};
  for (int j = 0; j < model.joints(); ++j)
    out.sign_width_radps[j] = robot.sign_law == "tanh" ? robot.sign_width_radps : robot.joint[j].v_min_radps;
  return out;
}

void LimitBands(Dataset& d, const Eigen::VectorXd& band_Hz) {
  d.band_Hz = band_Hz;
  if (band_Hz.size() == 0) return;  // a log that nobody has asked
  d.average.assign(static_cast<std::size_t>(d.joints()), {});
  for (int j = 0; j < d.joints(); ++j)
    if (std::isfinite(band_Hz[j])) d.average[static_cast<std::size_t>(j)] = AverageRows(d, j);
}

}  // namespace

void UseTurns(Dataset& d, int joint) {
  if (d.slides.size() == 0) d.slides = d.used;
  d.used.col(joint) = d.sound.col(joint);
  if (d.averaged(joint)) d.average[static_cast<std::size_t>(joint)] = AverageRows(d, joint);
}

namespace {

// A joint that sticks does not change its friction at once: at rest it may be anything between the two signs. A filter
// carries that to the rows beside it. They are left out; what the filter carries further is in the prediction, too.
void LeaveOutTurns(Dataset& d, int j) {
  const double step_s = (d.s.t[d.samples() - 1] - d.s.t[0]) / (d.samples() - 1);
  const int reach = static_cast<int>(std::ceil(kBesideTurn / (d.saved_Hz[j] * step_s)));
  const Eigen::VectorXi slides = d.used.col(j);
  for (int k = 0; k < d.samples(); ++k) {
    const int first = std::max(0, k - reach), last = std::min(d.samples() - 1, k + reach);
    d.used(k, j) = slides.segment(first, last - first + 1).minCoeff();
  }
}

// A log that was filtered before it was saved, with more samples in between. Its motion and torque are smooth, but the
// sign of friction is not: at the log's own samples it changes up to a sample late, and the filter was not late. The
// log has no gaps.
logs::Log Finer(const logs::Log& log) {
  const Eigen::Index count = (log.samples() - 1) * kFiner + 1;
  logs::Log out = log;
  out.t.resize(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index i = k / kFiner, part = k % kFiner;
    out.t[k] = log.t[i] + (part ? (log.t[i + 1] - log.t[i]) * static_cast<double>(part) / kFiner : 0);
  }
  for (Eigen::MatrixXd* block : {&out.q, &out.tau, &out.qd, &out.qref, &out.tauff, &out.ext, &out.temp})
    if (block->rows() == log.samples()) *block = logs::QuinticSpline(log.t, *block).Evaluate(out.t, 0);
  if (log.flags.rows() == log.samples()) {
    out.flags.resize(count, log.flags.cols());
    for (Eigen::Index k = 0; k < count; ++k)
      for (Eigen::Index j = 0; j < out.flags.cols(); ++j)
        out.flags(k, j) = log.flags(k / kFiner, j) | log.flags((k + kFiner - 1) / kFiner, j);
  }
  out.line.resize(0);
  return out;
}

// The log itself shows up to which frequency torque follows the prediction, and how far it is from it.
struct SeenBands {
  Eigen::VectorXd agreed_Hz, saved_Hz;  // [n]
  Eigen::VectorXd left;                 // [n] standard deviation of what a fit leaves, without its outliers
};

// Of the rows that are used, for Gaussian values with outliers.
double RobustDeviation(const Eigen::VectorXd& values, const Eigen::VectorXi& used) {
  constexpr double kOfMedian = 1.4826;
  std::vector<double> sizes;
  for (Eigen::Index k = 0; k < values.size(); ++k)
    if (used[k]) sizes.push_back(std::abs(values[k]));
  return sizes.empty() ? std::numeric_limits<double>::infinity() : kOfMedian * logs::Median(std::move(sizes));
}

void LeaveOutJolts(Dataset& d, const Eigen::MatrixXd& inertia, const Eigen::VectorXd& left) {
  const Eigen::ArrayXXi apart = 1 - BesideJolts(d.s.t, d.s.qdd, d.cutoff_Hz, inertia, left).array();
  d.moving.array() *= apart, d.used.array() *= apart;
}

// The median of the joints that show something; infinity if none does.
double MedianSeen_Hz(const Eigen::VectorXd& each_Hz) {
  std::vector<double> seen;
  for (const double one_Hz : each_Hz)
    if (std::isfinite(one_Hz)) seen.push_back(one_Hz);
  if (seen.empty()) return INFINITY;
  std::sort(seen.begin(), seen.end());
  return seen[(seen.size() - 1) / 2];
}

// Noise of one joint's acceleration is in every row: no joint's band goes beyond the median of those that end. What is
// missing on a joint can look like an end of its band, too. So fewer than half of the joints that move tell nothing.
Eigen::VectorXd Agreed_Hz(const Dataset& d, const Eigen::MatrixXd& predicted) {
  Eigen::VectorXd out(d.joints());
  int moving = 0;
  for (int j = 0; j < d.joints(); ++j) {
    const std::vector<TransferBand> transfer = Transfer(d, j, predicted.col(j));
    out[j] = AgreedBand_Hz(transfer);
    moving += !transfer.empty();
  }
  if (2 * out.array().isFinite().count() < moving) out.setConstant(INFINITY);
  const double common_Hz = MedianSeen_Hz(out);
  for (double& band_Hz : out) {
    band_Hz = std::min(band_Hz, common_Hz);
    if (band_Hz > kWholeBand * d.rate_Hz()) band_Hz = INFINITY;
  }
  return out;
}

// A logger filters all columns alike: where half of the joints show an edge, the others have its median.
void SpreadEdge(Eigen::VectorXd& saved_Hz) {
  if (2 * saved_Hz.array().isFinite().count() < saved_Hz.size()) return;
  const double common_Hz = MedianSeen_Hz(saved_Hz);
  for (double& edge_Hz : saved_Hz)
    if (!std::isfinite(edge_Hz)) edge_Hz = common_Hz;
}

SeenBands SeeBands(const codegen::Model& model, Dataset& d) {
  const Fit fit = WeightedFit(model, {&d});
  const Eigen::MatrixXd predicted = Predict(model, d, fit.x, fit.eta);
  SeenBands out{{}, Eigen::VectorXd(d.joints()), Eigen::VectorXd(d.joints())};
  for (int j = 0; j < d.joints(); ++j) {
    out.saved_Hz[j] = FilteredAbove_Hz(d, j, predicted.col(j));
    out.left[j] = RobustDeviation(d.tau.col(j) - predicted.col(j), d.used.col(j));
  }
  SpreadEdge(out.saved_Hz);
  d.saved_Hz = out.saved_Hz;
  out.agreed_Hz = Agreed_Hz(d, AsSaved(d, predicted));
  return out;
}

}  // namespace

Eigen::MatrixXd TypicalMass(const codegen::Model& model, const Eigen::VectorXd& base) {
  const int n = model.joints(), per_pose = n + 1;
  codegen::Signals
      s;  // at each pose: a unit acceleration of one joint a sample, then a sample at rest, which is gravity
  s.q.resize(kPoses * per_pose, n), s.qd.setZero(kPoses * per_pose, n), s.qdd = s.qd;
  for (int pose = 0; pose < kPoses; ++pose)
    for (int j = 0; j < n; ++j) {
      // the middle half of each range, evenly filled by multiples of irrational numbers
      const double turns = 0.5 + pose * std::sqrt(2 + j * (j + 3));
      const double share = 0.25 + 0.5 * (turns - std::floor(turns));
      const auto& limits = model.robot().joint[j].position_limit_rad;
      s.q.col(j).segment(pose * per_pose, per_pose).setConstant(limits[0] + share * (limits[1] - limits[0]));
      s.qdd(pose * per_pose + j, j) = 1;
    }
  std::vector<Eigen::MatrixXd> row;
  model.Regressor(s, {}, {}, row);
  Eigen::MatrixXd square = Eigen::MatrixXd::Zero(n, n);
  for (int r = 0; r < n; ++r) {
    const Eigen::VectorXd torque = row[r].middleCols(model.front(), model.rigid()) * base;
    for (int pose = 0; pose < kPoses; ++pose)
      for (int j = 0; j < n; ++j)
        square(r, j) += std::pow(torque[pose * per_pose + j] - torque[pose * per_pose + n], 2) / kPoses;
  }
  return square.cwiseSqrt();
}

Dataset Prepare(const codegen::Model& model, const logs::Log& log, const logs::Bandwidth& bandwidth) {
  const int n = model.joints();
  if (log.joints != n)
    throw io::InputError(log.source + ": " + std::to_string(log.joints) + " joints, expected " + std::to_string(n) +
                         " (robot " + model.robot().name + ")");
  Eigen::MatrixXd inertia = Eigen::MatrixXd::Zero(n, n);
  if (model.robot().has_prior) {
    Eigen::VectorXd bodies(model.body_parameters());
    for (int k = 0; k < bodies.size(); ++k) bodies[k] = model.table()[k].mean;
    inertia = TypicalMass(model, model.base_map() * bodies);
  } else {
    // A joint's torque limit over its acceleration limit is a heavy guess. It gives a low cut-off, which is good enough
    // for a first fit.
    for (int j = 0; j < n; ++j)
      inertia(j, j) = model.robot().joint[j].torque_limit_Nm / model.robot().joint[j].acceleration_limit_radps2;
    const Dataset rough = Derive(model, log, SensitivityOf(model, inertia), {});
    const Fit fit = WeightedFit(model, {&rough});
    const Eigen::VectorXd guess = inertia.diagonal();
    inertia = TypicalMass(model, fit.x.segment(model.front(), model.rigid()));
    for (int j = 0; j < n; ++j) inertia(j, j) = std::min(inertia(j, j), guess[j]);
  }
  const logs::Sensitivity sensitivity = SensitivityOf(model, inertia);
  const double asked_Hz = bandwidth.cutoff_Hz;
  if (asked_Hz > 0 && bandwidth.scale >= 1) return Derive(model, log, sensitivity, bandwidth);
  const Eigen::VectorXd chosen_Hz = logs::ChooseCutoffs_Hz(log, sensitivity);
  // Below a cut-off that was asked for there may be as much noise of the derivation. Below the chosen one there is not.
  if (asked_Hz > 0) return Derive(model, log, sensitivity, {0, bandwidth.scale, chosen_Hz.cwiseMin(asked_Hz)});
  Dataset out = Derive(model, log, sensitivity, {0, 1, chosen_Hz});
  const SeenBands of_all = SeeBands(model, out);
  SeenBands seen = of_all;
  // Jolts can look like a limit of the band. Where the rows apart from them show one, too, the averages of that band
  // take care of jolts.
  bool whole = false;
  if (!of_all.saved_Hz.array().isFinite().any()) {
    Dataset apart = out;
    LeaveOutJolts(apart, inertia, of_all.left);
    const SeenBands of_apart = SeeBands(model, apart);
    whole = !of_apart.agreed_Hz.array().isFinite().any() && !of_apart.saved_Hz.array().isFinite().any();
    if (whole) seen = of_apart;
  }
  const Eigen::VectorXd each_Hz = chosen_Hz.cwiseMin(kAboveBand * seen.agreed_Hz);
  if (seen.saved_Hz.array().isFinite().all() && log.gaps.empty()) {
    const double rate_Hz = out.rate_Hz();
    Eigen::VectorXd finer_Hz = each_Hz * bandwidth.scale;
    for (double& cutoff_Hz : finer_Hz)
      if (logs::IsHighest(cutoff_Hz, rate_Hz)) cutoff_Hz *= kFiner;
    out = Derive(model, Finer(log), sensitivity, {0, 1, finer_Hz});
    out.per_sample = kFiner;
    for (Eigen::Index k = 0; k < out.scored.size(); ++k)
      if (k % kFiner) out.scored[k] = 0;
  } else if (bandwidth.scale != 1 || each_Hz != chosen_Hz) {
    out = Derive(model, log, sensitivity, {0, bandwidth.scale, each_Hz});
  }
  if (whole) LeaveOutJolts(out, inertia, of_all.left);
  out.saved_Hz = seen.saved_Hz;
  for (int j = 0; j < n; ++j)
    if (std::isfinite(out.saved_Hz[j])) LeaveOutTurns(out, j);
  LimitBands(out, seen.agreed_Hz.cwiseMin(out.saved_Hz / kBelowEdge));
  return out;
}

Dataset ThinToBand(const Dataset& d) {
  const double rate_Hz = d.rate_Hz();
  const int every =
      std::isfinite(d.band_Hz.maxCoeff()) ? static_cast<int>(rate_Hz / (kOfAPeriod * d.band_Hz.maxCoeff())) : 1;
  if (every < 2) return d;
  const int reach = (every - 1) / 2, samples = (d.samples() - 1 - 2 * reach) / every + 1;
  const auto kept = Eigen::seqN(reach, samples, every);
  Dataset out = d;
  out.s.t = d.s.t(kept);
  for (const auto& [from, to] :
       {std::pair{&d.s.q, &out.s.q}, std::pair{&d.s.qd, &out.s.qd}, std::pair{&d.s.qdd, &out.s.qdd},
        std::pair{&d.s.temp, &out.s.temp}, std::pair{&d.reference, &out.reference}})
    if (from->rows() > 0) *to = (*from)(kept, Eigen::all);
  out.moving = d.moving(kept, Eigen::all), out.used = d.used(kept, Eigen::all);
  if (d.sound.size() > 0) out.sound = d.sound(kept, Eigen::all);
  out.scored = d.scored(kept);
  out.tau.resize(samples, d.joints());
  for (int k = 0; k < samples; ++k) {
    const auto about = Eigen::seqN(k * every, 2 * reach + 1);
    out.tau.row(k) = d.tau(about, Eigen::all).colwise().mean();
    out.used.row(k) = d.used(about, Eigen::all).colwise().minCoeff();
    if (d.sound.size() > 0) out.sound.row(k) = d.sound(about, Eigen::all).colwise().minCoeff();
  }
  LimitBands(out, d.band_Hz);
  return out;
}

Eigen::VectorXd Rms(const Dataset& d, const Eigen::MatrixXd& residual, bool moving_only) {
  Eigen::VectorXd rms = Eigen::VectorXd::Zero(d.joints());
  for (int j = 0; j < d.joints(); ++j) {
    double sum = 0;
    int count = 0;
    for (int k = 0; k < d.samples(); ++k) {
      if (!d.scored[k] || (moving_only && !d.moving(k, j))) continue;
      sum += residual(k, j) * residual(k, j);
      ++count;
    }
    rms[j] = count ? std::sqrt(sum / count) : 0;
  }
  return rms;
}

Eigen::VectorXd RmsInBand(const Dataset& d, const Eigen::MatrixXd& residual) {
  Eigen::VectorXd rms = Rms(d, residual, true);
  for (int j = 0; j < d.joints(); ++j) {
    if (!d.averaged(j)) continue;
    const Eigen::VectorXd rows = d.average[static_cast<std::size_t>(j)] * residual.col(j);
    rms[j] = rows.size() ? std::sqrt(rows.squaredNorm() / static_cast<double>(rows.size())) : 0;
  }
  return rms;
}

bool HaveReferences(const std::vector<Dataset>& data) {
  return std::all_of(data.begin(), data.end(), [](const Dataset& d) { return d.reference.size() > 0; });
}

std::vector<std::string> Sources(const std::vector<Dataset>& data) {
  std::vector<std::string> out;
  for (const Dataset& d : data) out.push_back(d.source);
  return out;
}

std::vector<const Dataset*> Pointers(const std::vector<Dataset>& data) {
  std::vector<const Dataset*> out;
  for (const auto& d : data) out.push_back(&d);
  return out;
}

Dataset Delayed(const Dataset& data, double delay_s) {
  Dataset out = data;
  const Eigen::VectorXd& t = data.s.t;
  const Eigen::Index last = t.size() - 1;
  Eigen::Index k = 0;  // t[k] <= time < t[k + 1]
  for (Eigen::Index i = 0; i <= last; ++i) {
    const double time = std::clamp(t[i] - delay_s, t[0], t[last]);
    k = std::min(k, last - 1);
    while (k + 1 < last && t[k + 1] <= time) ++k;
    while (k > 0 && t[k] > time) --k;
    if (data.sound.size() > 0)
      out.sound.row(i) = data.sound.row(i).cwiseMin(data.sound.row(k).cwiseMin(data.sound.row(k + 1)));
    out.used.row(i) = data.used.row(i).cwiseMin(data.used.row(k).cwiseMin(data.used.row(k + 1)));
    const Eigen::Index first = std::clamp<Eigen::Index>(k - 1, 0, last - 3);
    double weight[4];
    for (int a = 0; a < 4; ++a) {
      weight[a] = 1;
      for (int b = 0; b < 4; ++b)
        if (b != a) weight[a] *= (time - t[first + b]) / (t[first + a] - t[first + b]);
    }
    for (const auto& [from, to] :
         {std::pair{&data.s.q, &out.s.q}, std::pair{&data.s.qd, &out.s.qd}, std::pair{&data.s.qdd, &out.s.qdd}}) {
      to->row(i).setZero();
      for (int a = 0; a < 4; ++a) to->row(i) += weight[a] * from->row(first + a);
    }
  }
  LimitBands(out, data.band_Hz);
  return out;
}

}  // namespace armcal::calibration
