// diagnosis - computes the torque of a term that is known by its record and parameters, as a verdict holds it.
#pragma once

#include <vector>

#include "host_sim/diagnose/diagnosis/candidate.hpp"
#include "host_sim/identify/calibration/weighted_fit.hpp"

namespace armcal::diagnosis {

struct KnownTerm {
  const codegen::EffectRecord* record = nullptr;
  std::vector<int> joints;    // 0-based
  std::vector<double> eta;    // of every use of the record, one after the other
  Eigen::VectorXd amplitude;  // of the columns; one that the record fixes counts as fixed
};

// The term's torque on a log [N x n], and what it changes by per unit of each parameter: eta first, then amplitudes. A
// term that reads the model's torque reads that of `declared`.
struct TermTorques {
  Eigen::MatrixXd torque;
  std::vector<Eigen::MatrixXd> slope;
};
TermTorques TorquesOf(const KnownTerm& term, const codegen::Model& model, const calibration::Fit& declared,
                      const calibration::Dataset& data);

}  // namespace armcal::diagnosis
