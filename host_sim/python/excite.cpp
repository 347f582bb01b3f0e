// python - makes an excitation trajectory. The result is the JSON of the verb as a dict, and the motion as arrays.
#include <fmt/format.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "codegen/src/io/atomic_write.hpp"
#include "host_sim/data/trajectory/trajectory.hpp"
#include "host_sim/diagnose/analysis/excited.hpp"
#include "host_sim/python/arrays.hpp"
#include "host_sim/python/bindings.hpp"
#include "host_sim/python/long_call.hpp"

namespace armcal::python {

namespace {

using Path = std::optional<std::filesystem::path>;

void CheckWord(const std::string& word, const char* name, const std::vector<std::string>& words) {
  if (std::find(words.begin(), words.end(), word) == words.end())
    throw nb::value_error(fmt::format("{}: expected one of {}", name, fmt::join(words, ", ")).c_str());
}

template <class Number>
void CheckRange(Number value, const char* name, const analysis::Range<Number>& range) {
  if (!(value >= range.lowest && value <= range.highest))
    throw nb::value_error(
        fmt::format("{}: expected a number from {:.7g} to {:.7g}", name, 1.0 * range.lowest, 1.0 * range.highest)
            .c_str());
}

void Check(const analysis::ExciteOptions& o) {
  CheckWord(o.purpose, "purpose", analysis::kPurposes);
  CheckWord(o.curve, "curve", analysis::kCurves);
  CheckWord(o.criterion, "criterion", analysis::kCriteria);
  CheckWord(o.search, "search", analysis::kSearches);
  if (!o.separate.empty() && o.criterion != analysis::ExciteOptions().criterion)
    throw nb::value_error("separate: expected no criterion beside it");
  if (!o.from.empty() && o.separate.empty()) throw nb::value_error("from_: expected separate beside it");
  CheckRange(o.period_s, "period", analysis::kPeriod_s);
  CheckRange(o.harmonics, "harmonics", analysis::kHarmonics);
  CheckRange(o.seconds, "seconds", analysis::kSeconds);
  CheckRange(o.step_s, "step", analysis::kStep_s);
  CheckRange(o.margin, "margin", analysis::kMargin);
  CheckRange(o.clearance_m, "clearance", analysis::kClearance_m);
}

nb::object Excite(const codegen::Model& model, const Path& out, const std::string& purpose, std::int64_t seed,
                  std::optional<int> periods, double period_s, const std::string& curve, const std::string& criterion,
                  const std::vector<std::string>& separate, const Path& from, const std::string& search, int harmonics,
                  double seconds, std::optional<int> starts, double step_s, double margin, const Path& cell,
                  std::optional<double> clearance_m, bool no_slow, nb::handle progress) {
  analysis::ExciteOptions o;
  o.purpose = purpose, o.curve = curve, o.criterion = criterion, o.search = search, o.separate = separate;
  o.from = from.value_or("").string(), o.cell = cell.value_or("").string();
  if (seed < 0) throw nb::value_error("seed: expected an integer not below 0");
  o.seed = static_cast<std::uint64_t>(seed);
  if (periods) CheckRange(*periods, "periods", analysis::kPeriods);
  if (starts) CheckRange(*starts, "starts", analysis::kStarts);
  o.periods = periods.value_or(0), o.starts = starts.value_or(0), o.harmonics = harmonics;
  o.seconds = seconds, o.period_s = period_s, o.step_s = step_s, o.margin = margin, o.no_slow = no_slow;
  o.clearance_asked = clearance_m.has_value();
  o.clearance_m = clearance_m.value_or(o.clearance_m);
  Check(o);
  if (out) io::CheckWritable(*out);
  nlohmann::ordered_json json{{"robot", model.robot().name}};
  codegen::Signals motion;
  RunLongCall(progress, [&] {
    const analysis::Excited found(model, o);
    motion = found.Motion();
    if (out) trajectory::WriteTrajectory(*out, found.composed.trajectory);
    json.update(found.ToJson());
  });
  nb::object result = ToDict(json);
  result["time"] = ToArray(Eigen::VectorXd(motion.t));
  result["position"] = ToArray(motion.q);
  result["velocity"] = ToArray(motion.qd);
  result["acceleration"] = ToArray(motion.qdd);
  return result;
}

}  // namespace

void BindExcite(nb::module_& m) {
  const analysis::ExciteOptions d;
  m.def("excite", &Excite, nb::arg("robot"), nb::kw_only(), nb::arg("out") = nb::none(), nb::arg("purpose") = d.purpose,
        nb::arg("seed") = d.seed, nb::arg("periods") = nb::none(), nb::arg("period") = d.period_s,
        nb::arg("curve") = d.curve, nb::arg("criterion") = d.criterion, nb::arg("separate") = d.separate,
        nb::arg("from_") = nb::none(), nb::arg("search") = d.search, nb::arg("harmonics") = d.harmonics,
        nb::arg("seconds") = d.seconds, nb::arg("starts") = nb::none(), nb::arg("step") = d.step_s,
        nb::arg("margin") = d.margin, nb::arg("cell") = nb::none(), nb::arg("clearance") = nb::none(),
        nb::arg("no_slow") = false, nb::arg("progress") = nb::none(),
        "Searches a trajectory that shows the parameters, within the joints' limits, and off the arm itself and its "
        "cell where their shapes are known.\n\n"
        "Returns a dict. time: (samples,), s. position, velocity, acceleration: (samples, joints) float64; rad, rad/s, "
        "rad/s^2 (m, m/s, m/s^2 of a prismatic joint), along the spline through the positions. Beside them what "
        "armcal excite --json writes: cond_period and cond_whole (condition numbers), peaks, sections, collisions "
        "(nearest distance in m, pairs that are not checked) ...\n"
        "The arguments are the options of armcal excite. out: a trajectory file to write. seconds: time for the "
        "search; starts: searches at most; with time enough the result follows from the seed. period, step: s. "
        "margin: share of every limit that is kept free. clearance: m. cell, from_: paths.\n"
        "progress: a callable that gets the share done, 0 to 1, about ten times a second. What it raises ends the "
        "call, and so does Ctrl-C. Other threads run meanwhile.\n"
        "ValueError names the argument. InputError: no such motion was found, an effect or a file is not there ...");
}

}  // namespace armcal::python
