// diagnosis - chooses terms one at a time, re-scores them with the noise fitted anew, cross-validates, prunes, judges.
#include "host_sim/diagnosis/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "host_sim/calibration/delay.hpp"
#include "host_sim/diagnosis/grounds.hpp"
#include "host_sim/diagnosis/run_state.hpp"
#include "host_sim/diagnosis/work.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMaxTerms = 4;
constexpr int kRescored = 14;   // candidates whose likelihood is computed with their own noise model
constexpr double kAccept = 15;  // score: odds of about e^7 to one after all penalties
constexpr double kKeepsOutOfFold = 0.35;
constexpr int kBlocks = 20, kFolds = 5, kFoldsThatImprove = 4;
constexpr double kIndistinguishable = 25;  // chi^2 left when one kind imitates another
constexpr double kStays = 0.5;             // of the gain, at a lower bandwidth
constexpr int kSharpenings = 3;
constexpr double kNothing = 10;   // a gain that no score above zero can come from
constexpr double kWorse = 1.005;  // held-out: a joint that gets worse by more than this refutes the term

bool SharesJoint(const Candidate& a, const Candidate& b) {
  return std::any_of(a.rows().begin(), a.rows().end(),
                     [&](int j) { return std::find(b.rows().begin(), b.rows().end(), j) != b.rows().end(); });
}

struct Ranked {
  Candidate* candidate = nullptr;
  Found found;
};

class Selector {
 public:
  explicit Selector(Diagnosis::Work& work) : w_(work) {}

  // The best further term given those chosen; false if none is worth it.
  bool Next(const std::vector<const Chosen*>& terms, Chosen& out) {
    Grounds grounds(w_, terms);
    std::vector<Candidate*> reach;
    for (const auto& c : w_.candidates)
      if (!AlreadyIn(*c, terms) && !IsOutOfReach(*c, terms) && IsExcited(*c, w_.evidence)) reach.push_back(c.get());
    std::vector<Ranked> ranked = Rank(reach, grounds);
    // A strong effect passes for noise, and under so much noise others look as good. Once it is known what it leaves,
    // those that may be meant are searched again.
    for (int round = 0; round < kSharpenings && !ranked.empty(); ++round) {
      if (!grounds.Sharpen(GatherColumns(*ranked[0].candidate, w_.evidence, ranked[0].found.eta))) break;
      reach.clear();
      for (const Ranked& r : ranked) reach.push_back(r.candidate);
      ranked = Rank(reach, grounds);
    }
    for (Ranked& r : ranked) Rescore(grounds, r.found);
    std::sort(ranked.begin(), ranked.end(), [this](const Ranked& a, const Ranked& b) {
      // what is compiled in already wins among equals
      return a.found.score + Preference(a) > b.found.score + Preference(b);
    });
    for (std::size_t k = 0; k < ranked.size() && ranked[k].found.score > kAccept; ++k)
      if (Accept(grounds, terms, ranked, k, out)) return true;
    return false;
  }

  // Searches a chosen term again with the others in; false if it no longer earns its place.
  bool StillEarns(Chosen& term, const std::vector<const Chosen*>& others) {
    const Grounds grounds(w_, others);
    Found f = SearchCandidate(*term.candidate, grounds.ground());
    if (f.gain.gain <= 0) return false;
    Rescore(grounds, f);
    term.eta = f.eta;
    term.found = f;
    return f.score > kAccept;
  }

 private:
  // The strongest candidates by white score.
  std::vector<Ranked> Rank(const std::vector<Candidate*>& candidates, const Grounds& grounds) {
    std::vector<Ranked> ranked;
    for (Candidate* c : candidates) {
      const Found f = SearchCandidate(*c, grounds.ground());
      gain_[c] = f.gain.gain;
      if (f.score > 0) ranked.push_back({c, f});
    }
    const auto stronger = [](const Ranked& a, const Ranked& b) { return a.found.score > b.found.score; };
    std::sort(ranked.begin(), ranked.end(), stronger);
    if (ranked.size() > kRescored) ranked.resize(kRescored);
    return ranked;
  }
  void Rescore(const Grounds& grounds, Found& f) const {
    const Columns c = GatherColumns(*f.candidate, w_.evidence, f.eta);
    const double with = grounds.metric().RefittedDeviance(c);
    f.score = Score(f, grounds.DevianceWithout(c.joints) - with, w_.evidence);
  }
  // The latest term touches none of its joints, and there was nothing on them before.
  bool IsOutOfReach(const Candidate& c, const std::vector<const Chosen*>& terms) const {
    const auto known = gain_.find(&c);
    return known != gain_.end() && !terms.empty() && known->second < kNothing &&
           !SharesJoint(c, *terms.back()->candidate);
  }
  double Preference(const Ranked& r) const {
    const auto& names = w_.standby;
    return std::find(names.begin(), names.end(), r.candidate->record().name) != names.end() ? 1e-3 : 0;
  }
  // A chosen term, or one that is known to look like a chosen one on the same joints: the two together would only fit
  // noise, and apart from the training log's states they would fail.
  bool AlreadyIn(const Candidate& c, const std::vector<const Chosen*>& terms) const {
    return std::any_of(terms.begin(), terms.end(), [&](const Chosen* t) {
      const auto& like = t->candidate->record().confusable_with;
      const bool confusable = std::find(like.begin(), like.end(), c.record().name) != like.end();
      // another frequency of the same kind is another term
      return (t->candidate == &c && c.record().search.how != "spectral") ||
             (confusable && t->candidate->joints() == c.joints());
    });
  }
  // Delay, elasticity and backlash look like what a derivation of speed and acceleration leaves: a term that is real
  // gains about as much when these are derived otherwise.
  bool StaysAtLowerBandwidth(const Ranked& r, const std::vector<const Chosen*>& terms, double gain,
                             const std::vector<NoiseModel>& noise) {
    if (!w_.narrow) return true;
    Diagnosis::Work& narrow = *w_.narrow;
    narrow.estimate = w_.estimate;
    narrow.Prepare(terms);
    return Metric(narrow.rows, noise).Try(GatherColumns(*r.candidate, narrow.evidence, r.found.eta)).gain >
           kStays * gain;
  }
  bool Accept(const Grounds& grounds, const std::vector<const Chosen*>& terms, const std::vector<Ranked>& ranked,
              std::size_t k, Chosen& out) {
    const Ranked& r = ranked[k];
    const Columns c = GatherColumns(*r.candidate, w_.evidence, r.found.eta);
    std::vector<NoiseModel> noise;
    (void)grounds.metric().RefittedDeviance(c, &noise);
    const Metric metric(w_.rows, noise);
    const Gain gain = metric.Try(c);
    const VectorXd folds = metric.OutOfFold(Columns{}, kBlocks, kFolds) - metric.OutOfFold(c, kBlocks, kFolds);
    if (folds.sum() < kKeepsOutOfFold * gain.gain || (folds.array() > 0).count() < kFoldsThatImprove) return false;
    if (!StaysAtLowerBandwidth(r, terms, gain.gain, noise)) return false;
    out = Chosen{};
    out.candidate = r.candidate;
    out.eta = r.found.eta;
    out.found = r.found;
    out.folds = folds;
    for (std::size_t other = 0; other < ranked.size(); ++other) {
      if (other == k) continue;
      const Candidate& o = *ranked[other].candidate;
      if (out.runner_up.empty()) out.runner_up = o.name(), out.runner_up_score = ranked[other].found.score;
      if (!SharesJoint(o, *r.candidate) || o.record().name == r.candidate->record().name) continue;
      const auto [taken, own] =
          metric.Imitates(GatherColumns(o, w_.evidence, ranked[other].found.eta), c, gain.amplitude);
      const double left = own - taken;
      const bool same = left < kIndistinguishable && left < 0.1 * own;
      const bool near = ranked[other].found.score > 0.95 * r.found.score;
      if ((same || near) && out.also_fits.size() < 2) out.also_fits.push_back(o.record().name);
    }
    return true;
  }

  Diagnosis::Work& w_;
  std::map<const Candidate*, double> gain_;  // as last searched
};

double TotalDelay_s(const std::vector<Chosen>& chosen) {
  double sum = 0;
  for (const Chosen& c : chosen) sum += c.confirmed ? c.delay_s : 0;
  return sum;
}

// A log as the confirmed terms say that it was measured.
calibration::Dataset AsTermsSay(const std::vector<Chosen>& chosen, const calibration::Dataset& log) {
  const double delay_s = TotalDelay_s(chosen);
  return delay_s != 0 ? calibration::Delayed(log, delay_s) : log;
}

void WriteTerms(const Diagnosis::Work& w, Finding& finding) {
  finding.terms.clear();
  std::size_t k = 0;
  for (const Chosen& c : w.chosen) {
    Term t;
    t.record = &c.candidate->record();
    t.joints = c.candidate->joints();
    t.columns = c.candidate->instance().columns;
    t.unknowns = c.candidate->unknowns();
    t.eta = c.eta;
    t.score = c.found.score, t.gain = c.found.gain.gain;
    t.folds = c.folds, t.also_fits = c.also_fits;
    t.runner_up = c.runner_up, t.runner_up_score = c.runner_up_score;
    t.confirmed = c.confirmed;
    t.amplitude = VectorXd::Zero(c.candidate->columns()), t.sd = t.amplitude;
    if (c.confirmed) {
      t.amplitude = w.estimate.amplitude[k], t.sd = w.estimate.sd[k], ++k;
      if (c.delay_s != 0) t.amplitude[0] += c.delay_s;
    }
    finding.terms.push_back(std::move(t));
  }
  finding.x = w.estimate.x;
  finding.sigma = w.estimate.sigma;
  finding.innovation = w.estimate.innovation;
}

}  // namespace

Diagnosis::Diagnosis(const codegen::Model& model, const codegen::Catalogue& catalogue,
                     std::vector<const calibration::Dataset*> train, std::vector<const calibration::Dataset*> narrow)
    : model_(model), work_(std::make_unique<Work>(model, catalogue, std::move(train))) {
  Work& w = *work_;
  if (!narrow.empty()) {
    w.narrow = std::make_unique<Work>(model, codegen::Catalogue{}, std::move(narrow));
    w.narrow->needs_flange = w.needs_flange;
  }
  Selector select(w);
  for (Chosen next; static_cast<int>(w.chosen.size()) < kMaxTerms && select.Next(Confirmed(w.chosen), next);) {
    w.chosen.push_back(next);
    w.ApplyDelay();
  }
  for (std::size_t k = 0; w.chosen.size() > 1 && k < w.chosen.size();) {
    if (w.chosen[k].delay_s != 0) ++k;  // the logs are as it says now
    else if (select.StillEarns(w.chosen[k], Confirmed(w.chosen, &w.chosen[k]))) ++k;
    else w.chosen.erase(w.chosen.begin() + static_cast<long>(k));
  }
  std::sort(w.chosen.begin(), w.chosen.end(),
            [](const Chosen& a, const Chosen& b) { return a.found.score > b.found.score; });
  w.estimate = w.Solve(Confirmed(w.chosen));
  finding_.declared = w.declared;
  WriteTerms(w, finding_);
  finding_.smallest.resize(model.joints());
  for (int j = 0; j < model.joints(); ++j) {
    const double rows = std::max(2, w.evidence.index[j].size());
    finding_.smallest[j] = finding_.sigma[j] * std::sqrt((kAccept + 2 * std::log(rows) + 2 * std::log(10.0)) / rows);
  }
}

Diagnosis::~Diagnosis() = default;

HeldOut Diagnosis::Judge(const calibration::Dataset& test) {
  Work& w = *work_;
  HeldOut out;
  out.before = test.tau - calibration::Predict(model_, test, w.declared.x, w.declared.eta);
  const VectorXd before = calibration::Rms(test, out.before, true);
  for (;;) {
    w.estimate = w.Solve(Confirmed(w.chosen));
    const calibration::Dataset seen = AsTermsSay(w.chosen, test);
    const Quantities q = MakeQuantities(model_, w.arm, seen, w.estimate.x, w.declared.eta, w.needs_flange);
    out.after = test.tau - calibration::Predict(model_, seen, w.estimate.x, w.declared.eta);
    std::size_t k = 0;
    for (const Chosen& c : w.chosen) {
      if (!c.confirmed) continue;
      const VectorXd& amplitude = w.estimate.amplitude[k++];
      if (c.candidate->record().kind_class == "run_state") {
        const auto& t = w.train[0]->s.t;
        const RunState state = MakeRunState(*c.candidate, c.eta, amplitude, t[t.size() - 1] - t[0]);
        out.after -= Track(state, q, out.after, w.estimate.sigma);
        out.tracking = "run states followed one step ahead; delay one sample";
      } else {
        out.after -= CandidateTorque(*c.candidate, q, c.eta, amplitude);
      }
    }
    const VectorXd after = calibration::Rms(test, out.after, true);
    Chosen* refuted = nullptr;
    for (Chosen& c : w.chosen)
      for (const int j : c.candidate->rows())
        if (c.confirmed && after[j] > kWorse * before[j]) refuted = &c;  // the weakest one: they are sorted
    if (!refuted) break;
    refuted->confirmed = false;
    if (refuted->delay_s != 0) w.SetDelay(TotalDelay_s(w.chosen));
  }
  WriteTerms(w, finding_);
  return out;
}

std::vector<MatrixXd> Diagnosis::TermTorque(const calibration::Dataset& data) const {
  const Work& w = *work_;
  const calibration::Dataset seen = AsTermsSay(w.chosen, data);
  const Quantities q = MakeQuantities(model_, w.arm, seen, w.estimate.x, w.declared.eta, w.needs_flange);
  std::vector<MatrixXd> out;
  std::size_t k = 0;
  for (const Chosen& c : w.chosen) {
    out.push_back(c.confirmed ? CandidateTorque(*c.candidate, q, c.eta, w.estimate.amplitude[k++])
                              : MatrixXd::Zero(data.samples(), data.joints()));
    if (c.confirmed && c.delay_s != 0)
      out.back() += q.tau_model - calibration::Predict(model_, data, w.estimate.x, w.declared.eta);
  }
  return out;
}

}  // namespace armcal::diagnosis
