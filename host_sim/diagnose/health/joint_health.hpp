// health - tells whether a joint still fits its committed model, what its change looks like, and since when.
#pragma once

#include <optional>
#include <vector>

#include "host_sim/client/residual_reader.hpp"
#include "host_sim/diagnose/health/shapes.hpp"

namespace armcal::health {

enum class Verdict {
  kFits,          // as it did when the table was adopted
  kNoLongerFits,  // the residual has grown since
  kNeverFitted,   // the residual was large from the start
  kTooEarly,      // the joint has moved too little since the adoption
};

// Seconds since the adoption.
struct Onset {
  double at_s = 0;
  double earliest_s = 0, latest_s = 0;  // the two slices at the step
};

struct JointHealth {
  int joint = 0;
  Verdict verdict = Verdict::kTooEarly;
  Explanation looks_like;      // without terms: cannot be told
  std::optional<Onset> onset;  // of kNoLongerFits, if the history shows it
  double elapsed_s = 0;        // since the adoption
  double rms_then_Nm = 0, rms_now_Nm = 0, sigma_Nm = 0;
  double rows = 0;          // judged: first and latest
  double missing_rows = 0;  // of kTooEarly: until there is an answer
};

// A change whose torque has an RMS below this share of one row's torque noise is not reported.
inline constexpr double kSmallestInSigma = 0.4;
// A model whose residual exceeds this multiple of the torque noise from the start never fitted.
inline constexpr double kNeverInSigma = 2.0;
// Latest rows below which nothing is said: 16 s of motion at 125 Hz.
inline constexpr double kFewestLatestRows = 2048;
// The firmware keeps so many rows after an adoption as the reference, and about so many latest ones.
inline constexpr double kReferenceRows = 16384, kMemory = 16384;

// The step of the mean square that is most likely under Gaussian residuals. Nothing: no slice, or the residual did not
// grow.
std::optional<Onset> FindOnset(const std::vector<client::ResidualSlice>& slices, double elapsed_s);

JointHealth Judge(const client::JointResiduals& joint);

// Joints, counted from 1, that may no longer fit for one common reason, such as another payload or a tilted base. Their
// changes look like gain, offset or torque by position, or cannot be told, and may have begun at the same time. Empty
// unless there are at least two.
std::vector<int> ChangedTogether(const std::vector<JointHealth>& joints);

}  // namespace armcal::health
