// diagnosis - holds the state of one diagnosis: logs, current terms, rows of the base model. For this room only.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "host_sim/diagnose/diagnosis/candidate.hpp"
#include "host_sim/diagnose/diagnosis/diagnose.hpp"
#include "host_sim/diagnose/diagnosis/evidence.hpp"
#include "host_sim/diagnose/diagnosis/metric.hpp"
#include "host_sim/diagnose/diagnosis/noise.hpp"
#include "host_sim/diagnose/diagnosis/search.hpp"
#include "host_sim/identify/calibration/prior.hpp"

namespace armcal::diagnosis {

// A candidate that has been added, with its parameters.
struct Chosen {
  Candidate* candidate = nullptr;
  std::vector<double> eta;
  Found found;
  Eigen::VectorXd folds;
  std::vector<std::string> also_fits;
  std::vector<Rival> rivals;
  bool coloured = false;  // it was found in rows whose noise had been whitened
  bool earns = true;      // its place beside the others, as last seen
  bool confirmed = true;
  std::string unconfirmed;    // why it is not, where no error of the held-out log refuted it
  bool not_held_out = false;  // the held-out log refuted it or gave that reason
  double delay_s = 0;         // of a term that delays the measurement: as it has been applied to the logs
};

// The confirmed terms, except `without`.
std::vector<const Chosen*> Confirmed(const std::vector<Chosen>& chosen, const Chosen* without = nullptr);

// The terms beside which a term must earn its place. Curves over its joints are not among them: they could take its
// place, but they name no cause.
std::vector<const Chosen*> Rivals(const std::vector<Chosen>& chosen, const Chosen& term);

struct Diagnosis::Work {
  Work(const codegen::Model& model, const codegen::Catalogue& catalogue,
       std::vector<const calibration::Dataset*> train);
  // Other logs of the same arm, for the candidates of `other`; it has none of its own.
  Work(const Work& other, std::vector<const calibration::Dataset*> logs);

  // x, amplitudes, sigma and model torque for the given terms (white metric, the same method with and without terms).
  struct Estimate {
    Eigen::VectorXd x;                       // filter columns and gains
    std::vector<Eigen::VectorXd> amplitude;  // per term
    Eigen::VectorXd sigma;
  };
  // Leaves the estimate.
  void Solve(const std::vector<const Chosen*>& terms);
  // Moves the unknowns of all chosen terms to where they fit best together. A search moves those of one term, over a
  // model that was fitted without it. Leaves the estimate.
  void Polish();
  // Standard deviations of the terms' amplitudes and unknowns, all free together, at the estimate that Solve has left.
  struct Deviation {
    Eigen::VectorXd amplitude, eta;
    Eigen::MatrixXd covariance;  // of eta, then amplitude; zero where eta is not free
  };
  std::vector<Deviation> Deviations(const std::vector<const Chosen*>& terms);

  // What these terms read, and a candidate beside them.
  std::set<codegen::InputId> Reads(const std::vector<const Chosen*>& terms, const Candidate* further = nullptr) const;
  // The evidence's model torque and its parts at the estimate, as far as something reads them.
  void FollowEstimate(const std::set<codegen::InputId>& reads);
  // The term's columns. Those that no estimate changes are kept for the next time.
  const Columns& ColumnsOf(const Chosen& term);
  // Refreshes base rows at the estimate, the given terms' columns included.
  void Prepare(const std::vector<const Chosen*>& terms);
  // The same, and the evidence, at the estimate of `other`, for one of its candidates beside these terms.
  void PrepareAsIn(const Work& other, const std::vector<const Chosen*>& terms, const Candidate& further);
  Eigen::VectorXd SlopeOverModelTorque(const std::vector<const Chosen*>& terms, int j);
  std::vector<NoiseModel> WhiteNoise() const;
  // From now on, shifts the motion of the logs against their torque by the delay that the confirmed terms found.
  void AlignLogs();
  void SetDelay(double by_s);
  // From now on, leaves out the rows in which this term does not know its states yet, because a log does not say how
  // the joint moved before it began. Not where rows are averages, and not if half of the log would go.
  void LeaveOutUnsettled(const Chosen& term);
  // From now on, fits these joints also near turns and at rest. (1: yes)
  void ShowTurns(const std::vector<char>& joints);
  // Weighs the rows near turns and at rest by what these terms leave there.
  void WeighTurns(const std::vector<const Chosen*>& terms);
  // From now on, gives rows with knocks less weight, where the noise has heavy tails: for the search.
  void WeighKnocks(bool weigh);
  void MakeTrain();
  void WeighRows();
  void IndexRows();
  void StartRows();
  void FillDeclared(int j);
  bool FillGain(int j);
  Eigen::VectorXd Measured(int j) const;
  void Bend(int j, const Eigen::VectorXd& slope);
  void KeepCausesApart(const std::vector<const Chosen*>& terms);
  void MakeCoordinates(int size);

  const codegen::Model& model;
  codegen::ArmTorque arm;
  std::vector<const calibration::Dataset*> train;
  std::vector<const calibration::Dataset*> logged;  // as given
  std::vector<calibration::Dataset> changed;        // train points here once a delay or turns have been applied
  double delay_s = 0;                               // applied
  std::vector<Eigen::MatrixXi> known_start;         // [log] N x n, 0: LeaveOutUnsettled leaves it out
  std::vector<char> turns;                          // [joint] 1: rows near turns and at rest are fitted, too
  bool knocks = false;                              // rows are weighed by their knocks
  Eigen::VectorXd turn_weight;                      // [joint] of these rows
  std::vector<Eigen::VectorXd> sliding;             // [joint] share of each row's samples that are not such rows
  calibration::Prior prior;
  calibration::Fit declared;
  std::vector<std::unique_ptr<Candidate>> candidates;
  Evidence evidence;
  BaseRows rows;
  Estimate estimate;
  std::vector<Chosen> chosen;
  std::map<std::pair<const Candidate*, std::vector<double>>, Columns> gathered;  // of ColumnsOf
  KeptColumns kept_columns;                                                      // of searches
  std::vector<std::vector<Eigen::MatrixXd>> regressor;  // [log][joint], kept if it does not depend on the estimate
  std::vector<char> bent;                               // [joint] 1: its declared rows must be filled anew
  Eigen::VectorXd followed;                             // the estimate that the evidence is at ...
  std::set<codegen::InputId> followed_reads;            // ... in these
  std::vector<std::string> standby;                     // records compiled in, not yet estimated
  std::set<codegen::InputId> all_reads;                 // of all candidates
  std::unique_ptr<Work> narrow;  // the same logs at a lower bandwidth, without candidates of its own
};

// The chosen terms as they are now, with their deviations.
void WriteTerms(Diagnosis::Work& work, Finding& finding);

// What no estimate changes: steps, and the columns of the bodies that something reads.
Quantities MakeQuantities(const codegen::Model& model, const calibration::Dataset& data,
                          const std::set<codegen::InputId>& reads);
// Model torque and its parts at x, as far as something reads them.
void Follow(const codegen::Model& model, const codegen::ArmTorque& arm, const Eigen::VectorXd& x,
            const std::vector<double>& eta, const std::set<codegen::InputId>& reads, Quantities& quantities);

// The rows of one joint that may be used.
RowIndex UsedRows(const std::vector<const calibration::Dataset*>& logs, int joint);

// Torque of a candidate with given parameters on a dataset, N x n.
Eigen::MatrixXd CandidateTorque(const Candidate& candidate, const Quantities& quantities,
                                const std::vector<double>& eta, const Eigen::VectorXd& amplitude);

}  // namespace armcal::diagnosis
