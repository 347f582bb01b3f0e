// python - makes logs of numpy arrays or files.
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/data/logs/channels.hpp"
#include "host_sim/data/logs/log.hpp"
#include "host_sim/python/arrays.hpp"
#include "host_sim/python/bindings.hpp"
#include "host_sim/python/long_call.hpp"

namespace armcal::python {

namespace {

logs::Log FromArrays(nb::handle t, nb::handle q, nb::handle tau, nb::handle qd, nb::handle qdd, nb::handle qref,
                     nb::handle ext, nb::handle temp, const std::string& name) {
  logs::RawLog raw;
  logs::Log& log = raw.log;
  log.source = name;
  log.t = ReadVector(t, "t", -1);
  const Eigen::Index samples = log.t.size();
  log.q = ReadMatrix(q, "q", samples, -1);
  const Eigen::Index joints = log.q.cols();
  if (joints == 0) throw nb::value_error("q: shape (samples, 0), expected at least 1 joint");
  log.tau = ReadMatrix(tau, "tau", samples, joints);
  const auto read = [&](nb::handle array, const char* word, Eigen::MatrixXd& block) {
    if (!array.is_none()) block = ReadMatrix(array, word, samples, joints);
  };
  read(qd, "qd", log.qd), read(qdd, "qdd", log.qdd), read(qref, "qref", log.qref);
  read(ext, "ext", log.ext), read(temp, "temp", log.temp);
  log.joints = static_cast<int>(joints);
  raw.missing = Eigen::VectorXi::Zero(samples);
  raw.time_column = "t";
  raw.first_line = 0;  // messages count rows as numpy does
  for (const char* word : {"q", "tau"})
    for (int j = 1; j <= log.joints; ++j) raw.columns.push_back(word + std::to_string(j));
  return logs::MakeLog(std::move(raw));
}

logs::Log FromFile(const std::filesystem::path& path, const std::optional<std::filesystem::path>& channels,
                   const std::vector<std::filesystem::path>& messages) {
  if (!channels && !messages.empty()) throw nb::value_error("msg: expected channels beside it");
  logs::Log log;
  RunLongCall(nb::none(), [&] {
    log = channels ? logs::ReadLog(path, logs::ReadChannelMap(*channels, messages)) : logs::ReadLog(path);
  });
  return log;
}

}  // namespace

void BindLogs(nb::module_& m) {
  using logs::Log;
  nb::class_<Log>(m, "Log",
                  "What was measured on an arm: samples in time order, on the joint side, in SI units.\n\n"
                  "t: (samples,), s. q, tau and the optional qd, qdd, qref, ext, temp: (samples, joints) float64; rad, "
                  "N m, rad/s, rad/s^2, rad, N m, degrees Celsius (m, N ... of a prismatic joint). ext is a known "
                  "external torque along +q. name: how messages call the log.\n"
                  "ValueError names the argument. InputError: time does not rise, too few samples ...; rows count "
                  "from 0 in these messages, and are called lines.")
      .def(
          "__init__",
          [](Log* self, nb::handle t, nb::handle q, nb::handle tau, nb::handle qd, nb::handle qdd, nb::handle qref,
             nb::handle ext, nb::handle temp,
             const std::string& name) { new (self) Log(FromArrays(t, q, tau, qd, qdd, qref, ext, temp, name)); },
          nb::arg("t"), nb::arg("q"), nb::arg("tau"), nb::kw_only(), nb::arg("qd") = nb::none(),
          nb::arg("qdd") = nb::none(), nb::arg("qref") = nb::none(), nb::arg("ext") = nb::none(),
          nb::arg("temp") = nb::none(), nb::arg("name") = "log")
      .def_prop_ro("samples", [](const Log& log) { return static_cast<long>(log.samples()); })
      .def_ro("joints", &Log::joints)
      .def_ro("name", &Log::source)
      .def_ro("notes", &Log::notes, "what was left out or changed when the log was made, a line each")
      .def_prop_ro("t", [](const Log& log) { return ToArray(log.t); })
      .def_prop_ro("q", [](const Log& log) { return ToArray(log.q); })
      .def_prop_ro("tau", [](const Log& log) { return ToArray(log.tau); });
  m.def("read_log", &FromFile, nb::arg("path"), nb::arg("channels") = nb::none(), nb::kw_only(),
        nb::arg("msg") = std::vector<std::filesystem::path>(),
        "A log from a file: CSV, plain or gzip; with a channel map also MCAP, rosbag2 or MATLAB.\n\n"
        "channels: path of a channel map (TOML) of foreign columns. msg: paths of definitions (.msg) of messages that "
        "the file does not define itself; with channels only.\n"
        "InputError: the file cannot be read as a log.");
}

}  // namespace armcal::python
