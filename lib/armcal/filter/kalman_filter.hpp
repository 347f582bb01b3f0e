// filter - the Kalman filter of a constant state with process noise, as U D U'; knows columns, not what they mean.
#pragma once

#include "armcal/filter/prior.hpp"

namespace armcal::filter {

// Scalar rows in sequence (Bierman); process noise by rank-one additions, one state a sample in turn; `considered`
// columns by Schmidt's form. An instance belongs to the background; no call allocates, each is bounded.
template <class Layout>
class KalmanFilter {
 public:
  static constexpr int kColumns = Layout::kColumns;

  // Estimate in prior units and its standard deviation. Shape: [kColumns].
  struct ReadOut {
    float x[kColumns] = {};
    float sd[kColumns] = {};
  };

  // Starts at the prior, which must outlive the filter's use of it.
  void Restart(const Prior<Layout>& prior) {
    prior_ = &prior;
    ExpandPrior(prior, ud_);
    noisy_ = 0;
    for (int k = 0; k < kColumns; ++k) {
      x_[k] = 0.0f;
      noisy_ += prior.noise[k] > 0.0f;
    }
    next_noise_ = 0;
    floor_count_ = 0;
  }

  // One whitened row of `joint`. Shapes: front [its front columns], dense [kDense]. With use = false, or when the
  // report is not kOk, every bit of the filter stays as it was; the instructions spent are the same.
  UpdateReport Update(int joint, const float* front, const float* dense, float y, bool use) {
    float h[kColumns + 1] = {};
    const int first = Layout::kFrontBegin[joint], last = Layout::kFrontBegin[joint + 1];
    for (int k = first; k < last; ++k) h[k] = front[k - first];
    for (int k = 0; k < Layout::kDense; ++k) h[Layout::kFront + k] = dense[k];
    h[kColumns] = y;

    UpdateReport report;
    report.status = JudgeRow(h, kColumns + 1);
    const std::uint32_t taken = math::MaskOf(use && report.status == core::Status::kOk);
    for (int k = 0; k <= kColumns; ++k) h[k] = math::Masked(h[k], taken);

    float f[kColumns], gain[kColumns];
    math::UdProject<kColumns>(ud_, h, f);
    float innovation = h[kColumns];
    for (int k = 0; k < kColumns; ++k) innovation -= h[k] * x_[k];
    report.innovation = innovation;
    report.variance = 1.0f + math::UdQuadratic<kColumns>(ud_, f);

    const float gate = prior_->gate_sigma;
    const bool inside = !(gate > 0.0f && innovation * innovation > gate * gate * report.variance);
    report.accepted = taken != 0u && inside;
    if (report.status == core::Status::kOk && !report.accepted) report.status = core::Status::kGated;
    const std::uint32_t mask = math::MaskOf(report.accepted);
    for (int k = 0; k < kColumns; ++k) f[k] = math::Masked(f[k], mask);
    innovation = math::Masked(innovation, mask);

    const float variance = math::UdMeasure<kColumns>(ud_, f, 1.0f, gain);
    if (prior_->any_considered) KeepConsidered(variance, gain);
    for (int k = 0; k < kColumns; ++k) x_[k] += gain[k] * innovation;
    return report;
  }

  // Once after the rows of a sample: process noise on the next noisy state in turn, if its joints move (bit i of
  // `moving`: joint i), and the floor under the dense D.
  void EndSample(std::uint32_t moving) {
    if (noisy_ > 0) AddNoise(moving);
    for (int k = Layout::kFront; k < kColumns; ++k) {
      float& d = ud_[math::UdIndex(k, k)];
      const float floor = math::Masked(prior_->link_floor, prior_->active[k]);
      floor_count_ += d < floor;
      d = math::Max(d, floor);
    }
  }

  // Read-out in slices, interface shared by all filters: Begin, then Step until it answers true. No update between.
  void BeginReadOut(ReadOut&) const {}
  bool StepReadOut(ReadOut& out) const {
    math::UdDiagonal<kColumns>(ud_, out.sd);
    for (int k = 0; k < kColumns; ++k) {
      out.x[k] = x_[k];
      out.sd[k] = math::Sqrt(out.sd[k]);
    }
    return true;
  }

  std::uint32_t floor_count() const { return floor_count_; }  // how often the floor held a D
  const float* factor() const { return ud_; }                 // packed U D U', prior units

 private:
  // Schmidt: the optimal update minus what it took from the considered columns, P + S k k', and no gain for them.
  void KeepConsidered(float variance, float* gain) {
    float kept[kColumns];
    for (int k = 0; k < kColumns; ++k) {
      const std::uint32_t considered = math::MaskOf(prior_->considered[k]);
      kept[k] = math::Masked(gain[k], considered);
      gain[k] = math::Masked(gain[k], ~considered);
    }
    math::UdAdd<kColumns>(ud_, variance, kept);
  }

  void AddNoise(std::uint32_t moving) {
    int next = next_noise_;
    do next = next + 1 < kColumns ? next + 1 : 0;
    while (!(prior_->noise[next] > 0.0f));
    if (moving != 0u) next_noise_ = next;  // at rest nothing changes, however long it lasts
    const std::uint32_t needed = JointsOf<Layout>(next);
    float a[kColumns] = {};
    a[next] = 1.0f;
    const float variance = prior_->noise[next] * static_cast<float>(noisy_);  // its turn comes every noisy_-th
    math::UdAdd<kColumns>(ud_, math::Masked(variance, math::MaskOf((moving & needed) == needed)), a);
  }

  const Prior<Layout>* prior_ = nullptr;
  float ud_[math::UdSize(kColumns)] = {};
  float x_[kColumns] = {};
  int noisy_ = 0;
  int next_noise_ = 0;
  std::uint32_t floor_count_ = 0;
};

}  // namespace armcal::filter
