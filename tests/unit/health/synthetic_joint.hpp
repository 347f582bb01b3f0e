// health - makes rows of a joint with a known trouble, and feeds them to the drive's own statistics.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <numbers>
#include <random>

#include "armcal/monitor/residual_statistics.hpp"
#include "host_sim/client/residual_reader.hpp"

namespace armcal::health::test {

inline constexpr double kSigma_Nm = 2.0;

// One joint that swings in two tones under gravity; `trouble`: what its motor must give beyond the model, by row and
// time since the adoption in s.
class SyntheticJoint {
 public:
  using Trouble = std::function<double(const monitor::ResidualRow&, double)>;

  explicit SyntheticJoint(Trouble trouble) : trouble_(std::move(trouble)) { statistics_->Restart(0); }

  double speed_scale = 1;  // of the motion
  bool one_speed = false;  // to and fro at 0.5 rad/s instead
  std::function<double(double)> temperature_degC = [](double) { return NAN; };

  void Run(double seconds) {
    for (int k = 0; k < static_cast<int>(seconds * 125); ++k) Step();
  }

  client::JointResiduals Read() const {
    client::JointResiduals r;
    r.joint = 1, r.generation = 1, r.elapsed_s = statistics_->elapsed_s(), r.sigma_Nm = kSigma_Nm;
    const float* reference = statistics_->bins(0).reference();
    const float* recent = statistics_->bins(0).recent();
    for (int s = 0; s < 4; ++s)
      for (int d = 0; d < 2; ++d)
        for (int q = 0; q < 4; ++q, reference += 8, recent += 8) {
          r.reference.bin[s][d][q] = Bin(reference);
          r.recent.bin[s][d][q] = Bin(recent);
        }
    for (int i = 0; i < statistics_->history().size(); ++i) {
      const auto& slice = statistics_->history().slice(i);
      r.slices.push_back({static_cast<double>(slice.start_s), slice.count[0], slice.square[0]});
    }
    return r;
  }

 private:
  static client::ResidualBin Bin(const float* b) { return {b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]}; }

  void Step() {
    const double t = tick_ * 1e-3;
    phase_ += 0.008 * speed_scale;
    double q = 0.9 * std::sin(0.83 * phase_) + 0.35 * std::sin(2.9 * phase_ + 1),
           qd = speed_scale * (0.9 * 0.83 * std::cos(0.83 * phase_) + 0.35 * 2.9 * std::cos(2.9 * phase_ + 1));
    if (one_speed) {
      const double turn = std::fmod(phase_, 4.0);
      qd = turn < 2 ? 0.5 : -0.5;
      q = turn < 2 ? 0.5 * turn - 0.5 : 1.5 - 0.5 * turn;
    }
    const double load = 80 * std::cos(q - 0.4) + 60 * std::sin(1.31 * t);  // gravity, and what other joints do
    monitor::ResidualRow row{0, static_cast<float>(qd), static_cast<float>(q), static_cast<float>(load),
                             static_cast<float>(temperature_degC(t))};
    row.residual_Nm = static_cast<float>(kSigma_Nm * normal_(random_) + trouble_(row, t));
    statistics_->Add(0, row, std::abs(qd) > 0.02);
    statistics_->EndSample(tick_, 1000);
    tick_ += 8;
  }

  Trouble trouble_;
  std::mt19937 random_{11};
  std::normal_distribution<double> normal_;
  std::uint32_t tick_ = 0;
  double phase_ = 0;
  std::unique_ptr<monitor::ResidualStatistics<1>> statistics_ = std::make_unique<monitor::ResidualStatistics<1>>();
};

}  // namespace armcal::health::test
