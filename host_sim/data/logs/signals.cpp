// logs - derives speed and acceleration from positions, with a cut-off chosen from the log itself.
#include "host_sim/data/logs/signals.hpp"

#include <fmt/format.h>
#include <Eigen/QR>
#include <unsupported/Eigen/FFT>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <vector>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/watch.hpp"
#include "host_sim/data/logs/butterworth.hpp"
#include "host_sim/data/logs/quintic_spline.hpp"
#include "host_sim/data/logs/steps.hpp"

namespace armcal::logs {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

// An arm's motion lies below this frequency. Its position shows how far below.
constexpr double kLowest_Hz = 20;
constexpr double kLeastCutoff_Hz = 2;  // a lower cut-off would take seconds to settle at either end of a log
// Cut-off over the motion's band. The filter then removes 4 % of a signal at the edge of the band, and less below it.
constexpr double kAboveMotion = 1.5;
constexpr double kHighest_Hz = 60;  // above, the current loop no longer follows
// Torque from encoder noise, as a share of the torque's own jitter. It then adds 0.25 % to the noise power.
constexpr double kShareOfJitter = 0.07;
// Noise of the speed, as a share of the speed over which friction changes its sign. Friction is a hundred times the
// torque's noise, and a slow joint is often within that speed.
constexpr double kShareOfWidth = 0.05;
constexpr double kEdgePeriods = 3;       // periods of the lowest cut-off at each end that are not settled
constexpr double kWideGap = 5;           // sample times over which a spline may still bridge
constexpr double kBridged = 0.25;        // periods of kLowest_Hz that a cubic may bridge
constexpr double kRatesDiffer = 0.01;    // two rates of one log: from the median step and from its whole length
constexpr double kIrregular = 1e-4;      // time jitter over sample time below which a grid counts as uniform
constexpr double kNormalMad = 0.674490;  // median of |x| for a unit normal

VectorXd Difference(const VectorXd& x) { return x.tail(x.size() - 1) - x.head(x.size() - 1); }

// Standard deviation of white noise under a smooth signal, from its difference of some order: robust against the few
// samples where the signal itself jumps. Samples at rest (no difference at all) say nothing and are left out.
double NoiseUnderSmooth(VectorXd x, int order) {
  double power = 1;  // sum of squared binomials: what white noise of variance 1 becomes
  for (int k = 1; k <= order; ++k) {
    if (x.size() < 2) return 0;
    x = Difference(x);
    power *= (4.0 * k - 2) / k;
  }
  std::vector<double> size;
  for (const double value : x) {
    if (value != 0) size.push_back(std::abs(value));
  }
  return Median(std::move(size)) / kNormalMad / std::sqrt(power);
}

// The encoder step: the smallest change of q that the log shows, if the other small changes are multiples of it.
// Without a step to see, the smallest of thousands of changes means nothing.
double EncoderStep(const VectorXd& q) {
  constexpr double kSmall = 10, kOff = 0.1, kShare = 0.8;  // steps; of a step; of the small changes
  constexpr int kFew = 5;
  const VectorXd change = Difference(q).cwiseAbs();
  double smallest = INFINITY;
  for (const double x : change)
    if (x > 0) smallest = std::min(smallest, x);
  if (!std::isfinite(smallest)) return 0;
  int small = 0, multiples = 0;
  for (const double x : change) {
    if (x == 0 || x > kSmall * smallest) continue;
    ++small;
    multiples += std::abs(x / smallest - std::round(x / smallest)) < kOff;
  }
  return small >= kFew && multiples >= kShare * small ? smallest : 0;
}

struct Piece {
  Index first, count;
};

// The log cut at wide gaps.
std::vector<Piece> Pieces(const Log& log) {
  std::vector<Piece> pieces;
  const double widest_s = std::max(kWideGap * log.step_s(), kBridged / kLowest_Hz);
  Index first = 0;
  for (const int gap : log.gaps) {
    if (log.t[gap + 1] - log.t[gap] <= widest_s) continue;
    pieces.push_back({first, gap + 1 - first});
    first = gap + 1;
  }
  pieces.push_back({first, log.samples() - first});
  return pieces;
}

VectorXd EvenGrid(const VectorXd& t) { return VectorXd::LinSpaced(t.size(), t[0], t[t.size() - 1]); }

bool IsUniform(const VectorXd& t) {
  const double step = (t[t.size() - 1] - t[0]) / static_cast<double>(t.size() - 1);
  return (t - EvenGrid(t)).cwiseAbs().maxCoeff() < kIrregular * step;
}

// q as it would have been sampled evenly; a time that jitters would otherwise look like noise of q.
Eigen::MatrixXd OnEvenGrid(const VectorXd& t, const Eigen::MatrixXd& q) {
  if (t.size() < QuinticSpline::kMinSamples || IsUniform(t)) return q;
  return QuinticSpline(t, q).Evaluate(EvenGrid(t), 0);
}

struct Samples {
  VectorXd t;
  Eigen::MatrixXd q;
};

// A cubic through the samples on either side of a gap, by least squares: at `missing` even times within it. A spline
// through every one of these samples would carry their noise into the gap many times larger.
Samples InGap(const VectorXd& t, const Eigen::MatrixXd& q, Index last, Index missing) {
  const Index first = std::max<Index>(0, last - missing), end = std::min(t.size(), last + 2 + missing);
  const double middle = 0.5 * (t[last] + t[last + 1]), width = t[end - 1] - t[first];
  const auto powers = [&](const VectorXd& at) {
    Eigen::MatrixXd out(at.size(), 4);
    for (Index p = 0; p < 4; ++p) out.col(p) = ((at.array() - middle) / width).pow(static_cast<double>(p));
    return out;
  };
  Samples out{VectorXd(missing), {}};
  for (Index i = 0; i < missing; ++i)
    out.t[i] = t[last] + (t[last + 1] - t[last]) * static_cast<double>(i + 1) / static_cast<double>(missing + 1);
  out.q = powers(out.t) * powers(t.segment(first, end - first))
                              .colPivHouseholderQr()
                              .solve(Eigen::MatrixXd(q.middleRows(first, end - first)));
  return out;
}

// With samples put into the gaps that are too wide for a spline.
Samples Bridged(const VectorXd& t, const Eigen::MatrixXd& q, double step_s) {
  const auto missing = [&](Index k) {
    const double gap_s = t[k + 1] - t[k];
    return gap_s > kWideGap * step_s ? static_cast<Index>(std::lround(gap_s / step_s)) - 1 : 0;
  };
  Index count = t.size();
  for (Index k = 0; k + 1 < t.size(); ++k) count += missing(k);
  if (count == t.size()) return {t, q};
  Samples out{VectorXd(count), Eigen::MatrixXd(count, q.cols())};
  Index at = 0;
  for (Index k = 0; k < t.size(); ++k, ++at) {
    out.t[at] = t[k], out.q.row(at) = q.row(k);
    const Index more = k + 1 < t.size() ? missing(k) : 0;
    if (more == 0) continue;
    const Samples in = InGap(t, q, k, more);
    out.t.segment(at + 1, more) = in.t, out.q.middleRows(at + 1, more) = in.q;
    at += more;
  }
  return out;
}

void DerivePiece(const Samples& seen, double step_s, const Piece& piece, Derivatives& out) {
  const auto& [t, q] = Bridged(seen.t, seen.q, step_s);
  const double rate_Hz = static_cast<double>(t.size() - 1) / (t[t.size() - 1] - t[0]);
  Eigen::MatrixXd smooth = OnEvenGrid(t, q);
  // A position that needs no smoothing gets none: every filter rings where friction turns and acceleration jumps.
  for (Index j = 0; j < q.cols(); ++j)
    if (!IsHighest(out.cutoff_Hz[j], rate_Hz))
      smooth.col(j) = ZeroPhaseLowPass(smooth.col(j), out.cutoff_Hz[j], rate_Hz);
  const QuinticSpline spline(EvenGrid(t), smooth);
  const Index count = seen.t.size();
  out.q.middleRows(piece.first, count) = spline.Evaluate(seen.t, 0);
  out.qd.middleRows(piece.first, count) = spline.Evaluate(seen.t, 1);
  out.qdd.middleRows(piece.first, count) = spline.Evaluate(seen.t, 2);
  const double edge_s =
      kEdgePeriods / out.cutoff_Hz.minCoeff();  // the reflection there bends q: 1 % of qdd after 1.5 periods
  for (Index k = 0; k < count; ++k) {
    out.settled[piece.first + k] = seen.t[k] - seen.t[0] >= edge_s && seen.t[count - 1] - seen.t[k] >= edge_s;
  }
}

}  // namespace

bool IsHighest(double cutoff_Hz, double rate_Hz) { return cutoff_Hz >= kHighestOfRate * rate_Hz * (1 - kRatesDiffer); }

JointNoise EstimateNoise(const Log& log, int joint) {
  const std::vector<Piece> pieces = Pieces(log);
  const Piece longest =
      *std::max_element(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) { return a.count < b.count; });
  const auto& [t, q] = Bridged(log.t.segment(longest.first, longest.count),
                               log.q.col(joint).segment(longest.first, longest.count), log.step_s());
  const VectorXd tau = log.tau.col(joint).segment(longest.first, longest.count);
  // Orders: q moves smoothly over six samples, torque over two; beyond that the difference shows the noise alone.
  const VectorXd even = OnEvenGrid(t, q);
  const double step = EncoderStep(log.q.col(joint).segment(longest.first, longest.count));
  const double noise = std::max(step / std::sqrt(12.0), NoiseUnderSmooth(even, 6));
  const double rate_Hz = static_cast<double>(t.size() - 1) / (t[t.size() - 1] - t[0]);
  return {noise, NoiseUnderSmooth(tau, 2), MotionBand_Hz(even, noise, rate_Hz)};
}

double QuietCutoff_Hz(const JointNoise& noise, double inertia, double rate_Hz, double sign_width_radps) {
  // White noise s in q has the density 2 s^2 / rate; through gain 1 / (1 + (f/c)^8) and k derivatives its variance is
  // s^2 (2 pi)^2k c^(2k + 1) (2 / rate) times the integral of x^2k / (1 + x^8)^2 over x > 0.
  constexpr double kIntegral[] = {0.2657, 0.1594};  // of one derivative, of two
  constexpr double kTwoPi = 2 * std::numbers::pi;
  const double s = noise.position_rad * std::sqrt(2 / rate_Hz),
               highest_Hz = std::min(kHighest_Hz, kHighestOfRate * rate_Hz);
  const double speed = s * kTwoPi * std::sqrt(kIntegral[0]),
               torque = inertia * s * std::pow(kTwoPi, 2) * std::sqrt(kIntegral[1]);
  double cutoff_Hz = highest_Hz;
  if (torque > 0) cutoff_Hz = std::min(cutoff_Hz, std::pow(kShareOfJitter * noise.torque_Nm / torque, 2.0 / 5));
  if (speed > 0) cutoff_Hz = std::min(cutoff_Hz, std::pow(kShareOfWidth * sign_width_radps / speed, 2.0 / 3));
  return std::min(std::max(cutoff_Hz, kLeastCutoff_Hz), highest_Hz);
}

double MotionCutoff_Hz(const JointNoise& noise, double rate_Hz) {
  const double motion_Hz = noise.band_Hz > 0 ? kAboveMotion * noise.band_Hz : kLowest_Hz;
  return std::min({std::max(motion_Hz, kLeastCutoff_Hz), kLowest_Hz, kHighestOfRate * rate_Hz});
}

// What the user has set.
static VectorXd SetCutoffs_Hz(const Log& log, const Bandwidth& bandwidth) {
  const double half_Hz = 0.5 / log.step_s(), cutoff_Hz = bandwidth.cutoff_Hz * bandwidth.scale;
  if (bandwidth.cutoff_Hz >= half_Hz)
    throw io::InputError(fmt::format("{}: cut-off {:g} Hz, expected below half the sample rate, {:g} Hz", log.source,
                                     bandwidth.cutoff_Hz, half_Hz));
  const double length_s = log.t[log.samples() - 1] - log.t[0], least_Hz = 2 * kEdgePeriods / length_s;
  if (cutoff_Hz <= least_Hz)
    throw io::InputError(
        fmt::format("{}: cut-off {:g} Hz, expected above {:.2g} Hz: the filter needs {:g} periods of it "
                    "at either end of the log",
                    log.source, bandwidth.cutoff_Hz, least_Hz / bandwidth.scale, kEdgePeriods));
  return VectorXd::Constant(log.joints, cutoff_Hz);
}

VectorXd ChooseCutoffs_Hz(const Log& log, const Sensitivity& sensitivity) {
  const double rate_Hz = 1 / log.step_s();
  std::vector<JointNoise> noise;
  for (int j = 0; j < log.joints; ++j) noise.push_back(EstimateNoise(log, j));
  VectorXd out = VectorXd::Constant(log.joints, INFINITY);
  for (int j = 0; j < log.joints; ++j) {
    const double width = sensitivity.sign_width_radps.size() ? sensitivity.sign_width_radps[j] : INFINITY;
    for (int row = 0; row < log.joints; ++row) {
      const JointNoise seen{noise[j].position_rad, noise[row].torque_Nm, noise[j].band_Hz};
      // A brake may hold the joint of this row. Its torque never changes, and nothing is compared with it.
      const double inertia = seen.torque_Nm > 0 ? std::abs(sensitivity.inertia(row, j)) : 0;
      out[j] = std::min(out[j], QuietCutoff_Hz(seen, inertia, rate_Hz, width));
    }
    out[j] = std::max(out[j], MotionCutoff_Hz(noise[j], rate_Hz));
  }
  return out;
}

Derivatives DeriveSignals(const Log& log, const Sensitivity& sensitivity, const Bandwidth& bandwidth) {
  const Eigen::MatrixXd& inertia = sensitivity.inertia;
  if (inertia.rows() != log.joints || inertia.cols() != log.joints) {
    throw io::InputError(log.source + ": has " + std::to_string(log.joints) + " joints, the model has " +
                         std::to_string(inertia.cols()));
  }
  if (log.samples() < QuinticSpline::kMinSamples)
    throw io::InputError(log.source + ": too few samples for derivatives");
  Derivatives out;
  out.q = log.q;
  out.qd = out.qdd = Eigen::MatrixXd::Zero(log.samples(), log.joints);
  out.settled = Eigen::VectorXi::Zero(log.samples());
  if (bandwidth.each_Hz.size()) out.cutoff_Hz = bandwidth.each_Hz * bandwidth.scale;
  else if (bandwidth.cutoff_Hz > 0) out.cutoff_Hz = SetCutoffs_Hz(log, bandwidth);
  else out.cutoff_Hz = ChooseCutoffs_Hz(log, sensitivity) * bandwidth.scale;
  for (const Piece& piece : Pieces(log)) {
    if (piece.count < QuinticSpline::kMinSamples) continue;
    DerivePiece({log.t.segment(piece.first, piece.count), log.q.middleRows(piece.first, piece.count)}, log.step_s(),
                piece, out);
  }
  return out;
}

namespace {
constexpr double kSegment_s = 8;  // at most; a tone is a hertz or two wide
constexpr double kAbove = 4;      // times the noise: a bin of noise alone, averaged over ten segments, stays below
constexpr int kNeighbours = 2;    // bins on either side that must agree
}  // namespace

double MotionBand_Hz(const VectorXd& q, double noise, double rate_Hz) {
  const double most = kSegment_s * rate_Hz;
  if (!(most < static_cast<double>(q.size()) * 2)) return 0.5 * rate_Hz;  // of more samples than there are, or no rate
  const Index segment = most >= 1 ? static_cast<Index>(std::exp2(std::floor(std::log2(most)))) : 0;
  if (segment < 4 * kNeighbours || q.size() < segment + 2) return 0.5 * rate_Hz;
  const VectorXd bend = q.tail(q.size() - 2) - 2 * q.segment(1, q.size() - 2) + q.head(q.size() - 2);
  VectorXd window(segment);  // Blackman and Harris, four terms: what leaks of a tone is 92 dB below it
  for (Index k = 0; k < segment; ++k) {
    const double x = 2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(segment);
    window[k] = 0.35875 - 0.48829 * std::cos(x) + 0.14128 * std::cos(2 * x) - 0.01168 * std::cos(3 * x);
  }
  Eigen::FFT<double> fft;
  std::vector<double> part(static_cast<std::size_t>(segment));
  std::vector<std::complex<double>> spectrum;
  VectorXd power = VectorXd::Zero(segment / 2);
  int count = 0;
  for (Index first = 0; first + segment <= bend.size(); first += segment / 2, ++count) {
    io::CancellationPoint();
    VectorXd::Map(part.data(), segment) = bend.segment(first, segment).cwiseProduct(window);
    fft.fwd(spectrum, part);
    for (Index k = 0; k < power.size(); ++k) power[k] += std::norm(spectrum[static_cast<std::size_t>(k)]);
  }
  const double unit = noise * noise * window.squaredNorm() * count;
  for (Index k = power.size() - 1 - kNeighbours; k > kNeighbours; --k) {
    const double sine = 2 * std::sin(std::numbers::pi * static_cast<double>(k) / static_cast<double>(segment));
    const double expected = unit * std::pow(sine, 4);
    if (power.segment(k - kNeighbours, 2 * kNeighbours + 1).mean() > kAbove * expected)
      return static_cast<double>(k) * rate_Hz / static_cast<double>(segment);
  }
  return 0;
}

}  // namespace armcal::logs
