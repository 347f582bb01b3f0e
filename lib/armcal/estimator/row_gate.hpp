// estimator - which rows of a sample fit to those before: decided for all rows before any of them is worked in.
#pragma once

#include "armcal/math/elementary.hpp"

namespace armcal::estimator {

// A row is refused if it is further away than this, in standard deviations of what rows of its joint show.
inline constexpr float kGateSigma = 5.0f;

// The same gate for every filter. For each joint it knows two spreads, in units of the table's noise and never below
// it:
//   of the innovation, which is what the last read-out does not explain of a row;
//   of the change, from row to row, of what the committed table does not explain. Wrong parameters make that change
//   slowly, a wrong sample makes it jump. So this also works in the first seconds, when nothing is known of the arm.
// A row must be inside both. Spreads are means of squares, in which a square counts at most kClip times the mean, so
// single wrong rows hardly widen the gate. No arm is locked out: after kPatience refused rows in turn one is taken, and
// its innovation becomes the spread. The limit of the change grows with each refused row in turn. Context: background.
template <int n>
class RowGate {
 public:
  void Restart() {
    for (Joint& joint : joint_) joint = Joint{};
  }

  // The next row of joint i. residual: whitened, of the committed table; innovation: whitened, of the last read-out.
  // False: the row is outside. moves: the row may be judged; if not, it says nothing, and the next one follows none.
  // forward: the joint's direction; where it turns, friction jumps, and the row follows none. gate_sigma = 0: the gate
  // is open. The instructions are the same for any data.
  bool Admit(int i, float residual, float innovation, bool moves, bool forward, float gate_sigma) {
    Joint& j = joint_[i];
    const float apart = (residual - j.reference) / (1.0f + j.refused);
    const float change2 = math::Masked(apart * apart, math::MaskOf(j.follows) & math::MaskOf(j.forward == forward));
    const float level2 = innovation * innovation, few = kFew / math::Max(j.rows, 1.0f);
    const float gate2 = gate_sigma * gate_sigma * (1.0f + few * few);  // a spread of few rows is not known well
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
