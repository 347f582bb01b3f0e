// diagnosis - adds terms one at a time, prunes them, writes down what was found.
#include "host_sim/diagnose/diagnosis/diagnose.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/diagnose/diagnosis/selector.hpp"
#include "host_sim/diagnose/diagnosis/work.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMaxTerms = 4;
constexpr double kTried = 10;  // members of a usual grid, for what would just have been seen

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
    t.score = c.found.score;
    t.folds = c.folds, t.also_fits = c.also_fits;
    t.rivals = c.rivals;
    t.training_only = c.candidate->is_event(), t.confirmed = c.confirmed;
    t.amplitude = VectorXd::Zero(c.candidate->columns(c.eta)), t.sd = t.amplitude;
    t.eta_sd = VectorXd::Zero(static_cast<Eigen::Index>(c.eta.size()));
    if (c.confirmed) {
      t.amplitude = w.estimate.amplitude[k];
      t.sd = deviation[k].amplitude, t.eta_sd = deviation[k].eta, ++k;
    }
    finding.terms.push_back(std::move(t));
  }
  finding.x = w.estimate.x;
  finding.sigma = w.estimate.sigma;
  finding.innovation = w.estimate.innovation;
}

Diagnosis::Diagnosis(const codegen::Model& model, const codegen::Catalogue& catalogue,
                     std::vector<const calibration::Dataset*> train, std::vector<const calibration::Dataset*> narrow)
    : model_(model), work_(std::make_unique<Work>(model, catalogue, std::move(train))) {
  Work& w = *work_;
  if (!narrow.empty()) {
    w.narrow = std::make_unique<Work>(model, codegen::Catalogue{}, std::move(narrow));
    w.narrow->all_reads = w.all_reads;
  }
  Selector select(w);
  for (Chosen next; static_cast<int>(w.chosen.size()) < kMaxTerms && select.Next(Confirmed(w.chosen), next);) {
    w.chosen.push_back(next);
    ApplyDelay(w);
    // What was found under an effect that nobody had named yet is a little off, and what is off looks like more terms.
    for (std::size_t k = 0; k + 1 < w.chosen.size(); ++k) w.chosen[k].earns = StaysIn(w, select, w.chosen[k]);
    w.Polish();
  }
  // All but the latest have been searched again since it came.
  bool searched = true;
  for (std::size_t k = 0; w.chosen.size() > 1 && k < w.chosen.size();) {
    if (searched && k + 1 < w.chosen.size() ? w.chosen[k].earns : StaysIn(w, select, w.chosen[k])) {
      ++k;
    } else {
      w.chosen.erase(w.chosen.begin() + static_cast<long>(k));
      searched = false;
    }
  }
  std::sort(w.chosen.begin(), w.chosen.end(),
            [](const Chosen& a, const Chosen& b) { return a.found.score > b.found.score; });
  w.Polish();
  finding_.declared = w.declared;
  WriteTerms(w, finding_);
  finding_.smallest.resize(model.joints());
  for (int j = 0; j < model.joints(); ++j) {
    const double rows = std::max(2, w.evidence.index[j].size());
    finding_.smallest[j] = finding_.sigma[j] * std::sqrt((kAccept + 2 * std::log(rows) + 2 * std::log(kTried)) / rows);
  }
}

Diagnosis::~Diagnosis() = default;

}  // namespace armcal::diagnosis
