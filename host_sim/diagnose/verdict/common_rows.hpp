// verdict - compares terms of several splits on the same samples: the runs of all splits.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/diagnose/diagnosis/known_term.hpp"
#include "host_sim/diagnose/verdict/verdict_file.hpp"
#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::verdict {

// What of a term's torque the declared model cannot take up by other parameters of its own.
struct Trace {
  Eigen::VectorXd left;    // over the rows of all joints and runs, each in units of its joint's noise
  double uncertainty = 0;  // RMS length of left's error, from the covariance of the term's parameters
  Eigen::VectorXd rms_Nm;  // [n] of the same in torque
};

// The declared model's rows over some runs. A run of many samples is thinned; a term's memory sees all of them.
class CommonRows {
 public:
  // Throws io::InputError where the runs do not fit the model.
  CommonRows(const codegen::Model& model, const std::vector<calibration::Dataset>& runs);
  // declared: which coordinates count, each joint's noise, and the estimate that columns may depend on.
  CommonRows(const codegen::Model& model, const std::vector<calibration::Dataset>& runs, calibration::Fit declared);
  // covariance: of the term's eta, then amplitudes.
  Trace Of(const diagnosis::KnownTerm& term, const Eigen::MatrixXd& covariance) const;
  // For rows over a single run: what of each torque [N x n] the declared model cannot take up. A joint on which a
  // torque has no part keeps none.
  std::vector<Eigen::MatrixXd> Beyond(const std::vector<Eigen::MatrixXd>& torques) const;

 private:
  std::vector<Eigen::MatrixXd> DeclaredRows(const calibration::Dataset& run) const;
  Eigen::Index AllRows() const;
  Eigen::MatrixXd TakenUp(const Eigen::MatrixXd& torque) const;
  Eigen::MatrixXd Left(Eigen::MatrixXd torque) const;

  const codegen::Model& model_;
  const std::vector<calibration::Dataset>& runs_;
  calibration::Fit declared_;
  std::vector<std::vector<std::pair<int, int>>> row_;  // [n] (run, sample) that are used
  std::vector<Eigen::MatrixXd> design_;                // [n] rows x active coordinates, over the joint's noise
  Eigen::MatrixXd inverse_;                            // of the normal equations
};

// By held-out run and place in its verdict's list of terms.
using Traces = std::map<std::pair<std::string, std::size_t>, Trace>;

// Of all terms of these verdicts except those of one run only (a run's state, an event).
Traces TracesOf(const Verdicts& splits, const CommonRows& rows, const codegen::Catalogue& catalogue);

// How far two traces lie apart, over the length of the longer one; and the uncertainty of that, which takes the two as
// independent. Fits to overlapping logs are not: the true uncertainty is then smaller.
struct Distance {
  double share = 0, uncertainty = 0;
};
Distance Compare(const Trace& a, const Trace& b);

}  // namespace armcal::verdict
