// generator - an effect record as its file says it.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "codegen/src/generator/quantity.hpp"

namespace armcal::codegen {

// Words of a record. Word() gives each as the file has it.
enum class EffectClass { kStatic, kStateful, kRunState, kSensor };
enum class EffectScope { kJoint, kPair, kArm, kBody };
enum class SearchWay { kLinear, kProfile, kSpectral, kSpline, kOnset, kWindow, kShared, kNone };
enum class SensorAct { kNone, kGain, kDelay, kCensor };  // kNone: no sensor record
std::string Word(EffectClass value);
std::string Word(EffectScope value);

struct LinearParameter {
  std::string name, unit;
  std::map<std::string, std::string> rows;  // row ("j", "k", "all") -> expression
  std::vector<std::string> index;           // array parameter: the values its index [i] takes; empty: a scalar
  std::string sd;                           // default prior standard deviation, expression over robot constants
  double amplitude = 0;                     // when fixed
  bool fixed_amplitude = false;
  double lower, upper;       // bounds; +-infinity where none
  double process_noise = 0;  // variance per second, relative to sd^2
};

struct NonlinearParameter {
  std::string name, unit;
  std::string lower, upper, initial;  // expressions over robot constants
  bool logarithmic = false;
};

// What an effect carries from sample to sample.
struct RecordState {
  std::string name, unit;
  std::string initial, step;  // expressions; in `step` the own name is the old value, the inputs are the new sample's
  std::string settled;        // above zero once the start no longer matters; empty: from the first sample on
};

// A sensor record's exact form: what the measurement underwent, and which parameter says how much.
struct Apply {
  SensorAct how = SensorAct::kNone;
  std::string by;
};

struct Search {
  SearchWay how = SearchWay::kLinear;
  std::string signal;     // spectral, spline: over which signal
  std::string second;     // spline: over this one, too
  int grid = 10;          // profile: points per nonlinear parameter
  double minimum_s = 0;   // onset: shortest stretch
  std::string after;      // a simpler record: tried only where that one finds something on the same joints
  bool at_turns = false;  // tried on the rows near turns and at rest, too, before all others
};

struct EffectRecord {
  std::string name, title, source, path, text;
  std::string kind;  // what a verdict calls it: its name, or "unknown" for a curve that names no cause
  EffectClass effect_class = EffectClass::kStatic;
  EffectScope scope = EffectScope::kJoint;
  std::string place;  // what a report calls the joints of an effect of the arm or a body: "all", "base", "flange"
  std::set<Quantity> inputs;
  std::vector<std::string> signals, let, confusable_with, needs;
  std::vector<LinearParameter> linear;
  std::vector<NonlinearParameter> nonlinear;
  std::vector<RecordState> state;
  Apply apply;                         // class sensor only
  std::string replaces;                // the friction law whose place it takes on its joint
  std::vector<std::string> adds_base;  // body parameters that it makes visible
  bool depends_on_estimate = false;
  bool on_target = true;       // a model can hold it: static and stateful ones unless the file says no
  std::string remedy;          // what to do about one that no model holds
  std::string separate;        // the motion or log that tells it from those it is confused with
  bool friction_law = false;   // the robot's own friction, not a candidate
  double generic_penalty = 0;  // added to the score a flexible term must beat
  Search search;

  // Another frequency, or another part of a signal's range, is another use on the same joints.
  bool repeats() const {
    return search.how == SearchWay::kSpectral || (search.how == SearchWay::kSpline && generic_penalty > 0);
  }
};

// Throws io::InputError: file, key, what was expected.
EffectRecord ReadEffect(const std::filesystem::path& path);

// All *.toml of a folder by name, in alphabetical order.
std::map<std::string, EffectRecord> ReadCatalogue(const std::filesystem::path& folder);

// InputError, which begins with `where`: there is no such record.
const EffectRecord& FindRecord(const std::map<std::string, EffectRecord>& catalogue, const std::string& where,
                               const std::string& name);

}  // namespace armcal::codegen
