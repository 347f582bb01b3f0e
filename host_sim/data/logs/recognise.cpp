// logs - finds sets of columns that differ in the joint only, and tells by their names what they are.
#include "host_sim/data/logs/recognise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "host_sim/data/logs/steps.hpp"

namespace armcal::logs {

namespace {

// Columns of one kind, one a joint: their common name has {}, {0} or {joint} at the place of the joint.
struct Set {
  std::string column;
  std::vector<std::string> names;     // of the joints, where they have names
  std::vector<Eigen::Index> columns;  // of the sight, in the order of the joints
  const Sight* sight = nullptr;
  std::string quantity;
  std::size_t joints() const { return columns.size(); }
};

bool OfSameJoints(const Set& a, const Set& b) { return a.joints() == b.joints() && a.names == b.names; }

bool IsInUnitsOfRos(const Set& set) {
  return set.sight->type.ends_with("/JointState") || set.sight->type.ends_with("/DynamicJointState");
}

using Words = std::set<std::string>;

// "/Robot/actPos_deg{}" -> robot, act, pos, deg
Words WordsOf(const std::string& name) {
  Words words;
  std::string word;
  char before = ' ';
  for (const char c : name + " ") {
    const bool upper = c >= 'A' && c <= 'Z', letter = upper || (c >= 'a' && c <= 'z');
    if (!word.empty() && (!letter || (upper && before >= 'a' && before <= 'z'))) words.insert(std::exchange(word, {}));
    if (letter) word += upper ? static_cast<char>(c - 'A' + 'a') : c;
    before = c;
  }
  return words;
}

bool HasAny(const Words& words, std::initializer_list<const char*> any) {
  return std::any_of(any.begin(), any.end(), [&words](const char* word) { return words.contains(word); });
}

// What the words name; empty: nothing that a map has.
std::string QuantityOf(const Words& words) {
  if (HasAny(words, {"error", "err", "std", "cov", "covariance", "limit", "min", "max"})) return {};
  const bool wanted =
      HasAny(words, {"ref", "reference", "cmd", "command", "des", "desired", "target", "setpoint", "qref"});
  if (HasAny(words, {"torque", "torques", "tau", "effort", "efforts", "trq", "moment"})) return wanted ? "" : "tau";
  if (HasAny(words, {"acceleration", "accelerations", "acc", "qdd", "ddq"})) return wanted ? "" : "qdd";
  if (HasAny(words, {"velocity", "velocities", "vel", "speed", "qd", "dq"})) return wanted ? "" : "qd";
  if (HasAny(words, {"position", "positions", "pos", "q", "angle", "angles", "qref"})) return wanted ? "qref" : "q";
  if (HasAny(words, {"temperature", "temperatures", "temp"})) return "temp";
  if (HasAny(words, {"current", "currents", "cur", "iq", "amp", "amps", "ampere"})) return wanted ? "" : "current";
  return {};
}

// The sets that a number in the name tells apart: one set for each place of a number.
void AddNumbered(const Sight& sight, std::vector<Set>& sets) {
  std::map<std::string, std::map<int, Eigen::Index>> found;  // by the name with a mark: number -> column
  const auto& names = sight.series.numbers.names;
  for (std::size_t c = 0; c < names.size(); ++c) {
    const std::string& name = names[c];
    for (std::size_t at = 0; at < name.size();) {
      const std::size_t begin = name.find_first_of("0123456789", at);
      if (begin == name.npos) break;
      const std::size_t end = std::min(name.find_first_not_of("0123456789", begin), name.size());
      at = end;
      if (end - begin > 2 || (end - begin == 2 && name[begin] == '0')) continue;
      found[name.substr(0, begin) + '\1' + name.substr(end)].emplace(std::stoi(name.substr(begin, end - begin)),
                                                                     static_cast<Eigen::Index>(c));
    }
  }
  for (const auto& [marked, numbers] : found) {
    const int first = numbers.begin()->first, last = numbers.rbegin()->first;
    if (first > 1 || last - first + 1 != static_cast<int>(numbers.size())) continue;
    Set set{marked, {}, {}, &sight, {}};
    set.column.replace(set.column.find('\1'), 1, first == 0 ? "{0}" : "{}");
    for (const auto& [number, column] : numbers) set.columns.push_back(column);
    sets.push_back(std::move(set));
  }
}

// The sets that a part of the path behind the topic tells apart: "/joint_states/elbow/position".
void AddNamed(const Sight& sight, std::vector<Set>& sets) {
  if (sight.name.empty()) return;
  std::map<std::string, Set> found;
  const auto& names = sight.series.numbers.names;
  for (std::size_t c = 0; c < names.size(); ++c) {
    const std::string& name = names[c];
    std::size_t begin = sight.name.size() + 1;
    for (std::size_t end = name.find('/', begin); end != name.npos; begin = end + 1, end = name.find('/', begin)) {
      const std::string column = name.substr(0, begin) + "{joint}" + name.substr(end);
      Set& set = found.try_emplace(column, Set{column, {}, {}, &sight, {}}).first->second;
      set.names.push_back(name.substr(begin, end - begin));
      set.columns.push_back(static_cast<Eigen::Index>(c));
    }
  }
  for (auto& [column, set] : found)
    if (set.joints() > 1 || IsInUnitsOfRos(set)) sets.push_back(std::move(set));
}

double Largest(const Set& set) {
  double most = 0;
  for (const Eigen::Index c : set.columns)
    for (const double x : set.sight->series.numbers.values.col(c))
      if (std::isfinite(x)) most = std::max(most, std::abs(x));
  return most;
}

struct Guessed {
  std::string unit, why;  // without a reason it is certain
};

Guessed UnitOf(const Set& set) {
  const Words words = WordsOf(set.column);
  const bool degrees = HasAny(words, {"deg", "degree", "degrees"}), metres = HasAny(words, {"mm"});
  const std::string& what = set.quantity;
  if (what == "tau") {
    if (HasAny(words, {"nm"})) return {"N*m", ""};
    return {"N*m", IsInUnitsOfRos(set) ? "what ROS prescribes; some drivers put the motor current here"
                                       : "no unit in the name"};
  }
  if (what == "temp")
    return {HasAny(words, {"k", "kelvin"}) ? "K" : "degC",
            HasAny(words, {"degc", "c", "k", "kelvin"}) ? "" : "no unit in the name"};
  const std::string behind = what == "qd" ? "/s" : what == "qdd" ? "/s^2" : "";
  if (degrees) return {"deg" + behind, ""};
  if (metres && what != "qdd") return {"mm" + behind, ""};
  if (HasAny(words, {"rad"})) return {"rad" + behind, ""};
  if (HasAny(words, {"rpm"}) && what == "qd") return {"rpm", ""};
  if (IsInUnitsOfRos(set)) return {"rad" + behind, ""};
  constexpr double kMostTurn_rad = 7;  // a joint that turns further is rare
  const double largest = Largest(set);
  return {(behind.empty() && largest > kMostTurn_rad ? "deg" : "rad") + behind,
          fmt::format("no unit in the name; the largest value is {:.4g}", largest)};
}

std::string Quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) >= ' ' && c != '\x7F') out += c;
  }
  return out + '"';
}

// The time column of a file without topics, as lines of the map.
std::string TimeLines(const Sight& sight) {
  const auto& table = sight.series.numbers;
  Eigen::Index best = -1;
  for (std::size_t c = 0; c < table.names.size() && best < 0; ++c)
    if (HasAny(WordsOf(table.names[c]), {"t", "time", "timestamp", "stamp", "zeit"}))
      best = static_cast<Eigen::Index>(c);
  if (best < 0) return "# [time]: not recognised\n# column = \"\"\n# unit = \"s\"\n";
  const std::string& name = table.names[static_cast<std::size_t>(best)];
  const Words words = WordsOf(name);
  std::string unit, why;
  for (const char* known : {"ns", "us", "ms", "s"})
    if (words.contains(known)) unit = known;
  if (name == "__time") unit = "s";
  if (unit.empty()) {
    const double step = MedianStep(table.values.col(best));
    constexpr double kSlowest_Hz = 10, kFastest_Hz = 2e4;  // of nearly all logs
    unit = "s", why = "no unit in the name";
    for (const auto& [other, si] :
         {std::pair{"s", 1.0}, std::pair{"ms", 1e-3}, std::pair{"us", 1e-6}, std::pair{"ns", 1e-9}})
      if (step > 0 && 1 / (si * step) >= kSlowest_Hz && 1 / (si * step) <= kFastest_Hz) {
        unit = other, why = fmt::format("no unit in the name; with it the log has {:.4g} Hz", 1 / (si * step));
        break;
      }
  }
  return fmt::format("[time]\ncolumn = {}\nunit = \"{}\"{}\n", Quoted(name), unit,
                     why.empty() ? "" : "  # guess: " + why);
}

std::string List(const std::vector<std::string>& texts) {
  std::string out;
  for (const std::string& text : texts) out += (out.empty() ? "" : ", ") + Quoted(text);
  return "[" + out + "]";
}

// A torque from a current needs what the log does not hold: the lines stay comments.
std::string CurrentLines(const Set& current) {
  std::string scale;
  for (std::size_t j = 0; j < current.joints(); ++j) scale += j == 0 ? "?" : ", ?";
  return fmt::format(
      "\n# [tau]: not recognised, but {0} may be motor currents. Write torque constant (N m per A) times gear ratio "
      "of\n"
      "# each joint as scale, and take away the # before the four lines.\n"
      "# [tau]\n# column = {0}\n# unit = \"N*m\"\n# scale = [{1}]\n",
      Quoted(current.column), scale);
}

// Of the sets that fit q best, the largest one that has a torque with as many joints; else the largest.
const Set* ChooseMain(const std::vector<Set>& sets) {
  const Set* best = nullptr;
  const auto rank = [&sets](const Set& q) {
    int partner = 0;
    for (const Set& other : sets)
      if (other.quantity == "tau" && OfSameJoints(other, q))
        partner = std::max(partner, other.sight == q.sight ? 2 : 1);
    return std::pair(partner, q.joints());
  };
  for (const Set& set : sets)
    if (set.quantity == "q" && (best == nullptr || rank(set) > rank(*best))) best = &set;
  return best;
}

}  // namespace

Proposal Recognise(const Look& look, const std::string& source, const std::vector<std::string>& definitions) {
  std::vector<Set> sets;
  for (const Sight& sight : look.sights) AddNamed(sight, sets), AddNumbered(sight, sets);
  for (Set& set : sets) set.quantity = QuantityOf(WordsOf(set.column));
  const Set* const main = ChooseMain(sets);
  Proposal out;
  out.map = "# From " + Quoted(source) + " by armcal channels. Check the lines that are marked with \"guess\".\n";
  out.map += main == nullptr ? std::string("joints = 6  # guess: no positions were recognised\n")
                             : fmt::format("joints = {}\n", main->joints());
  if (main != nullptr && !main->names.empty())
    out.map += "names = " + List(main->names) + "  # guess: the order from the base to the tool\n";
  if (!definitions.empty()) out.map += "messages = " + List(definitions) + "\n";
  if (look.format != "recording") out.map += "\n" + TimeLines(look.sights[0]);
  for (const char* quantity : {"q", "qd", "qdd", "tau", "qref", "temp"}) {
    const Set* chosen = std::string(quantity) == "q" ? main : nullptr;
    const Set* rival = nullptr;
    for (const Set& set : sets) {
      if (main == nullptr || set.quantity != quantity || !OfSameJoints(set, *main)) continue;
      if (chosen == nullptr || (chosen->sight != main->sight && set.sight == main->sight)) chosen = &set;
      if (chosen != &set && rival == nullptr) rival = &set;
    }
    const bool needed = std::string(quantity) == "q" || std::string(quantity) == "tau";
    if (chosen == nullptr) {
      if (!needed) continue;
      out.missing.push_back(quantity);
      const auto current = std::find_if(sets.begin(), sets.end(), [&](const Set& set) {
        return set.quantity == "current" && main != nullptr && OfSameJoints(set, *main);
      });
      out.map += std::string(quantity) != "tau" || current == sets.end()
                     ? fmt::format("\n# [{}]: not recognised\n# column = \"\"\n# unit = \"\"\n", quantity)
                     : CurrentLines(*current);
      continue;
    }
    out.recognised.push_back(quantity);
    const Guessed unit = UnitOf(*chosen);
    out.map += fmt::format("\n[{}]\ncolumn = {}{}\nunit = \"{}\"{}\n", quantity, Quoted(chosen->column),
                           rival == nullptr ? "" : "  # guess: or " + Quoted(rival->column), unit.unit,
                           unit.why.empty() ? "" : "  # guess: " + unit.why);
    if (!needed) out.map += "optional = true\n";
  }
  return out;
}

}  // namespace armcal::logs
