// calibration - compares the spectra of torque and prediction, and builds the averages of a limited band.
#include "host_sim/identify/calibration/band.hpp"

#include <unsupported/Eigen/FFT>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "codegen/src/io/watch.hpp"
#include "host_sim/data/logs/butterworth.hpp"

namespace armcal::calibration {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double kSegment_s = 4;  // of Welch's method: bins of a quarter hertz
constexpr double kLowest_Hz = 1;  // below, the motion itself is; noise of a derivative is small there
constexpr double kThird = 1.26;   // a third of an octave
constexpr int kFewSegments = 5;   // fewer tell nothing
// Of the gain: where it is below the first in two bands, the prediction has half as much noise as torque; the band ends
// where it has a tenth.
constexpr double kMuchNoise = 0.8, kSomeNoise = 0.9;
constexpr double kNoLag = 0.9;     // of the inverse gain: noise in the prediction does not lower it
constexpr double kSureOfGain = 2;  // standard deviations
constexpr double kReach = 3;       // of a Gaussian's standard deviation, over which an average goes
constexpr double kSeen = 0.6;      // of an average's weight: the used samples have so much of it at least

// y with the samples in between drawn over as a straight line where the row is not used.
VectorXd Bridged(VectorXd y, const Eigen::VectorXi& used) {
  Index last = -1;
  for (Index k = 0; k < y.size(); ++k) {
    if (!used[k]) continue;
    for (Index i = last + 1; i < k; ++i)
      y[i] =
          last < 0 ? y[k] : y[last] + (y[k] - y[last]) * static_cast<double>(i - last) / static_cast<double>(k - last);
    last = k;
  }
  for (Index i = last + 1; i < y.size(); ++i) y[i] = last < 0 ? 0 : y[last];
  return y;
}

constexpr int kBins = 64;               // of a spectrum up to half the sample rate
constexpr double kFilteredAway = 1e-2;  // of the torque's power over the prediction's
constexpr double kSteep = 1.5;          // the factor in frequency within which that happens
constexpr Index kAboveMotion = 14;  // bin: who brings a log to a lower rate filters at an eighth of that rate or above
constexpr double kHalfway = 0.25;   // of that ratio at the edge

// Power of the first kBins bins in evenly spaced samples, by Welch's method with Blackman and Harris' window: what
// leaks is 92 dB down. Empty: too few samples.
VectorXd Power(const VectorXd& y) {
  const Index size = 2 * kBins;
  VectorXd out = VectorXd::Zero(kBins);
  Eigen::FFT<double> fft;
  std::vector<double> part(static_cast<std::size_t>(size));
  std::vector<std::complex<double>> spectrum;
  int segments = 0;
  for (Index first = 0; first + size <= y.size(); first += size / 2, ++segments) {
    io::CancellationPoint();
    const double mean = y.segment(first, size).mean();
    for (Index k = 0; k < size; ++k) {
      const double x = 2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(size);
      part[static_cast<std::size_t>(k)] =
          (y[first + k] - mean) *
          (0.35875 - 0.48829 * std::cos(x) + 0.14128 * std::cos(2 * x) - 0.01168 * std::cos(3 * x));
    }
    fft.fwd(spectrum, part);
    for (Index k = 0; k < kBins; ++k) out[k] += std::norm(spectrum[static_cast<std::size_t>(k)]);
  }
  return segments < kFewSegments ? VectorXd() : out;
}

}  // namespace

double FilteredAbove_Hz(const Dataset& data, int joint, const VectorXd& predicted) {
  const auto measured = data.tau.col(joint);
  if (measured.minCoeff() == measured.maxCoeff()) return INFINITY;  // a brake holds the joint
  const VectorXd torque = Power(measured), model = Power(predicted);
  if (torque.size() == 0) return INFINITY;
  // Three bins at a time: a single one may be empty by chance.
  const auto ratio = [&](Index k) { return torque.segment(k - 1, 3).sum() / (model.segment(k - 1, 3).sum() + 1e-300); };
  for (Index k = kAboveMotion; kSteep * static_cast<double>(k) + 1 < kBins; ++k) {
    const auto above = static_cast<Index>(kSteep * static_cast<double>(k));
    if (ratio(above) > kFilteredAway * ratio(k)) continue;
    double highest = 0;
    for (Index i = above; i + 1 < kBins; ++i) highest = std::max(highest, ratio(i));
    if (highest > kFilteredAway * ratio(k)) continue;
    Index edge = k;
    while (ratio(edge) > kHalfway * ratio(k)) ++edge;
    return static_cast<double>(edge) * data.rate_Hz() / (2 * kBins);
  }
  return INFINITY;
}

Eigen::MatrixXd AsSaved(const Dataset& data, Eigen::MatrixXd torque) {
  for (Index j = 0; j < data.saved_Hz.size(); ++j)
    if (const double rate_Hz = data.rate_Hz(); data.saved_Hz[j] < 0.5 * rate_Hz)
      torque.col(j) = logs::ZeroPhaseLowPass(torque.col(j), data.saved_Hz[j], rate_Hz);
  return torque;
}

std::vector<TransferBand> Transfer(const Dataset& data, int joint, const VectorXd& predicted) {
  const VectorXd& t = data.s.t;
  const double rate_Hz = data.rate_Hz();
  const Index size = static_cast<Index>(kSegment_s * rate_Hz) / 2 * 2;
  std::vector<TransferBand> out;
  if (size < 16 || t.size() < size) return out;
  const VectorXd y = Bridged(data.tau.col(joint), data.used.col(joint)), x = Bridged(predicted, data.used.col(joint));
  VectorXd window(size);
  for (Index k = 0; k < size; ++k)
    window[k] = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * (static_cast<double>(k) + 0.5) / static_cast<double>(size));
  Eigen::FFT<double> fft;
  const Index bins = size / 2;
  VectorXd xx = VectorXd::Zero(bins), yy = xx;
  Eigen::VectorXcd xy = Eigen::VectorXcd::Zero(bins);
  int segments = 0;
  std::vector<std::complex<double>> fx, fy;
  const auto transform = [&](const VectorXd& v, Index first, std::vector<std::complex<double>>& to) {
    const VectorXd part = v.segment(first, size);
    const VectorXd tapered = (part.array() - part.mean()) * window.array();
    std::vector<double> in(tapered.begin(), tapered.end());
    fft.fwd(to, in);
  };
  for (Index first = 0; first + size <= t.size(); first += size / 2) {
    io::CancellationPoint();
    if (data.used.col(joint).segment(first, size).sum() < kSeen * static_cast<double>(size)) continue;
    transform(x, first, fx), transform(y, first, fy);
    for (Index k = 0; k < bins; ++k) {
      const auto a = fx[static_cast<std::size_t>(k)], b = fy[static_cast<std::size_t>(k)];
      xx[k] += std::norm(a), yy[k] += std::norm(b), xy[k] += std::conj(a) * b;
    }
    ++segments;
  }
  if (segments < kFewSegments) return out;
  const double step_Hz = rate_Hz / static_cast<double>(size);
  for (double lower = kLowest_Hz; lower * kThird < 0.5 * rate_Hz; lower *= kThird) {
    const Index first = std::max<Index>(1, static_cast<Index>(std::ceil(lower / step_Hz))),
                last = std::min(bins - 1, static_cast<Index>(std::ceil(lower * kThird / step_Hz)));
    if (last <= first) continue;
    // A Hann window ties a bin to its neighbours and, over half its length, a segment to the next one.
    const double looks = 0.5 * static_cast<double>((last - first) * segments);
    double sxx = 0, syy = 0;
    std::complex<double> sum = 0;  // over so narrow a band a delay of some samples turns all bins alike
    for (Index k = first; k < last; ++k) sxx += xx[k], syy += yy[k], sum += xy[k];
    TransferBand band{lower, lower * kThird, 0, 0, 0, 0};
    if (sxx > 0 && syy > 0) {
      const double chance = 1 / looks, raw = std::min(1.0, std::norm(sum) / (sxx * syy));
      band.coherence = std::max(0.0, (raw - chance) / (1 - chance));
      band.gain = std::sqrt(band.coherence * syy / sxx);
      band.gain_sd = std::sqrt((1 - band.coherence) / (2 * looks) * syy / sxx);
      band.inverse_gain = std::sqrt(syy / sxx / std::max(band.coherence, 1e-6));
    }
    out.push_back(band);
  }
  return out;
}

double AgreedBand_Hz(const std::vector<TransferBand>& transfer) {
  const auto below = [](const TransferBand& b, double gain) {
    // Both gains have the same relative deviation.
    return b.gain + kSureOfGain * b.gain_sd < gain &&
           b.inverse_gain * (b.gain + kSureOfGain * b.gain_sd) > kNoLag * b.gain;
  };
  for (std::size_t k = 0; k + 1 < transfer.size(); ++k) {
    if (!below(transfer[k], kMuchNoise) || !below(transfer[k + 1], kMuchNoise)) continue;
    while (k > 0 && below(transfer[k - 1], kSomeNoise)) --k;
    return transfer[k].lower_Hz;
  }
  return INFINITY;
}

Eigen::SparseMatrix<double, Eigen::RowMajor> AverageRows(const Dataset& data, int joint) {
  const VectorXd& t = data.s.t;
  const Index samples = t.size();
  const double band_Hz = data.band_Hz[joint], step_s = 1 / data.rate_Hz();
  const double width_s = std::sqrt(std::log(2.0)) / (2 * std::numbers::pi * band_Hz), apart_s = 0.5 / band_Hz;
  const double whole = width_s * std::sqrt(2 * std::numbers::pi) / step_s;  // weight of a window without gaps
  std::vector<Eigen::Triplet<double>> entries;
  Index row = 0, first = 0;
  for (double centre = t[0] + 0.5 * apart_s; centre < t[samples - 1]; centre += apart_s) {
    while (first < samples && t[first] < centre - kReach * width_s) ++first;
    const std::size_t begin = entries.size();
    double sum = 0;
    for (Index k = first; k < samples && t[k] <= centre + kReach * width_s; ++k) {
      if (!data.used(k, joint)) continue;
      const double off = (t[k] - centre) / width_s, weight = std::exp(-0.5 * off * off);
      entries.emplace_back(row, k, weight);
      sum += weight;
    }
    if (sum < kSeen * whole) {
      entries.resize(begin);
      continue;
    }
    for (std::size_t e = begin; e < entries.size(); ++e)
      entries[e] = {static_cast<int>(row), entries[e].col(), entries[e].value() / sum};
    ++row;
  }
  Eigen::SparseMatrix<double, Eigen::RowMajor> out(row, samples);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

}  // namespace armcal::calibration
