// diagnosis - adds terms one by one on the training logs, prunes them, and judges them on a held-out log.
#include "host_sim/diagnose/diagnosis/diagnose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "codegen/src/io/watch.hpp"
#include "host_sim/diagnose/diagnosis/determined.hpp"
#include "host_sim/diagnose/diagnosis/gain_on_log.hpp"
#include "host_sim/diagnose/diagnosis/limits.hpp"
#include "host_sim/diagnose/diagnosis/run_state.hpp"
#include "host_sim/diagnose/diagnosis/selector.hpp"
#include "host_sim/diagnose/diagnosis/work.hpp"
#include "host_sim/identify/calibration/channel.hpp"
#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMaxTerms = 24;  // far beyond what logs have shown: the search must end
// For a watch: of the search's time, the part that looks for terms; and of what is left of this part, about, a term's.
constexpr double kLooking = 0.8, kForATerm = 0.3;

// Delays the logs by what the latest term says of them.
void ApplyDelay(Diagnosis::Work& w) {
  Chosen& c = w.chosen.back();
  if (c.candidate->delay() < 0) return;
  double& found_s = c.eta[static_cast<std::size_t>(c.candidate->delay())];
  c.delay_s = found_s, found_s = 0;
  w.AlignLogs();
}

// Parameters of every use of a record: F_1, F_2 where there are two.
template <class Parameter>
void Repeat(const std::vector<Parameter>& once, std::size_t count, std::vector<Parameter>& out) {
  for (std::size_t k = 0; k < count; ++k) {
    out.push_back(once[k % once.size()]);
    if (count > once.size()) out.back().name += "_" + std::to_string(k / once.size() + 1);
  }
}

// Whether a term earns its place beside the others, searched again. A delay stays: the logs are as it says now.
bool StaysIn(const Diagnosis::Work& w, Selector& select, Chosen& term) {
  return term.delay_s != 0 || select.StillEarns(term, Rivals(w.chosen, term));
}

}  // namespace

std::vector<const Chosen*> Rivals(const std::vector<Chosen>& chosen, const Chosen& term) {
  std::vector<const Chosen*> out = Confirmed(chosen, &term);
  if (term.candidate->is_curve()) return out;
  std::erase_if(
      out, [&](const Chosen* c) { return c->candidate->is_curve() && c->candidate->rows() == term.candidate->rows(); });
  return out;
}

std::string ChanceText(const Term& term) {
  constexpr double kMost = 15;  // a rarer chance tells a reader nothing more
  const auto power = [](double log_chance) { return -log_chance / std::numbers::ln10; };
  const double rare = std::floor(power(term.log_chance));
  return fmt::format("noise alone gains as much in {} of 10^{:.0f} searches; the limit is one of 10^{:.0f}",
                     rare > kMost ? "fewer than one" : "one", std::min(rare, kMost), power(term.log_limit));
}

void WriteTerms(Diagnosis::Work& w, Finding& finding) {
  finding.terms.clear();
  const std::vector<Diagnosis::Work::Deviation> deviation = w.Deviations(Confirmed(w.chosen));
  std::size_t k = 0;
  for (const Chosen& c : w.chosen) {
    Term t;
    t.record = &c.candidate->record();
    t.joints = c.candidate->joints();
    Repeat(c.candidate->instance().columns, static_cast<std::size_t>(c.candidate->columns(c.eta)), t.columns);
    Repeat(c.candidate->unknowns(), c.eta.size(), t.unknowns);
    t.eta = c.eta;
    if (c.delay_s != 0) t.eta[static_cast<std::size_t>(c.candidate->delay())] += c.delay_s;
    t.score = c.found.score, t.log_chance = c.found.log_chance, t.log_limit = LogLimit(*t.record, *w.train[0]);
    t.folds = c.folds, t.also_fits = c.also_fits;
    t.rivals = c.rivals;
    t.training_only = c.candidate->is_event(), t.confirmed = t.in_fit = c.confirmed;
    t.unconfirmed = c.unconfirmed, t.not_held_out = c.not_held_out;
    t.amplitude = VectorXd::Zero(c.candidate->columns(c.eta)), t.sd = t.amplitude;
    t.eta_sd = VectorXd::Zero(static_cast<Eigen::Index>(c.eta.size()));
    if (c.confirmed) {
      t.amplitude = w.estimate.amplitude[k];
      t.sd = deviation[k].amplitude, t.eta_sd = deviation[k].eta, t.covariance = deviation[k].covariance, ++k;
    }
    finding.terms.push_back(std::move(t));
  }
  finding.x = w.estimate.x;
  finding.sigma = w.estimate.sigma;
  const Metric metric(w.rows, w.WhiteNoise());  // Deviations has left the rows of this fit
  finding.innovation.setConstant(w.model.joints(), std::numeric_limits<double>::quiet_NaN());
  for (int j = 0; j < w.model.joints(); ++j)
    if (const RowIndex& index = w.rows.index[static_cast<std::size_t>(j)]; index.size() > 0)
      finding.innovation[j] = FitNoise(index, metric.RawResidual(j)).innovation;
}

Diagnosis::Diagnosis(const codegen::Model& model, const codegen::Catalogue& catalogue,
                     std::vector<const calibration::Dataset*> train, std::vector<const calibration::Dataset*> narrow,
                     AtTurns at_turns)
    : model_(model), work_(std::make_unique<Work>(model, catalogue, std::move(train))) {
  Work& w = *work_;
  if (!narrow.empty()) w.narrow = std::make_unique<Work>(w, std::move(narrow));
  w.WeighKnocks(true);
  Selector select(w);
  // What friction does near turns and at rest is larger there than most of what else is missing, so it comes first.
  if (at_turns != AtTurns::kNever) w.chosen = select.FirstAtTurns(at_turns == AtTurns::kWhereAveraged);
  if (!w.chosen.empty()) w.Polish();
  double left = 1;  // of the time
  const auto find = [&](Chosen& next) {
    const io::Stage stage(kLooking * (1 - left), kLooking * (1 - left * (1 - kForATerm)));
    left *= 1 - kForATerm;
    return select.Next(Confirmed(w.chosen), next);
  };
  for (Chosen next; static_cast<int>(w.chosen.size()) < kMaxTerms && find(next);) {
    w.chosen.push_back(next);
    ApplyDelay(w);
    w.LeaveOutUnsettled(w.chosen.back());
    // A term that was found while another one was still unknown is a little wrong, and its error looks like further
    // terms. What shows near turns and at rest is slow to search, and other joints hardly move it.
    for (std::size_t k = 0; k + 1 < w.chosen.size(); ++k) {
      const Candidate& known = *w.chosen[k].candidate;
      if (!known.record().search.at_turns || SharesJoint(known, *next.candidate))
        w.chosen[k].earns = StaysIn(w, select, w.chosen[k]);
    }
    w.Polish();
  }
  const int most = static_cast<int>(w.chosen.size()) == kMaxTerms ? kMaxTerms : 0;
  // All terms but the latest have been searched again since the latest came.
  bool searched = true;
  for (std::size_t k = 0; w.chosen.size() > 1 && k < w.chosen.size();) {
    if (searched && k + 1 < w.chosen.size() ? w.chosen[k].earns : StaysIn(w, select, w.chosen[k])) {
      ++k;
    } else {
      w.chosen.erase(w.chosen.begin() + static_cast<long>(k));
      searched = false;
    }
  }
  std::stable_sort(w.chosen.begin(), w.chosen.end(),
                   [](const Chosen& a, const Chosen& b) { return a.found.score > b.found.score; });
  w.WeighKnocks(false);
  w.Polish();
  finding_.declared = w.declared;
  LeaveOutUndetermined(w, finding_);
  finding_.most_terms = most;
  for (int j = 0; j < model.joints(); ++j)
    if (w.turns[static_cast<std::size_t>(j)]) finding_.at_turns.push_back(j);
  for (int j = 0; j < model.joints(); ++j)
    if (!HasEnough(w.evidence.index[static_cast<std::size_t>(j)])) finding_.too_short.push_back(j);
  finding_.limits = DetectionLimits(w);
  finding_.smallest = TypicalLimits(finding_.limits, model.joints());
}

Diagnosis::~Diagnosis() = default;

namespace {

constexpr double kWorse = 1.005;        // what gets worse by more refutes a term
constexpr double kOfAllGains = 0.2;     // of what a term's joints gain: one of them may lose that much
constexpr double kOfThePromise = 0.15;  // of the gain that training promises: what gains less is not on this log
constexpr double kShows = 25;           // a gain that a term without any freedom never has by chance

bool IsOfTheRun(const Chosen& c) { return c.candidate->record().effect_class == codegen::EffectClass::kRunState; }

// A log as the confirmed terms say that it was measured.
calibration::Dataset AsTermsSay(const Diagnosis::Work& w, const calibration::Dataset& log) {
  return w.delay_s != 0 ? calibration::Delayed(log, w.delay_s) : log;
}

Quantities AtEstimate(const Diagnosis::Work& w, const std::vector<const Chosen*>& terms,
                      const calibration::Dataset& log) {
  const std::set<codegen::InputId> reads = w.Reads(terms);
  Quantities q = MakeQuantities(w.model, log, reads);
  Follow(w.model, w.arm, w.estimate.x, w.declared.eta, reads, q);
  return q;
}

// The residual of another log with the terms at w's estimate, [N x n]. tracking: says how run states were followed.
MatrixXd LeavesAtEstimate(const Diagnosis::Work& w, const std::vector<const Chosen*>& terms,
                          const calibration::Dataset& log, std::string* tracking) {
  const calibration::Dataset seen = AsTermsSay(w, log);
  const Quantities q = AtEstimate(w, terms, seen);
  MatrixXd left = log.tau - calibration::Predict(w.model, seen, w.estimate.x, w.declared.eta);
  if (tracking) tracking->clear();
  // Run states are followed in what is left once everything else has been taken off.
  for (const bool run_states : {false, true})
    for (std::size_t k = 0; k < terms.size(); ++k) {
      const Chosen& c = *terms[k];
      if (c.candidate->is_event() || IsOfTheRun(c) != run_states) continue;
      if (!run_states) {
        left -= CandidateTorque(*c.candidate, q, c.eta, w.estimate.amplitude[k]);
        continue;
      }
      const auto& t = w.train[0]->s.t;
      const RunState state = MakeRunState(*c.candidate, c.eta, w.estimate.amplitude[k], t[t.size() - 1] - t[0]);
      left -= Track(state, q, left, w.estimate.sigma);
      if (tracking) *tracking = "run states followed one step ahead; delay one sample";
    }
  return left;
}

// A payload is a change of the rigid coordinates, so the terms that follow the load follow it, too. leaves: [N x n] at
// given coordinates. On each half of the log it takes the payload of the other half.
template <class LeavesAt>
MatrixXd OnOtherHalves(const codegen::Model& model, const calibration::Carried& payload, const VectorXd& x,
                       const LeavesAt& leaves) {
  MatrixXd out = leaves(x + payload.Coordinates(model, 1));
  const Eigen::Index second = payload.begin_second, rest = out.rows() - second;
  out.bottomRows(rest) = leaves(x + payload.Coordinates(model, 0)).bottomRows(rest);
  return out;
}

// The same with the terms fitted; w keeps their estimate.
MatrixXd Leaves(Diagnosis::Work& w, const std::vector<const Chosen*>& terms, const calibration::Dataset& log,
                const calibration::Carried& payload, std::string* tracking = nullptr) {
  w.Solve(terms);
  if (!payload.named) return LeavesAtEstimate(w, terms, log, tracking);
  const VectorXd x = w.estimate.x;
  const MatrixXd left = OnOtherHalves(w.model, payload, x, [&](const VectorXd& laden) {
    w.estimate.x = laden;
    return LeavesAtEstimate(w, terms, log, tracking);
  });
  w.estimate.x = x;
  return left;
}

// What a log leaves, RMS of each joint: where it slides, and on the rows that are fitted. Those are all samples where
// rest and turns are fitted, too.
struct Errors {
  VectorXd sliding, fitted;
};

Errors ErrorsOf(const Diagnosis::Work& w, const calibration::Dataset& log, const MatrixXd& residual) {
  Errors out{calibration::RmsInBand(log, residual), {}};
  out.fitted = out.sliding;
  const VectorXd all = calibration::Rms(log, residual, false);
  for (std::size_t j = 0; j < w.turns.size(); ++j)
    if (w.turns[j]) out.fitted[static_cast<Eigen::Index>(j)] = all[static_cast<Eigen::Index>(j)];
  return out;
}

// Compares the errors with a term to those without it. One of its own joints can refute it, or all joints together. A
// term that acts on many joints may be a little wrong on one of them where it explains much of the others.
std::optional<Refutation> Worse(const Chosen& term, const VectorXd& with, const VectorXd& without) {
  const VectorXd change = (with.array().max(1e-12) / without.array().max(1e-12)).log();
  const auto& own = term.candidate->rows();
  const auto worst = std::max_element(own.begin(), own.end(), [&](int a, int b) { return change[a] < change[b]; });
  const double gained = -change(own).cwiseMin(0).sum();
  if (worst != own.end() && change[*worst] > std::log(kWorse) && change[*worst] > kOfAllGains * gained)
    return Refutation{*worst, false, std::exp(change[*worst]), with, without};
  // All joints together: the base fit moves with every term, so a term may help one joint and harm another.
  if (change.sum() > std::log(kWorse)) return Refutation{-1, false, std::exp(change.sum()), with, without};
  return {};
}

std::optional<Refutation> Worse(const Chosen& term, const Errors& with, const Errors& without) {
  // What is about turns and rest is judged where they count: the rows that slide are among the fitted ones.
  if (term.candidate->record().search.at_turns) return Worse(term, with.fitted, without.fitted);
  if (const auto why = Worse(term, with.sliding, without.sliding)) return why;
  return Worse(term, with.fitted, without.fitted);
}

// The rows of a term's joints, and the square of its torque in them.
struct Share {
  double rows = 0, square = 0;
};

Share ShareOf(const Diagnosis::Work& w, const Chosen& c, const VectorXd& amplitude,
              const std::vector<const calibration::Dataset*>& logs) {
  Share out;
  for (const auto* log : logs) {
    const MatrixXd torque = CandidateTorque(*c.candidate, AtEstimate(w, {&c}, *log), c.eta, amplitude);
    for (const int j : c.candidate->rows()) {
      const RowIndex rows = UsedRows({log}, j);
      VectorXd own(rows.size());
      rows.Take(0, torque.col(j), own);
      out.rows += rows.size(), out.square += own.squaredNorm();
    }
  }
  return out;
}

// Of the terms that predict one of their joints, or all joints together, worse than the declared model does, the one
// whose absence helps all joints most: a wrong term bends the base fit, and then the right ones beside it predict
// badly, too. Delays come last.
Chosen* WorstThanDeclared(Diagnosis::Work& w, const calibration::Dataset& log, const calibration::Carried& payload,
                          const Errors& before, const Errors& after, std::optional<Refutation>& why) {
  std::vector<std::pair<Chosen*, Refutation>> suspects;
  for (auto c = w.chosen.rbegin(); c != w.chosen.rend(); ++c)  // sorted, the strongest first
    if (c->confirmed && !c->candidate->is_event())
      if (const auto reason = Worse(*c, after, before)) suspects.emplace_back(&*c, *reason);
  if (suspects.empty()) return nullptr;
  auto worst = suspects.begin();
  double most = -std::numeric_limits<double>::infinity();
  for (auto s = suspects.begin(); s != suspects.end() && suspects.size() > 1; ++s) {
    if (s->first->delay_s != 0) continue;
    const Errors without = ErrorsOf(w, log, Leaves(w, Rivals(w.chosen, *s->first), log, payload));
    const double helps = (after.fitted.array().max(1e-12) / without.fitted.array().max(1e-12)).log().sum();
    if (helps > most) most = helps, worst = s;
  }
  why = worst->second;
  return worst->first;
}

// The term that goes next: one that predicts worse than the declared model does; if there is none, the weakest that
// predicts worse than the other terms do without it. A delay is not compared with the other terms: they were found on
// logs that it had aligned. A state of a run may also be refuted by the way that it takes there, another term by
// gaining much less than its torque on this log and its gain in training promise.
Chosen* Refuted(Diagnosis::Work& w, const calibration::Dataset& log, const calibration::Carried& payload,
                const MatrixXd& before, const MatrixXd& after, std::optional<Refutation>& why) {
  const Errors error_before = ErrorsOf(w, log, before), error_after = ErrorsOf(w, log, after);
  calibration::Dataset seen = AsTermsSay(w, log);
  for (int j = 0; j < w.model.joints(); ++j)
    if (w.turns[static_cast<std::size_t>(j)]) calibration::UseTurns(seen, j);
  std::map<const Chosen*, VectorXd> amplitude;
  for (const Chosen* c : Confirmed(w.chosen)) amplitude.emplace(c, w.estimate.amplitude[amplitude.size()]);
  if (Chosen* worst = WorstThanDeclared(w, log, payload, error_before, error_after, why)) return worst;
  for (auto c = w.chosen.rbegin(); c != w.chosen.rend(); ++c) {
    if (!c->confirmed || c->candidate->is_event()) continue;
    const std::vector<const Chosen*> others = Rivals(w.chosen, *c);
    if (c->delay_s != 0) continue;
    const MatrixXd without = Leaves(w, others, log, payload);
    if (!others.empty() && (why = Worse(*c, error_after, ErrorsOf(w, log, without)))) {
      why->beside_others = true;
      return &*c;
    }
    if (GoesToAndFroOn(*c->candidate, amplitude.at(&*c), AtEstimate(w, others, seen), without)) {
      c->unconfirmed = "on the held-out log it goes to and fro, which a state of a run does not";
      return &*c;
    }
    if (IsOfTheRun(*c)) continue;
    double gained = GainOn(seen, *c->candidate, without, after);
    if (gained >= kShows) continue;
    const Share trained = ShareOf(w, *c, amplitude.at(&*c), w.train),
                shown = ShareOf(w, *c, amplitude.at(&*c), {&seen});
    const double promised = c->found.rated * std::min(shown.square / trained.square, shown.rows / trained.rows);
    const double least = kOfThePromise * promised;
    if (gained < least && !payload.named) gained = std::max(gained, AddedBy(w, seen, *c, others));
    if (gained < least) {
      c->unconfirmed =
          fmt::format("the held-out log gains {:.0f} by it, where {:.0f} was to be expected from the training logs",
                      gained, promised);
      return &*c;
    }
  }
  return nullptr;
}

// Training could not tell some kinds apart, and the held-out log has refuted the one that would belong to the arm. A
// kind that belongs to the run takes its place. False if there is none.
bool OfTheRunInstead(Diagnosis::Work& w, const Chosen& refuted, Chosen& out) {
  for (const Rival& rival : refuted.rivals) {
    const auto& names = refuted.also_fits;
    if (rival.record->effect_class != codegen::EffectClass::kRunState ||
        std::find(names.begin(), names.end(), rival.record->kind) == names.end())
      continue;
    const auto is_it = [&](const auto& c) { return &c->record() == rival.record && c->joints() == rival.joints; };
    const auto candidate = std::find_if(w.candidates.begin(), w.candidates.end(), is_it);
    out = Chosen{};
    out.candidate = candidate->get();
    out.folds = refuted.folds;
    if (Selector(w).StillEarns(out, Confirmed(w.chosen))) return true;
  }
  return false;
}

}  // namespace

HeldOut Diagnosis::Judge(const calibration::Dataset& test, double gain_tolerance) {
  Work& w = *work_;
  HeldOut out;
  const auto declared = [&](const VectorXd& x) {
    return MatrixXd(test.tau - calibration::Predict(model_, test, x, w.declared.eta));
  };
  out.before = declared(w.declared.x);
  const MatrixXd with_terms = Leaves(w, Confirmed(w.chosen), test, {});
  out.payload = calibration::FindCarried(model_, w.declared, w.estimate.sigma, test, with_terms, gain_tolerance);
  const MatrixXd before = out.payload.named ? OnOtherHalves(model_, out.payload, w.declared.x, declared) : out.before;
  std::vector<std::optional<Refutation>> why;
  for (const Term& t : finding_.terms) why.push_back(t.refuted);
  for (;;) {
    out.after = Leaves(w, Confirmed(w.chosen), test, out.payload, &out.tracking);
    Work::Estimate with_all = w.estimate;
    std::optional<Refutation> reason;
    Chosen* refuted = Refuted(w, test, out.payload, before, out.after, reason);
    w.estimate = std::move(with_all);
    if (!refuted) break;
    const auto at = refuted - w.chosen.data();
    refuted->confirmed = false, refuted->not_held_out = true;
    why[static_cast<std::size_t>(at)] = reason;
    w.AlignLogs();
    if (Chosen instead; !IsOfTheRun(*refuted) && OfTheRunInstead(w, *refuted, instead)) {
      w.chosen.insert(w.chosen.begin() + at + 1, instead);
      why.insert(why.begin() + at + 1, std::nullopt);
    }
  }
  if (out.payload.named) out.without_payload = Leaves(w, Confirmed(w.chosen), test, {});
  WriteTerms(w, finding_);
  for (std::size_t k = 0; k < why.size(); ++k) finding_.terms[k].refuted = why[k];
  return out;
}

void Diagnosis::ConfirmNothing(const std::string& why) {
  for (Term& t : finding_.terms) {
    if (!t.confirmed || t.training_only || t.record->effect_class == codegen::EffectClass::kRunState) continue;
    t.confirmed = false, t.unconfirmed = why;
  }
}

std::vector<MatrixXd> Diagnosis::TermTorque(const calibration::Dataset& data) const {
  const Work& w = *work_;
  const calibration::Dataset seen = AsTermsSay(w, data);
  const Quantities q = AtEstimate(w, Confirmed(w.chosen), seen);
  std::vector<MatrixXd> out;
  std::size_t k = 0;
  for (const Chosen& c : w.chosen) {
    out.push_back(MatrixXd::Zero(data.samples(), data.joints()));
    if (!c.confirmed) continue;
    const VectorXd& amplitude = w.estimate.amplitude[k++];
    if (!c.candidate->is_event()) out.back() = CandidateTorque(*c.candidate, q, c.eta, amplitude);
    if (c.delay_s != 0)
      out.back() += calibration::ThroughChannel(data, q.tau_model) -
                    calibration::Predict(model_, data, w.estimate.x, w.declared.eta);
  }
  return out;
}

std::vector<calibration::Dataset> Diagnosis::WithoutTerms() const {
  const Work& w = *work_;
  const std::vector<const Chosen*> terms = Confirmed(w.chosen);
  std::vector<calibration::Dataset> out;
  for (const calibration::Dataset* log : w.train) {
    out.push_back(*log);
    if (terms.empty()) continue;
    const Quantities q = AtEstimate(w, terms, *log);
    for (std::size_t k = 0; k < terms.size(); ++k)
      out.back().tau -= CandidateTorque(*terms[k]->candidate, q, terms[k]->eta, w.estimate.amplitude[k]);
  }
  return out;
}

}  // namespace armcal::diagnosis
