// generator - reads an effect record and checks every key.
#include "codegen/src/generator/effect.hpp"

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>

#include "codegen/src/io/toml_reader.hpp"

namespace armcal::codegen {
namespace {

// The words of each choice; their order is that of the enum.
constexpr const char* kClassWords[] = {"static", "stateful", "run_state", "sensor"};
constexpr const char* kScopeWords[] = {"joint", "pair", "arm", "body"};
constexpr const char* kSearchWords[] = {"linear", "profile", "spectral", "spline", "onset", "window", "shared", "none"};
constexpr const char* kScaleWords[] = {"linear", "log"};
constexpr const char* kActWords[] = {"", "gain", "delay", "censor"};

std::string ExpressionText(const io::TomlReader& in, std::string_view key, const std::string& otherwise) {
  if (!in.Has(key)) return otherwise;
  if (in.table()[key].is_string()) return in.Text(key);
  std::ostringstream text;
  text.precision(17);
  text << in.Number(key);
  return text.str();
}

// The position of the key's word in the list. An empty word cannot be chosen.
template <class Words>
int ReadChoice(const io::TomlReader& in, std::string_view key, const std::string& value, const Words& words) {
  std::string known;
  int at = 0;
  for (const auto& word : words) {
    if (value == word && !value.empty()) return at;
    if (*word != '\0') known += (known.empty() ? "" : ", ") + std::string(word);
    ++at;
  }
  in.Fail(key, "one of " + known);
}

Quantity ReadInput(const io::TomlReader& in, const std::string& declared) {
  if (const QuantityInfo* info = FindDeclared(declared)) return info->quantity;
  std::string known;
  for (const QuantityInfo& info : QuantityTable()) known += (known.empty() ? "" : ", ") + std::string(info.declared);
  in.Fail("inputs", "one of " + known);
}

LinearParameter ReadLinear(const io::TomlReader& in) {
  in.AllowOnly({"name", "unit", "rows", "index", "sd", "amplitude", "bounds", "process_noise"});
  LinearParameter p;
  p.name = in.Text("name");
  p.unit = in.Text("unit");
  const io::TomlReader rows = in.Table("rows");
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

RecordState ReadState(const io::TomlReader& in) {
  in.AllowOnly({"name", "unit", "initial", "step", "settled"});
  RecordState s{in.Text("name"), in.Text("unit"), ExpressionText(in, "initial", "0"), in.Text("step"),
                in.Text("settled", "")};
  if (s.name.empty() || s.name.find(' ') != std::string::npos) in.Fail("name", "one word");
  return s;
}

}  // namespace

std::string Word(EffectClass value) { return kClassWords[static_cast<int>(value)]; }
std::string Word(EffectScope value) { return kScopeWords[static_cast<int>(value)]; }

EffectRecord ReadEffect(const std::filesystem::path& path) {
  const toml::table table = io::ParseToml(path);
  const io::TomlReader in(table, path.string());
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
  r.effect_class = static_cast<EffectClass>(ReadChoice(in, "class", in.Text("class"), kClassWords));
  r.scope = static_cast<EffectScope>(ReadChoice(in, "scope", in.Text("scope"), kScopeWords));
  r.place = in.Text("place", r.scope == EffectScope::kBody ? "flange" : "all");
  for (const std::string& input : in.Texts("inputs")) r.inputs.insert(ReadInput(in, input));
  r.signals = in.Texts("signals");
  r.let = in.Texts("let");
  for (const io::TomlReader& linear : in.Tables("linear")) r.linear.push_back(ReadLinear(linear));
  if (r.linear.empty()) in.Fail("linear", "at least one [[linear]] parameter");
  for (const io::TomlReader& t : in.Tables("nonlinear")) {
    t.AllowOnly({"name", "unit", "lower", "upper", "initial", "scale"});
    NonlinearParameter p;
    p.name = t.Text("name");
    p.unit = t.Text("unit");
    p.lower = ExpressionText(t, "lower", "");
    p.upper = ExpressionText(t, "upper", "");
    p.initial = ExpressionText(t, "initial", "");
    if (p.lower.empty() || p.upper.empty() || p.initial.empty()) t.Fail("lower", "lower, upper and initial");
    p.logarithmic = ReadChoice(t, "scale", t.Text("scale", "linear"), kScaleWords) == 1;
    r.nonlinear.push_back(p);
  }
  for (const io::TomlReader& t : in.Tables("state")) r.state.push_back(ReadState(t));
  if (!r.state.empty() && r.effect_class == EffectClass::kStatic)
    in.Fail("class", "\"stateful\" where there is a [[state]]");
  if (in.Has("apply")) {
    const io::TomlReader apply = in.Table("apply");
    apply.AllowOnly({"how", "by"});
    r.apply = {static_cast<SensorAct>(ReadChoice(apply, "how", apply.Text("how"), kActWords)), apply.Text("by")};
  }
  if ((r.effect_class == EffectClass::kSensor) != in.Has("apply"))
    in.Fail("apply", "a table if, and only if, class is \"sensor\"");
  r.adds_base = in.Texts("adds_base");
  r.replaces = in.Text("replaces", "");
  r.depends_on_estimate = in.Flag("depends_on_estimate", false);
  // What the measurement underwent, or what belongs to one run, is no property of the arm that a table could state.
  const bool of_the_arm = r.effect_class == EffectClass::kStatic || r.effect_class == EffectClass::kStateful;
  r.on_target = in.Flag("on_target", of_the_arm);
  if (r.on_target && !of_the_arm) in.Fail("on_target", "false where class is \"" + Word(r.effect_class) + "\"");
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
    const io::TomlReader s = in.Table("search");
    s.AllowOnly({"how", "signal", "second", "grid", "minimum_s", "after", "at_turns"});
    r.search.how = static_cast<SearchWay>(ReadChoice(s, "how", s.Text("how"), kSearchWords));
    r.search.signal = s.Text("signal", "");
    r.search.second = s.Text("second", "");
    r.search.grid = static_cast<int>(s.Number("grid", 10));
    r.search.minimum_s = s.Number("minimum_s", 0);
    r.search.after = s.Text("after", "");
    r.search.at_turns = s.Flag("at_turns", false);
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

const EffectRecord& FindRecord(const std::map<std::string, EffectRecord>& catalogue, const std::string& where,
                               const std::string& name) {
  if (const auto found = catalogue.find(name); found != catalogue.end()) return found->second;
  std::vector<std::string> known;
  for (const auto& [key, record] : catalogue) known.push_back(key);
  const std::string nearest = io::Nearest(name, known);
  throw io::InputError(where + ": no effect " + name + "; " +
                       (nearest.empty() ? "docs/effects.md lists them" : "the nearest is " + nearest));
}

}  // namespace armcal::codegen
