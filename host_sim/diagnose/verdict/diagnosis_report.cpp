// verdict - a diagnosis as lines for the terminal.
#include "host_sim/diagnose/verdict/diagnosis_report.hpp"

#include <fmt/core.h>

#include "host_sim/diagnose/verdict/diagnosis_words.hpp"
#include "host_sim/diagnose/verdict/figures.hpp"

namespace armcal::verdict {

using diagnosis::Term;

std::string DiagnosisText(const DiagnosisView& v) {
  std::string out = "verdict: " + Headline(*v.finding) + "\n";
  for (std::size_t k = 0; k < v.finding->terms.size(); ++k) {
    const Term& t = v.finding->terms[k];
    out += fmt::format("  {}, joint {}{}: {}\n", t.record->kind, JointName(t), Remark(t), t.record->title);
    if (t.confirmed) out += fmt::format("    {}\n", Parameters(t));
    else out += fmt::format("    refuted on the held-out log: {}\n", WhyRefuted(t, v.model->robot()));
    out += fmt::format("    score {}; {}\n", ScoreText(t), FoldText(t));
    out += fmt::format("    runner-up: {}; fits equally: {}\n", RunnerUp(t), AlsoFits(t));
    for (const Separation& s : v.separation[k]) {
      out += fmt::format("    to tell it from {}: {}\n", s.from, s.how);
      out += fmt::format("      {}\n", s.command.empty() ? kNoMotion : s.command);
    }
    if (t.confirmed && !t.record->on_target) out += fmt::format("    {}\n", t.record->remedy);
  }
  return out + ExogeneityText(v.exogeneity, kLacksMore);
}

}  // namespace armcal::verdict
