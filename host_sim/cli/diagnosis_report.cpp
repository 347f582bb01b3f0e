// cli - what a diagnosis shows: numbers, plots, a robot file.
#include "host_sim/cli/diagnosis_report.hpp"

#include <fmt/core.h>
#include <algorithm>
#include <cmath>

#include "host_sim/cli/logs.hpp"
#include "host_sim/report/axis.hpp"

namespace armcal::cli {

using diagnosis::Term;
using Eigen::VectorXd;

namespace {

// Of a curve that names no cause the joint is the one whose torque it changes; the other is among the signals.
bool IsUnknown(const Term& t) { return t.record->kind != t.record->name; }

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

std::vector<std::string> Signals(const Term& t) {
  std::vector<std::string> out;
  const std::string joint = t.joints.empty() ? "" : std::to_string(t.joints[0] + 1);
  for (std::string s : t.record->signals) {
    if (s == "t") out.push_back("time");
    else if (s.ends_with("[k]")) out.push_back(s.substr(0, s.size() - 3) + std::to_string(t.joints.at(1) + 1));
    else if (s.back() == ')') out.push_back(s.insert(s.size() - 1, joint));
    else out.push_back(s == "tau_rigid" ? "load" + joint : s + joint);
  }
  return out;
}

// The signal over which the term's dependence is drawn, over the test log.
std::pair<std::string, VectorXd> Abscissa(const DiagnosisView& v, const Term& t) {
  const auto& s = v.test->s;
  const int j = t.joints.empty() ? v.model->joints() - 1 : t.joints[0];
  const std::string& signal = t.record->signals.empty() ? "qd" : t.record->signals[0];
  const std::string number = std::to_string(j + 1);
  if (signal == "qd[k]")
    return {"speed of joint " + std::to_string(t.joints.at(1) + 1) + " / rad/s", s.qd.col(t.joints.at(1))};
  if (signal == "q[k]") return {"q" + std::to_string(t.joints.at(1) + 1) + " / rad", s.q.col(t.joints.at(1))};
  if (signal == "q") return {"q" + number + " / rad", s.q.col(j)};
  if (signal == "temp" && s.temp.cols() > j) return {"temperature " + number + " / deg C", s.temp.col(j)};
  if (signal == "t") return {"time / s", s.t};
  if (signal == "tau_rigid") return {"torque of joint " + number + " / N m", v.test->tau.col(j)};
  return {"speed of joint " + number + " / rad/s", s.qd.col(j)};
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

std::string JointName(const Term& t) {
  if (t.joints.size() == 1 || IsUnknown(t)) return std::to_string(t.joints[0] + 1);
  if (t.joints.size() == 2) return fmt::format("{}-{}", t.joints[0] + 1, t.joints[1] + 1);
  return t.record->place;
}

nlohmann::ordered_json DiagnosisJson(const DiagnosisView& v) {
  const auto& f = *v.finding;
  nlohmann::ordered_json j;
  j["verdict"] = AnyConfirmed(f) ? "effect" : "none";
  j["joint_base"] = 1;
  j["terms"] = nlohmann::ordered_json::array();
  for (const Term& t : f.terms) {
    nlohmann::ordered_json term{{"kind", t.record->kind}, {"record", t.record->name}};
    if (t.joints.size() == 1 || IsUnknown(t)) term["joint"] = t.joints[0] + 1;
    else term["joint"] = JointName(t);
    term["signals"] = Signals(t);
    nlohmann::ordered_json parameters, deviations;
    for (std::size_t k = 0; k < t.eta.size(); ++k) {
      parameters[t.unknowns[k].name] = t.eta[k];
      if (t.eta_sd[static_cast<Eigen::Index>(k)] > 0)
        deviations[t.unknowns[k].name] = t.eta_sd[static_cast<Eigen::Index>(k)];
    }
    for (std::size_t c = 0; c < t.columns.size(); ++c)
      parameters[t.columns[c].name] = t.amplitude[c], deviations[t.columns[c].name] = t.sd[c];
    term["parameters"] = parameters;
    term["parameter_sd"] = deviations;
    term["also_fits"] = t.also_fits;
    term["confirmed"] = t.confirmed;
    term["score"] = t.score;
    term["folds"] = ToList(t.folds);
    term["runner_up"] = t.runner_up;
    term["runner_up_score"] = t.runner_up_score;
    j["terms"].push_back(term);
  }
  const auto& test = *v.test;
  j["before"] = ToList(calibration::Rms(test, v.held_out->before, false));
  j["after"] = ToList(calibration::Rms(test, v.held_out->after, false));
  j["before_moving"] = ToList(calibration::Rms(test, v.held_out->before, true));
  j["after_moving"] = ToList(calibration::Rms(test, v.held_out->after, true));
  std::vector<double> share;
  for (int k = 0; k < test.joints(); ++k) share.push_back(test.moving.col(k).cast<double>().mean());
  j["moving_share"] = share;
  j["noise_floor"] = ToList(f.sigma);
  j["noise_innovation"] = ToList(f.innovation);
  j["smallest_detectable"] = ToList(f.smallest);
  if (!v.held_out->tracking.empty()) j["tracking"] = v.held_out->tracking;
  j["seconds"] = v.seconds;
  return j;
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
    const int j = t.joints.empty() ? 1 % test.joints() : t.joints[0];
    const auto [label, x] = Abscissa(v, t);
    const VectorXd without =
        v.held_out->after.col(j) + v.term_torque[k].col(j);  // what this term alone explains is put back
    report::Plot dependence{
        {fmt::format("what gave it away: residual of joint {}, mean over bins", j + 1), label, "torque / N m"},
        {Binned("without the term", x, without, test.moving.col(j)),
         Binned("the term", x, v.term_torque[k].col(j), test.moving.col(j)),
         Binned("what remains", x, v.held_out->after.col(j), test.moving.col(j))}};
    page.Add(dependence, "Held-out log, moving samples.");
    report::Plot time{{fmt::format("residual of joint {} over time", j + 1), "time / s", "torque / N m"},
                      {{"before", Values(test.s.t), Moving(test, v.held_out->before, j), report::Style::kLine},
                       {"after", Values(test.s.t), Moving(test, v.held_out->after, j), report::Style::kLine}}};
    page.Add(time,
             "Held-out log, where the joint moves; at standstill friction holds any torque up to its breakaway level.");
  }
}

}  // namespace armcal::cli
