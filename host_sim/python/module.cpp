// python - the module armcal._core: a robot's model and what is computed with it.
#include <nanobind/nanobind.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <filesystem>
#include <string>
#include <vector>

#include "codegen/src/generator/load.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/prior.hpp"
#include "host_sim/python/arrays.hpp"
#include "host_sim/python/bindings.hpp"
#include "host_sim/python/long_call.hpp"

namespace armcal::python {
namespace {

std::vector<std::string> ColumnNames(const codegen::Model& model) {
  std::vector<std::string> names;
  for (int c = 0; c < model.columns(); ++c) names.push_back(model.column_name(c));
  return names;
}

std::vector<std::string> ColumnUnits(const codegen::Model& model) {
  std::vector<std::string> units;
  for (int c = 0; c < model.columns(); ++c) units.push_back(model.column_unit(c));
  return units;
}

nb::object Regressor(const codegen::Model& model, nb::handle q, nb::handle qd, nb::handle qdd, double step_s,
                     nb::handle temp) {
  codegen::Signals s;
  s.q = ReadMatrix(q, "q", -1, model.joints());
  s.qd = ReadMatrix(qd, "qd", s.q.rows(), model.joints());
  s.qdd = ReadMatrix(qdd, "qdd", s.q.rows(), model.joints());
  if (!temp.is_none()) s.temp = ReadMatrix(temp, "temp", s.q.rows(), model.joints());
  if (!(step_s > 0 && step_s < 1e300)) throw nb::value_error("step_s: expected a time above 0 s");
  s.t = Eigen::VectorXd::LinSpaced(s.q.rows(), 0, step_s * static_cast<double>(s.q.rows() - 1));
  std::vector<Eigen::MatrixXd> row;
  RunLongCall(nb::none(), [&] {
    const Eigen::VectorXd committed = calibration::MakePrior(model).mean.head(model.columns());
    const std::vector<double> eta = calibration::MeanUnknowns(model);
    model.Regressor(s, {committed.data(), static_cast<std::size_t>(committed.size())}, eta, row);
  });
  return ToArray(row);
}

}  // namespace
}  // namespace armcal::python

NB_MODULE(_core, m) {
  using namespace armcal;  // NOLINT: a module's entry is one function
  nanobind::exception<io::InputError>(m, "InputError", PyExc_ValueError);
  m.def("_set_installed_home", [](const std::string& folder) { codegen::SetInstalledHome(folder); });
  nanobind::class_<codegen::Model>(m, "Robot",
                                   "An arm's model. path: a robot file (TOML), or the name of a robot of armcal.\n"
                                   "InputError: no such file, or a key of it is wrong.")
      .def(
          "__init__",
          [](codegen::Model* self, const std::filesystem::path& path) {
            new (self) codegen::Model(codegen::LoadModel(path.string()));
          },
          nanobind::arg("path"))
      .def_prop_ro("name", [](const codegen::Model& model) { return model.robot().name; })
      .def_prop_ro("joints", &codegen::Model::joints)
      .def_prop_ro("columns", &python::ColumnNames, "names of the regressor's columns")
      .def_prop_ro("units", &python::ColumnUnits, "units of the parameters of these columns");
  python::BindLogs(m);
  python::BindAnalyses(m);
  python::BindExcite(m);
  m.def("regressor", &python::Regressor, nanobind::arg("robot"), nanobind::arg("q"), nanobind::arg("qd"),
        nanobind::arg("qdd"), nanobind::kw_only(), nanobind::arg("step_s") = 0.008,
        nanobind::arg("temp") = nanobind::none(),
        "The torque of each joint per unit of each parameter.\n\n"
        "q, qd, qdd: (samples, joints) float64; rad, rad/s, rad/s^2 (m, m/s, m/s^2 of a prismatic joint).\n"
        "step_s: time from sample to sample in s, for effects with memory. temp: (samples, joints), degrees Celsius.\n"
        "Returns (samples, joints, columns) float64, C order; columns and their units: Robot.columns, Robot.units.\n"
        "Columns that depend on the estimate are taken at the robot file's values.\n"
        "ValueError names the argument: no float64 array, another shape, a value that is not finite.");
}
