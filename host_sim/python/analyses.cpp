// python - what is computed from logs: identify, evaluate, diagnose. A result is the JSON of the verb as a dict.
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "codegen/src/generator/load.hpp"
#include "codegen/src/io/json.hpp"
#include "host_sim/diagnose/analysis/checked_logs.hpp"
#include "host_sim/diagnose/analysis/diagnosed.hpp"
#include "host_sim/diagnose/analysis/evaluated.hpp"
#include "host_sim/diagnose/analysis/identified.hpp"
#include "host_sim/diagnose/verdict/figures.hpp"
#include "host_sim/python/arrays.hpp"
#include "host_sim/python/bindings.hpp"
#include "host_sim/python/long_call.hpp"

namespace armcal::python {

namespace {

using nlohmann::ordered_json;
using Notes = std::vector<std::string>;

// One Log, or a list of them. Read while this thread holds the interpreter.
std::vector<logs::Log> ReadLogs(nb::handle given, const char* name) {
  const std::string expected = std::string(name) + ": expected a Log, or a list of at least one";
  std::vector<logs::Log> out;
  if (nb::isinstance<logs::Log>(given)) {
    out.push_back(nb::cast<const logs::Log&>(given));
  } else if (nb::isinstance<nb::list>(given) || nb::isinstance<nb::tuple>(given)) {
    for (const nb::handle one : given) {
      if (!nb::isinstance<logs::Log>(one)) throw nb::value_error(expected.c_str());
      out.push_back(nb::cast<const logs::Log&>(one));
    }
  }
  if (out.empty()) throw nb::value_error(expected.c_str());
  return out;
}

logs::Log ReadTest(nb::handle test) {
  if (!nb::isinstance<logs::Log>(test)) throw nb::value_error("test: expected a Log");
  return nb::cast<const logs::Log&>(test);
}

void CheckFrequency(double value_Hz, const char* name) {
  if (!(value_Hz >= 0 && std::isfinite(value_Hz)))
    throw nb::value_error((std::string(name) + ": expected a frequency, or 0 for none").c_str());
}

analysis::Say Into(Notes& notes) {
  return [&notes](const std::string& line) { notes.push_back(line); };
}

void Warn(const Notes& notes) {
  for (const std::string& note : notes)
    if (PyErr_WarnEx(PyExc_UserWarning, note.c_str(), 1) != 0) throw nb::python_error();
}

void AddMotion(const calibration::HeldOutMotion& motion, ordered_json& json, Notes& notes) {
  for (const std::string& line : verdict::MotionText(motion)) notes.push_back(line);
  json["held_out_motion"] = verdict::ToJson(motion);
  json["held_out_text"] = verdict::MotionText(motion);
}

nb::object Identify(const codegen::Model& model, nb::handle train, nb::handle test, double cutoff_Hz, double band_Hz,
                    bool force, nb::handle progress) {
  const std::vector<logs::Log> logs = ReadLogs(train, "train");
  std::vector<logs::Log> held_out;
  if (!test.is_none()) held_out = {ReadTest(test)};
  CheckFrequency(cutoff_Hz, "cutoff_Hz"), CheckFrequency(band_Hz, "band_Hz");
  ordered_json json{{"robot", model.robot().name}};
  Notes notes;
  RunLongCall(progress, [&] {
    const std::vector<calibration::Dataset> data = analysis::CheckedLogs(model, logs, cutoff_Hz, Into(notes));
    for (const std::string& line : analysis::Untold(model, data)) notes.push_back(line);
    io::SetDone(0.3);
    analysis::Identified found(model, data);
    io::SetDone(0.6);
    if (model.robot().has_prior) found.ReadOut(data, force);
    io::SetDone(0.8);
    json.update(found.ToJson());
    if (!held_out.empty()) {
      const calibration::Dataset judged = analysis::CheckedLogs(model, held_out, cutoff_Hz, Into(notes))[0];
      json.update(found.Compare(judged, true, band_Hz).json);
      AddMotion(calibration::CompareMotion(model, found.all, calibration::Pointers(data), judged), json, notes);
    } else {
      json.update(found.Compare(data[0], false, 0).json);
    }
  });
  Warn(notes);
  return ToDict(json);
}

nb::object Evaluate(const codegen::Model& model, nb::handle given_logs,
                    const std::optional<std::filesystem::path>& table, double cutoff_Hz, double band_Hz,
                    nb::handle progress) {
  const std::vector<logs::Log> logs = ReadLogs(given_logs, "logs");
  CheckFrequency(cutoff_Hz, "cutoff_Hz"), CheckFrequency(band_Hz, "band_Hz");
  ordered_json json{{"robot", model.robot().name}};
  Notes notes;
  RunLongCall(progress, [&] {
    const calibration::Given given =
        table ? calibration::GivenByFile(model, table->string()) : calibration::GivenByRobot(model);
    for (const std::string& name : given.missing)
      notes.push_back("no value for " + name + ": the robot file's is taken");
    const std::vector<calibration::Dataset> data = analysis::CheckedLogs(model, logs, cutoff_Hz, Into(notes));
    io::SetDone(0.5);
    json.update(analysis::Evaluate(model, given, data, band_Hz).json);
  });
  Warn(notes);
  return ToDict(json);
}

diagnosis::AtTurns AtTurnsOf(std::optional<bool> turns) {
  if (!turns) return diagnosis::AtTurns::kWhereAveraged;
  return *turns ? diagnosis::AtTurns::kAlways : diagnosis::AtTurns::kNever;
}

nb::object Diagnose(const codegen::Model& model, nb::handle train, nb::handle test, std::optional<bool> turns,
                    double cutoff_Hz, double gain_tolerance, nb::handle progress) {
  const std::vector<logs::Log> logs = ReadLogs(train, "train");
  const logs::Log held_out = ReadTest(test);
  CheckFrequency(cutoff_Hz, "cutoff_Hz");
  if (!(gain_tolerance >= 0 && gain_tolerance <= 0.9))
    throw nb::value_error("gain_tolerance: expected a share from 0 to 0.9");
  ordered_json json;
  Notes notes;
  RunLongCall(progress, [&] {
    codegen::Catalogue catalogue = codegen::LoadCatalogue();
    auto declared = std::make_unique<codegen::Model>(model.robot(), catalogue);
    analysis::Diagnosed run(std::move(declared), std::move(catalogue), logs,
                            {AtTurnsOf(turns), cutoff_Hz, gain_tolerance}, Into(notes));
    for (const std::string& line : analysis::Untold(*run.model, run.train)) notes.push_back(line);
    run.Judge(held_out, model.robot().name, "", Into(notes));
    json = std::move(run.json);
    std::string of = "Train:";
    for (const logs::Log& log : logs) of += " " + log.source;
    json["model_file"] = diagnosis::ModelFile(*run.model, run.catalogue, run.diagnosis->finding(), of).text;
  });
  Warn(notes);
  return ToDict(json);
}

}  // namespace

nb::object ToDict(const ordered_json& json) { return nb::module_::import_("json").attr("loads")(io::JsonText(json)); }

void BindAnalyses(nb::module_& m) {
  const char* const common =
      "\n\nlogs are a Log or a list of them. cutoff_Hz: speed and acceleration are derived below this frequency; 0: "
      "chosen from the noise of each log. A UserWarning says what a user should know of the logs. Other threads run "
      "meanwhile. InputError: a log cannot be one of this arm; the line names the log, the joint and the fault.";
  const char* const watched =
      " progress: a callable that gets the share done, 0 to 1, about ten times a second. What it raises ends the call, "
      "and so does Ctrl-C.";
  const auto text = [common](const char* own, const char* more = "") { return std::string(own) + common + more; };
  m.def("identify", &Identify, nb::arg("robot"), nb::arg("train"), nb::kw_only(), nb::arg("test") = nb::none(),
        nb::arg("cutoff_Hz") = 0.0, nb::arg("band_Hz") = 0.0, nb::arg("force") = false,
        nb::arg("progress") = nb::none(),
        text("Fits the declared model to logs, weighted, with the robot file's prior. Returns what armcal identify "
             "--json writes, as a dict. test: a held-out Log; nothing is fitted to it. force: parameters may move that "
             "the data hardly determine.",
             watched)
            .c_str());
  m.def("evaluate", &Evaluate, nb::arg("robot"), nb::arg("logs"), nb::kw_only(), nb::arg("table") = nb::none(),
        nb::arg("cutoff_Hz") = 0.0, nb::arg("band_Hz") = 0.0, nb::arg("progress") = nb::none(),
        text("The torque error of a given model on logs; nothing is fitted. Returns what armcal evaluate --json "
             "writes, as a dict. table: path of a parameter table, or of a JSON that armcal identify wrote; without "
             "it the robot file's own values.",
             watched)
            .c_str());
  m.def("diagnose", &Diagnose, nb::arg("robot"), nb::arg("train"), nb::arg("test"), nb::kw_only(),
        nb::arg("turns") = nb::none(), nb::arg("cutoff_Hz") = 0.0, nb::arg("gain_tolerance") = 0.0,
        nb::arg("progress") = nb::none(),
        text("Finds what the model lacks on the training logs, and judges it on the held-out log. Returns what armcal "
             "diagnose --json writes, as a dict, and under model_file the robot file with the terms, as text. turns: "
             "look at the rows near turns and at rest, too; None: where the torque shows only slow motion. "
             "gain_tolerance: share by which a joint's torque may be off; 0: the robot file's, or 0.1.",
             watched)
            .c_str());
}

}  // namespace armcal::python
