// judged set - draws the noise of each class.
#include "tests/judged/noise.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace armcal::judged {

using Eigen::VectorXd;

const std::vector<std::string>& NoiseClasses() {
  static const std::vector<std::string> classes{"white",    "coloured",       "heavy_tailed",
                                                "resonant", "coarse_encoder", "quiet"};
  return classes;
}

VectorXd DrawNoise(const std::string& noise_class, int samples, double sigma, double rate_Hz, plant::Random& random) {
  VectorXd e(samples);
  for (double& v : e) v = random.Normal();
  if (noise_class == "heavy_tailed")  // Student's t with four degrees of freedom
    for (double& v : e) {
      double square = 0;
      for (int k = 0; k < 4; ++k) square += std::pow(random.Normal(), 2);
      v /= std::sqrt(square / 4);
    }
  if (noise_class == "coloured") {
    const double a = random.Uniform(0.5, 0.9);
    for (Eigen::Index k = 1; k < e.size(); ++k) e[k] += a * e[k - 1];
  }
  if (noise_class == "slow") {  // as of a warm amplifier: correlated over a fifth of a second, and a white part
    const double a = std::exp(-1 / (rate_Hz * random.Uniform(0.15, 0.4))), white = random.Uniform(0.1, 0.4);
    VectorXd fresh(samples);
    for (double& v : fresh) v = random.Normal();
    for (Eigen::Index k = 1; k < e.size(); ++k) e[k] += a * e[k - 1];
    e = e * std::sqrt(1 - a * a) + white * fresh;
  }
  if (noise_class == "resonant") {  // a structure that rings, lightly damped
    const double w = 2 * std::numbers::pi * random.Uniform(12, std::min(40.0, 0.35 * rate_Hz)) / rate_Hz, r = 0.97;
    for (Eigen::Index k = 2; k < e.size(); ++k) e[k] += 2 * r * std::cos(w) * e[k - 1] - r * r * e[k - 2];
  }
  e.array() -= e.mean();
  e /= std::sqrt(e.squaredNorm() / samples);
  return (noise_class == "quiet" ? 0.1 : noise_class == "very_quiet" ? 0.02 : 1.0) * sigma * e;
}

double EncoderCounts(const std::string& noise_class) { return noise_class == "coarse_encoder" ? 1024 : 65536; }

}  // namespace armcal::judged
