// verdict - a diagnosis as a page: verdict, errors, and for each term its evidence and what gave it away.
#include <fmt/core.h>

#include <cmath>

#include "host_sim/data/report/axis.hpp"
#include "host_sim/diagnose/verdict/diagnosis_words.hpp"
#include "host_sim/diagnose/verdict/figures.hpp"

namespace armcal::verdict {

using diagnosis::Term;
using Eigen::VectorXd;

namespace {

// Residual of joint j where it moves, a gap elsewhere.
std::vector<double> Moving(const calibration::Dataset& d, const Eigen::MatrixXd& residual, int j) {
  std::vector<double> out(static_cast<std::size_t>(d.samples()));
  for (int k = 0; k < d.samples(); ++k) out[static_cast<std::size_t>(k)] = d.used(k, j) ? residual(k, j) : std::nan("");
  return out;
}

std::vector<double> Values(const VectorXd& v) { return {v.data(), v.data() + v.size()}; }

void AddSeparations(report::Page& page, const std::vector<Separation>& separations) {
  for (const Separation& s : separations) {
    page.Text(fmt::format("To tell it from {}: {}{}.", s.from, s.how,
                          s.command.empty() ? std::string(". ") + kNoMotion : ""));
    if (!s.command.empty()) page.Code(s.command);
  }
}

}  // namespace

void AddDiagnosis(report::Page& page, const DiagnosisView& v) {
  const auto& f = *v.finding;
  const auto& test = *v.test;
  std::string list;
  for (const Term& t : f.terms)
    list += (list.empty() ? "" : "; ") + fmt::format("{} on joint {}{}", t.record->kind, JointName(t), Remark(t));
  if (f.terms.empty())
    page.Box(report::Tone::kGood, "Nothing is missing",
             "No effect of the catalogue improves the declared model by more than chance would. What these logs would "
             "have shown is in the table: smallest effect seen.");
  else if (!AnyConfirmed(f))
    page.Box(report::Tone::kNeutral, "Nothing is missing that the held-out log bears out", list);
  else page.Box(report::Tone::kWarning, "The model lacks: " + list, f.terms[0].record->title);
  page.Section("Error on the held-out log");
  report::Table table{
      {"joint", "before", "after", "before, moving", "after, moving", "noise floor (estimate)", "smallest effect seen"},
      {},
      "RMS of measured minus predicted torque, N m. Before: the declared model fitted on the training "
      "logs; after: the same with the terms. Smallest effect seen: RMS of an effect that these logs would "
      "just have shown."};
  const VectorXd b = calibration::Rms(test, v.held_out->before, false),
                 a = calibration::Rms(test, v.held_out->after, false),
                 bm = calibration::Rms(test, v.held_out->before, true),
                 am = calibration::Rms(test, v.held_out->after, true);
  for (int j = 0; j < test.joints(); ++j)
    table.rows.push_back({std::to_string(j + 1), report::Number(b[j]), report::Number(a[j]), report::Number(bm[j]),
                          report::Number(am[j]), report::Number(f.sigma[j]), report::Number(f.smallest[j])});
  page.Add(table);
  if (!v.held_out->tracking.empty()) page.Text(v.held_out->tracking + ".");
  page.Section("Exogeneity");
  page.Text("A Durbin-Wu-Hausman test on the training logs, with the terms in the model.");
  page.Code(ExogeneityText(v.exogeneity, kLacksMore));
  for (std::size_t k = 0; k < f.terms.size(); ++k) {
    const Term& t = f.terms[k];
    page.Section(fmt::format("{}, joint {}", t.record->kind, JointName(t)));
    page.Text(t.record->title + ". " + t.record->source + ".");
    page.Facts({{"parameters", Parameters(t)},
                {"in the new model", InTheModel(t, v.model->robot())},
                {"score", ScoreText(t)},
                {"folds", FoldText(t)},
                {"runner-up", RunnerUp(t)},
                {"fits equally", AlsoFits(t)}});
    AddSeparations(page, v.separation[k]);
    if (t.training_only) {
      page.Text("Explained in the training log, no property of the arm: it is left out of the comparison above.");
      continue;
    }
    const Dependence d = DependenceOf(v, k);
    const int j = d.joint;
    report::Plot dependence{
        {fmt::format("what gave it away: residual of joint {}, mean over bins", j + 1), d.signal, d.torque},
        {d.without, d.term, d.remains}};
    page.Add(dependence, "Held-out log, moving samples.");
    report::Plot time{{fmt::format("residual of joint {} over time", j + 1), "time / s", d.torque},
                      {{"before", Values(test.s.t), Moving(test, v.held_out->before, j), report::Style::kLine},
                       {"after", Values(test.s.t), Moving(test, v.held_out->after, j), report::Style::kLine}}};
    page.Add(time,
             "Held-out log, where the joint moves; at standstill friction holds any torque up to its breakaway level.");
  }
}

}  // namespace armcal::verdict
