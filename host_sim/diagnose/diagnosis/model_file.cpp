// diagnosis - writes the found terms into a robot file: as [[effect]] tables, or as comments if no model can hold them.
#include "host_sim/diagnose/diagnosis/diagnose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>

#include "host_sim/identify/calibration/table_ceilings.hpp"

namespace armcal::diagnosis {

namespace {

// The line with each quoted value, a path seen from `folder`, as it is seen from `other`; empty: from anywhere.
std::string WithPaths(const std::string& line, const std::filesystem::path& folder,
                      const std::filesystem::path& other) {
  std::string out;
  std::size_t done = 0;
  for (std::size_t equals; (equals = line.find('=', done)) != std::string::npos;) {
    const std::size_t open = line.find_first_not_of(" \t", equals + 1);
    const bool quoted = open != std::string::npos && (line[open] == '"' || line[open] == '\'');
    const std::size_t close = quoted ? line.find(line[open], open + 1) : std::string::npos;
    if (close == std::string::npos || close == open + 1) {
      out += line.substr(done, equals + 1 - done);
      done = equals + 1;
      continue;
    }
    const std::filesystem::path path = std::filesystem::absolute(folder / line.substr(open + 1, close - open - 1));
    const auto near = other.empty() ? path : path.lexically_proximate(std::filesystem::absolute(other));
    out += line.substr(done, equals - done) + "= \"" + near.string() + "\"";
    done = close + 1;
  }
  return out + line.substr(done);
}

// The declared file as it is in `folder`: what it names beside itself is named from there.
std::string Declared(const std::filesystem::path& path, const std::filesystem::path& folder) {
  std::ifstream in(path);
  std::string text;
  bool in_packages = false;
  for (std::string line; std::getline(in, line);) {
    std::string bare = line;
    std::erase_if(bare, [](char c) { return c == ' ' || c == '\t'; });
    if (bare.starts_with('[')) in_packages = bare.starts_with("[packages]");
    const bool names_files = in_packages || bare.starts_with("urdf=") || bare.starts_with("packages=");
    if (names_files) line = WithPaths(line, path.parent_path(), folder);
    text += line + "\n";
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

using Joints = std::vector<int>;

bool Contains(const Joints& joints, int joint) {
  return std::find(joints.begin(), joints.end(), joint) != joints.end();
}

bool IsWritten(const Term& t) { return t.confirmed && t.record->on_target; }

bool StartsFromZero(const Term& t, const Joints& from_zero) {
  return !t.record->search.at_turns &&
         std::any_of(t.joints.begin(), t.joints.end(), [&](int j) { return Contains(from_zero, j); });
}

codegen::EffectUse UseOf(const codegen::Model& model, const Finding& finding, const Term& t, const Joints& from_zero) {
  codegen::EffectUse use;
  use.effect = t.record->name, use.joints = t.joints;
  // An estimate on sliding rows alone cannot see what shows near turns and at rest: it stays as it was found.
  use.state = t.record->search.at_turns ? "fixed" : "estimated";
  for (std::size_t c = 0; c < t.columns.size(); ++c) {
    const codegen::EffectColumn& column = t.columns[c];
    if (column.fixed_amplitude) continue;  // the record's own
    const double value = t.amplitude[static_cast<Eigen::Index>(c)] + DeclaredShare(model, finding, t, column.key);
    use.mean[column.key] = StartsFromZero(t, from_zero) ? 0 : std::clamp(value, column.lower, column.upper);
  }
  for (std::size_t k = 0; k < t.eta.size(); ++k) use.nonlinear[t.unknowns[k].key] = t.eta[k];
  return use;
}

// Terms stand beside the declared friction as it was fitted with them. Beside other friction their sum may push. So the
// fitted friction of their joints is written, too, unless a term takes its place.
std::vector<codegen::EffectUse> FrictionBeside(const codegen::Model& model, const Finding& finding) {
  std::vector<codegen::EffectUse> out;
  for (const codegen::EffectInstance& e : model.effects()) {
    if (!e.record->friction_law && e.record->replaces.empty()) continue;
    const auto any = [&](const auto& is) {
      return std::any_of(finding.terms.begin(), finding.terms.end(),
                         [&](const Term& t) { return IsWritten(t) && is(t); });
    };
    if (!any([&](const Term& t) { return Contains(t.joints, e.joints[0]); })) continue;
    if (any([&](const Term& t) { return t.record->replaces == e.record->name && t.joints == e.joints; })) continue;
    codegen::EffectUse use;
    use.effect = e.record->name, use.joints = e.joints;
    for (const codegen::EffectColumn& column : e.columns)
      for (int c = 0; c < model.columns(); ++c)
        if (!model.is_rigid(c) && model.column_name(c) == column.name &&
            model.table()[static_cast<std::size_t>(model.table_index(c))].state == "estimated")
          use.mean[column.key] = std::clamp(finding.x[c], column.lower, column.upper);
    if (!use.mean.empty()) out.push_back(use);
  }
  return out;
}

std::string TableText(const codegen::EffectUse& use) {
  const auto list = [](const std::map<std::string, double>& values) {
    std::string text;
    for (const auto& [key, value] : values) text += fmt::format("{}{} = {:.9e}", text.empty() ? "" : ", ", key, value);
    return text;
  };
  std::string joints, text = fmt::format("[[effect]]\nname = \"{}\"\nstate = \"{}\"\n", use.effect, use.state);
  for (const int j : use.joints) joints += fmt::format("{}{}", joints.empty() ? "" : ", ", j + 1);
  if (!joints.empty()) text += fmt::format("joints = [{}]\n", joints);
  if (!use.mean.empty()) text += fmt::format("mean = {{ {} }}\n", list(use.mean));
  if (!use.nonlinear.empty()) text += fmt::format("nonlinear = {{ {} }}\n", list(use.nonlinear));
  return text;
}

// Joints on which a drive would refuse the friction of the new model's own table.
Joints Pushing(const codegen::Model& model, const codegen::Catalogue& catalogue, const Finding& finding,
               const std::vector<codegen::EffectUse>& beside) {
  codegen::Robot robot = model.robot();
  for (const Term& t : finding.terms)
    if (IsWritten(t)) robot.effect.push_back(UseOf(model, finding, t, {}));
  robot.effect.insert(robot.effect.end(), beside.begin(), beside.end());
  const codegen::Model next(robot, catalogue);
  return calibration::BeyondCeilings(next, calibration::DefaultTable(next)).joints;
}

}  // namespace

NewModel ModelFile(const codegen::Model& model, const codegen::Catalogue& catalogue, const Finding& finding,
                   const std::string& provenance, const std::filesystem::path& folder) {
  const std::vector<codegen::EffectUse> beside = FrictionBeside(model, finding);
  NewModel out{Declared(model.robot().path, folder), Pushing(model, catalogue, finding, beside)};
  for (const Term& t : finding.terms) {
    if (!t.confirmed) continue;
    out.text += Comments(t, provenance);
    if (!t.record->on_target) {
      out.text += fmt::format("# No model can hold it: {}.\n", t.record->remedy);
      continue;
    }
    if (StartsFromZero(t, out.from_zero))
      out.text += "# Beyond the logs this friction would push. So it starts from zero, and armcal identify fits it.\n";
    out.text += TableText(UseOf(model, finding, t, out.from_zero));
  }
  for (const codegen::EffectUse& use : beside)
    out.text += "\n# The friction that was fitted beside what was found.\n" + TableText(use);
  return out;
}

}  // namespace armcal::diagnosis
