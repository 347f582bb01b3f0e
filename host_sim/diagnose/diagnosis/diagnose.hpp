// diagnosis - finds the causes of what a model leaves. The training logs alone decide; a held-out log judges.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "codegen/src/generator/model.hpp"
#include "host_sim/identify/calibration/carried.hpp"
#include "host_sim/identify/calibration/dataset.hpp"
#include "host_sim/identify/calibration/weighted_fit.hpp"

namespace armcal::diagnosis {

// A term is accepted where noise alone gains as much in one search of 10 000. The held-out log judges it again. Above
// one in 100 it is not looked at.
inline constexpr double kLogRare = -9.21, kLogLikely = -4.6;

// Which joints' rows near turns and at rest are looked at, too. kWhereAveraged: where the band is limited, so that an
// average reaches over a turn.
enum class AtTurns { kNever, kWhereAveraged, kAlways };

// Another candidate, as it was found beside a term.
struct Rival {
  const codegen::EffectRecord* record = nullptr;
  std::vector<int> joints;
  double score = 0;
  std::string refused;  // why it was not taken, where it scored higher in that pass
  double beside = 0;    // the term's own score in the same pass
};

// How a held-out log refuted a term: which joint it predicts worse with the term than without it.
struct Refutation {
  int joint = -1;                 // 0-based, the worst of the term's own joints; -1: all joints together
  bool beside_others = false;     // without it: the other terms alone; false: the declared model
  double factor = 1;              // by which it makes the joint's error, or the product of all errors, larger
  Eigen::VectorXd with, without;  // [n] RMS of measured minus predicted torque where the joint moves
};

struct Term {
  const codegen::EffectRecord* record = nullptr;
  std::vector<int> joints;                     // 0-based; empty: the whole arm or its flange
  std::vector<codegen::EffectColumn> columns;  // names and units
  std::vector<codegen::EffectUnknown> unknowns;
  Eigen::VectorXd amplitude, sd;  // of the columns
  std::vector<double> eta;
  Eigen::VectorXd eta_sd;
  Eigen::MatrixXd covariance;  // of eta, then amplitude
  double score = 0;
  double log_chance = 0;               // natural logarithm of the chance that noise alone gains as much, at most
  double log_limit = kLogRare;         // of that chance: a term with a larger one was not accepted
  Eigen::VectorXd folds;               // improvement of chi^2 out of fold
  std::vector<std::string> also_fits;  // kinds that this log cannot tell from it
  std::vector<Rival> rivals;           // the runner-up, then those of also_fits that are not it
  bool training_only = false;          // an event of the training log: it says nothing about the arm or another log
  bool confirmed = true;               // false: the held-out log did not bear it out, or nobody could use it
  std::optional<Refutation> refuted;   // how the held-out log refuted it
  std::string unconfirmed;             // else why it is not confirmed
  bool not_held_out = false;           // the held-out log refuted it or gave that reason
  bool in_fit = true;                  // it is in the model that was compared; false: refuted, or not determined
};

// "noise alone gains as much in one search of 10^9, accepted from 10^5".
std::string ChanceText(const Term& term);

// How large a term would have had to be for the logs to show it.
struct Limit {
  const codegen::EffectRecord* record = nullptr;
  std::vector<int> joints;  // 0-based; empty: the whole arm or its flange
  int joint = 0;            // 0-based, on whose torque it is told
  double rms_Nm = 0;        // of its torque there; infinity: the declared model takes all of it up
};

struct Finding {
  std::vector<Term> terms;            // strongest first; empty: nothing is missing
  calibration::Fit declared;          // the declared model, fitted on train
  Eigen::VectorXd x;                  // filter coordinates and gains with the terms in
  Eigen::VectorXd sigma, innovation;  // [n] residual and innovation standard deviation with the terms in; a joint at
                                      // rest has no innovation: NaN
  std::vector<Limit> limits;          // by joint, then size
  Eigen::VectorXd smallest;           // [n] the median of a joint's limits; infinity: it has none
  std::vector<int> at_turns;          // joints whose rows near turns and at rest were fitted, too
  std::vector<int> too_short;         // joints with too few rows to search an effect on them
  int most_terms = 0;                 // the search ended at so many, and did not ask for another; 0: it did
};

struct HeldOut {
  Eigen::MatrixXd before, after;  // [N x n] residuals: measured minus predicted
  std::string tracking;           // how run-state terms were followed; empty if there are none
  // Where one is named, `after` holds it: on each half of the log the payload that was fitted to the other half.
  calibration::Carried payload;
  Eigen::MatrixXd without_payload;  // [N x n] residuals with the same terms and no payload; empty if none is named
};

// Decides on the training logs at construction; the held-out log is only judged. Throws io::InputError where logs do
// not fit.
class Diagnosis {
 public:
  struct Work;  // work.hpp; the room's own
  // The logs outlive the diagnosis. narrow: the training logs once more, derived with a lower bandwidth; a term that
  // depends on the bandwidth is then refused. Empty: this is not checked. at_turns: rows near turns and at rest are
  // looked at, too.
  Diagnosis(const codegen::Model& model, const codegen::Catalogue& catalogue,
            std::vector<const calibration::Dataset*> train, std::vector<const calibration::Dataset*> narrow = {},
            AtTurns at_turns = AtTurns::kNever);
  ~Diagnosis();

  const Finding& finding() const { return finding_; }

  // Predicts the held-out log with and without the terms. Marks terms that worsen a joint of their own, or the product
  // of all joints' errors, by more than 0.5 %, against the declared model or against the other terms, as not confirmed,
  // says why, and leaves them out of `after`; kinds and nonlinear parameters do not change. A payload that the held-out
  // log carries and the training logs do not is a state of that run. It is fitted to each half of the log and taken
  // off the other half before a term is judged. gain_tolerance: as FindCarried has it.
  HeldOut Judge(const calibration::Dataset& test, double gain_tolerance = 0);

  // After Judge: the held-out log repeats a trajectory of the training logs. What was found there about the arm is no
  // longer confirmed, and says this as the reason; it stays in the comparison. A state of a run is not touched.
  void ConfirmNothing(const std::string& why);

  // One N x n torque a term on a log (run-state terms: as windows of that log's own time would give).
  std::vector<Eigen::MatrixXd> TermTorque(const calibration::Dataset& data) const;

  // The training logs as the declared model alone should explain them: aligned, the torque of the terms taken off.
  std::vector<calibration::Dataset> WithoutTerms() const;

 private:
  const codegen::Model& model_;
  Finding finding_;
  std::unique_ptr<Work> work_;
};

// The robot file with the confirmed terms added: each with its record, parameters and standard deviations, `provenance`
// and score as comments. What a model can hold is an [[effect]] table; of the rest a comment says what to do about it.
// folder: where the file will lie; the URDF and packages are named from there, or, if it is empty, from the root.
struct NewModel {
  std::string text;
  // Joints, from 0, on which the friction found would push at speeds or temperatures beyond the logs, so that a drive
  // would refuse the model's own table. There the terms that an estimate may move start from zero.
  std::vector<int> from_zero;
};
NewModel ModelFile(const codegen::Model& model, const codegen::Catalogue& catalogue, const Finding& finding,
                   const std::string& provenance, const std::filesystem::path& folder = {});

}  // namespace armcal::diagnosis
