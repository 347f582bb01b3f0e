// diagnosis - evaluates a known term's columns over a log, and their differences by each nonlinear parameter.
#include "host_sim/diagnose/diagnosis/known_term.hpp"

#include <algorithm>

#include "host_sim/diagnose/diagnosis/work.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
constexpr double kDifference = 1e-3;  // of a parameter's range or size, for the difference
}  // namespace

TermTorques TorquesOf(const KnownTerm& term, const codegen::Model& model, const calibration::Fit& declared,
                      const calibration::Dataset& data) {
  const Candidate candidate(*term.record, model.robot(), term.joints);
  const codegen::ArmTorque arm(model);
  Quantities quantities = MakeQuantities(model, data, candidate.inputs());
  Follow(model, arm, declared.x, declared.eta, candidate.inputs(), quantities);
  VectorXd amplitude = term.amplitude;
  for (int c = 0; c < amplitude.size(); ++c)
    if (candidate.column(c).fixed_amplitude) amplitude[c] = candidate.column(c).amplitude;
  TermTorques out;
  out.torque = CandidateTorque(candidate, quantities, term.eta, amplitude);
  for (std::size_t k = 0; k < term.eta.size(); ++k) {
    const codegen::EffectUnknown& unknown = candidate.unknowns()[k % candidate.unknowns().size()];
    const double range = unknown.upper - unknown.lower;
    const double step = kDifference * (unknown.logarithmic ? std::min(range, std::abs(term.eta[k])) : range);
    std::vector<double> above = term.eta, below = term.eta;
    above[k] += step, below[k] -= step;
    out.slope.push_back((CandidateTorque(candidate, quantities, above, amplitude) -
                         CandidateTorque(candidate, quantities, below, amplitude)) /
                        (2 * step));
  }
  for (int c = 0; c < amplitude.size(); ++c) {
    if (candidate.column(c).fixed_amplitude) {
      out.slope.push_back(MatrixXd::Zero(data.samples(), data.joints()));
      continue;
    }
    out.slope.push_back(CandidateTorque(candidate, quantities, term.eta, VectorXd::Unit(amplitude.size(), c)));
  }
  return out;
}

}  // namespace armcal::diagnosis
