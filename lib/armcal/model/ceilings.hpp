// model - the hardest values that any table may hold, and the check of a table's words against them.
//
// A generated model carries its ceilings as kCeilings. They follow from the robot file, and the integrator may give a
// controller others. They are no part of the table: the schema and the layout do not depend on them.
#pragma once

#include <cstdint>

#include "armcal/core/status.hpp"
#include "armcal/core/words.hpp"
#include "armcal/math/elementary.hpp"
#include "armcal/model/parameters.hpp"

namespace armcal::model {

// A table may set the row gate of a joint to a limit between these two, in standard deviations. A narrower gate would
// refuse ordinary rows.
inline constexpr float kNarrowestGate = 3.0f, kWidestGate = 1000.0f;

struct JointCeiling {
  float torque_Nm;              // no torque limit is higher, so no table commands more
  float friction_Nm;            // no sum of the joint's friction columns is higher
  float feed_Nm;                // tolerance: the friction may drive the joint by up to this torque
  float scale_low, scale_high;  // of the torque scale
  float sigma_low_Nm, sigma_high_Nm;
  float v_min_low_radps, v_min_high_radps;
  float speed_radps;                          // the joint's limit, where the grid of friction ends
  float position_low_rad, position_high_rad;  // the joint's range, from which the grid takes its poses
};

struct ParameterCeiling {
  float low, high;  // of the mean
  float sd;
  float process_noise;  // per sample
};

struct TableCeiling {
  std::uint32_t least_fade_ms;  // of a table that may be adopted while axes are enabled
  std::uint32_t longest_fade_ms;
  float least_forgetting;
  float coldest_degC, warmest_degC;  // where the grid of friction begins and ends
};

// Shapes: n joints, p parameters.
template <int n, int p>
struct Ceilings {
  TableCeiling table;
  JointCeiling joint[n];
  ParameterCeiling parameter[p];
};

// The same without the shapes, so that one function serves every model and the PC, too.
struct CeilingView {
  int joints, parameters;
  const TableCeiling* table;
  const JointCeiling* joint;
  const ParameterCeiling* parameter;
};

template <int n, int p>
constexpr CeilingView View(const Ceilings<n, p>& c) {
  return {n, p, &c.table, c.joint, c.parameter};
}

constexpr std::uint16_t WordOfJoint(int joint) {
  return static_cast<std::uint16_t>(kHeaderWords + joint * kJointWords);
}
constexpr std::uint16_t WordOfParameter(int joints, int parameter) {
  return static_cast<std::uint16_t>(WordOfJoint(joints) + parameter * kParameterWords);
}

constexpr std::uint16_t WordOfGate(int joints, int parameters, int joint) {
  return static_cast<std::uint16_t>(WordOfParameter(joints, parameters) + joint * kGateWords);
}

namespace internal {

inline constexpr std::uint16_t kFlagsWord = 5, kFadeWord = 6, kForgettingWord = 8;

// Keeps the first refusal. Each check takes one number and returns true if that number is allowed.
class WordCheck {
 public:
  explicit WordCheck(const std::uint16_t* words) : words_(words) {}

  bool Refuse(core::Status status, int word, float value, float bound) {
    if (core::IsOk(refusal_.status)) refusal_ = {status, static_cast<std::uint16_t>(word), value, bound};
    return false;
  }
  // The float at `word` must be finite (else kNotFinite), and from low to high, the range of the ceiling (else
  // kBeyondCeiling).
  bool Float(int word, float low, float high) {
    const float value = core::GetF32(words_ + word);
    if (!math::IsFinite(value)) return Refuse(core::Status::kNotFinite, word, value, high);
    if (value < low) return Refuse(core::Status::kBeyondCeiling, word, value, low);
    if (value > high) return Refuse(core::Status::kBeyondCeiling, word, value, high);
    return true;
  }
  // The same for a number that must be positive, or not negative, by the layout itself (else kOutOfRange, before the
  // others).
  bool Positive(int word, float low, float high) {
    const float value = core::GetF32(words_ + word);
    if (value <= 0.0f) return Refuse(core::Status::kOutOfRange, word, value, low);
    return Float(word, low, high);
  }
  bool NotNegative(int word, float high) {
    const float value = core::GetF32(words_ + word);
    if (value < 0.0f) return Refuse(core::Status::kOutOfRange, word, value, 0.0f);
    return Float(word, 0.0f, high);
  }
  // A word, of which only the bits of `known` may be set (else kOutOfRange).
  bool Bits(int word, unsigned known) {
    const unsigned value = words_[word];
    return (value & ~known) == 0 ||
           Refuse(core::Status::kOutOfRange, word, static_cast<float>(value), static_cast<float>(known));
  }
  const core::Refusal& refusal() const { return refusal_; }

 private:
  const std::uint16_t* words_;
  core::Refusal refusal_;
};

inline bool HeaderIsAllowed(const TableCeiling& ceiling, bool bumpless_allowed, const std::uint16_t* words,
                            WordCheck& check) {
  if (!check.Bits(kFlagsWord, kFlagBumpless)) return false;
  const bool bumpless = (words[kFlagsWord] & kFlagBumpless) != 0;
  if (bumpless && !bumpless_allowed) return check.Refuse(core::Status::kForbidden, kFlagsWord, 1.0f, 0.0f);
  const std::uint32_t fade_ms = core::GetU32(words + kFadeWord);
  const std::uint32_t least_ms = bumpless ? ceiling.least_fade_ms : 0;
  const bool allowed = fade_ms >= least_ms && fade_ms <= ceiling.longest_fade_ms;
  if (!allowed)
    return check.Refuse(core::Status::kBeyondCeiling, kFadeWord, static_cast<float>(fade_ms),
                        static_cast<float>(fade_ms < least_ms ? least_ms : ceiling.longest_fade_ms));
  for (int g = 0; g < kForgettingGroups; ++g) {
    const int word = kForgettingWord + 2 * g;
    const float kept = core::GetF32(words + word);
    if (kept > 1.0f) return check.Refuse(core::Status::kOutOfRange, word, kept, 1.0f);
    if (!check.Positive(word, ceiling.least_forgetting, 1.0f)) return false;
  }
  return true;
}

}  // namespace internal

// Whether it is a table of this model at all. words [count], count: at least kHeaderWords. kWrongSchema; kWrongSize
// (layout version or shapes, or the version has another length). Context: any.
template <int n, int p>
core::Status CheckHeading(const std::uint16_t* words, int count, std::uint32_t schema) {
  using Table = ParameterTable<n, p>;
  if (core::GetU32(words) != schema) return core::Status::kWrongSchema;
  const bool fits = (words[2] == kFirstLayout && count == Table::kFirstWords) ||
                    (words[2] == kLayoutVersion && count == Table::kWords);
  return fits && words[3] == n && words[4] == p ? core::Status::kOk : core::Status::kWrongSize;
}

// Judges the numbers of a table one by one. `words`: a table of this model, by schema, version and shapes.
// bumpless_allowed: whether the board lets a table be adopted while axes are enabled. sealed: whether the table may
// have a seal; it is not judged here. kNotFinite; kOutOfRange (against the layout: not positive, unknown state or
// group, a reserved bit is set); kForbidden (bumpless); kBeyondCeiling. The count of instructions depends on the
// model's shapes, and on the first word that is refused. Context: background.
inline core::Refusal CheckWords(const CeilingView& ceilings, bool bumpless_allowed, const std::uint16_t* words,
                                bool sealed = false) {
  internal::WordCheck check(words);
  if (!internal::HeaderIsAllowed(*ceilings.table, bumpless_allowed, words, check)) return check.refusal();
  for (int j = 0; j < ceilings.joints; ++j) {
    const JointCeiling& c = ceilings.joint[j];
    const int word = WordOfJoint(j);
    if (!check.Positive(word, c.sigma_low_Nm, c.sigma_high_Nm)) return check.refusal();
    if (!check.Positive(word + 2, c.v_min_low_radps, c.v_min_high_radps)) return check.refusal();
    if (!check.Positive(word + 4, 0.0f, c.torque_Nm)) return check.refusal();
    if (!check.Positive(word + 6, c.scale_low, c.scale_high)) return check.refusal();
  }
  for (int k = 0; k < ceilings.parameters; ++k) {
    const ParameterCeiling& c = ceilings.parameter[k];
    const int word = WordOfParameter(ceilings.joints, k);
    if (!check.Float(word, c.low, c.high)) return check.refusal();
    if (!check.NotNegative(word + 2, c.sd)) return check.refusal();
    if (!check.NotNegative(word + 4, c.process_noise)) return check.refusal();
    if (!check.Bits(word + 6, 0x0303)) return check.refusal();  // four states, four groups
    if (!check.Bits(word + 7, 0)) return check.refusal();
  }
  if (words[2] == kFirstLayout) return check.refusal();
  for (int j = 0; j < ceilings.joints; ++j) {
    const int word = WordOfGate(ceilings.joints, ceilings.parameters, j);
    if (core::GetF32(words + word) == 0.0f) continue;
    if (!check.Positive(word, kNarrowestGate, kWidestGate)) return check.refusal();
  }
  const int seal = WordOfGate(ceilings.joints, ceilings.parameters, ceilings.joints);
  for (int k = 0; k < kSealWords; ++k) {
    const bool reserved = k >= kSealReserved && k < kSealReserved + kSealReservedWords;
    if ((reserved || !sealed) && !check.Bits(seal + k, 0)) return check.refusal();
  }
  return check.refusal();
}

}  // namespace armcal::model
