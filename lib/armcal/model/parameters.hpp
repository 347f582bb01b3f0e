// model - the parameter table as numbers, and its byte layout.
//
// The byte layout is the same on the wire (Modbus registers), in storage and in the files of the PC: big-endian 16-bit
// words, and 32-bit values with the high word first. Layout version 2, in 16-bit words:
//   header  (16 words): schema u32, layout version u16, joints u16, parameters u16, flags u16 (bit 0: bumpless),
//                       blend_ms u32, forgetting[4] f32 (per estimator sample, group 0..3, in (0, 1])
//   joint   (8 words each): sigma f32, v_min f32, torque_limit f32, torque_scale f32
//   parameter (8 words each): mean f32, sd f32, process_noise f32, state u8 << 8 | group u8, 0
//   gate    (2 words a joint): gate_sigma f32, 0: the compiled default
//   seal    (40 words): which drive the table is for, a counter and a signature; 0: it is not signed
// Version 1 ends before the gate and is otherwise the same. A table of version 1 means what the compiled defaults say.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "armcal/core/status.hpp"
#include "armcal/core/words.hpp"
#include "armcal/model/contract.hpp"

namespace armcal::model {

inline constexpr std::uint16_t kFirstLayout = 1, kLayoutVersion = 2;  // both are read
inline constexpr int kForgettingGroups = 4;                           // 0 bodies, 1 friction, 2 effects, 3 free
inline constexpr std::uint16_t kFlagBumpless = 1;
inline constexpr int kHeaderWords = 16;
inline constexpr int kJointWords = 8;
inline constexpr int kParameterWords = 8;
inline constexpr int kGateWords = 2;
inline constexpr int kSealWords = 40;  // the last words of every table of version 2; no part of the numbers
inline constexpr int kSealReserved = 5, kSealReservedWords = 3;  // these of them are always 0

struct JointEntry {
  float sigma_Nm;
  float v_min_radps;
  float torque_limit_Nm;
  float torque_scale;       // measured torque = torque_scale x nominal torque constant x current
  float gate_sigma = 0.0f;  // limit of the row gate in standard deviations; 0: the compiled default
};

struct ParameterEntry {
  float mean;           // committed value, and where the filters start
  float sd;             // prior standard deviation; bodies in (m, c, I about the centre, rotor)
  float process_noise;  // variance per estimator sample
  ParameterState state;
  std::uint8_t group;
};

// Shapes: n joints, p parameters.
template <int n, int p>
struct ParameterTable {
  static constexpr int kFirstWords = kHeaderWords + n * kJointWords + p * kParameterWords;  // of layout version 1
  static constexpr int kWords = kFirstWords + n * kGateWords + kSealWords;

  std::uint32_t schema = 0;
  std::uint16_t flags = 0;
  std::uint32_t blend_ms = 0;
  float forgetting[kForgettingGroups] = {1, 1, 1, 1};
  JointEntry joint[n] = {};
  ParameterEntry parameter[p] = {};
};

// w: [ParameterTable<n,p>::kWords], or [kFirstWords] for kFirstLayout; native 16-bit values (the wire and the store put
// the high byte first). Context: any.
template <int n, int p>
void Encode(const ParameterTable<n, p>& t, std::uint16_t* w, std::uint16_t layout = kLayoutVersion) {
  core::PutU32(w, t.schema);
  w[2] = layout;
  w[3] = n;
  w[4] = p;
  w[5] = t.flags;
  core::PutU32(w + 6, t.blend_ms);
  for (int g = 0; g < kForgettingGroups; ++g) core::PutF32(w + 8 + 2 * g, t.forgetting[g]);
  w += kHeaderWords;
  for (int j = 0; j < n; ++j, w += kJointWords) {
    core::PutF32(w, t.joint[j].sigma_Nm);
    core::PutF32(w + 2, t.joint[j].v_min_radps);
    core::PutF32(w + 4, t.joint[j].torque_limit_Nm);
    core::PutF32(w + 6, t.joint[j].torque_scale);
  }
  for (int k = 0; k < p; ++k, w += kParameterWords) {
    core::PutF32(w, t.parameter[k].mean);
    core::PutF32(w + 2, t.parameter[k].sd);
    core::PutF32(w + 4, t.parameter[k].process_noise);
    w[6] = static_cast<std::uint16_t>((static_cast<unsigned>(t.parameter[k].state) << 8) | t.parameter[k].group);
    w[7] = 0;
  }
  if (layout == kFirstLayout) return;
  for (int j = 0; j < n; ++j, w += kGateWords) core::PutF32(w, t.joint[j].gate_sigma);
  for (int k = 0; k < kSealWords; ++k) w[k] = 0;
}

// w: as many words as a table of its layout version has. kWrongSchema; kWrongSize (layout version, joints or parameters
// differ); kNotFinite; kOutOfRange (sigma, v_min, limit, scale or forgetting is not positive, forgetting is above 1,
// sd, noise or gate is negative, state or group is unknown). On refusal `t` is unchanged. This does not check the
// reserved bits and words (see CheckWords), nor whether bodies can exist (see physical::IsPhysical). Context:
// background.
template <int n, int p>
core::Status Decode(const std::uint16_t* w, std::uint32_t schema, ParameterTable<n, p>& t) {
  using core::Status;
  if (core::GetU32(w) != schema) return Status::kWrongSchema;
  if (w[2] < kFirstLayout || w[2] > kLayoutVersion || w[3] != n || w[4] != p) return Status::kWrongSize;
  const std::uint16_t* jw = w + kHeaderWords;
  const std::uint16_t* pw = jw + n * kJointWords;
  const std::uint16_t* gates = w[2] == kFirstLayout ? nullptr : pw + p * kParameterWords;
  for (int g = 0; g < kForgettingGroups; ++g) {
    const float f = core::GetF32(w + 8 + 2 * g);
    if (!std::isfinite(f)) return Status::kNotFinite;
    if (!(f > 0.0f && f <= 1.0f)) return Status::kOutOfRange;
  }
  for (int k = 0; k < 4 * n; ++k) {
    const float v = core::GetF32(jw + 2 * k);
    if (!std::isfinite(v)) return Status::kNotFinite;
    if (!(v > 0.0f)) return Status::kOutOfRange;
  }
  for (int k = 0; k < p; ++k) {
    const std::uint16_t* e = pw + k * kParameterWords;
    const float mean = core::GetF32(e), sd = core::GetF32(e + 2), noise = core::GetF32(e + 4);
    if (!std::isfinite(mean) || !std::isfinite(sd) || !std::isfinite(noise)) return Status::kNotFinite;
    if (sd < 0.0f || noise < 0.0f || (e[6] >> 8) > 3 || (e[6] & 0xFF) >= kForgettingGroups) return Status::kOutOfRange;
  }
  for (int j = 0; j < n && gates != nullptr; ++j) {
    const float gate = core::GetF32(gates + j * kGateWords);
    if (!std::isfinite(gate)) return Status::kNotFinite;
    if (gate < 0.0f) return Status::kOutOfRange;
  }
  t.schema = schema;
  t.flags = w[5];
  t.blend_ms = core::GetU32(w + 6);
  for (int g = 0; g < kForgettingGroups; ++g) t.forgetting[g] = core::GetF32(w + 8 + 2 * g);
  for (int j = 0; j < n; ++j, jw += kJointWords)
    t.joint[j] = {core::GetF32(jw), core::GetF32(jw + 2), core::GetF32(jw + 4), core::GetF32(jw + 6),
                  gates == nullptr ? 0.0f : core::GetF32(gates + j * kGateWords)};
  for (int k = 0; k < p; ++k, pw += kParameterWords)
    t.parameter[k] = {core::GetF32(pw), core::GetF32(pw + 2), core::GetF32(pw + 4),
                      static_cast<ParameterState>(pw[6] >> 8), static_cast<std::uint8_t>(pw[6] & 0xFF)};
  return Status::kOk;
}

}  // namespace armcal::model
