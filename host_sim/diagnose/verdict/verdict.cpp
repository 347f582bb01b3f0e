// verdict - shows one diagnosis: lines for the terminal, a page, and each term over the signal that gave it away.
#include "host_sim/diagnose/verdict/verdict.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "host_sim/data/report/axis.hpp"
#include "host_sim/diagnose/diagnosis/determined.hpp"
#include "host_sim/diagnose/verdict/figures.hpp"
#include "host_sim/diagnose/verdict/words.hpp"

namespace armcal::verdict {

using diagnosis::Term;
using Eigen::VectorXd;

namespace {

// The signal over which the term's dependence is drawn, over the test log.
std::pair<std::string, VectorXd> Abscissa(const DiagnosisView& v, const Term& t) {
  const auto& s = v.test->s;
  const std::string& signal = t.record->signals.empty() ? "qd" : t.record->signals[0];
  const bool other = signal == "q[k]" || signal == "qd[k]";
  const int j = other ? t.joints.at(1) : t.joints.empty() ? v.model->joints() - 1 : t.joints[0];
  const bool slides = v.model->robot().joint[j].kinematics.type == codegen::JointType::kPrismatic;
  if (signal == "q" || signal == "q[k]") return {fmt::format("q{} / {}", j + 1, slides ? "m" : "rad"), s.q.col(j)};
  if (signal == "temp" && s.temp.cols() > j) return {fmt::format("temperature {} / deg C", j + 1), s.temp.col(j)};
  if (signal == "t") return {"time / s", s.t};
  if (signal == "tau_rigid")
    return {fmt::format("{} of joint {} / {}", slides ? "force" : "torque", j + 1, slides ? "N" : "N m"),
            v.test->tau.col(j)};
  return {fmt::format("speed of joint {} / {}/s", j + 1, slides ? "m" : "rad"), s.qd.col(j)};
}

// Mean of y in equal bins of x, where `use` holds.
report::Series Binned(const std::string& name, const VectorXd& x, const VectorXd& y, const Eigen::VectorXi& use) {
  constexpr int kBins = 60;
  const double lo = x.minCoeff(), hi = x.maxCoeff();
  std::vector<double> sum(kBins, 0), count(kBins, 0);
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    if (!use[k] || hi <= lo) continue;
    const int b = std::min(kBins - 1, static_cast<int>((x[k] - lo) / (hi - lo) * kBins));
    sum[b] += y[k];
    ++count[b];
  }
  report::Series s{name, {}, {}, report::Style::kLine};
  for (int b = 0; b < kBins; ++b)
    if (count[b] >= 3) s.x.push_back(lo + (b + 0.5) * (hi - lo) / kBins), s.y.push_back(sum[b] / count[b]);
  return s;
}

}  // namespace

Dependence DependenceOf(const DiagnosisView& v, std::size_t term) {
  const Term& t = v.finding->terms[term];
  Dependence d;
  d.joint = t.joints.empty() ? 1 % v.test->joints() : t.joints[0];
  const auto [label, x] = Abscissa(v, t);
  const VectorXd own = v.term_torque[term].col(d.joint), remains = v.held_out->after.col(d.joint);
  const auto moving = v.test->moving.col(d.joint);
  d.signal = label;
  const bool slides = v.model->robot().joint[d.joint].kinematics.type == codegen::JointType::kPrismatic;
  d.torque =
      slides ? fmt::format("force of joint {} / N", d.joint + 1) : fmt::format("torque of joint {} / N m", d.joint + 1);
  d.without = Binned("without the term", x, remains + own, moving);
  d.term = Binned("the term", x, own, moving);
  d.remains = Binned("what remains", x, remains, moving);
  return d;
}

std::string DiagnosisText(const DiagnosisView& v) {
  std::string out = "verdict: " + Headline(*v.finding) + "\n";
  for (const std::string& line : PayloadText(v)) out += "  " + line + "\n";
  for (std::size_t k = 0; k < v.finding->terms.size(); ++k) {
    const Term& t = v.finding->terms[k];
    out += fmt::format("  {}, joint {}{}: {}\n", t.record->kind, JointName(t), Remark(t), t.record->title);
    out += fmt::format("    {}\n", Sentence(v, k));
    if (t.in_fit) out += fmt::format("    {}\n", Parameters(t));
    if (const std::string marked = t.in_fit ? diagnosis::MarkText(t) : ""; !marked.empty())
      out += fmt::format("    do not use alone: {}\n", marked);
    if (!t.confirmed)
      out += fmt::format("    {}{}\n", t.refuted ? "refuted on the held-out log: " : "",
                         WhyNotConfirmed(t, v.model->robot()));
    out += fmt::format("    score {}; {}\n", ScoreText(t), FoldText(t));
    out += fmt::format("    runner-up: {}; fits equally: {}\n", RunnerUp(t), AlsoFits(t));
    for (const Separation& s : v.separation[k]) {
      out += fmt::format("    to tell it from {}: {}\n", s.from, s.how);
      out += fmt::format("      {}\n", s.command.empty() ? kNoMotion : s.command);
    }
    if (t.confirmed && !t.record->on_target) out += fmt::format("    {}\n", t.record->remedy);
  }
  for (const std::string& line : MotionText(v.motion)) out += line + "\n";
  out += ExogeneityText(v.exogeneity, kLacksMore);
  const char* title = "not looked at: ";
  for (const std::string& line : NotLookedAt(v)) out += title + line + "\n", title = "               ";
  return out;
}

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
  if (f.terms.empty() && !f.too_short.empty()) page.Box(report::Tone::kNeutral, Headline(f), "");
  else if (f.terms.empty())
    page.Box(report::Tone::kGood, "Nothing is missing",
             "No effect of the catalogue improves the declared model by more than chance would. What these logs would "
             "have shown is in the table: smallest effect seen.");
  else if (!AnyConfirmed(f)) page.Box(report::Tone::kNeutral, Headline(f), list);
  else page.Box(report::Tone::kWarning, "The model lacks: " + list, f.terms[0].record->title);
  std::vector<std::string> sentences;
  for (std::size_t k = 0; k < f.terms.size(); ++k) sentences.push_back(Sentence(v, k));
  if (!sentences.empty()) page.List(sentences);
  if (const auto lines = PayloadText(v); !lines.empty()) {
    page.Section("A payload of the held-out log");
    page.List(lines);
  }
  if (const auto lines = MotionText(v.motion); !lines.empty()) {
    page.Section("What the held-out log cannot tell");
    page.List(lines);
  }
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
  if (const auto lines = NotLookedAt(v); !lines.empty()) {
    page.Section("Not looked at");
    page.List(lines);
  }
  page.Section("Exogeneity");
  page.Text("A Durbin-Wu-Hausman test on the training logs, with the terms in the model.");
  page.Code(ExogeneityText(v.exogeneity, kLacksMore));
  for (std::size_t k = 0; k < f.terms.size(); ++k) {
    const Term& t = f.terms[k];
    page.Section(fmt::format("{}, joint {}", t.record->kind, JointName(t)));
    page.Text(t.record->title + ". " + t.record->source + ".");
    page.Facts({{"parameters", Parameters(t)},
                {"not to be used alone", t.in_fit ? diagnosis::MarkText(t) : ""},
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
