// logs - computes spectra.
#include "host_sim/data/logs/spectrum.hpp"

#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "codegen/src/io/watch.hpp"

namespace armcal::logs {

Spectrum AmplitudeDensity(const Eigen::VectorXd& y, double rate_Hz, double segment_s) {
  constexpr double kBinsPerDecade = 24;
  Spectrum out;
  const auto size = static_cast<Eigen::Index>(segment_s * rate_Hz) / 2 * 2;
  if (size < 4 || y.size() < size) return out;
  const Eigen::ArrayXd phase = Eigen::ArrayXd::LinSpaced(size, 0, static_cast<double>(size - 1)) *
                               (2 * std::numbers::pi / static_cast<double>(size));
  const Eigen::ArrayXd window = 0.5 - 0.5 * phase.cos();
  Eigen::FFT<double> fft;
  std::vector<double> part(static_cast<std::size_t>(size));
  std::vector<std::complex<double>> transform;
  Eigen::ArrayXd power = Eigen::ArrayXd::Zero(size / 2);
  int segments = 0;
  for (Eigen::Index first = 0; first + size <= y.size(); first += size / 2, ++segments) {
    io::CancellationPoint();
    const auto piece = y.segment(first, size).array();
    Eigen::ArrayXd::Map(part.data(), size) = (piece - piece.mean()) * window;
    fft.fwd(transform, part);
    for (Eigen::Index k = 1; k < power.size(); ++k) power[k] += std::norm(transform[static_cast<std::size_t>(k)]);
  }
  power *= 2 / (rate_Hz * window.square().sum() * segments);

  const double step_Hz = rate_Hz / static_cast<double>(size);
  for (Eigen::Index k = 1; k < power.size();) {
    Eigen::Index end = k + 1;
    const double top = static_cast<double>(k) * std::pow(10, 1 / kBinsPerDecade);
    while (end < power.size() && static_cast<double>(end) < top) ++end;
    out.f_Hz.push_back(step_Hz * (static_cast<double>(k) + static_cast<double>(end - 1)) / 2);
    out.density.push_back(std::sqrt(power.segment(k, end - k).mean()));
    k = end;
  }
  return out;
}

}  // namespace armcal::logs
