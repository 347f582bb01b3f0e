// monitor - how large the residuals of all joints were, and when: a few slices of time since the adoption; knows no
// model and no register.
#pragma once

#include <cstdint>

namespace armcal::monitor {

// Slices of time, each with the number of rows and the sum of the squared residuals of every joint. When there is no
// room for another, the two neighbours are joined that are shortest for their age. So the slices reach back to the
// restart whatever the time since, and each is some share of its age long: a change of an hour ago is dated to
// minutes, one of last month to days. Only time in which a joint moved fills a slice; a night at rest costs none.
template <int n>
class ResidualHistory {
 public:
  static constexpr int kSlices = 32;
  static constexpr std::uint32_t kSliceSamples =
      1024;  // with motion, of a slice that has not been joined: 8 s at 125 Hz

  struct Slice {
    std::uint32_t start_s = 0;            // since the restart
    float count[n] = {}, square[n] = {};  // rows; sum of residual^2
  };

  // Forgets everything. Context: background.
  void Restart() {
    slices_[0] = Slice{};
    size_ = 1;
    samples_ = 0;
  }

  // A row that may be judged, finite. Context: background.
  void Add(int joint, float residual_Nm) {
    slices_[size_ - 1].count[joint] += 1.0f;
    slices_[size_ - 1].square[joint] += residual_Nm * residual_Nm;
  }

  // After the rows of one sample in which some joint moved; at `now_s` since the restart. Context: background.
  void EndSample(std::uint32_t now_s) {
    if (++samples_ < kSliceSamples) return;
    samples_ = 0;
    if (size_ == kSlices) Join(ShortestForItsAge(now_s));
    slices_[size_] = Slice{};
    slices_[size_++].start_s = now_s;
  }

  int size() const { return size_; }  // at least 1; the last slice is still being filled
  const Slice& slice(int i) const { return slices_[i]; }

 private:
  // The first of the two neighbours.
  int ShortestForItsAge(std::uint32_t now_s) const {
    int best = 0;
    float least = 2.0f;  // no pair is longer than its age
    for (int i = 0; i + 1 < size_; ++i) {
      const std::uint32_t end_s = i + 2 < size_ ? slices_[i + 2].start_s : now_s;
      const float age = static_cast<float>(now_s - slices_[i].start_s) + 1.0f;
      const float share = static_cast<float>(end_s - slices_[i].start_s) / age;
      if (share < least) least = share, best = i;
    }
    return best;
  }

  void Join(int first) {
    for (int j = 0; j < n; ++j) {
      slices_[first].count[j] += slices_[first + 1].count[j];
      slices_[first].square[j] += slices_[first + 1].square[j];
    }
    for (int i = first + 1; i + 1 < size_; ++i) slices_[i] = slices_[i + 1];
    --size_;
  }

  Slice slices_[kSlices] = {};
  int size_ = 1;
  std::uint32_t samples_ = 0;
};

}  // namespace armcal::monitor
