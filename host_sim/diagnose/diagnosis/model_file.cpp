// diagnosis - writes the found terms into a robot file: as [[effect]] tables, or as comments if no model can hold them.
#include "host_sim/diagnose/diagnosis/diagnose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>

namespace armcal::diagnosis {

namespace {

// The declared file. What it names beside itself is named from anywhere, for the new file may lie elsewhere.
std::string Declared(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::string text;
  const std::regex urdf("^\\s*urdf\\s*=\\s*[\"']([^\"']+)[\"'](.*)");
  std::smatch found;
  for (std::string line; std::getline(in, line);) {
    if (std::regex_match(line, found, urdf))
      line = fmt::format("urdf = \"{}\"{}", std::filesystem::absolute(path.parent_path() / found[1].str()).string(),
                         found[2].str());
    text += line + "\n";
  }
  return text;
}

bool IsFrictionLaw(const codegen::EffectInstance& e) { return e.record->friction_law || !e.record->replaces.empty(); }

// Terms stand beside the declared friction as it was fitted with them. Beside other friction their sum may push. So the
// fitted friction of their joints is written, too, unless a term takes its place.
std::string FrictionBeside(const codegen::Model& model, const Finding& finding) {
  std::string text;
  for (const codegen::EffectInstance& e : model.effects()) {
    if (!IsFrictionLaw(e)) continue;
    const auto written = [&](const Term& t) { return t.confirmed && t.record->on_target; };
    const bool beside = std::any_of(finding.terms.begin(), finding.terms.end(), [&](const Term& t) {
      return written(t) && std::find(t.joints.begin(), t.joints.end(), e.joints[0]) != t.joints.end();
    });
    const bool replaced = std::any_of(finding.terms.begin(), finding.terms.end(), [&](const Term& t) {
      return written(t) && t.record->replaces == e.record->name && t.joints == e.joints;
    });
    if (!beside || replaced) continue;
    std::string mean;
    for (const codegen::EffectColumn& column : e.columns)
      for (int c = 0; c < model.columns(); ++c)
        if (!model.is_rigid(c) && model.column_name(c) == column.name &&
            model.table()[static_cast<std::size_t>(model.table_index(c))].state == "estimated")
          mean += fmt::format("{}{} = {:.9e}", mean.empty() ? "" : ", ", column.key,
                              std::clamp(finding.x[c], column.lower, column.upper));
    if (!mean.empty())
      text += fmt::format(
          "\n# The friction that was fitted beside what was found.\n[[effect]]\nname = \"{}\"\njoints = [{}]\nmean = {{ {} "
          "}}\n",
          e.record->name, e.joints[0] + 1, mean);
  }
  return text;
}

// The declared law's own value of this column, as fitted: a law that takes its place has to do its work, too.
double DeclaredShare(const codegen::Model& model, const Finding& finding, const Term& t, const std::string& key) {
  for (const codegen::EffectInstance& e : model.effects()) {
    if (t.record->replaces.empty() || e.record->name != t.record->replaces || e.joints != t.joints) continue;
    for (const codegen::EffectColumn& column : e.columns)
      for (int c = 0; c < model.columns(); ++c)
        if (column.key == key && !model.is_rigid(c) && model.column_name(c) == column.name) return finding.x[c];
  }
  return 0;
}

std::string Parameter(const std::string& name, double value, double sd, const std::string& unit) {
  return fmt::format("# {} = {:.5g}{} {}\n", name, value, sd > 0 ? fmt::format(" +- {:.2g}", sd) : "", unit);
}

std::string Comments(const Term& t, const std::string& provenance) {
  std::string text = fmt::format("\n# Found by armcal diagnose: {}\n# Record: codegen/effects/{}.toml. {}\n",
                                 t.record->title, t.record->name, provenance);
  text += fmt::format("# Score {:.0f}. {}.\n", t.score, ChanceText(t));
  for (std::size_t k = 0; k < t.eta.size(); ++k)
    text += Parameter(t.unknowns[k].name, t.eta[k], t.eta_sd[static_cast<Eigen::Index>(k)], t.unknowns[k].unit);
  for (std::size_t c = 0; c < t.columns.size(); ++c)
    if (!t.columns[c].fixed_amplitude)
      text += Parameter(t.columns[c].name, t.amplitude[static_cast<Eigen::Index>(c)],
                        t.sd[static_cast<Eigen::Index>(c)], t.columns[c].unit);
  return text;
}

std::string EffectTable(const codegen::Model& model, const Finding& finding, const Term& t) {
  std::string joints, mean, nonlinear;
  for (const int j : t.joints) joints += fmt::format("{}{}", joints.empty() ? "" : ", ", j + 1);
  for (std::size_t c = 0; c < t.columns.size(); ++c) {
    const codegen::EffectColumn& column = t.columns[c];
    if (column.fixed_amplitude) continue;  // the record's own
    const double value = t.amplitude[static_cast<Eigen::Index>(c)] + DeclaredShare(model, finding, t, column.key);
    mean += fmt::format("{}{} = {:.9e}", mean.empty() ? "" : ", ", column.key,
                        std::clamp(value, column.lower, column.upper));
  }
  for (std::size_t k = 0; k < t.eta.size(); ++k)
    nonlinear += fmt::format("{}{} = {:.9e}", nonlinear.empty() ? "" : ", ", t.unknowns[k].key, t.eta[k]);
  // An estimate on sliding rows alone cannot see what shows near turns and at rest: it stays as it was found.
  std::string text = fmt::format("[[effect]]\nname = \"{}\"\nstate = \"{}\"\n", t.record->name,
                                 t.record->search.at_turns ? "fixed" : "estimated");
  if (!joints.empty()) text += fmt::format("joints = [{}]\n", joints);
  if (!mean.empty()) text += fmt::format("mean = {{ {} }}\n", mean);
  if (!nonlinear.empty()) text += fmt::format("nonlinear = {{ {} }}\n", nonlinear);
  return text;
}

}  // namespace

std::string ModelFile(const codegen::Model& model, const Finding& finding, const std::string& provenance) {
  std::string text = Declared(model.robot().path);
  for (const Term& t : finding.terms) {
    if (!t.confirmed) continue;
    text += Comments(t, provenance);
    text += t.record->on_target ? EffectTable(model, finding, t)
                                : fmt::format("# No model can hold it: {}.\n", t.record->remedy);
  }
  return text + FrictionBeside(model, finding);
}

}  // namespace armcal::diagnosis
