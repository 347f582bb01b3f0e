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

}  // namespace

Exogeneity CheckExogeneity(const codegen::Model& model, const std::vector<Dataset>& data, const VectorXd& z) {
  const std::map<std::string, MatrixXd> reference = References(data);
  const char* kind = "smoothed positions";
  std::vector<Dataset> instruments;
  if (!reference.empty()) {
    kind = kSimulatedLoop;
    instruments = Simulated(model, data, reference, z);
    if (instruments.empty()) {
      kind = "commanded motion";
      instruments = calibration::ReferenceInstruments(Pointers(data));
    }
  } else {
    instruments = calibration::SmoothedInstruments(Pointers(data));
  }
  Exogeneity e = calibration::TestExogeneity(model, Pointers(data), instruments, z);
  e.instruments = kind;
  return e;
}

std::string ExogeneityText(const Exogeneity& e) {
  std::string text = fmt::format("regressors free of the torque's error (instruments: {}): ", e.instruments);
  if (e.passed()) return text + "yes\n";
  std::string joints;
  for (std::size_t j = 0; j < e.joint.size(); ++j)
    if (!e.joint[j].exogenous)
      joints += fmt::format("{}joint {} (p {:.1g}, bias {:.2g} of {:.2g} left)", joints.empty() ? "" : ", ", j + 1,
                            e.joint[j].p, e.joint[j].bias_Nm, e.joint[j].left_Nm);
  return text + "NO, " + joints + "\n  least squares is biased there: --method " +
         (e.instruments == kSimulatedLoop ? "instrumental_variable" : "fourier_fit for periodic motion") +
         ", a finer encoder or a lower bandwidth; or the model lacks a term: armcal diagnose\n";
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
                             {"exogenous", j.exogenous}});
  return out;
}

}  // namespace armcal::cli
