// diagnosis - searches over a signal: its harmonics, and splines over the part of its range that shows most.
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "host_sim/diagnose/diagnosis/searcher.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Of the gain that a score above zero needs: a peak between two bins shows less than it has.
constexpr double kWorthATry = 0.6;
constexpr int kCells = 64, kKnots = 8;  // of a signal's range; of a spline, as its record has them
constexpr int kNarrowest = kCells / 8;  // one cell a knot
constexpr int kSurfaceCells = 8;        // of each of two signals
constexpr double kWorthASurface = 1.5;  // times what chance gains

// The part of a signal's range, in cells [first, last), over which a step function of kKnots values explains most.
std::pair<int, int> WidestGain(const VectorXd& product, const VectorXd& square) {
  std::pair<int, int> best{0, kCells};
  double most = 0;
  for (int width = kCells; width >= kNarrowest; width /= 2)
    for (int first = 0; first + width <= kCells; first += width / 2) {
      double gain = 0;
      const auto add = [&](int from, int to) {
        const double n = square.segment(from, to - from).sum(), s = product.segment(from, to - from).sum();
        if (n > 0) gain += s * s / n;
      };
      add(0, first), add(first + width, kCells);
      for (int k = 0; k < kKnots; ++k) add(first + k * width / kKnots, first + (k + 1) * width / kKnots);
      if (gain > most) most = gain, best = {first, first + width};
    }
  return best;
}

}  // namespace

// The record's first column at frequency zero is what multiplies the harmonic; one FFT of residual x that over the
// signal scans all frequencies.
void Searcher::Spectral() {
  const VectorXd signal = OwnSignal(c_, e_, c_.record().search.signal);
  const double lo = signal.minCoeff(), range = signal.maxCoeff() - lo;
  best_.searched = 1;
  if (range <= 0) return;
  const auto& k = c_.unknowns()[0];
  const Columns at_zero = GatherColumns(c_, e_, {1e-9});
  const int row = at_zero.joints[0];
  const VectorXd &residual = g_.metric.Residual(row), weight = at_zero.block[0].col(0);
  int size = 256;
  while (size < 8 * k.upper * range / (2 * std::numbers::pi)) size *= 2;  // four cells a period at the upper end
  constexpr int kPadding = 4;
  std::vector<double> grid(static_cast<std::size_t>(size) * kPadding, 0.0);
  for (int i = 0; i < signal.size(); ++i)
    grid[std::min(size - 1, static_cast<int>((signal[i] - lo) / range * size))] += residual[i] * weight[i];
  Eigen::FFT<double> fft;
  std::vector<std::complex<double>> spectrum;
  fft.fwd(spectrum, grid);
  const double step = 2 * std::numbers::pi / (range * kPadding);  // 1/rad per bin
  // Below two periods over the range a harmonic is a polynomial: other records' business.
  const double lowest = std::max(k.lower, 2 * 2 * std::numbers::pi / range);
  std::vector<std::pair<double, int>> peaks;
  const int bins = static_cast<int>(spectrum.size()) / 2;
  for (int b = 1; b + 1 < bins; ++b) {
    if (b * step < lowest || b * step > k.upper) continue;
    const double p = std::norm(spectrum[b]);
    if (p >= std::norm(spectrum[b - 1]) && p > std::norm(spectrum[b + 1])) peaks.emplace_back(p, b);
  }
  best_.tried = std::max(1, static_cast<int>((k.upper - lowest) * range / (2 * std::numbers::pi)));
  std::sort(peaks.rbegin(), peaks.rend());
  if (peaks.size() > static_cast<std::size_t>(c_.record().search.grid)) peaks.resize(c_.record().search.grid);
  // What a peak gains if the base takes nothing of it; it never takes much of two periods and more.
  const double unit = 0.5 * weight.squaredNorm();
  double centre = 0, most = 0;
  for (const auto& [power, b] : peaks) {
    if (power < kWorthATry * Needed(2) * unit) break;
    if (const double value = Consider({b * step}); value > most) most = value, centre = b * step;
  }
  if (!Promising()) return;
  double width = step;
  for (int round = 0; round < 6; ++round, width /= 2)
    for (const double sign : {-1.0, 1.0}) {
      const double next = centre + sign * width, value = Consider({next});
      if (value > most) most = value, centre = next;
    }
}

// Knots over all that was seen of both signals.
void Searcher::Surface() {
  const VectorXd first = OwnSignal(c_, e_, c_.record().search.signal),
                 second = OwnSignal(c_, e_, c_.record().search.second);
  if (first.size() == 0) return;
  const double ends[] = {first.minCoeff(), first.maxCoeff(), second.minCoeff(), second.maxCoeff()};
  if (ends[1] <= ends[0] || ends[3] <= ends[2]) return;
  // Few pairs of joints show anything, and steps over a coarse grid tell which.
  const int row = c_.rows()[0];
  const VectorXd& residual = metric().Residual(row);
  MatrixXd sum = MatrixXd::Zero(kSurfaceCells, kSurfaceCells), count = sum;
  const auto cell = [](double at, double lo, double hi) {
    return std::min(kSurfaceCells - 1, static_cast<int>((at - lo) / (hi - lo) * kSurfaceCells));
  };
  for (int i = 0; i < residual.size(); ++i) {
    const int at = g_.thinned.kept[row][i], a = cell(first[at], ends[0], ends[1]),
              b = cell(second[at], ends[2], ends[3]);
    sum(a, b) += residual[i], count(a, b) += 1;
  }
  const double gain = (sum.array().square() / count.array().max(1)).sum();
  if (gain > kWorthASurface * static_cast<double>((count.array() > 0).count()))
    Consider({ends[0], ends[1], ends[2], ends[3]});
}

// Knots over the range that was seen, or over that part of it where the torque changes most; clamped outside, so that
// the term cannot extrapolate.
void Searcher::Spline() {
  if (c_.is_surface()) return Surface();
  const std::string& name = c_.record().search.signal;
  const VectorXd signal = OwnSignal(c_, e_, name);
  if (signal.size() == 0 || signal.maxCoeff() - signal.minCoeff() <= 0) return;
  if (name == "t" && e_.logs.size() != 1) return;  // each run has a time of its own
  const double lo = signal.minCoeff(), range = signal.maxCoeff() - lo;
  const std::vector<double> over_all{lo, lo + range};
  const double chance = kKnots * (1 + 1 / g_.thinned.share());  // and a little more
  if (name == "t") {                                            // a run state wanders all the time
    if (Try(over_all).gain > chance) Consider(over_all);
    return;
  }
  // What the splines sum up to is what multiplies them.
  const Columns at_all = Gather(over_all);
  const int row = at_all.joints[0];
  const VectorXd weight = at_all.block[0].rowwise().sum(), &residual = metric().Residual(row);
  VectorXd product = VectorXd::Zero(kCells), square = product;
  for (int i = 0; i < weight.size(); ++i) {
    const double at = signal[g_.thinned.kept[row][i]];
    const int cell = std::min(kCells - 1, static_cast<int>((at - lo) / range * kCells));
    product[cell] += weight[i] * residual[i], square[cell] += weight[i] * weight[i];
  }
  const auto [first, last] = WidestGain(product, square);
  if (Consider(over_all) < chance && last - first == kCells) return void(best_.gain = Gain{});
  const Found all = Scored();
  const Projection seen_over_all = seen_;
  if (last - first == kCells) return;
  best_.searched = 2;
  best_.tried = 4.0 * kCells / kNarrowest;
  best_.gain = Gain{};
  Consider({lo + range * first / kCells, lo + range * last / kCells});
  if (Scored().score < all.score) best_ = all, seen_ = seen_over_all;
}

}  // namespace armcal::diagnosis
