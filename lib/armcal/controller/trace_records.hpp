// controller - what one record of the two traces holds: averaged raw samples, or processed samples.
#pragma once

#include <cstdint>

#include "armcal/core/words.hpp"
#include "armcal/link/trace.hpp"
#include "armcal/model/sample.hpp"

namespace armcal::controller {

// Trace 0: raw samples, averaged over the decimation that the client asked for. Per joint and channel, in this order;
// 32-bit values high word first:
//   bit 0  motor counts, int32 in 1/16 count (wraps) and current, int32 in 1/16 LSB
//   bit 1  temperature, f32, deg C
//   bit 2  flags, u16: RawSample flags of all ticks (enabled: and; saturated, stale: or)
//   bit 3  set-point position, f32, and feed-forward torque, f32, joint side
inline constexpr std::uint32_t kRawMotion = 1, kRawTemperature = 2, kRawFlags = 4, kRawSetPoint = 8, kRawAll = 15;
//   bit 4  alone: motion and state, packed for a slow line, in 2 n + (n + 1) / 2 + 1 words (16 for six joints):
//     n words   position p: its lowest 16 bits, in 1/16 count
//     n words   current: its lowest 16 bits, in 1/4 LSB, two's complement
//     a byte a joint, the first in the high byte: 4 bits p >> 16, 2 bits current >> 16, 2 bits state: 0 not enabled,
//               1 enabled, 2 enabled and saturated, 3 stale, or p changed more than a reader can tell
//     a word    joint in 4 bits, from 0, in turn; p >> 20 of this joint in 12 bits
//   A record holds only 20 bits of p. A reader predicts p from the last two records (2 p1 - p0) and takes the value
//   with these 20 bits that is nearest. This is right if the prediction is wrong by less than 2^19 sixteenths, that is
//   32768 counts. Otherwise the state is 3.
inline constexpr std::uint32_t kRawPacked = 16;

// Trace 1: one record for each estimator sample. Per joint: q, qd, qdd, tau and temperature as f32, flags as u16
// (kUsed: the row changed the estimate of filter A), and the committed model's torque at this state as f32.
inline constexpr std::uint32_t kSampleAll = 1;
inline constexpr int kSampleWordsPerJoint = 13;

template <int n>
constexpr std::uint16_t PackedRecordWords() {
  return static_cast<std::uint16_t>(2 * n + (n + 1) / 2 + 1);
}

template <int n>
constexpr std::uint16_t RawRecordWords(std::uint32_t channels) {
  const int per_joint = (channels & kRawMotion ? 4 : 0) + (channels & kRawTemperature ? 2 : 0) +
                        (channels & kRawFlags ? 1 : 0) + (channels & kRawSetPoint ? 4 : 0);
  if (channels == kRawPacked) return PackedRecordWords<n>();
  return channels > kRawAll ? std::uint16_t{0} : static_cast<std::uint16_t>(n * per_joint);
}

template <int n>
constexpr std::uint16_t SampleRecordWords(std::uint32_t channels) {
  return channels == kSampleAll ? static_cast<std::uint16_t>(n * kSampleWordsPerJoint) : std::uint16_t{0};
}

// What packed records need of those before them. Context: tick.
template <int n>
struct PackedHistory {
  std::uint32_t last[n] = {}, before[n] = {};  // positions in 1/16 count
  int records = 0;                             // up to 2
  int turn = 0;                                // joint whose highest bits come next
};

// Sums up the ticks of one record. Context: tick.
template <int n>
class RawRecord {
 public:
  void Clear() { *this = RawRecord{}; }

  // One tick. Shapes: [n]. q_reference: position of the set-point in rad (m); feedforward_Nm: the torque that
  // FeedForward answered.
  void Add(const model::RawSample<n>& raw, const float* q_reference, const float* feedforward_Nm) {
    for (int j = 0; j < n; ++j) {
      if (count_ == 0) first_[j] = static_cast<std::uint32_t>(raw.counts[j]);
      counts_[j] += static_cast<std::int32_t>(static_cast<std::uint32_t>(raw.counts[j]) - first_[j]);
      current_[j] += raw.current[j];
      temperature_[j] += raw.temperature_degC[j];
      enabled_[j] = static_cast<std::uint8_t>(count_ == 0 ? raw.flags[j] : enabled_[j] & raw.flags[j]);
      any_[j] = static_cast<std::uint8_t>(any_[j] | raw.flags[j]);
      reference_[j] += q_reference[j];
      feedforward_[j] += feedforward_Nm[j];
    }
    ++count_;
  }

  // w [RawRecordWords<n>(channels)].
  void Write(std::uint32_t channels, std::uint16_t* w) const {
    const float share = 1.0f / static_cast<float>(count_ > 0 ? count_ : 1);
    for (int j = 0; j < n; ++j) {
      if (channels & kRawMotion) {
        core::PutU32(w, first_[j] * 16u + static_cast<std::uint32_t>(Sixteenths(counts_[j])));
        core::PutU32(w + 2, static_cast<std::uint32_t>(Sixteenths(current_[j])));
        w += 4;
      }
      if (channels & kRawTemperature) core::PutF32(w, temperature_[j] * share), w += 2;
      if (channels & kRawFlags)
        *w++ = static_cast<std::uint16_t>((enabled_[j] & model::kEnabled) |
                                          (any_[j] & (model::kSaturated | model::kStale)));
      if (channels & kRawSetPoint) {
        core::PutF32(w, reference_[j] * share);
        core::PutF32(w + 2, feedforward_[j] * share);
        w += 4;
      }
    }
  }

  // w [PackedRecordWords<n>()].
  void WritePacked(PackedHistory<n>& history, std::uint16_t* w) const {
    constexpr int kBytes = 2 * n;  // where the bytes begin
    constexpr std::uint32_t kHalf = 1u << 19;
    std::uint32_t p[n];
    for (int k = kBytes; k < PackedRecordWords<n>(); ++k) w[k] = 0;
    for (int j = 0; j < n; ++j) {
      p[j] = first_[j] * 16u + static_cast<std::uint32_t>(Sixteenths(counts_[j]));
      const std::uint32_t bend = p[j] - 2 * history.last[j] + history.before[j];
      const bool beyond = history.records == 2 && bend + kHalf >= 2 * kHalf;
      const bool stale = (any_[j] & model::kStale) != 0, saturated = (any_[j] & model::kSaturated) != 0;
      const std::uint32_t state = beyond || stale                        ? 3u
                                  : (enabled_[j] & model::kEnabled) == 0 ? 0u
                                  : saturated                            ? 2u
                                                                         : 1u;
      const auto current = static_cast<std::uint32_t>((Sixteenths(current_[j]) + 2) >> 2);
      w[j] = static_cast<std::uint16_t>(p[j]);
      w[n + j] = static_cast<std::uint16_t>(current);
      const std::uint32_t byte = ((p[j] >> 16 & 0xFu) << 4) | ((current >> 16 & 3u) << 2) | state;
      w[kBytes + j / 2] = static_cast<std::uint16_t>(w[kBytes + j / 2] | (j % 2 == 0 ? byte << 8 : byte));
      history.before[j] = history.last[j];
      history.last[j] = p[j];
    }
    const auto turn = static_cast<std::uint32_t>(history.turn);
    w[PackedRecordWords<n>() - 1] = static_cast<std::uint16_t>((turn << 12) | (p[history.turn] >> 20));
    history.turn = history.turn + 1 == n ? 0 : history.turn + 1;
    if (history.records < 2) ++history.records;
  }

 private:
  // 16 x mean, rounded to nearest. In 32 bits, because the core has an instruction for that division.
  std::int32_t Sixteenths(std::int32_t sum) const {
    if (count_ == 0) return 0;
    const std::int32_t whole = sum / count_, rest = sum % count_;
    const std::int32_t share = (rest * 32 + (rest >= 0 ? count_ : -count_)) / (2 * count_);
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(whole) * 16u + static_cast<std::uint32_t>(share));
  }

  std::int32_t count_ = 0;
  std::uint32_t first_[n] = {};
  std::int32_t counts_[n] = {}, current_[n] = {};
  float temperature_[n] = {}, reference_[n] = {}, feedforward_[n] = {};
  std::uint8_t enabled_[n] = {}, any_[n] = {};
};

// w [SampleRecordWords<n>(kSampleAll)], tau_model_Nm [n]. Context: background.
template <int n>
void WriteSampleRecord(const model::Sample<n>& s, const float* tau_model_Nm, std::uint16_t* w) {
  using core::PutF32;
  for (int j = 0; j < n; ++j, w += kSampleWordsPerJoint) {
    PutF32(w, s.q[j]);
    PutF32(w + 2, s.qd[j]);
    PutF32(w + 4, s.qdd[j]);
    PutF32(w + 6, s.tau[j]);
    PutF32(w + 8, s.temperature_degC[j]);
    w[10] = s.flags[j];
    PutF32(w + 11, tau_model_Nm[j]);
  }
}

// The opposite of WriteSampleRecord; s.tick is not in the record and stays. tau_model_Nm [n]. Context: any.
template <int n>
void ReadSampleRecord(const std::uint16_t* w, model::Sample<n>& s, float* tau_model_Nm) {
  using core::GetF32;
  for (int j = 0; j < n; ++j, w += kSampleWordsPerJoint) {
    s.q[j] = GetF32(w);
    s.qd[j] = GetF32(w + 2);
    s.qdd[j] = GetF32(w + 4);
    s.tau[j] = GetF32(w + 6);
    s.temperature_degC[j] = GetF32(w + 8);
    s.flags[j] = static_cast<std::uint8_t>(w[10]);
    tau_model_Nm[j] = GetF32(w + 11);
  }
}

// The ring of the raw trace. kWords: its length in 16-bit words. For six joints a packed record takes 19 words and a
// record of all channels 69, the three words of its stamp included.
template <class Model, std::uint32_t kWords = link::kDefaultTraceWords>
class RawTrace : public link::TraceRing<kWords> {
 public:
  RawTrace() : link::TraceRing<kWords>(1, RecordWords, nullptr) {}

 private:
  static std::uint16_t RecordWords(void*, std::uint32_t channels) { return RawRecordWords<Model::kJoints>(channels); }
};

}  // namespace armcal::controller
