// logs tests - a spectrum keeps the variance of a signal, and shows it at its frequency.
#include "host_sim/data/logs/spectrum.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace armcal::logs {
namespace {

// Trapezoids over frequency.
double Variance(const Spectrum& s) {
  double sum = 0;
  for (std::size_t k = 1; k < s.f_Hz.size(); ++k)
    sum += 0.5 * (s.f_Hz[k] - s.f_Hz[k - 1]) * (std::pow(s.density[k], 2) + std::pow(s.density[k - 1], 2));
  return sum;
}

TEST(Spectrum, OfWhiteNoise_IsFlatAndHoldsItsVariance) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, 3);
  Eigen::VectorXd y(100000);
  for (double& v : y) v = normal(random);
  const Spectrum s = AmplitudeDensity(y, 250, 4);
  EXPECT_NEAR(Variance(s), 9, 0.2);
  for (std::size_t k = 0; k < s.f_Hz.size(); ++k)
    EXPECT_NEAR(s.density[k], 3 / std::sqrt(125), 0.06) << s.f_Hz[k] << " Hz";
}

TEST(Spectrum, OfASine_PeaksAtItsFrequency) {
  Eigen::VectorXd y(10000);
  for (Eigen::Index k = 0; k < y.size(); ++k)
    y[k] = 5 + 2 * std::sin(2 * std::numbers::pi * 10 * static_cast<double>(k) / 250);
  const Spectrum s = AmplitudeDensity(y, 250, 4);
  const auto peak = std::max_element(s.density.begin(), s.density.end()) - s.density.begin();
  EXPECT_NEAR(s.f_Hz[static_cast<std::size_t>(peak)], 10, 0.6);
  EXPECT_NEAR(Variance(s), 2, 0.15);  // half the square of the amplitude; the mean is no part of it
}

TEST(Spectrum, OfLessThanASegment_IsEmpty) {
  EXPECT_TRUE(AmplitudeDensity(Eigen::VectorXd::Zero(900), 250, 4).f_Hz.empty());
}

}  // namespace
}  // namespace armcal::logs
