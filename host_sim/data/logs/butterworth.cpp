// logs - filters by a Butterworth filter of order 4, as two second-order sections.
#include "host_sim/data/logs/butterworth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace armcal::logs {
namespace {

// y = b (x + 2 x' + x'') - a1 y' - a2 y'', unit gain at rest.
struct Section {
  double b, a1, a2;
};

std::array<Section, 2> Design(double cutoff_Hz, double rate_Hz) {
  const double w = std::tan(std::numbers::pi * cutoff_Hz / rate_Hz);  // prewarped analogue cut-off
  std::array<Section, 2> sections{};
  for (int k = 0; k < 2; ++k) {
    const double damping = 2 * std::sin(std::numbers::pi * (2 * k + 1) / 8);  // 1 / Q of pole pair k
    const double scale = 1 / (1 + damping * w + w * w);
    sections[static_cast<std::size_t>(k)] = {w * w * scale, 2 * (w * w - 1) * scale, (1 - damping * w + w * w) * scale};
  }
  return sections;
}

// In place, from the state that a constant x[0] leaves behind (transposed direct form II).
void Run(const Section& s, Eigen::VectorXd& x) {
  double z1 = x[0] * (1 - s.b);
  double z2 = x[0] * (s.b - s.a2);
  for (double& value : x) {
    const double in = value;
    value = s.b * in + z1;
    z1 = 2 * s.b * in - s.a1 * value + z2;
    z2 = s.b * in - s.a2 * value;
  }
}

}  // namespace

Eigen::VectorXd ZeroPhaseLowPass(const Eigen::VectorXd& x, double cutoff_Hz, double rate_Hz) {
  const Eigen::Index n = x.size();
  if (n < 2) return x;
  // The slowest pole pair decays as exp(-0.38 x 2 pi cutoff t): e^-19 within eight periods of the cut-off.
  const Eigen::Index pad = std::min(n - 1, static_cast<Eigen::Index>(std::ceil(8 * rate_Hz / cutoff_Hz)));
  Eigen::VectorXd y(n + 2 * pad);
  y.segment(pad, n) = x;
  for (Eigen::Index k = 1; k <= pad; ++k) {
    y[pad - k] = 2 * x[0] - x[k];
    y[pad + n - 1 + k] = 2 * x[n - 1] - x[n - 1 - k];
  }
  const auto sections = Design(cutoff_Hz, rate_Hz);
  for (int pass = 0; pass < 2; ++pass) {
    for (const Section& section : sections) Run(section, y);
    y.reverseInPlace();
  }
  return y.segment(pad, n);
}

}  // namespace armcal::logs
