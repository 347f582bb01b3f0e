// analysis - makes an excitation trajectory: what armcal excite finds, from a robot to its JSON.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "codegen/src/generator/model.hpp"
#include "host_sim/identify/collision/clearance.hpp"
#include "host_sim/identify/excitation/compose.hpp"
#include "host_sim/identify/excitation/optimise.hpp"
#include "host_sim/identify/excitation/target.hpp"

namespace armcal::analysis {

struct ExciteOptions {
  std::string purpose = "train", curve = "fourier", criterion = "condition", search = "gradient";
  std::vector<std::string> separate;  // effects to tell apart; then the criterion is not used
  std::string from;                   // path of a verdict that found some of these; empty: none
  std::string cell;                   // path; empty: none
  std::uint64_t seed = 1;
  int periods = 0, harmonics = 5, starts = 0;  // periods 0: by purpose; starts 0: as many as the time allows
  double seconds = 20, period_s = 10, step_s = 0.004, margin = 0.05, clearance_m = 0.02;
  bool no_slow = false, clearance_asked = false;
};

// What these options may be.
inline const std::vector<std::string> kPurposes{"train", "test"}, kCurves{"fourier", "sine", "polynomial", "spline"},
    kCriteria{"condition", "d-optimal", "friction"}, kSearches{"gradient", "genetic"};
template <class Number>
struct Range {
  Number lowest, highest;
};
inline constexpr Range<int> kPeriods{1, 100}, kHarmonics{1, 20}, kStarts{1, 1000000};
inline constexpr Range<double> kSeconds{0, 1e6}, kPeriod_s{1, 1000}, kStep_s{0.0005, 0.05}, kMargin{0.01, 0.9},
    kClearance_m{0, 1};

struct Excited {
  // Called from any thread, one at a time, after each search: how many there were, and the best figure with its name.
  using Tell = std::function<void(int searches, const char* name, double figure)>;
  // The model outlives this. stop: once it is set, the best motion so far is taken. InputError: no motion within the
  // limits, no such effect, or a collision check was asked for that is not possible.
  Excited(const codegen::Model& model, const ExciteOptions& given, const std::atomic<bool>* stop = nullptr,
          const Tell& tell = {});

  nlohmann::ordered_json ToJson() const;
  // The trajectory at the points of its file, with the speed and acceleration of the spline that every player follows.
  codegen::Signals Motion() const;

  // A parameter that the motion was to show, after one period.
  struct Accuracy {
    std::string parameter;
    double sd = 0, separation = 0;
  };

  ExciteOptions options;
  excitation::Observation observation, without_rotors;
  excitation::Target target;
  std::string unchecked;  // why collisions are not checked
  std::optional<collision::Clearance> clearance;
  // Distances that left no room for a motion; each of the next ones is half as large. Empty if a distance was asked
  // for, or if there is a cell.
  std::vector<double> too_far_m;
  excitation::Optimum best;
  bool interrupted = false;
  excitation::Composed composed;
  double condition = 0, whole = 0, rigid_only = 0;  // cond(K): of a period, of all, of a period without the rotors
  std::vector<Accuracy> accuracy;

 private:
  // False: there is none at this distance, and a smaller one may be tried.
  bool FindMotion(const std::atomic<bool>* stop, const Tell& tell);
  nlohmann::ordered_json ClearanceJson() const;
};

}  // namespace armcal::analysis
