// verdict - holds one diagnosis with all that shows it, and shows it in the terminal.
#pragma once

#include <string>
#include <vector>

#include "host_sim/data/report/plot.hpp"
#include "host_sim/diagnose/diagnosis/diagnose.hpp"
#include "host_sim/identify/calibration/held_out.hpp"
#include "host_sim/identify/methods/exogeneity.hpp"

namespace armcal::verdict {

// How to tell a term from a rival on the same joints: in their records' words and, where a motion alone does it, as a
// command for a shell.
struct Separation {
  std::string from, how, command;  // command: empty where a motion does not do
};

// Everything that one diagnosis has to show.
struct DiagnosisView {
  const codegen::Model* model = nullptr;
  const diagnosis::Finding* finding = nullptr;
  const calibration::Dataset* test = nullptr;
  const diagnosis::HeldOut* held_out = nullptr;
  // On the test log, less what parameters of the declared model could give: a friction curve with a large constant part
  // and as much less Coulomb friction is a small term.
  std::vector<Eigen::MatrixXd> term_torque;
  double seconds = 0;
  calibration::Exogeneity exogeneity;               // of the training logs, with the terms in
  std::vector<std::vector<Separation>> separation;  // per term
  const std::vector<calibration::Dataset>* train = nullptr;
  // [n] What the terms leave at the samples of the training logs, RMS where the joint moves.
  Eigen::VectorXd left_at_samples;
  calibration::HeldOutMotion motion;
};

// Means over bins of a signal, over the held-out log where the joint moves: the residual with the term's torque put
// back, the term, and the residual.
struct Dependence {
  int joint = 0;
  std::string signal, torque;  // what they are, with unit
  report::Series without, term, remains;
};
Dependence DependenceOf(const DiagnosisView& v, std::size_t term);

// Short lines for the terminal.
std::string DiagnosisText(const DiagnosisView& v);

}  // namespace armcal::verdict
