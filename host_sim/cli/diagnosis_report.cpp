// cli - what a diagnosis shows: numbers, plots, a robot file.
#include "host_sim/cli/diagnosis_report.hpp"

#include <fmt/core.h>
#include <algorithm>
#include <cmath>
#include <fstream>

#include "host_sim/cli/logs.hpp"
#include "host_sim/report/axis.hpp"

namespace armcal::cli {

using diagnosis::Term;
using Eigen::VectorXd;

namespace {

std::string Amplitudes(const Term& t) {
  std::string out;
  for (std::size_t k = 0; k < t.eta.size(); ++k)
    out += fmt::format("{}{} = {:.4g} {}", out.empty() ? "" : ", ", t.unknowns[k].name, t.eta[k], t.unknowns[k].unit);
  for (std::size_t c = 0; c < t.columns.size() && c < 4; ++c)
    out += fmt::format("{}{} = {:.4g} +- {:.2g} {}", out.empty() ? "" : ", ", t.columns[c].name, t.amplitude[c],
                       t.sd[c], t.columns[c].unit);
  if (t.columns.size() > 4) out += ", ...";
  return out;
}

// Residual of joint j where it moves, a gap elsewhere.
std::vector<double> Moving(const calibration::Dataset& d, const Eigen::MatrixXd& residual, int j) {
  std::vector<double> out(static_cast<std::size_t>(d.samples()));
  for (int k = 0; k < d.samples(); ++k) out[static_cast<std::size_t>(k)] = d.used(k, j) ? residual(k, j) : std::nan("");
  return out;
}

std::vector<double> Values(const VectorXd& v) { return {v.data(), v.data() + v.size()}; }

}  // namespace

bool AnyConfirmed(const diagnosis::Finding& f) {
  return std::any_of(f.terms.begin(), f.terms.end(), [](const Term& t) { return t.confirmed; });
}

bool IsUnknown(const Term& t) { return t.record->kind != t.record->name; }

std::string JointName(const Term& t) {
  if (t.joints.size() == 1 || IsUnknown(t)) return std::to_string(t.joints[0] + 1);
  if (t.joints.size() == 2) return fmt::format("{}-{}", t.joints[0] + 1, t.joints[1] + 1);
  return t.record->place;
}

std::string DiagnosisText(const DiagnosisView& v) {
  std::string out;
  if (v.finding->terms.empty()) {
    out =
        "verdict: none. Nothing is missing that these logs could show; the smallest effect they would have shown, RMS "
        "per joint:";
    for (int j = 0; j < v.model->joints(); ++j) out += fmt::format(" {:.2g}", v.finding->smallest[j]);
    return out + "\n";
  }
  out = AnyConfirmed(*v.finding)
            ? "verdict: effect\n"
            : "verdict: none. What the training logs suggested did not hold on the held-out log:\n";
  for (const Term& t : v.finding->terms) {
    out += fmt::format("  {}, joint {}{}: {}\n", t.record->kind, JointName(t),
                       t.confirmed ? "" : " (NOT CONFIRMED on the held-out log)", t.record->title);
    if (t.confirmed) out += fmt::format("    {}\n", Amplitudes(t));
    for (const std::string& other : t.also_fits) out += fmt::format("    fits equally: {}\n", other);
    out +=
        fmt::format("    score {:.0f}{}\n", t.score,
                    t.runner_up.empty() ? "" : fmt::format(", runner-up {} ({:.0f})", t.runner_up, t.runner_up_score));
  }
  return out;
}

void AddDiagnosis(report::Page& page, const DiagnosisView& v) {
  const auto& f = *v.finding;
  const auto& test = *v.test;
  if (f.terms.empty()) {
    page.Box(report::Tone::kGood, "Nothing is missing",
             "No effect of the catalogue improves the declared model by more than chance would.");
  } else {
    std::string list;
    for (const Term& t : f.terms)
      list += (list.empty() ? "" : "; ") +
              fmt::format("{} on joint {}{}", t.record->kind, JointName(t), t.confirmed ? "" : " (not confirmed)");
    page.Box(report::Tone::kWarning, "The model lacks: " + list, f.terms[0].record->title);
  }
  page.Section("Error on the held-out log");
  report::Table table{{"joint", "before", "after", "before, moving", "after, moving", "noise floor (estimate)",
                       "smallest effect visible"},
                      {},
                      "RMS of measured minus predicted torque, N m. Before: the declared model fitted on the training "
                      "logs; after: the same with the terms."};
  const VectorXd b = calibration::Rms(test, v.held_out->before, false),
                 a = calibration::Rms(test, v.held_out->after, false),
                 bm = calibration::Rms(test, v.held_out->before, true),
                 am = calibration::Rms(test, v.held_out->after, true);
  for (int j = 0; j < test.joints(); ++j)
    table.rows.push_back({std::to_string(j + 1), report::Number(b[j]), report::Number(a[j]), report::Number(bm[j]),
                          report::Number(am[j]), report::Number(f.sigma[j]), report::Number(f.smallest[j])});
  page.Add(table);
  if (!v.held_out->tracking.empty()) page.Text(v.held_out->tracking + ".");
  for (std::size_t k = 0; k < f.terms.size(); ++k) {
    const Term& t = f.terms[k];
    page.Section(fmt::format("{}, joint {}", t.record->kind, JointName(t)));
    page.Text(t.record->title + ". " + t.record->source + ".");
    page.Facts(
        {{"parameters", Amplitudes(t)},
         {"score", fmt::format("{:.0f} (accepted above 15)", t.score)},
         {"folds", fmt::format("improves {} of {} blocks of the training log that it was not fitted to",
                               (t.folds.array() > 0).count(), t.folds.size())},
         {"runner-up", t.runner_up.empty() ? "none" : fmt::format("{} (score {:.0f})", t.runner_up, t.runner_up_score)},
         {"fits equally", t.also_fits.empty() ? "nothing else in the catalogue"
                                              : fmt::format("{}{}", t.also_fits[0],
                                                            t.also_fits.size() > 1 ? ", " + t.also_fits[1] : "")}});
    const Dependence d = DependenceOf(v, k);
    const int j = d.joint;
    report::Plot dependence{
        {fmt::format("what gave it away: residual of joint {}, mean over bins", j + 1), d.signal, "torque / N m"},
        {d.without, d.term, d.remains}};
    page.Add(dependence, "Held-out log, moving samples.");
    report::Plot time{{fmt::format("residual of joint {} over time", j + 1), "time / s", "torque / N m"},
                      {{"before", Values(test.s.t), Moving(test, v.held_out->before, j), report::Style::kLine},
                       {"after", Values(test.s.t), Moving(test, v.held_out->after, j), report::Style::kLine}}};
    page.Add(time,
             "Held-out log, where the joint moves; at standstill friction holds any torque up to its breakaway level.");
  }
}

std::string RobotFileWithTerms(const codegen::Model& model, const diagnosis::Finding& finding,
                               const std::string& provenance) {
  std::ifstream in(model.robot().path);
  std::string text(std::istreambuf_iterator<char>(in), {});
  if (!text.empty() && text.back() != '\n') text += '\n';
  for (const Term& t : finding.terms) {
    if (!t.confirmed) continue;
    text += fmt::format("\n# Found by armcal diagnose: {}. Record: codegen/effects/{}.toml. {}\n", t.record->title,
                        t.record->name, provenance);
    if (!t.record->in_model()) {
      text += fmt::format("# {} describes {}; it is not compiled into the model.\n", t.record->name,
                          t.record->on_target ? "the measurement" : "one run only");
      continue;
    }
    text += fmt::format("[[effect]]\nname = \"{}\"\nstate = \"estimated\"\n", t.record->name);
    std::string joints;
    for (const int j : t.joints) joints += fmt::format("{}{}", joints.empty() ? "" : ", ", j + 1);
    if (!joints.empty()) text += fmt::format("joints = [{}]\n", joints);
    std::string mean, nonlinear;
    for (std::size_t c = 0; c < t.columns.size(); ++c) {
      mean += fmt::format("{}{} = {:.9e}", mean.empty() ? "" : ", ", t.columns[c].key, t.amplitude[c]);
      text +=
          fmt::format("# {} = {:.5g} +- {:.2g} {}\n", t.columns[c].name, t.amplitude[c], t.sd[c], t.columns[c].unit);
    }
    for (std::size_t k = 0; k < t.eta.size(); ++k)
      nonlinear += fmt::format("{}{} = {:.9e}", nonlinear.empty() ? "" : ", ", t.unknowns[k].key, t.eta[k]);
    text += "mean = { " + mean + " }\n";
    if (!nonlinear.empty()) text += "nonlinear = { " + nonlinear + " }\n";
  }
  return text;
}

}  // namespace armcal::cli
