// filter - how likely each member of a bank is, joint by joint, by what it was surprised; knows no filter.
#pragma once

#include <cstdint>

#include "armcal/math/elementary.hpp"

namespace armcal::filter {

template <int kJoints, int kMembers>
class ModeWeights {
 public:
  void Restart() {
    for (int i = 0; i < kJoints; ++i)
      for (int m = 0; m < kMembers; ++m) weight_[i][m] = 1.0f / kMembers, log_likelihood_[i][m] = 0.0f;
    Average();
  }

  // A row of the joint, whitened; one that is not used says nothing.
  void Add(int joint, int member, float innovation, float variance, bool used) {
    const float surprise = 0.5f * (innovation * innovation / variance + math::Log(variance));
    log_likelihood_[joint][member] -= math::Masked(surprise, math::MaskOf(used));
  }

  // Bayes' rule over the rows of a sample, for joints that move (bit i: joint i); a member that is wrong keeps kLeast,
  // so that it can come back.
  void EndSample(std::uint32_t moving) {
    for (int i = 0; i < kJoints; ++i) {
      float best = log_likelihood_[i][0], sum = 0.0f;
      for (const float l : log_likelihood_[i]) best = math::Max(best, l);
      float next[kMembers];
      for (int m = 0; m < kMembers; ++m) {
        next[m] = math::Max(kLeast, weight_[i][m] * math::Exp(log_likelihood_[i][m] - best));
        log_likelihood_[i][m] = 0.0f;
        sum += next[m];
      }
      for (int m = 0; m < kMembers; ++m)
        weight_[i][m] = math::Select((moving >> i & 1u) != 0u, next[m] / sum, weight_[i][m]);
    }
    Average();
  }

  // Of the joints' weights, for what all of them see.
  void Average() {
    for (int m = 0; m < kMembers; ++m) {
      float sum = 0.0f;
      for (const auto& joint : weight_) sum += joint[m];
      dense_[m] = sum / kJoints;
    }
  }

  // A mode may have changed: share[to][from] of what member `to` goes on with. A joint's weights move with it unless
  // `due` is zero; those of kJoints, their mean, do not. All joints after kJoints, then Average.
  void Exchange(int joint, float (&share)[kMembers][kMembers], std::uint32_t due) {
    float next[kMembers];
    for (int to = 0; to < kMembers; ++to) next[to] = Shares(of(joint), to, share[to]);
    if (joint == kJoints) return;
    for (int m = 0; m < kMembers; ++m) weight_[joint][m] = math::Select(due != 0u, next[m], weight_[joint][m]);
  }

  // [kMembers] of a joint; kJoints: their mean.
  const float* of(int joint) const { return joint < kJoints ? weight_[joint] : dense_; }

 private:
  static constexpr float kStay = 0.995f;  // probability that a mode lasts from one exchange to the next
  static constexpr float kLeast = 1e-4f;

  static float Shares(const float* weight, int to, float* share) {
    float sum = 0.0f;
    for (int from = 0; from < kMembers; ++from) {
      share[from] = weight[from] * (from == to ? kStay : (1.0f - kStay) / (kMembers - 1));
      sum += share[from];
    }
    for (int from = 0; from < kMembers; ++from) share[from] /= sum;
    return sum;
  }

  float weight_[kJoints][kMembers] = {}, log_likelihood_[kJoints][kMembers] = {}, dense_[kMembers] = {};
};

}  // namespace armcal::filter
