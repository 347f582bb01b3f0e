// calibration tests - jolts of a motion that is written down in closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host_sim/data/logs/signals.hpp"
#include "host_sim/identify/calibration/jolts.hpp"

namespace armcal::calibration {
namespace {

constexpr double kSampled_Hz = 125, kSwings_s = 20, kLeft = 0.02, kJump = 2;  // N m, rad/s^2
constexpr double kJumps_s[] = {3.1234, 7.777, 7.9, 14.2468};

// Joint 1 swings, and from some instants on its acceleration is larger by kJump for 0.3 s: the second integral of that
// is written down. Joint 2 only swings.
double Position(int joint, double t) {
  double q = 0.4 * std::sin(2.1 * t + joint) + 0.2 * std::sin(5.3 * t);
  const auto past = [t](double from) { return 0.5 * std::pow(std::max(0.0, t - from), 2); };
  if (joint == 0)
    for (const double from : kJumps_s) q += kJump * (past(from) - past(from + 0.3));
  return q;
}

logs::Log MakeLog(double position_noise) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  logs::Log log;
  log.source = "jolts";
  log.joints = 2;
  const auto samples = static_cast<Eigen::Index>(kSampled_Hz * kSwings_s);
  log.t = Eigen::VectorXd::LinSpaced(samples, 0, static_cast<double>(samples - 1) / kSampled_Hz);
  log.q.resize(samples, 2), log.tau.resize(samples, 2);
  for (Eigen::Index k = 0; k < samples; ++k)
    for (int j = 0; j < 2; ++j) {
      log.q(k, j) = Position(j, log.t[k]) + position_noise * normal(random);
      log.tau(k, j) = std::sin(2.1 * log.t[k]);
    }
  return log;
}

Eigen::MatrixXi Found(const logs::Log& log, const Eigen::Matrix2d& inertia) {
  const logs::Derivatives derived = logs::DeriveSignals(log, {inertia}, {20});
  return BesideJolts(log.t, derived.qdd, derived.cutoff_Hz, inertia, Eigen::Vector2d::Constant(kLeft));
}

Eigen::Matrix2d Coupled(double across) { return Eigen::Matrix2d{{0.5, across}, {across, 0.3}}; }

TEST(Jolts, AreFoundInEachJointThatFeelsThem_AndNowhereElse) {
  const logs::Log log = MakeLog(1e-7);
  const Eigen::MatrixXi beside = Found(log, Coupled(0.1));
  const auto inner = Eigen::seqN(Eigen::Index{100}, log.samples() - 200);  // derivatives are settled there
  for (Eigen::Index k = 100; k < log.samples() - 100; ++k) {
    double nearest = INFINITY;
    for (const double from : kJumps_s)
      nearest = std::min({nearest, std::abs(log.t[k] - from), std::abs(log.t[k] - from - 0.3)});
    for (int j = 0; j < 2; ++j) {
      if (nearest > 0.02 && nearest < 0.15) continue;  // a filter of 20 Hz rings for about two periods
      EXPECT_EQ(beside(k, j), nearest < 0.1 ? 1 : 0) << log.t[k] << " s, joint " << j + 1;
    }
  }
  EXPECT_EQ(Found(log, Coupled(0)).col(1)(inner).sum(), 0) << "joint 2 does not feel joint 1";
  EXPECT_EQ(Found(log, 1e-3 * Coupled(0.1))(inner, Eigen::all).sum(), 0)
      << "nothing shows beside what the model leaves";
}

TEST(Jolts, NoiseOfTheEncoder_IsNone) {
  // So much noise that the jumps drown in it: 5e-5 rad make 4 rad/s^2 at 20 Hz and 125 samples/s.
  EXPECT_LT(Found(MakeLog(5e-4), Coupled(0.1)).cast<double>().mean(), 0.01);
}

}  // namespace
}  // namespace armcal::calibration
