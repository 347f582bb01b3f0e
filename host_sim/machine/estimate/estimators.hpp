// estimate - what the tool and the firmware's estimators that were compiled for a model know of each other.
//
// Only plain types pass between them, as with the simulated drive's firmware: the estimators are linked in, or they are
// a shared object that the tool loads. Whoever changes this file changes kEstimatorsInterface.
#pragma once

#include <cstdint>
#include <string>

namespace armcal::estimate {

inline constexpr int kEstimatorsInterface = 1;

// What a filter tells of the samples so far. Pointers into the estimators.
struct FilterResult {
  const float *value, *sd;                        // [columns]
  const std::uint32_t *rows_used, *rows_outside;  // [joints]; outside: in motion and refused by the row gate
  std::uint32_t samples;
  bool inconsistent;  // the torque holds more than the model and its stated noise
};

// The most probable bodies that can exist. Pointers into the estimators.
struct BodiesResult {
  const double *value, *sd;  // [bodies]; the sd of mass, centre and inertia about the centre
  bool converged;
  bool prior_too_narrow;  // the parameters have moved further than the table's deviations allow
};

// Arrays [joints], as model::Sample has them.
struct SampleView {
  std::uint32_t tick;
  const float *q, *qd, *qdd, *tau, *temperature_degC;
  const std::uint8_t* flags;
};

// Both filters of the firmware on one stream of samples, and the bodies that the Kalman filter's result stands for.
class Estimators {
 public:
  virtual ~Estimators() = default;

  virtual std::uint32_t schema() const = 0;
  virtual int joints() const = 0;
  virtual int columns() const = 0;
  virtual int bodies() const = 0;
  // Of body parameter k, from 0: its name, and its mean in the table.
  virtual const char* body_name(int k) const = 0;
  virtual double body_in_table(int k) const = 0;

  // words: [count], a table as the wire has it. Empty, or what is wrong. The others want this first.
  virtual std::string Start(const std::uint16_t* words, int count) = 0;
  virtual void Add(const SampleView& sample) = 0;
  // A record of the drive's sample trace. Returns how many rows changed the estimate of the drive's filter A.
  virtual int AddRecord(std::uint32_t tick, const std::uint16_t* record) = 0;
  // Reads out. Empty, or what is wrong. The results below want this first.
  virtual std::string Finish() = 0;
  virtual FilterResult forgetting() const = 0;
  virtual FilterResult kalman() const = 0;
  virtual BodiesResult physical() const = 0;
};

}  // namespace armcal::estimate

// The estimators of the model that this was compiled for; `delete` ends them. nullptr: another interface.
extern "C" armcal::estimate::Estimators* MakeArmcalEstimators(int interface);
