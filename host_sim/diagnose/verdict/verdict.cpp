// verdict - shows one diagnosis: lines for the terminal, and each term over the signal that gave it away.
#include "host_sim/diagnose/verdict/verdict.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

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

// Mean of y in equal bins of x, where `use` holds: fine bins where there are samples for them, so that a short ripple
// keeps its shape.
report::Series Binned(const std::string& name, const VectorXd& x, const VectorXd& y, const Eigen::VectorXi& use) {
  constexpr int kFewestBins = 60, kMostBins = 240, kSamplesPerBin = 16;
  const int bins = std::clamp(use.sum() / kSamplesPerBin, kFewestBins, kMostBins);
  const double lo = x.minCoeff(), hi = x.maxCoeff();
  std::vector<double> sum(bins, 0), count(bins, 0);
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    if (!use[k] || hi <= lo) continue;
    const int b = std::min(bins - 1, static_cast<int>((x[k] - lo) / (hi - lo) * bins));
    sum[b] += y[k];
    ++count[b];
  }
  report::Series s{name, {}, {}, report::Style::kLine};
  for (int b = 0; b < bins; ++b)
    if (count[b] >= 3) s.x.push_back(lo + (b + 0.5) * (hi - lo) / bins), s.y.push_back(sum[b] / count[b]);
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
  const std::vector<std::string> strange = StrangeText(StrangeJoints(v), v.model->robot());
  std::string out = "verdict: " + Headline(*v.finding, !strange.empty()) + "\n";
  for (const std::string& line : strange) out += "  " + line + "\n";
  for (const std::string& line : PayloadText(v)) out += "  " + line + "\n";
  for (const std::size_t k : OrderOfTerms(v)) {
    const Term& t = v.finding->terms[k];
    out += fmt::format("  {}, joint {}{}: {}\n", t.record->kind, JointName(t), Remark(t), t.record->title);
    out += fmt::format("    {}\n", Sentence(v, k));
    if (t.in_fit) out += fmt::format("    {}\n", Parameters(t, v.model->robot()));
    if (const std::string marked = t.in_fit ? diagnosis::MarkText(t) : ""; !marked.empty())
      out += fmt::format("    do not use alone: {}\n", marked);
    if (!t.confirmed)
      out += fmt::format("    {}{}\n", t.refuted ? "refuted on the held-out log: " : "",
                         WhyNotConfirmed(t, v.model->robot()));
    if (!t.in_fit && t.not_held_out) continue;  // the page and the JSON say more of what was rejected
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

}  // namespace armcal::verdict
