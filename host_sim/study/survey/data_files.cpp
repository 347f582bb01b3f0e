// survey - reads the level limits and the printed figures.
#include "host_sim/study/survey/data_files.hpp"

#include <limits>

#include "codegen/src/io/toml_reader.hpp"

namespace armcal::survey {

using io::TomlReader;

char Levels::Of(const std::string& index, double value) const {
  const Limits& l = limit.at(index);
  return value < l.A ? 'A' : value < l.B ? 'B' : 'C';
}

Levels ReadLevels(const std::filesystem::path& path) {
  const toml::table table = io::ParseToml(path);
  const TomlReader in(table, path.string());
  Levels levels;
  for (const char* index : {"e_T", "e_d", "e_f", "J_e", "solution_time_s", "delta_J_e"}) {
    const TomlReader one = in.Table(index);
    one.AllowOnly({"A", "B"});
    levels.limit[index] = {one.Positive("A"), one.Positive("B")};
    if (!(levels.limit[index].A < levels.limit[index].B)) one.Fail("B", "a number above A");
  }
  levels.follow_rms = in.Table("follow").Positive("relative_rms");
  levels.settle_s = in.Table("follow").Positive("settle_s");
  levels.tau_max_Nm = in.Table("tau_max_Nm").Numbers("value");
  const TomlReader floor = in.Table("floor");
  levels.mass_floor_kg = floor.Positive("mass_kg");
  levels.center_floor_m = floor.Positive("center_m");
  levels.inertia_floor_of_trace = floor.Positive("inertia_of_trace");
  return levels;
}

Printed ReadPrinted(const std::filesystem::path& path) {
  const toml::table file = io::ParseToml(path);
  Printed printed;
  for (const auto& [name, node] : file) {
    const std::string table(name.str());
    if (!node.is_table()) throw io::InputError(path.string() + ": " + table + ": expected a table");
    for (const auto& [row_name, row] : *node.as_table()) {
      const std::string key(row_name.str());
      if (const auto single = row.value<double>()) {
        printed.number[table][key] = {*single};
        continue;
      }
      if (!row.is_array()) throw io::InputError(path.string() + ": " + table + "." + key + ": expected an array");
      for (const auto& item : *row.as_array())
        if (item.is_string()) printed.words[table][key].push_back(*item.value<std::string>());
        else if (const auto v = item.value<double>()) printed.number[table][key].push_back(*v);
        else throw io::InputError(path.string() + ": " + table + "." + key + ": expected numbers or words");
    }
  }
  return printed;
}

double Printed::At(const std::string& table, const std::string& row, std::size_t place) const {
  const auto t = number.find(table);
  if (t == number.end()) return std::numeric_limits<double>::quiet_NaN();
  const auto r = t->second.find(row);
  return r == t->second.end() || place >= r->second.size() ? std::numeric_limits<double>::quiet_NaN()
                                                           : r->second[place];
}

std::string Printed::WordAt(const std::string& table, const std::string& row, std::size_t place) const {
  const auto t = words.find(table);
  if (t == words.end()) return "-";
  const auto r = t->second.find(row);
  return r == t->second.end() || place >= r->second.size() ? "-" : r->second[place];
}

}  // namespace armcal::survey
