// model - checks on a grid of speeds, temperatures and loads that the friction of a table brakes and is not too large.
//
// A joint's friction may be a sum of many columns, and a single coefficient may be negative: friction that rises less
// than in proportion to speed, that falls with temperature, or that differs between the directions. What counts is the
// sum. It feeds energy where its torque times the speed is negative.
#pragma once

#include <cstdint>

#include "armcal/core/status.hpp"
#include "armcal/math/elementary.hpp"
#include "armcal/model/ceilings.hpp"
#include "armcal/model/evaluate.hpp"

namespace armcal::model {

// Bits of a model's kFrictionReads: what its friction columns depend on besides the joint's own speed.
inline constexpr unsigned kReadsPose = 1, kReadsTemperature = 2, kReadsHistory = 4;

// The grid. Speeds are shares of the joint's limit, poses are shares of its range. At each point all joints move. One
// evaluation then checks all joints, because a friction column acts on its own joint only. The poses are there because
// friction may depend on load and on the joint's own position.
inline constexpr float kGridSpeed[] = {0.003f, 0.01f, 0.03f, 0.1f, 0.2f, 0.4f, 0.7f, 1.0f};
inline constexpr float kGridPose[] = {0.5f, 0.12f, 0.88f, 0.31f};
inline constexpr float kGridTemperature[] = {0.5f, 0.0f, 1.0f};  // shares of the range
inline constexpr int kGridSpeeds = 8, kGridPoses = 4, kGridTemperatures = 3;
// Where a column reads the pose, a sweep follows, at the lowest and the highest speed. Each joint visits each of
// kSweepPoses equal parts of its range once, at a scattered place, so that no ripple is zero at all of them. A table
// also says where a spline of friction begins and ends, as two neighbouring nonlinear parameters. So kBetween positions
// between each two neighbours follow.
inline constexpr int kSweepPoses = 53, kBetween = 8;  // a prime: each joint takes the parts in another order
inline constexpr float kSweepSpeed[] = {kGridSpeed[0], kGridSpeed[kGridSpeeds - 1]};
inline constexpr int kSweepSpeeds = 2;
// Friction with memory gets this time at each speed, so that it slides.
inline constexpr float kGridStep_s = 10.0f;

namespace internal {

constexpr int Temperatures(unsigned reads) { return (reads & kReadsTemperature) != 0 ? kGridTemperatures : 1; }
constexpr int PlainPoints(unsigned reads) {
  return 2 * kGridSpeeds * ((reads & kReadsPose) != 0 ? kGridPoses : 1) * Temperatures(reads);
}

// The share of a joint's range at one pose of the sweep.
constexpr float SweepShare(int pose, int joint) {
  std::uint32_t scatter = static_cast<std::uint32_t>(pose * 64 + joint + 1) * 0x9E3779B1u;
  scatter = (scatter ^ scatter >> 15) * 0x85EBCA77u;
  const int part = pose * (2 * joint + 1) % kSweepPoses;
  return (static_cast<float>(part) + static_cast<float>(scatter >> 8) * 0x1p-24f) / static_cast<float>(kSweepPoses);
}

}  // namespace internal

// reads: the model's kFrictionReads, nonlinear: its kNonlinear.
constexpr int GridPoints(unsigned reads, int nonlinear) {
  const int poses = kSweepPoses + (nonlinear > 1 ? (nonlinear - 1) * kBetween : 0);
  const int sweep = (reads & kReadsPose) != 0 ? 2 * kSweepSpeeds * poses * internal::Temperatures(reads) : 0;
  return internal::PlainPoints(reads) + sweep;
}

// Fills in the state of the joints at one point of the grid: q in rad (m), qd in rad/s (m/s), temp in deg C. Shapes: q,
// qd, temp [joints]; eta, the table's nonlinear parameters [nonlinear]. point: from 0, below GridPoints(reads,
// nonlinear).
template <class T, class Eta>
void GridState(const CeilingView& ceilings, unsigned reads, int point, const Eta* eta, T* q, T* qd, T* temp) {
  const bool sweep = point >= internal::PlainPoints(reads);
  if (sweep) point -= internal::PlainPoints(reads);
  const bool backward = point % 2 != 0;
  point /= 2;
  const int speeds = sweep ? kSweepSpeeds : kGridSpeeds;
  const float speed = sweep ? kSweepSpeed[point % speeds] : kGridSpeed[point % speeds];
  point /= speeds;
  const int temperature = point % internal::Temperatures(reads), pose = point / internal::Temperatures(reads);
  const TableCeiling& t = *ceilings.table;
  const float degC = t.coldest_degC + kGridTemperature[temperature] * (t.warmest_degC - t.coldest_degC);
  for (int i = 0; i < ceilings.joints; ++i) {
    const JointCeiling& c = ceilings.joint[i];
    const float low = c.position_low_rad, high = c.position_high_rad;
    float position;
    if (sweep && pose >= kSweepPoses) {
      const int at = pose - kSweepPoses, k = at / kBetween;
      const float from = static_cast<float>(eta[k]), to = static_cast<float>(eta[k + 1]);
      const float share = (static_cast<float>(at % kBetween) + 0.5f) / static_cast<float>(kBetween);
      const float between = from + share * (to - from);
      position = between < low ? low : between > high ? high : between;
    } else {
      const float share = sweep ? internal::SweepShare(pose, i) : kGridPose[(pose + i) % kGridPoses];
      position = low + share * (high - low);
    }
    q[i] = static_cast<T>(position);
    const float size = speed * c.speed_radps;
    qd[i] = static_cast<T>(backward ? -size : size);
    temp[i] = static_cast<T>(degC);
  }
}

// Compares the friction of one joint at one point with its ceilings. braking_Nm: the torque, positive if it is against
// the motion. kOk; kNotFinite; kFeedsEnergy; kBeyondCeiling.
inline core::Status JudgeFriction(const JointCeiling& c, float braking_Nm) {
  if (!math::IsFinite(braking_Nm)) return core::Status::kNotFinite;
  if (braking_Nm < -c.feed_Nm) return core::Status::kFeedsEnergy;
  return braking_Nm > c.friction_Nm ? core::Status::kBeyondCeiling : core::Status::kOk;
}

// Checks the friction at one point of the grid. `committed` comes from BuildAdoptedTable. kFeedsEnergy; kBeyondCeiling
// (a joint's friction is higher than its ceiling); kNotFinite. The refusal's word is that of the joint's friction
// column with the largest torque. Evaluates the regressor once, or twice if friction has memory. `memory` and `rows`
// are work space. Before the first point set memory.running to false. `rows` starts as zeros and is used for this model
// only. Context: background.
template <class Model>
core::Refusal CheckFrictionAt(int point, const Committed<Model>& committed, const CeilingView& ceilings,
                              Memory<Model>& memory, Rows<Model>& rows) {
  constexpr int n = Model::kJoints;
  ModelInput<float, n> x = {};
  x.dt = kGridStep_s;
  GridState(ceilings, Model::kFrictionReads, point, committed.eta, x.q, x.qd, x.temp);
  if constexpr ((Model::kFrictionReads & kReadsHistory) != 0) {
    for (int i = 0; i < n; ++i) x.q[i] -= kGridStep_s * x.qd[i];
    EvaluateRows(committed, x, memory, rows);
    for (int i = 0; i < n; ++i) x.q[i] += kGridStep_s * x.qd[i];
  }
  EvaluateRows(committed, x, memory, rows);
  for (int i = 0; i < n; ++i) {
    float sum = 0.0f, greatest = -1.0f;
    int column = Model::kFrontBegin[i];
    for (int c = Model::kFrontBegin[i]; c < Model::kFrontBegin[i + 1]; ++c) {
      const bool counts = Model::kFriction[c] && committed.p[c] != 0.0f;
      const float part = math::Masked(committed.p[c] * rows.front[c], math::MaskOf(counts));
      sum += part;
      if (math::Abs(part) > greatest) greatest = math::Abs(part), column = c;
    }
    const float braking_Nm = x.qd[i] < 0.0f ? -sum : sum;
    const core::Status judged = JudgeFriction(ceilings.joint[i], braking_Nm);
    if (core::IsOk(judged)) continue;
    const JointCeiling& c = ceilings.joint[i];
    return {judged, WordOfParameter(n, Model::kBodyParameters + column), braking_Nm,
            judged == core::Status::kFeedsEnergy ? -c.feed_Nm : c.friction_Nm};
  }
  return {};
}

// The same at all points of the grid, up to the first refusal.
template <class Model>
core::Refusal CheckFriction(const Committed<Model>& committed, const CeilingView& ceilings, Memory<Model>& memory,
                            Rows<Model>& rows) {
  core::Refusal refusal;
  memory.running = false;
  for (int point = 0; point < GridPoints(Model::kFrictionReads, Model::kNonlinear) && core::IsOk(refusal.status);
       ++point)
    refusal = CheckFrictionAt(point, committed, ceilings, memory, rows);
  return refusal;
}

}  // namespace armcal::model
