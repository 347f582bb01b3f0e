// generator - reads effect records; every word it accepts is listed here, no kind is known by name.
#include "codegen/src/generator/effect.hpp"

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>

#include "codegen/src/robot/toml_reader.hpp"

namespace armcal::codegen {
namespace {

// Everything that a record may read.
constexpr const char* kInputs[] = {"q",           "qd",     "qdd",       "temp",        "t",
                                   "dt",          "flag",   "tau_rigid", "tau_gravity", "Y",
                                   "dY/dgravity", "M[:,j]", "tau_model", "tau_delayed"};

std::string ExpressionText(const TomlReader& in, std::string_view key, const std::string& otherwise) {
  if (!in.Has(key)) return otherwise;
  if (in.table()[key].is_string()) return in.Text(key);
  std::ostringstream text;
  text.precision(17);
  text << in.Number(key);
  return text.str();
}

template <class List>
void MustBeOneOf(const TomlReader& in, std::string_view key, const std::string& value, const List& allowed) {
  if (std::find(std::begin(allowed), std::end(allowed), value) != std::end(allowed)) return;
  std::string list;
  for (const auto& a : allowed) list += (list.empty() ? "" : ", ") + std::string(a);
  in.Fail(key, "one of " + list);
}

LinearParameter ReadLinear(const TomlReader& in) {
  in.AllowOnly({"name", "unit", "rows", "index", "sd", "amplitude", "bounds", "process_noise"});
  LinearParameter p;
  p.name = in.Text("name");
  p.unit = in.Text("unit");
  const TomlReader rows = in.Table("rows");
  for (const auto& [row, expression] : rows.table()) p.rows[std::string(row.str())] = rows.Text(row.str());
  if (p.rows.empty()) in.Fail("rows", "at least one row = \"expression\"");
  p.index = in.Texts("index");
  p.sd = ExpressionText(in, "sd", "0.05*torque_limit");
  p.lower = -std::numeric_limits<double>::infinity();
  p.upper = std::numeric_limits<double>::infinity();
  if (in.Has("bounds")) {
    const auto b = in.Texts("bounds");
    for (const std::string& text : b) {
      if (text == ">= 0") p.lower = 0;
      else if (text == "<= 0") p.upper = 0;
      else in.Fail("bounds", "\">= 0\" or \"<= 0\"");
    }
  }
  if (in.Has("amplitude")) {
    p.fixed_amplitude = true;
    p.amplitude = in.Number("amplitude");
  }
  p.process_noise = in.Number("process_noise", 0);
  return p;
}

RecordState ReadState(const TomlReader& in) {
  in.AllowOnly({"name", "unit", "initial", "step", "settled"});
  RecordState s{in.Text("name"), in.Text("unit"), ExpressionText(in, "initial", "0"), in.Text("step"),
                in.Text("settled", "")};
  if (s.name.empty() || s.name.find(' ') != std::string::npos) in.Fail("name", "one word");
  return s;
}

}  // namespace

EffectRecord ReadEffect(const std::filesystem::path& path) {
  const toml::table table = ParseToml(path);
  const TomlReader in(table, path.string());
  in.AllowOnly({"name",
                "title",
                "source",
                "class",
                "scope",
                "inputs",
                "signals",
                "let",
                "place",
                "kind",
                "state",
                "linear",
                "nonlinear",
                "apply",
                "replaces",
                "adds_base",
                "depends_on_estimate",
                "on_target",
                "remedy",
                "separate",
                "friction_law",
                "generic_penalty",
                "search",
                "confusable_with",
                "needs"});
  EffectRecord r;
  r.path = path.string();
  std::ifstream file(path);
  r.text.assign(std::istreambuf_iterator<char>(file), {});
  r.name = in.Text("name");
  if (r.name != path.stem().string()) in.Fail("name", "the file's own name, \"" + path.stem().string() + "\"");
  r.kind = in.Text("kind", r.name);
  r.title = in.Text("title");
  r.source = in.Text("source", "");
  r.kind_class = in.Text("class");
  MustBeOneOf(in, "class", r.kind_class,
              std::initializer_list<const char*>{"static", "stateful", "run_state", "sensor"});
  r.scope = in.Text("scope");
  MustBeOneOf(in, "scope", r.scope, std::initializer_list<const char*>{"joint", "pair", "arm", "body"});
  r.place = in.Text("place", r.scope == "body" ? "flange" : "all");
  r.inputs = in.Texts("inputs");
  for (const std::string& input : r.inputs) MustBeOneOf(in, "inputs", input, kInputs);
  r.signals = in.Texts("signals");
  r.let = in.Texts("let");
  for (const TomlReader& linear : in.Tables("linear")) r.linear.push_back(ReadLinear(linear));
  if (r.linear.empty()) in.Fail("linear", "at least one [[linear]] parameter");
  for (const TomlReader& t : in.Tables("nonlinear")) {
    t.AllowOnly({"name", "unit", "lower", "upper", "initial", "scale"});
    NonlinearParameter p;
    p.name = t.Text("name");
    p.unit = t.Text("unit");
    p.lower = ExpressionText(t, "lower", "");
    p.upper = ExpressionText(t, "upper", "");
    p.initial = ExpressionText(t, "initial", "");
    if (p.lower.empty() || p.upper.empty() || p.initial.empty()) t.Fail("lower", "lower, upper and initial");
    p.logarithmic = t.Text("scale", "linear") == "log";
    r.nonlinear.push_back(p);
  }
  for (const TomlReader& t : in.Tables("state")) r.state.push_back(ReadState(t));
  if (!r.state.empty() && r.kind_class == "static") in.Fail("class", "\"stateful\" where there is a [[state]]");
  if (in.Has("apply")) {
    const TomlReader apply = in.Table("apply");
    apply.AllowOnly({"how", "by"});
    r.apply = {apply.Text("how"), apply.Text("by")};
    MustBeOneOf(apply, "how", r.apply.how, std::initializer_list<const char*>{"gain", "delay", "censor"});
  }
  if ((r.kind_class == "sensor") != in.Has("apply")) in.Fail("apply", "a table if, and only if, class is \"sensor\"");
  r.adds_base = in.Texts("adds_base");
  r.replaces = in.Text("replaces", "");
  r.depends_on_estimate = in.Flag("depends_on_estimate", false);
  // What the measurement underwent, or what belongs to one run, is no property of the arm that a table could state.
  const bool of_the_arm = r.kind_class == "static" || r.kind_class == "stateful";
  r.on_target = in.Flag("on_target", of_the_arm);
  if (r.on_target && !of_the_arm) in.Fail("on_target", "false where class is \"" + r.kind_class + "\"");
  r.remedy = in.Text("remedy", "");
  if (r.on_target != r.remedy.empty()) in.Fail("remedy", "a sentence if, and only if, no model can hold the effect");
  r.separate = in.Text("separate", "");
  r.friction_law = in.Flag("friction_law", false);
  r.generic_penalty = in.Number("generic_penalty", 0);
  r.confusable_with = in.Texts("confusable_with");
  if (!r.confusable_with.empty() && r.separate.empty())
    in.Fail("separate", "what tells it from those of confusable_with");
  r.needs = in.Texts("needs");
  if (in.Has("search")) {
    const TomlReader s = in.Table("search");
    s.AllowOnly({"how", "signal", "grid", "minimum_s", "after"});
    r.search.how = s.Text("how");
    MustBeOneOf(s, "how", r.search.how,
                std::initializer_list<const char*>{"linear", "profile", "spectral", "spline", "onset", "window",
                                                   "shared", "none"});
    r.search.signal = s.Text("signal", "");
    r.search.grid = static_cast<int>(s.Number("grid", 10));
    r.search.minimum_s = s.Number("minimum_s", 0);
    r.search.after = s.Text("after", "");
  }
  return r;
}

std::map<std::string, EffectRecord> ReadCatalogue(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder))
    throw io::InputError(folder.string() + ": no such folder of effect records");
  std::map<std::string, EffectRecord> out;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".toml") {
      EffectRecord r = ReadEffect(entry.path());
      out.emplace(r.name, std::move(r));
    }
  return out;
}

}  // namespace armcal::codegen
