// diagnosis - what terms leave of a log, and which of them a log that was held out refutes.
#include <algorithm>
#include <cmath>

#include "host_sim/diagnose/diagnosis/run_state.hpp"
#include "host_sim/diagnose/diagnosis/selector.hpp"
#include "host_sim/diagnose/diagnosis/work.hpp"
#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kWorse = 1.005;  // what gets worse by more refutes a term

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

// What the declared model with these terms leaves of another log, [N x n]; w keeps their estimate. tracking: how run
// states among them were followed.
MatrixXd Leaves(Diagnosis::Work& w, const std::vector<const Chosen*>& terms, const calibration::Dataset& log,
                std::string* tracking = nullptr) {
  w.Solve(terms);
  const calibration::Dataset seen = AsTermsSay(w, log);
  const Quantities q = AtEstimate(w, terms, seen);
  MatrixXd left = log.tau - calibration::Predict(w.model, seen, w.estimate.x, w.declared.eta);
  if (tracking) tracking->clear();
  // Run states are followed in what is left once everything else has been taken off.
  for (const bool run_states : {false, true})
    for (std::size_t k = 0; k < terms.size(); ++k) {
      const Chosen& c = *terms[k];
      const bool is_run_state = c.candidate->record().effect_class == codegen::EffectClass::kRunState;
      if (c.candidate->is_event() || is_run_state != run_states) continue;
      if (!is_run_state) {
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

// Whether these errors with a term refute it beside those without it: those of a joint of its own, or all together.
std::optional<Refutation> Worse(const Chosen& term, const VectorXd& with, const VectorXd& without) {
  const VectorXd change = (with.array().max(1e-12) / without.array().max(1e-12)).log();
  const auto& own = term.candidate->rows();
  const auto worst = std::max_element(own.begin(), own.end(), [&](int a, int b) { return change[a] < change[b]; });
  if (worst != own.end() && change[*worst] > std::log(kWorse))
    return Refutation{*worst, false, std::exp(change[*worst]), with, without};
  // All joints: the base fit moves with every term, and where more is missing one joint's gain is another's loss.
  if (change.sum() > std::log(kWorse)) return Refutation{-1, false, std::exp(change.sum()), with, without};
  return {};
}

// The weakest term that makes a joint of its own worse, or all joints together: than the declared model is, or than the
// other terms that could tell its cause are without it. A delay is judged with all others, which were found on logs
// that it had aligned.
Chosen* Refuted(Diagnosis::Work& w, const calibration::Dataset& log, const VectorXd& before, const VectorXd& after,
                std::optional<Refutation>& why) {
  for (auto c = w.chosen.rbegin(); c != w.chosen.rend(); ++c) {  // sorted, the strongest first
    if (!c->confirmed || c->candidate->is_event()) continue;
    if ((why = Worse(*c, after, before))) return &*c;
    const std::vector<const Chosen*> others = Rivals(w.chosen, *c);
    if (others.empty() || c->delay_s != 0) continue;
    if ((why = Worse(*c, after, calibration::Rms(log, Leaves(w, others, log), true)))) {
      why->beside_others = true;
      return &*c;
    }
  }
  return nullptr;
}

// Of kinds that training could not tell apart the held-out log has refuted one that would be the arm's own: what it
// leaves of them belongs to the run. False if nothing does.
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

HeldOut Diagnosis::Judge(const calibration::Dataset& test) {
  Work& w = *work_;
  HeldOut out;
  out.before = test.tau - calibration::Predict(model_, test, w.declared.x, w.declared.eta);
  const VectorXd before = calibration::Rms(test, out.before, true);
  std::vector<std::optional<Refutation>> why;
  for (const Term& t : finding_.terms) why.push_back(t.refuted);
  for (;;) {
    out.after = Leaves(w, Confirmed(w.chosen), test, &out.tracking);
    Work::Estimate with_all = w.estimate;
    std::optional<Refutation> reason;
    Chosen* refuted = Refuted(w, test, before, calibration::Rms(test, out.after, true), reason);
    w.estimate = std::move(with_all);
    if (!refuted) break;
    const auto at = refuted - w.chosen.data();
    refuted->confirmed = false;
    why[static_cast<std::size_t>(at)] = reason;
    w.AlignLogs();
    if (Chosen instead; OfTheRunInstead(w, *refuted, instead)) {
      w.chosen.insert(w.chosen.begin() + at + 1, instead);
      why.insert(why.begin() + at + 1, std::nullopt);
    }
  }
  WriteTerms(w, finding_);
  for (std::size_t k = 0; k < why.size(); ++k) finding_.terms[k].refuted = why[k];
  return out;
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
    if (c.delay_s != 0) out.back() += q.tau_model - calibration::Predict(model_, data, w.estimate.x, w.declared.eta);
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
