// logs - a periodogram against the noise that a position carries.
#include "host_sim/data/logs/motion_band.hpp"

#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <vector>

namespace armcal::logs {

using Eigen::Index;
using Eigen::VectorXd;

namespace {
constexpr double kSegment_s = 8;  // at most; a tone is a hertz or two wide
constexpr double kAbove = 4;      // times the noise: a bin of noise alone, averaged over ten segments, stays below
constexpr int kNeighbours = 2;    // bins on either side that must agree
}  // namespace

double MotionBand_Hz(const VectorXd& q, double noise, double rate_Hz) {
  const Index segment = static_cast<Index>(std::exp2(std::floor(std::log2(kSegment_s * rate_Hz))));
  if (q.size() < segment + 2) return 0.5 * rate_Hz;
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
