// estimator - the row gate: refuses rows that differ too much from the earlier rows of their joint.
#pragma once

#include "armcal/math/elementary.hpp"

namespace armcal::estimator {

// A row is refused if it differs from the expected value by more than this many standard deviations, unless the table
// gives the joint another number. The gate learns the standard deviation from the earlier rows of the joint.
inline constexpr float kGateSigma = 5.0f;

// The same gate for every filter. For each joint it compares two numbers of a row with their mean squares over earlier
// rows, both in units of the table's noise:
//   the measured torque minus the torque by the last periodic read-out (here called innovation; in a filter this word
//   means the difference from the estimate just before the row);
//   the difference between the residuals of this row and of the last row that was taken. Wrong parameters change the
//   residual slowly; a wrong sample makes it jump. So this test also works in the first seconds, when the estimates are
//   still poor.
// A row is taken if both numbers are within the limit. The mean squares never count as less than 1 (second number: 2).
// In a mean, one square counts at most kClip times the mean, so single wrong rows hardly widen the gate. The limit is
// wider while a joint has had few rows, and the first row of a joint is always taken. After kPatience refused rows in
// turn the next row is taken, and the mean square becomes at least the square of its innovation. The limit of the
// second number grows with each refused row in turn. Context of every call: background.
template <int n>
class RowGate {
 public:
  void Restart() {
    for (Joint& joint : joint_) joint = Joint{};
  }

  // Returns true if the next row of joint i may update the estimate. residual: measured minus committed model,
  // whitened. innovation: measured minus last periodic read-out, whitened. moves = false: the row is not used for the
  // statistics, and the next row is not compared with it. forward: the direction of the joint; after a change of
  // direction, friction jumps, so the row is not compared with the one before. gate_sigma = 0: every row is taken. The
  // instructions are the same for any data.
  bool Admit(int i, float residual, float innovation, bool moves, bool forward, float gate_sigma) {
    Joint& j = joint_[i];
    const float apart = (residual - j.reference) / (1.0f + j.refused);
    const float change2 = math::Masked(apart * apart, math::MaskOf(j.follows) & math::MaskOf(j.forward == forward));
    const float level2 = innovation * innovation, few = kFew / math::Max(j.rows, 1.0f);
    const float gate2 = gate_sigma * gate_sigma * (1.0f + few * few);  // a mean of few rows is not known well
    const bool first = !(j.rows > 0.0f);
    const bool near = level2 <= gate2 * math::Max(j.level2, 1.0f),
               steady = change2 <= gate2 * math::Max(j.change2, 2.0f);
    const bool inside = near & steady;
    const bool opens = !(j.refused < kPatience);
    const bool taken = inside | first | opens | !(gate_sigma > 0.0f);
    j.rows += math::Select(moves & (j.rows < kMemory), 1.0f, 0.0f);
    const float share = math::Select(moves, 1.0f / math::Max(j.rows, 1.0f), 0.0f);
    j.level2 = math::Max(Mean(j.level2, level2, 1.0f, share, first), math::Select(opens & moves, level2, 0.0f));
    j.change2 = Mean(j.change2, change2, 2.0f, share, first);
    j.reference = math::Select(taken, residual, j.reference);
    j.refused = math::Select(taken | !moves, 0.0f, j.refused + 1.0f);
    j.follows = moves;
    j.forward = forward;
    return taken;
  }

 private:
  static constexpr float kMemory = 1024.0f;  // rows
  static constexpr float kFew = 16.0f;       // rows
  static constexpr float kPatience = 16.0f;  // rows in turn: an eighth of a second
  static constexpr float kClip = 9.0f;

  struct Joint {
    float level2 = 0.0f, change2 = 0.0f;  // means of the squares
    float reference = 0.0f;               // residual of the last row that was taken
    float refused = 0.0f;                 // rows since then
    float rows = 0.0f;
    bool follows = false, forward = false;
  };

  static float Mean(float mean, float square, float least, float share, bool first) {
    const float clipped = math::Min(square, math::Select(first, square, kClip * math::Max(mean, least)));
    const float next = mean + share * (clipped - mean);
    return math::Select(math::IsFinite(next), next, mean);
  }

  Joint joint_[n];
};

}  // namespace armcal::estimator
