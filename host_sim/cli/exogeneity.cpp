// cli - chooses instruments and words the verdict.
#include "host_sim/cli/exogeneity.hpp"

#include <fmt/core.h>

#include "host_sim/calibration/closed_loop.hpp"
#include "host_sim/io/input_error.hpp"

namespace armcal::cli {

using calibration::Dataset;
using calibration::Exogeneity;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr const char *kCommandedMotion = "commanded motion", *kSmoothedPositions = "smoothed positions";

// Empty where the arm that the robot file describes does not follow its reference in simulation.
std::vector<Dataset> Simulated(const codegen::Model& model, const std::vector<Dataset>& data,
                               const std::map<std::string, MatrixXd>& reference, const VectorXd& z) {
  if (model.robot().control.structure.empty() || model.states() > 0) return {};
  calibration::Problem problem = calibration::MakeProblem(model, Pointers(data));
  try {
    problem.closed_loop = calibration::MakeClosedLoop(model, reference);
    return calibration::SimulatedInstruments(problem, z);
  } catch (const io::InputError&) {
    return {};  // the reference itself serves, too
  }
}

const char* Result(const calibration::JointExogeneity& j) {
  return j.restrictions == 0 ? "cannot be told" : j.exogenous ? "holds" : "FAILS";
}

std::string Remedy(const Exogeneity& e) {
  std::string method = "armcal identify --method instrumental_variable";
  if (e.instruments == kSimulatedLoop) return method;
  const std::string lower = "a lower --cutoff or a finer encoder; or " + method;
  if (e.instruments == kCommandedMotion) return lower + ", which needs a [control] table in the robot file";
  return lower + ", which needs qref in the log and a [control] table in the robot file";
}

}  // namespace

Exogeneity CheckExogeneity(const codegen::Model& model, const std::vector<Dataset>& data, const VectorXd& z,
                           Instruments best) {
  const std::map<std::string, MatrixXd> reference = References(data);
  std::string kind = kSimulatedLoop;
  std::vector<Dataset> instruments;
  if (best == Instruments::kSimulated && !reference.empty()) instruments = Simulated(model, data, reference, z);
  if (instruments.empty()) {
    kind = reference.empty() ? kSmoothedPositions : kCommandedMotion;
    instruments = reference.empty() ? calibration::SmoothedInstruments(Pointers(data))
                                    : calibration::ReferenceInstruments(Pointers(data));
  }
  Exogeneity e = calibration::TestExogeneity(model, Pointers(data), instruments, z);
  e.instruments = kind;
  return e;
}

std::string ExogeneityText(const Exogeneity& e, const std::string& otherwise) {
  std::map<std::string, std::string> joints;
  for (std::size_t j = 0; j < e.joint.size(); ++j) {
    std::string& list = joints[Result(e.joint[j])];
    list += fmt::format("{}{}", list.empty() ? "" : ", ", j + 1);
    if (e.joint[j].exogenous) continue;
    list +=
        fmt::format(" (p {:.1g}, bias {:.2g} of {:.2g} left)", e.joint[j].p, e.joint[j].bias_Nm, e.joint[j].left_Nm);
  }
  // What the motion itself took up of the torque's error is in its smoothed positions, too.
  const char* shown = e.instruments == kSmoothedPositions ? ", which show noise of the derivation alone" : "";
  std::string text = fmt::format("regressors free of the torque's error (instruments: {}{}):", e.instruments, shown);
  const char* separator = " ";
  for (const auto& [result, list] : joints)
    text += fmt::format("{}{} on joint {}", separator, result, list), separator = "; ";
  text += "\n";
  if (e.passed()) return text;
  return text + "  least squares is biased where it fails: " + Remedy(e) + "; or " + otherwise + "\n";
}

nlohmann::ordered_json ToJson(const Exogeneity& e) {
  nlohmann::ordered_json out{{"instruments", e.instruments}, {"passed", e.passed()}};
  for (const calibration::JointExogeneity& j : e.joint)
    out["joints"].push_back({{"rows", j.rows},
                             {"restrictions", j.restrictions},
                             {"F", j.F},
                             {"p", j.p},
                             {"bias_Nm", j.bias_Nm},
                             {"left_Nm", j.left_Nm},
                             {"exogenous", j.exogenous},
                             {"told", j.restrictions > 0}});
  return out;
}

}  // namespace armcal::cli
