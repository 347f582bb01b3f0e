// logs - reads and writes logs.
#include "host_sim/data/logs/log.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/bags/mat.hpp"
#include "host_sim/data/bags/recording.hpp"
#include "host_sim/data/files/csv.hpp"
#include "host_sim/data/logs/channels.hpp"
#include "host_sim/data/logs/rows.hpp"
#include "host_sim/data/logs/steps.hpp"
#include "host_sim/data/logs/table.hpp"

namespace armcal::logs {
namespace {

// Splits "qdd12" into {"qdd", 12}; nothing if the name is not letters followed by a plain number from 1.
struct JointName {
  std::string quantity;
  int joint = 0;
};

std::optional<JointName> SplitName(const std::string& name) {
  const auto digit = name.find_first_of("0123456789");
  if (digit == 0 || digit == name.npos || name[digit] == '0' || name.size() - digit > 2) return std::nullopt;
  if (name.find_first_not_of("0123456789", digit) != name.npos) return std::nullopt;
  return JointName{name.substr(0, digit), std::stoi(name.substr(digit))};
}

const std::string kOurColumns = "expected t, q1..qn, tau1..taun (other names need a channel map: --channels)";

constexpr const char* kQuantities[] = {"q", "tau", "qd", "qdd", "qref", "tauff", "ext", "temp", "flag"};

bool IsQuantity(const std::string& name) {
  return std::find(std::begin(kQuantities), std::end(kQuantities), name) != std::end(kQuantities);
}

// The map of a file that already carries our names.
ChannelMap OurNames(const std::string& file, const std::vector<std::string>& header) {
  int joints = 0;
  std::vector<std::string> present;
  for (const std::string& name : header) {
    const auto split = SplitName(name);
    if (!split || !IsQuantity(split->quantity)) continue;
    joints = std::max(joints, split->joint);
    present.push_back(split->quantity);
  }
  if (joints == 0) {
    throw io::InputError(file + ":1: no column 'q1', " + kOurColumns);
  }
  if (!std::count(present.begin(), present.end(), "tau"))
    throw io::InputError(file + ":1: no column 'tau1'; if it is a trajectory, armcal record plays it; " + kOurColumns);
  ChannelMap map{joints, {"t"}, {}, file};
  for (const char* quantity : kQuantities) {
    const bool required = std::string(quantity) == "q" || std::string(quantity) == "tau";
    if (!required && std::find(present.begin(), present.end(), quantity) == present.end()) continue;
    Quantity& added = map.quantities.emplace_back(Quantity{quantity, {}, false});
    for (int j = 1; j <= joints; ++j) added.joint.push_back({quantity + std::to_string(j)});
  }
  return map;
}

class Columns {
 public:
  // `instead` ends the message about a missing column.
  Columns(const Table& table, std::string instead)
      : from_(table), table_(table.numbers), instead_(std::move(instead)) {}

  Eigen::Index Find(const std::string& name) const {
    const auto at = std::find(table_.names.begin(), table_.names.end(), name);
    return at == table_.names.end() ? -1 : at - table_.names.begin();
  }

  Eigen::VectorXd Take(const Channel& channel) const {
    const Eigen::Index c = Find(channel.column);
    if (c < 0) throw io::InputError(from_.where + ": no column '" + channel.column + "', " + instead_);
    return (channel.gain * table_.values.col(c).array() + channel.bias).matrix();
  }

  Eigen::MatrixXd Take(const Quantity& quantity) const {
    if (quantity.optional) {
      for (const Channel& channel : quantity.joint) {
        if (Find(channel.column) < 0) return {};
      }
    }
    Eigen::MatrixXd block(table_.values.rows(), static_cast<Eigen::Index>(quantity.joint.size()));
    for (std::size_t j = 0; j < quantity.joint.size(); ++j)
      block.col(static_cast<Eigen::Index>(j)) = Take(quantity.joint[j]);
    if (quantity.matrix.size() > 0) block = (block * quantity.matrix.transpose()).eval();
    return block;
  }

 private:
  const Table& from_;
  const files::NumericTable& table_;
  std::string instead_;
};

Eigen::MatrixXd& Block(Log& log, const std::string& quantity) {
  if (quantity == "q") return log.q;
  if (quantity == "tau") return log.tau;
  if (quantity == "qd") return log.qd;
  if (quantity == "qdd") return log.qdd;
  if (quantity == "qref") return log.qref;
  if (quantity == "tauff") return log.tauff;
  if (quantity == "ext") return log.ext;
  return log.temp;
}

// The file's rows as they stand.
RawLog Raw(const std::string& file, Table table, const ChannelMap& map) {
  const Columns columns(
      table, map.source == file ? kOurColumns : "which the channel map " + map.source + " names; " + table.has);
  RawLog raw;
  raw.log.joints = map.joints;
  raw.log.source = file;
  raw.log.t = columns.Take(map.time);
  raw.time_column = map.time.column;
  for (const Quantity& quantity : map.quantities) {
    if (quantity.name == "flag") raw.flags = columns.Take(quantity);
    else Block(raw.log, quantity.name) = columns.Take(quantity);
  }
  for (const char* name : {"q", "tau"})
    for (const Quantity& quantity : map.quantities)
      for (const Channel& channel : quantity.joint)
        if (quantity.name == name) raw.columns.push_back(channel.column);
  raw.missing = table.numbers.values.array().isNaN().rowwise().any().cast<int>();
  raw.first_line = table.first_line;
  raw.log.ignored = std::move(table.numbers.ignored);
  raw.log.notes = std::move(table.notes);
  if (!map.unused.empty())
    raw.log.notes.push_back(map.unused + " of the channel map is not read; torque = \"" + map.unused +
                            "\" in the map takes it");
  return raw;
}

}  // namespace

double Log::step_s() const {
  if (samples() < 2) throw io::InputError(source + ": has no sample time, expected at least 2 samples");
  return MedianStep(t);
}

Log MakeLog(RawLog raw, int min_samples) {
  Log& log = raw.log;
  const Eigen::Index rows = log.t.size();
  Samples samples =
      ChooseSamples({log.t, log.q, log.tau, raw.missing, log.source, raw.time_column, raw.columns, raw.first_line});
  for (Eigen::MatrixXd* block : {&log.q, &log.tau, &log.qd, &log.qdd, &log.qref, &log.tauff, &log.ext, &log.temp})
    if (block->size() > 0) *block = (*block)(samples.row, Eigen::all).eval();
  // A word of 32 bits may be written with or without a sign.
  const auto bits = [](double flag) { return static_cast<int>(static_cast<std::uint32_t>(std::llrint(flag))); };
  if (raw.flags.size() > 0) log.flags = raw.flags(samples.row, Eigen::all).unaryExpr(bits);
  log.t = samples.t;
  log.notes.insert(log.notes.end(), samples.notes.begin(), samples.notes.end());
  log.line.resize(log.samples());
  for (Eigen::Index k = 0; k < log.samples(); ++k)
    log.line[k] = static_cast<int>(samples.row[static_cast<std::size_t>(k)]) + raw.first_line;
  if (log.samples() < min_samples) {
    throw io::InputError(log.source + ": has " + std::to_string(log.samples()) + " samples" +
                         (rows > log.samples() ? " in " + std::to_string(rows) + " rows" : "") +
                         ", expected at least " + std::to_string(min_samples));
  }
  if (std::abs(log.t[0]) >= files::kLargeTime) log.t.array() -= log.t[0];  // a sum with such a time would be rounded
  log.gaps = LostBehind(log.t);
  return std::move(raw.log);
}

Log ReadLog(const std::filesystem::path& path, int min_samples) {
  if (bags::IsRecording(path) || bags::IsMat(path))
    throw io::InputError(path.string() + ": expected a channel map (--channels), because this is no CSV file; armcal " +
                         "channels writes one");
  files::NumericTable table = files::ReadCsv(
      path,
      [](const std::string& name) {
        const auto split = SplitName(name);
        return name == "t" || (split && IsQuantity(split->quantity));
      },
      files::Missing::kNan, "t");
  const ChannelMap map = OurNames(path.string(), table.names);
  return MakeLog(Raw(path.string(), {std::move(table), path.string() + ":1"}, map), min_samples);
}

Log ReadLog(const std::filesystem::path& path, const ChannelMap& map, int min_samples) {
  return MakeLog(Raw(path.string(), ReadTable(path, map), map), min_samples);
}

void WriteLog(const std::filesystem::path& path, const Log& log, Digits digits) {
  const Eigen::MatrixXd flags = log.flags.cast<double>();
  const std::pair<const char*, const Eigen::MatrixXd*> blocks[] = {
      {"q", &log.q},         {"qd", &log.qd},   {"qdd", &log.qdd},   {"tau", &log.tau}, {"qref", &log.qref},
      {"tauff", &log.tauff}, {"ext", &log.ext}, {"temp", &log.temp}, {"flag", &flags}};
  files::NumericTable table;
  table.names = {"t"};
  for (const auto& [name, block] : blocks) {
    for (Eigen::Index j = 1; j <= block->cols(); ++j) table.names.push_back(name + std::to_string(j));
  }
  table.values.resize(log.samples(), static_cast<Eigen::Index>(table.names.size()));
  table.values.col(0) = log.t;
  Eigen::Index at = 1;
  for (const auto& [name, block] : blocks) {
    if (block->cols() > 0) table.values.middleCols(at, block->cols()) = *block;
    at += block->cols();
  }
  std::vector<int> counts(table.names.size(), digits == Digits::kAll ? 0 : 9);
  if (digits == Digits::kUsual) counts.front() = 12;
  files::WriteCsv(path, table, counts);
}

}  // namespace armcal::logs
