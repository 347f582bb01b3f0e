// diagnosis - chooses the next term, and says whether a chosen one still earns its place.
#pragma once

#include <map>
#include <vector>

#include "host_sim/diagnose/diagnosis/work.hpp"

namespace armcal::diagnosis {

class Grounds;  // what the candidates of one pass are tried on

// The largest chance that noise alone gains as much, for which a term of this record is accepted on such a log.
double LogLimit(const codegen::EffectRecord& record, const calibration::Dataset& log);

// They have a torque on the same joint.
bool SharesJoint(const Candidate& a, const Candidate& b);

class Selector {
 public:
  explicit Selector(Diagnosis::Work& work) : w_(work) {}

  // The best further term given those chosen; false if none is worth it.
  bool Next(const std::vector<const Chosen*>& terms, Chosen& out);

  // The first terms of all: of the records that count the rows near turns and at rest, at most one a joint. The joints
  // that got one are fitted there from now on.
  std::vector<Chosen> FirstAtTurns(bool averaged_only);

  // Searches a chosen term again with the others in; false if it no longer earns its place.
  bool StillEarns(Chosen& term, const std::vector<const Chosen*>& others);

 private:
  // The best of these candidates that can be accepted; false if none can.
  bool Best(std::vector<Candidate*> reach, const std::vector<const Chosen*>& terms, Grounds& grounds, Chosen& out);
  // The strongest candidates by white score.
  std::vector<Found> Rank(const std::vector<Candidate*>& candidates, const Grounds& grounds);
  void Rescore(const Grounds& grounds, Found& f) const;
  bool IsOutOfReach(const Candidate& c, const std::vector<const Chosen*>& terms) const;
  bool StandsOrTurns(int joint, bool averaged_only) const;
  bool AlreadyIn(const Candidate& c, const std::vector<const Chosen*>& terms) const;
  // Best first: by score, but a named cause before a curve that explains little more.
  void Sort(std::vector<Found>& ranked);
  std::string WhyNotAtLowerBandwidth(const Found& f, const std::vector<const Chosen*>& terms, const Columns& columns,
                                     const Gain& gain, const Metric& wide);
  std::string WhyNotOfTheMotion(const Found& f, const std::vector<const Chosen*>& terms, const Columns& columns,
                                const Eigen::VectorXd& amplitude, const Metric& wide) const;
  std::vector<calibration::Dataset> Without(const std::vector<const Chosen*>& terms, const Found& f,
                                            const Eigen::VectorXd& amplitude) const;
  bool ShowsBesideChannel(const Found& f, const Columns& columns, const Metric& metric) const;
  bool ShowsInSliding(const Found& f, const Columns& columns, const std::vector<NoiseModel>& noise) const;
  bool ShowsWhereSignIsSteady(const Found& f, const Columns& columns, const std::vector<NoiseModel>& noise) const;
  bool ShowsMemory(const Found& f, const Gain& gain, const Metric& metric) const;
  bool Accept(const Grounds& grounds, const std::vector<const Chosen*>& terms, const std::vector<Found>& ranked,
              std::size_t k, Chosen& out);

  Diagnosis::Work& w_;
  std::map<const Candidate*, std::string> refused_;  // of this pass: why it was not accepted
  std::map<const Candidate*, double> gain_;          // as last searched
  std::vector<Candidate*> bursts_;                   // causes that this pass could not judge fold by fold
};

}  // namespace armcal::diagnosis
