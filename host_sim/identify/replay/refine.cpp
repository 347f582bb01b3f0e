// replay - multiple shooting: segments, their errors, and Levenberg and Marquardt's steps.
#include "host_sim/identify/replay/refine.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "codegen/src/io/input_error.hpp"

namespace armcal::replay {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kReach = 100;          // prior of the refinement: this many standard deviations of the fit
constexpr double kSpread = 10;          // starting points: that many
constexpr double kDifference = 0.1;     // of a numeric derivative, standard deviations of the fit
constexpr double kSeenEach_s = 0.02;    // positions are compared this often
constexpr double kSeenEachAtLeast = 2;  // comparisons of a segment
constexpr double kIndependent = 2;      // errors of one segment and joint count as this many: they are one smooth curve
constexpr double kSearchStart = 0.25;   // share of a segment within which its start is looked for
constexpr int kParts[] = {24, 12, 6, 3, 2, 1};  // of a block: the lengths that are compared
constexpr int kRounds = 2;                      // more, with the scale of the errors that are left
constexpr int kMostSteps = 40;
constexpr double kSmallGain = 1e-4;  // of the sum of squares: the step was the last one

struct Segment {
  int log = 0, block = 0, first = 0, last = 0;
};

// The sample where part `k` of `parts` begins.
int Part(Eigen::Index first, Eigen::Index last, Eigen::Index k, Eigen::Index parts) {
  return static_cast<int>(first + (last - first) * k / parts);
}

class Shooting {
 public:
  Shooting(const codegen::Model& model, const std::vector<Training>& logs, const calibration::Fit& fit,
           const RefineSettings& settings)
      : model_(model), logs_(logs), fit_(fit), settings_(settings), run_(model, settings.step_s) {
    MakeBlocks();
    MakeCoordinates();
    scale_ = VectorXd::Ones(model.joints());
  }

  int blocks() const { return static_cast<int>(block_.size()); }
  Eigen::Index size() const { return factor_.cols() + drifts(); }
  double block_s() const { return block_s_; }

  // Blocks as segments of about this length.
  std::vector<Segment> Cut(double segment_s) const {
    std::vector<Segment> out;
    for (const Segment& b : block_) {
      const Record& r = logs_[static_cast<std::size_t>(b.log)].record;
      const double length = r.t[b.last] - r.t[b.first];
      const int parts = std::max(1, static_cast<int>(std::lround(length / segment_s)));
      for (int i = 0; i < parts; ++i)
        out.push_back(
            WithGoodStart({b.log, b.block, Part(b.first, b.last, i, parts), Part(b.first, b.last, i + 1, parts)}));
    }
    return out;
  }

  // Errors in units of scale_, weighed so that their squares count as kIndependent a segment and joint; false where a
  // segment ran away.
  bool Errors(const std::vector<Segment>& segments, const VectorXd& weight, const VectorXd& w, VectorXd& errors) {
    std::vector<Record> shifted;
    for (std::size_t l = 0; l < logs_.size(); ++l) shifted.push_back(WithoutDrift(l, w));
    const Parameters p = At(w);
    std::vector<double> all;
    for (const Segment& s : segments) {
      if (weight[s.block] == 0) continue;
      const Training& log = logs_[static_cast<std::size_t>(s.log)];
      const int stride = run_.Stride(log.record);
      const MatrixXd q = run_.Run(shifted[static_cast<std::size_t>(s.log)], s.first, s.last,
                                  {log.q.row(s.first), log.qd.row(s.first)}, p);
      if (!q.row(q.rows() - 1).allFinite()) return false;
      const double step_s = (log.record.t[s.last] - log.record.t[s.first]) / std::max<double>(1, s.last - s.first);
      const int each = std::max(1, static_cast<int>(std::lround(kSeenEach_s / (step_s * stride))));
      const double count = std::floor((q.rows() - 1) / each);
      for (int i = each; i < q.rows(); i += each)
        for (Eigen::Index j = 0; j < q.cols(); ++j)
          all.push_back(std::sqrt(weight[s.block] * kIndependent / count) *
                        (q(i, j) - log.record.q(s.first + i * stride, j)) / scale_[j]);
    }
    errors = VectorXd::Map(all.data(), static_cast<Eigen::Index>(all.size()));
    return errors.allFinite();
  }

  // Minimises the errors plus |w|^2 from w; returns the sum of squares, infinity where the start runs away.
  double Minimise(const std::vector<Segment>& segments, const VectorXd& weight, VectorXd& w) {
    VectorXd e, next;
    if (!Errors(segments, weight, w, e)) return std::numeric_limits<double>::infinity();
    double value = e.squaredNorm() + w.squaredNorm(), damping = 1e-3;
    for (int step = 0; step < kMostSteps; ++step) {
      MatrixXd J(e.size(), w.size());
      for (Eigen::Index i = 0; i < w.size(); ++i) {
        VectorXd moved = w;
        const double d = i < factor_.cols() ? kDifference / kReach : 0.01;
        moved[i] += d;
        if (Errors(segments, weight, moved, next)) J.col(i) = (next - e) / d;
        else J.col(i).setZero();
      }
      MatrixXd H = J.transpose() * J;
      H.diagonal().array() += 1;
      const VectorXd g = J.transpose() * e + w;
      double gain = 0;
      for (; damping < 1e6 && gain <= 0; damping *= gain > 0 ? 0.1 : 4) {
        MatrixXd damped = H;
        damped.diagonal() *= 1 + damping;
        const VectorXd moved = w - damped.ldlt().solve(g);
        if (!Errors(segments, weight, moved, next)) continue;
        const double at = next.squaredNorm() + moved.squaredNorm();
        gain = value - at;
        if (gain > 0) w = moved, e = next, value = at;
      }
      if (gain < kSmallGain * value) break;
    }
    return value;
  }

  // The scale of the errors is what they are at w. It is set before a minimisation and held during it.
  bool SetScale(const std::vector<Segment>& segments, const VectorXd& w) {
    scale_.setOnes();
    VectorXd e;
    if (!Errors(segments, VectorXd::Ones(blocks()), w, e)) return false;
    scale_ = JointRms(e, segments.size());
    const double largest = scale_.maxCoeff();
    for (double& s : scale_)
      if (s == 0) s = largest;  // friction holds the joint at rest
    return scale_.allFinite() && largest > 0;
  }
  VectorXd JointRms(const VectorXd& errors, std::size_t segments) const {
    const Eigen::Index n = model_.joints();
    const auto by_joint = MatrixXd::Map(errors.data(), n, errors.size() / n);
    return (by_joint.rowwise().squaredNorm() / (kIndependent * static_cast<double>(segments)))
        .cwiseSqrt()
        .cwiseProduct(scale_);
  }

  // RMS over left-out blocks and joints, each block one free run, in standard deviations of the joint's position.
  double LeftOut(const std::vector<Segment>& segments, const VectorXd& start) {
    VectorXd sum = VectorXd::Zero(model_.joints());
    for (int b = 0; b < blocks(); ++b) {
      VectorXd weight = VectorXd::Ones(blocks()), w = start, e;
      weight[b] = 0;
      if (!std::isfinite(Minimise(segments, weight, w))) return std::numeric_limits<double>::infinity();
      const std::vector<Segment> whole{WithGoodStart(block_[static_cast<std::size_t>(b)])};
      if (!Errors(whole, VectorXd::Ones(blocks()), w, e)) return std::numeric_limits<double>::infinity();
      sum += JointRms(e, 1).cwiseAbs2();
    }
    const VectorXd variance = Variance();
    double relative = 0;
    int moving = 0;
    for (Eigen::Index j = 0; j < sum.size(); ++j)
      if (variance[j] > 0) relative += sum[j] / blocks() / variance[j], ++moving;
    return std::sqrt(relative / moving);
  }

  // Of each joint's position over all logs; 0: the joint rests in all of them.
  VectorXd Variance() const {
    VectorXd sum = VectorXd::Zero(model_.joints());
    double samples = 0;
    for (const Training& log : logs_) {
      const MatrixXd& q = log.record.q;
      for (Eigen::Index j = 0; j < q.cols(); ++j)
        if (q.col(j).minCoeff() < q.col(j).maxCoeff()) sum[j] += (q.col(j).array() - q.col(j).mean()).square().sum();
      samples += static_cast<double>(q.rows());
    }
    return sum / samples;
  }

  VectorXd Drawn(std::mt19937_64& random) const {
    std::normal_distribution<double> normal;
    VectorXd w = VectorXd::Zero(size());
    for (Eigen::Index i = 0; i < factor_.cols(); ++i) w[i] = kSpread / kReach * normal(random);
    return w;
  }

  VectorXd X(const VectorXd& w) const { return fit_.x + factor_ * w.head(factor_.cols()); }
  MatrixXd Drift(const VectorXd& w) const {
    const Eigen::Index n = model_.joints();
    MatrixXd out(static_cast<Eigen::Index>(logs_.size()), n);
    for (Eigen::Index l = 0; l < out.rows(); ++l)
      out.row(l) = w.segment(factor_.cols() + l * n, n).cwiseProduct(fit_.sigma);
    return out;
  }

 private:
  Eigen::Index drifts() const { return static_cast<Eigen::Index>(logs_.size()) * model_.joints(); }

  void MakeBlocks() {
    for (std::size_t l = 0; l < logs_.size(); ++l) {
      const Record& r = logs_[l].record;
      const double all_s = r.t[r.samples() - 1] - r.t[0];
      const double wanted_s = settings_.block_s > 0 ? settings_.block_s : all_s / 4;
      const int count = static_cast<int>(std::lround(all_s / wanted_s));
      if (count < 1 || (count < 2 && logs_.size() == 1))
        throw io::InputError(r.source + ": " + std::to_string(all_s) + " s: expected at least two blocks of " +
                             std::to_string(wanted_s) + " s (--period)");
      block_s_ = std::max(block_s_, all_s / count);
      for (int b = 0; b < count; ++b)
        block_.push_back({static_cast<int>(l), static_cast<int>(block_.size()), Part(0, r.samples() - 1, b, count),
                          Part(0, r.samples() - 1, b + 1, count)});
    }
  }

  // x = fit.x + factor w: a unit of w is kReach standard deviations along an axis of the fit's covariance.
  void MakeCoordinates() {
    const auto count = static_cast<Eigen::Index>(fit_.active.size());
    MatrixXd covariance(count, count);
    for (Eigen::Index i = 0; i < count; ++i)
      for (Eigen::Index k = 0; k < count; ++k)
        covariance(i, k) =
            fit_.covariance(fit_.active[static_cast<std::size_t>(i)], fit_.active[static_cast<std::size_t>(k)]);
    const VectorXd sd = covariance.diagonal().cwiseMax(1e-300).cwiseSqrt();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(
        MatrixXd(sd.cwiseInverse().asDiagonal() * covariance * sd.cwiseInverse().asDiagonal()));
    const MatrixXd root =
        sd.asDiagonal() * eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
    factor_ = MatrixXd::Zero(fit_.x.size(), count);
    for (Eigen::Index i = 0; i < count; ++i)
      factor_.row(fit_.active[static_cast<std::size_t>(i)]) = kReach * root.row(i);
  }

  Segment WithGoodStart(Segment s) const {
    const Training& log = logs_[static_cast<std::size_t>(s.log)];
    const int until = s.first + static_cast<int>(kSearchStart * (s.last - s.first));
    int best = s.first;
    for (int k = s.first; k <= until; ++k)
      if (log.used.row(k).sum() > log.used.row(best).sum()) best = k;
    s.first = best;
    return s;
  }

  Parameters At(const VectorXd& w) const {
    const VectorXd x = X(w);
    VectorXd z(model_.columns() + model_.nonlinear());
    z << x.head(model_.columns()), VectorXd::Map(fit_.eta.data(), model_.nonlinear());
    return {z, x.tail(model_.joints())};
  }

  Record WithoutDrift(std::size_t l, const VectorXd& w) const {
    Record r = logs_[l].record;
    const double middle = 0.5 * (r.t[0] + r.t[r.samples() - 1]), half = 0.5 * (r.t[r.samples() - 1] - r.t[0]);
    const Eigen::RowVectorXd drift = Drift(w).row(static_cast<Eigen::Index>(l));
    r.torque -= ((r.t.array() - middle) / half).matrix() * drift;
    return r;
  }

  const codegen::Model& model_;
  const std::vector<Training>& logs_;
  const calibration::Fit& fit_;
  const RefineSettings& settings_;
  FreeRun run_;
  std::vector<Segment> block_;
  double block_s_ = 0;
  MatrixXd factor_;
  VectorXd scale_;
};

}  // namespace

Training MakeTraining(const logs::Log& log, const calibration::Dataset& data) {
  const auto own = Eigen::seqN(0, log.samples(), static_cast<Eigen::Index>(data.per_sample));
  return {MakeRecord(log), data.s.q(own, Eigen::all), data.s.qd(own, Eigen::all), data.used(own, Eigen::all)};
}

Refined Refine(const codegen::Model& model, const std::vector<Training>& logs, const calibration::Fit& fit,
               const RefineSettings& settings) {
  Shooting shooting(model, logs, fit, settings);
  Refined out;
  out.eta = fit.eta;
  const VectorXd at_fit = VectorXd::Zero(shooting.size()), once = VectorXd::Ones(shooting.blocks());
  out.segment_s = settings.segment_s;
  if (settings.segment_s <= 0) {
    for (const int parts : kParts) {
      const double length = shooting.block_s() / parts;
      const std::vector<Segment> segments = shooting.Cut(length);
      VectorXd w = at_fit;
      const bool runs = shooting.SetScale(segments, w) && std::isfinite(shooting.Minimise(segments, once, w)) &&
                        shooting.SetScale(segments, w);
      out.lengths.push_back({length, runs ? shooting.LeftOut(segments, w) : std::numeric_limits<double>::infinity()});
    }
    const auto best = std::min_element(out.lengths.begin(), out.lengths.end(),
                                       [](const auto& a, const auto& b) { return a.error < b.error; });
    if (!std::isfinite(best->error))
      throw io::InputError(
          logs[0].record.source +
          ": the arm of the fitted parameters runs away in every segment: open loop says nothing here");
    out.segment_s = best->segment_s;
  }
  if (out.segment_s < kSeenEachAtLeast * kSeenEach_s)
    throw io::InputError("--segment " + std::to_string(out.segment_s) + ": expected " +
                         std::to_string(kSeenEachAtLeast * kSeenEach_s) + " s or more");
  const std::vector<Segment> segments = shooting.Cut(out.segment_s);
  if (!shooting.SetScale(segments, at_fit))
    throw io::InputError(logs[0].record.source + ": the arm of the fitted parameters runs away in segments of " +
                         std::to_string(out.segment_s) + " s: expected shorter ones (--segment)");
  std::mt19937_64 random(settings.seed);
  VectorXd weight = once;
  if (settings.resample) {
    weight.setZero();
    std::uniform_int_distribution<int> draw(0, shooting.blocks() - 1);
    for (int b = 0; b < shooting.blocks(); ++b) weight[draw(random)] += 1;
  }
  double best = std::numeric_limits<double>::infinity();
  VectorXd best_w = at_fit;
  std::vector<double> values;
  for (out.tries = 0; out.tries < settings.tries; ++out.tries) {
    VectorXd w = out.tries == 0 && !settings.resample ? at_fit : shooting.Drawn(random);
    const double value = shooting.Minimise(segments, weight, w);
    values.push_back(value);
    if (value < best) best = value, best_w = w;
  }
  // The first scale was the fit's error, which gives the prior too much weight if the fit is poor.
  for (int round = 0; round < kRounds && shooting.SetScale(segments, best_w); ++round)
    shooting.Minimise(segments, weight, best_w);
  if (std::isfinite(best))
    out.agree =
        static_cast<int>(std::count_if(values.begin(), values.end(), [&](double v) { return v <= 1.01 * best; }));
  out.x = shooting.X(best_w);
  out.drift = shooting.Drift(best_w);
  VectorXd e;
  if (shooting.Errors(segments, once, best_w, e)) out.rms = shooting.JointRms(e, segments.size());
  out.segments = static_cast<int>(segments.size());
  return out;
}

}  // namespace armcal::replay
