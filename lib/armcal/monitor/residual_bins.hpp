// monitor - how one joint's residual depends on speed, position, load and temperature; knows no model and no register.
#pragma once

#include <cstdint>

#include "armcal/math/elementary.hpp"

namespace armcal::monitor {

// One row: measured minus committed model's torque, and where the joint was. Joint side, SI.
struct ResidualRow {
  float residual_Nm;
  float speed_radps;
  float position_rad;
  float load_Nm;           // the committed model's torque of the links, without joint friction
  float temperature_degC;  // NaN: no sensor
};

// Sums over the rows of a bin. Their quotients by kCount are means, so a host can regress them on any function that is
// linear in them; `load_size` sums |load|.
enum ResidualSum : int { kCount, kResidual, kSquare, kSpeed, kPosition, kLoad, kLoadSize, kTemperature, kResidualSums };
enum ResidualSignal : int { kBySpeed, kByPosition, kByLoad, kByTemperature, kResidualSignals };

// A row is added to one bin of each signal: by the direction of motion (friction turns with it, other torques do not)
// and by the quarter of the range that the signal (speed: its size) has covered since the restart. Ranges are learned,
// so no limits have to be known; a bin whose borders move with them still tells by its means what lies inside.
//
// Two sets of bins: the first kReferenceRows rows show how the model fitted when it was adopted, and stay. Later rows
// go to the recent set, which forgets: one bin a row is faded, in turn, so all fade alike whether visited or not, the
// sums stay bounded, and a row costs the same for ever: some 500 instructions on a Cortex-M4F, an eighth of the
// filter's.
class ResidualBins {
 public:
  static constexpr int kDirections = 2;  // 0: qd < 0, 1: qd > 0
  static constexpr int kQuarters = 4;
  static constexpr int kBins = kResidualSignals * kDirections * kQuarters;
  static constexpr int kValues = kBins * kResidualSums;    // of one set, in the order [signal][direction][quarter][sum]
  static constexpr std::uint32_t kReferenceRows = 16384;   // 131 s of motion at 125 Hz: several cycles of a program
  static constexpr float kKeep = 1.0f - kBins / 16384.0f;  // of a faded bin: the recent set holds 16384 rows or so

  // Forgets everything. Context: background.
  void Restart() {
    for (int k = 0; k < kValues; ++k) reference_[k] = recent_[k] = 0.0f;
    for (int s = 0; s < kResidualSignals; ++s) low_[s] = kLargest, high_[s] = -kLargest;
    rows_ = 0;
    faded_ = 0;
  }

  // use: the row may be judged (joint under control, moving in one direction). False, and no bit has changed: it may
  // not, or a number is not finite; without a temperature only those bins stay. Same cost in every case. Context:
  // background.
  bool Add(const ResidualRow& row, bool use) {
    const bool good =
        use & Usable(row.residual_Nm) & Usable(row.speed_radps) & Usable(row.position_rad) & Usable(row.load_Nm);
    const bool warm = good & Usable(row.temperature_degC);
    const std::uint32_t mask = math::MaskOf(good), warm_mask = math::MaskOf(warm);
    const float residual = math::Masked(row.residual_Nm, mask), speed = math::Masked(row.speed_radps, mask),
                position = math::Masked(row.position_rad, mask), load = math::Masked(row.load_Nm, mask),
                temperature = math::Masked(row.temperature_degC, warm_mask);
    const float value[kResidualSums] = {
        math::Masked(1.0f, mask), residual, residual * residual, speed, position, load, math::Abs(load), temperature};
    float warm_value[kResidualSums];
    for (int k = 0; k < kResidualSums; ++k) warm_value[k] = math::Masked(value[k], warm_mask);

    const bool reference = rows_ < kReferenceRows;
    float* set = (reference ? reference_ : recent_) + static_cast<int>(speed > 0.0f) * kQuarters * kResidualSums;
    AddTo(set, QuarterOf(kBySpeed, math::Abs(speed), good), kBySpeed, value);
    AddTo(set, QuarterOf(kByPosition, position, good), kByPosition, value);
    AddTo(set, QuarterOf(kByLoad, load, good), kByLoad, value);
    AddTo(set, QuarterOf(kByTemperature, temperature, warm), kByTemperature, warm_value);
    const bool fade = good & !reference;
    const float keep = math::Select(fade, kKeep, 1.0f);
    for (int k = 0; k < kResidualSums; ++k) recent_[faded_ * kResidualSums + k] *= keep;
    faded_ = (faded_ + static_cast<int>(fade)) % kBins;
    rows_ += static_cast<std::uint32_t>(good & reference);
    return good;
  }

  const float* reference() const { return reference_; }  // [kValues]
  const float* recent() const { return recent_; }        // [kValues]

 private:
  // Beyond any arm's figures; sums of such squares stay far from float's end. False for NaN.
  static constexpr float kLargest = 1e12f;
  static bool Usable(float x) { return math::Abs(x) < kLargest; }

  // set: of one direction.
  static void AddTo(float* set, int quarter, int s, const float* value) {
    float* bin = set + (s * kDirections * kQuarters + quarter) * kResidualSums;
    for (int k = 0; k < kResidualSums; k += 4) {  // by four: -O2 unrolls nothing
      const float a = bin[k] + value[k], b = bin[k + 1] + value[k + 1];
      const float c = bin[k + 2] + value[k + 2], d = bin[k + 3] + value[k + 3];
      bin[k] = a, bin[k + 1] = b, bin[k + 2] = c, bin[k + 3] = d;
    }
  }

  // Widens the range of a signal that counts; where in it x lies.
  int QuarterOf(int s, float x, bool counts) {
    low_[s] = math::Min(low_[s], math::Select(counts, x, low_[s]));
    high_[s] = math::Max(high_[s], math::Select(counts, x, high_[s]));
    const float width = high_[s] - low_[s], above = kQuarters * (x - low_[s]);
    return static_cast<int>(above > width) + static_cast<int>(above > 2 * width) + static_cast<int>(above > 3 * width);
  }

  float reference_[kValues] = {}, recent_[kValues] = {};
  float low_[kResidualSignals] = {kLargest, kLargest, kLargest, kLargest};  // ranges seen
  float high_[kResidualSignals] = {-kLargest, -kLargest, -kLargest, -kLargest};
  std::uint32_t rows_ = 0;  // in the reference set
  int faded_ = 0;
};

}  // namespace armcal::monitor
