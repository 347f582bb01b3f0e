// logs - reads a channel map.
#include "host_sim/data/logs/channels.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include "codegen/src/io/file_kind.hpp"
#include "codegen/src/io/toml_reader.hpp"
#include "host_sim/data/logs/table.hpp"

namespace armcal::logs {
namespace {

struct Unit {
  std::string_view name;
  std::string_view dimension;
  double si;  // value in SI = si x value + zero
  double zero = 0;
};

constexpr double kDegree_rad = std::numbers::pi / 180;
constexpr double kRpm = std::numbers::pi / 30;
constexpr double kGravity = 9.80665;  // m/s^2, by definition of kgf

// Position, speed and acceleration of a revolute joint in rad, of a prismatic one in m; torque in N m, force in N.
constexpr Unit kUnits[] = {
    {"s", "time", 1},
    {"ms", "time", 1e-3},
    {"us", "time", 1e-6},
    {"ns", "time", 1e-9},
    {"rad", "position", 1},
    {"deg", "position", kDegree_rad},
    {"mrad", "position", 1e-3},
    {"rev", "position", 2 * std::numbers::pi},
    {"m", "position", 1},
    {"mm", "position", 1e-3},
    {"rad/s", "speed", 1},
    {"deg/s", "speed", kDegree_rad},
    {"rpm", "speed", kRpm},
    {"m/s", "speed", 1},
    {"mm/s", "speed", 1e-3},
    {"rad/s^2", "acceleration", 1},
    {"deg/s^2", "acceleration", kDegree_rad},
    {"m/s^2", "acceleration", 1},
    {"N*m", "torque", 1},
    {"mN*m", "torque", 1e-3},
    {"kN*m", "torque", 1e3},
    {"kgf*m", "torque", kGravity},
    {"N", "torque", 1},
    {"kN", "torque", 1e3},
    {"degC", "temperature", 1},
    {"K", "temperature", 1, -273.15},
    {"1", "flag", 1},
};

struct Rule {
  std::string_view key;
  std::string_view dimension;
  bool required;
};
constexpr Rule kRules[] = {{"q", "position", true},        {"tau", "torque", true},        {"qd", "speed", false},
                           {"qdd", "acceleration", false}, {"qref", "position", false},    {"tauff", "torque", false},
                           {"ext", "torque", false},       {"temp", "temperature", false}, {"flag", "flag", false}};
// The first one of its dimension.
constexpr std::string_view DefaultUnit(std::string_view dimension) {
  for (const Unit& unit : kUnits)
    if (unit.dimension == dimension) return unit.name;
  return "";
}

constexpr std::string_view kLinkTorque = "tau_link";  // the other torque of a log that has two
constexpr double kSingular = 1e-9;                    // of the product of the rows' lengths
constexpr double kSamePower = 1e-3;

class MapReader {
 public:
  explicit MapReader(const std::filesystem::path& path) : file_(path.string()), root_(io::ParseToml(path)) {
    io::RequireKind(root_, path, io::FileKind::kChannelMap);
  }

  ChannelMap Read() {
    ChannelMap map;
    map.source = file_;
    CheckTopLevelKeys();
    map.joints = static_cast<int>(root_["joints"].value_or<std::int64_t>(0));
    if (map.joints < 1 || map.joints > 64) Fail("joints", "expected a number of joints, 1 to 64");
    joints_ = 1;
    if (root_.contains("time") && !root_["time"].is_table()) Fail("time", "expected a table with column and unit");
    map.time =
        root_.contains("time") ? Channels("time", *root_["time"].as_table(), "time").front() : Channel{kTimeColumn};
    joints_ = static_cast<std::size_t>(map.joints);
    names_ = Texts("names");
    if (!names_.empty() && names_.size() != joints_)
      Fail("names", "expected a list of " + std::to_string(joints_) + " names, one a joint");
    for (const std::string& file : Texts("messages"))
      map.definitions.push_back(std::filesystem::path(file_).parent_path() / file);
    const std::string torque = root_["torque"].value_or<std::string>("tau");
    if ((root_.contains("torque") && !root_["torque"].is_string()) || (torque != "tau" && torque != kLinkTorque))
      Fail("torque", "expected \"tau\" or \"" + std::string(kLinkTorque) + "\", the torque to use");
    for (const Rule& rule : kRules) {
      const std::string key = rule.key == "tau" ? torque : std::string(rule.key);
      const toml::table* table = TableOf(key, rule.dimension, rule.required);
      if (table == nullptr) continue;
      const bool optional = (*table)["optional"].value_or(false);
      if (optional && rule.required) Fail(key + ".optional", "this quantity is always needed");
      map.quantities.push_back(
          {std::string(rule.key), Channels(key, *table, rule.dimension), optional, Matrix(key, *table)});
    }
    // The torque that is not used must be right, too: the map is for both.
    for (const std::string& other : {std::string("tau"), std::string(kLinkTorque)})
      if (const toml::table* table = other != torque ? TableOf(other, "torque", false) : nullptr; table != nullptr)
        Channels(other, *table, "torque"), Matrix(other, *table), map.unused = other;
    CheckPower(map, torque);
    return map;
  }

 private:
  [[noreturn]] void Fail(const std::string& key, const std::string& expected) const {
    throw io::InputError(file_ + ": " + key + ": " + expected);
  }

  // The table of a quantity; null: the map does without it.
  const toml::table* TableOf(const std::string& key, std::string_view dimension, bool required) const {
    const toml::table* table = root_[key].as_table();
    if (table == nullptr && (required || root_.contains(key)))
      Fail(key, std::string(root_.contains(key) ? "" : "missing, ") +
                    "expected a table, as in { column = \"a{}\", unit = \"" + std::string(DefaultUnit(dimension)) +
                    "\" }");
    return table;
  }

  void CheckTopLevelKeys() const {
    for (const auto& [key, node] : root_) {
      bool known = key == "joints" || key == "title" || key == "names" || key == "messages" || key == "time" ||
                   key == "torque" || key.str() == kLinkTorque;
      for (const Rule& rule : kRules) known = known || key.str() == rule.key;
      if (!known)
        Fail(std::string(key.str()),
             "unknown key, expected joints, names, title, messages, time, torque or a quantity");
    }
  }

  const Unit& FindUnit(const std::string& key, const std::string& name, std::string_view dimension) const {
    std::string expected;
    for (const Unit& unit : kUnits) {
      if (unit.dimension != dimension) continue;
      if (unit.name == name) return unit;
      expected += (expected.empty() ? "" : ", ") + std::string(unit.name);
    }
    Fail(key + ".unit", "'" + name + "' is no unit of " + std::string(dimension) + ", expected " + expected);
  }

  // A value for all joints, or a list of one per joint.
  template <class T>
  std::vector<T> PerJoint(const std::string& key, const toml::table& table, const char* name,
                          const T& otherwise) const {
    const toml::node* node = table.get(name);
    if (node == nullptr) return std::vector<T>(joints_, otherwise);
    const std::string where = key + "." + name;
    const std::string kind = std::is_same_v<T, double> ? "number" : "text";
    const auto value_of = [&](const toml::node& of) {
      const auto value = of.value<T>();
      if constexpr (std::is_same_v<T, double>)
        if (value && !std::isfinite(*value)) Fail(where, "expected a finite number");
      return value;
    };
    if (const auto one = value_of(*node)) return std::vector<T>(joints_, *one);
    const toml::array* list = node->as_array();
    if (list == nullptr || list->size() != joints_) {
      Fail(where, "expected one " + kind + " or a list of " + std::to_string(joints_));
    }
    std::vector<T> values;
    for (const toml::node& item : *list) {
      const auto value = value_of(item);
      if (!value) Fail(where, "expected a list of " + kind + "s");
      values.push_back(*value);
    }
    return values;
  }

  // A list of texts; empty without the key.
  std::vector<std::string> Texts(const std::string& key) const {
    std::vector<std::string> out;
    if (!root_.contains(key)) return out;
    const toml::array* list = root_[key].as_array();
    for (std::size_t k = 0; list != nullptr && k < list->size(); ++k)
      out.push_back(list->get(k)->value<std::string>().value_or(""));
    if (out.empty() || std::find(out.begin(), out.end(), "") != out.end()) Fail(key, "expected a list of texts");
    return out;
  }

  // The column of joint j, where the map may say the joint by its number or its name.
  std::string ColumnOf(const std::string& key, std::string column, std::size_t j) const {
    const auto put = [&column](std::string_view mark, const std::string& text) {
      if (const auto at = column.find(mark); at != column.npos) column.replace(at, mark.size(), text);
    };
    put("{}", std::to_string(j + 1));
    put("{0}", std::to_string(j));
    if (column.find("{joint}") != column.npos && names_.empty())
      Fail(key + ".column", "{joint} needs the joints' names, as in names = [\"base\", \"elbow\"]");
    if (!names_.empty()) put("{joint}", names_[j]);
    return column;
  }

  std::vector<Channel> Channels(const std::string& key, const toml::table& table, std::string_view dimension) const {
    for (const auto& [name, node] : table) {
      if (name != "column" && name != "unit" && name != "scale" && name != "offset" && name != "optional" &&
          name != "matrix") {
        Fail(key + "." + std::string(name.str()),
             "unknown key, expected column, unit, scale, offset, optional or matrix");
      }
    }
    if (table.contains("optional") && !table["optional"].is_boolean())
      Fail(key + ".optional", "expected true or false");
    if (table.contains("matrix") && (dimension == "time" || dimension == "temperature" || dimension == "flag"))
      Fail(key + ".matrix", "only positions, speeds, accelerations and torques take a matrix");
    const auto columns = PerJoint<std::string>(key, table, "column", "");
    const auto units = PerJoint<std::string>(key, table, "unit", dimension == "flag" ? "1" : "");
    const auto scales = PerJoint<double>(key, table, "scale", 1.0);
    const auto offsets = PerJoint<double>(key, table, "offset", 0.0);
    std::vector<Channel> channels;
    for (std::size_t j = 0; j < joints_; ++j) {
      const Unit& unit = FindUnit(key, units[j], dimension);
      const std::string column = ColumnOf(key, columns[j], j);
      if (column.empty()) Fail(key + ".column", "expected the name of a column of the log");
      for (const Channel& other : channels) {
        if (other.column == column) Fail(key + ".column", "'" + column + "' is used for two joints");
      }
      channels.push_back({column, unit.si * scales[j], unit.si * offsets[j] + unit.zero});
    }
    return channels;
  }

  // Empty where there is none.
  Eigen::MatrixXd Matrix(const std::string& key, const toml::table& table) const {
    const toml::node* node = table.get("matrix");
    if (node == nullptr) return {};
    const std::string size = std::to_string(joints_), where = key + ".matrix";
    const auto fail = [&] { Fail(where, "expected " + size + " rows of " + size + " numbers, one row a joint"); };
    const toml::array* rows = node->as_array();
    if (rows == nullptr || rows->size() != joints_) fail();
    Eigen::MatrixXd out(static_cast<Eigen::Index>(joints_), static_cast<Eigen::Index>(joints_));
    for (std::size_t i = 0; i < joints_; ++i) {
      const toml::array* row = rows->get(i)->as_array();
      if (row == nullptr || row->size() != joints_) fail();
      for (std::size_t k = 0; k < joints_; ++k) {
        const auto value = row->get(k)->value<double>();
        if (!value || !std::isfinite(*value)) fail();
        out(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = *value;
      }
    }
    if (std::abs(out.determinant()) <= kSingular * out.rowwise().norm().prod())
      Fail(where, "expected rows that are independent: each motor turns some joint");
    return out;
  }

  // Motors and joints have the same power: what turns speeds by M turns torques by the transpose of M's inverse.
  void CheckPower(const ChannelMap& map, const std::string& torque) const {
    const auto of = [&](const char* name) {
      for (const Quantity& q : map.quantities)
        if (q.name == name) return q.matrix;
      return Eigen::MatrixXd();
    };
    const Eigen::MatrixXd position = of("q"), tau = of("tau");
    if (position.size() == 0 || tau.size() == 0) return;
    const Eigen::MatrixXd expected = position.inverse().transpose();
    if ((tau - expected).cwiseAbs().maxCoeff() > kSamePower * expected.cwiseAbs().maxCoeff())
      Fail(torque + ".matrix",
           "expected the transpose of the inverse of q.matrix: motors and joints have the same power (gear ratios and "
           "units belong in scale)");
  }

  std::string file_;
  toml::table root_;
  std::size_t joints_ = 1;
  std::vector<std::string> names_;  // of the joints; empty: not given
};

}  // namespace

ChannelMap ReadChannelMap(const std::filesystem::path& path, const std::vector<std::filesystem::path>& definitions) {
  ChannelMap map = MapReader(path).Read();
  map.definitions.insert(map.definitions.end(), definitions.begin(), definitions.end());
  return map;
}

}  // namespace armcal::logs
