// logs - makes one table of a CSV file or of the topics of a recording.
#include "host_sim/data/logs/table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/bags/mat.hpp"
#include "host_sim/data/bags/one_line.hpp"

namespace armcal::logs {

namespace {

constexpr double kFullRows = 0.9;  // of a table; with fewer, its columns have times of their own

std::set<std::string> ColumnsOf(const ChannelMap& map) {
  std::set<std::string> names{map.time.column};
  for (const Quantity& quantity : map.quantities)
    for (const Channel& channel : quantity.joint) names.insert(channel.column);
  return names;
}

std::vector<std::string> ColumnsOf(const ChannelMap& map, std::initializer_list<std::string_view> quantities) {
  std::vector<std::string> names;
  for (const Quantity& quantity : map.quantities)
    if (std::find(quantities.begin(), quantities.end(), quantity.name) != quantities.end())
      for (const Channel& channel : quantity.joint) names.push_back(channel.column);
  return names;
}

// Rows between the first and the last full one that are full; 1 if none is asked to be.
double FullShare(const Eigen::MatrixXd& values) {
  const Eigen::Array<bool, Eigen::Dynamic, 1> empty = values.array().isNaN().rowwise().any();
  Eigen::Index begin = 0, end = empty.size();
  while (begin < end && empty[begin]) ++begin;
  while (end > begin && empty[end - 1]) --end;
  if (begin == end) return empty.size() > 0 ? 0 : 1;
  return 1 - static_cast<double>(empty.segment(begin, end - begin).count()) / static_cast<double>(end - begin);
}

void Append(std::vector<std::string>& to, const std::vector<std::string>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

void PutTimeFirst(files::NumericTable& table, const std::string& name, const Eigen::VectorXd& t) {
  table.names.insert(table.names.begin(), name);
  Eigen::MatrixXd values(table.values.rows(), table.values.cols() + 1);
  values << t, table.values;
  table.values = std::move(values);
}

// A table with many empty cells, such as an export of topics with different rates. If common times do not fill the
// cells, the table stays as it is.
void FillEmptyCells(Table& table, const ChannelMap& map) {
  files::NumericTable& old = table.numbers;
  const auto found = std::find(old.names.begin(), old.names.end(), map.time.column);
  if (found == old.names.end() || FullShare(old.values) >= kFullRows) return;
  const auto at = found - old.names.begin();
  const Eigen::VectorXd t = map.time.gain * old.values.col(at).array() + map.time.bias;
  std::vector<Series> series = SplitByEmptyCells(old, t);
  std::erase_if(series, [](const Series& one) { return one.t.size() < 2; });
  std::size_t columns = 0;
  for (Series& one : series) columns += one.numbers.names.size();
  if (columns != old.names.size()) return;  // a column without numbers
  Common common = OnCommonTimes(series, ColumnsOf(map, {"q", "tau"}), ColumnsOf(map, {"flag"}));
  if (FullShare(common.numbers.values) < kFullRows) return;
  common.numbers.ignored = std::move(old.ignored);
  old = std::move(common.numbers);
  table.first_line = 1;
  Append(table.notes, common.notes);
}

Table FromCsv(const std::filesystem::path& path, const ChannelMap& map) {
  const std::set<std::string> columns = ColumnsOf(map);
  const auto wanted = [&columns](const std::string& name) { return columns.contains(name); };
  Table table{files::ReadCsv(path, wanted, files::Missing::kNan, map.time.column), path.string() + ":1"};
  FillEmptyCells(table, map);
  return table;
}

Table FromMat(const std::filesystem::path& path, const ChannelMap& map) {
  const std::set<std::string> columns = ColumnsOf(map);
  Table table{bags::ReadMat(path, {columns.begin(), columns.end()}), path.string()};
  table.first_line = 1;
  FillEmptyCells(table, map);
  return table;
}

Table FromRecording(const std::filesystem::path& path, const ChannelMap& map) {
  const std::set<std::string> columns = ColumnsOf(map);
  const bool recorder_time = map.time.column == kRecorderTimeColumn;
  bags::Recording recording =
      bags::ReadRecording(path, {{columns.begin(), columns.end()}, map.definitions, recorder_time});
  Table table{{}, path.string(), "its topics are", 1, std::move(recording.notes)};
  for (const std::string& topic : recording.topics) table.has += " " + topic;
  if (recording.streams.empty() && !recording.ignored.empty()) {  // its joints have other names
    const std::size_t shown = std::min<std::size_t>(recording.ignored.size(), 8);
    throw io::InputError(bags::OneLine(fmt::format(
        "{}: no column '{}' nor another one of the map; its topic has {}{}; armcal channels shows all", path.string(),
        map.quantities.at(0).joint.at(0).column,
        fmt::join(recording.ignored.begin(), recording.ignored.begin() + static_cast<std::ptrdiff_t>(shown), ", "),
        shown < recording.ignored.size() ? ", .." : "")));
  }
  if (recording.streams.empty()) return table;
  std::int64_t begin_ns = recording.streams[0].stamp_ns[0];
  for (const bags::Stream& stream : recording.streams) begin_ns = std::min(begin_ns, stream.stamp_ns[0]);
  std::vector<Series> series;
  for (bags::Stream& stream : recording.streams) series.push_back(SeriesOf(stream, begin_ns));
  Common common = OnCommonTimes(series, ColumnsOf(map, {"q", "tau"}), ColumnsOf(map, {"flag"}));
  Append(table.notes, common.notes);
  const Eigen::VectorXd& t = series[common.grid].t;
  table.numbers = std::move(common.numbers);
  PutTimeFirst(table.numbers, recorder_time ? kRecorderTimeColumn : kTimeColumn, t);
  FillEmptyCells(table, map);
  table.numbers.ignored = std::move(recording.ignored);
  return table;
}

// What may be meant instead of a column that is missing.
std::string OtherColumns(const std::vector<std::string>& names) {
  if (names.empty()) return "it names all others";
  constexpr std::size_t kMost = 20;
  std::string text = "it does not name";
  for (std::size_t k = 0; k < std::min(kMost, names.size()); ++k) text += (k > 0 ? ", " : " ") + names[k];
  return text + (names.size() > kMost ? ", ..." : "");
}

}  // namespace

Series SeriesOf(bags::Stream& stream, std::int64_t begin_ns) {
  Series series{stream.topic, Eigen::VectorXd(static_cast<Eigen::Index>(stream.stamp_ns.size())), {}};
  for (Eigen::Index k = 0; k < series.t.size(); ++k) {
    const std::int64_t stamp_ns = stream.stamp_ns[static_cast<std::size_t>(k)];
    series.t[k] =
        1e-9 * static_cast<double>(static_cast<std::uint64_t>(stamp_ns) - static_cast<std::uint64_t>(begin_ns));
  }
  series.numbers.names = std::move(stream.names);
  series.numbers.values = std::move(stream.values);
  return series;
}

Table ReadTable(const std::filesystem::path& path, const ChannelMap& map) {
  if (bags::IsRecording(path)) return FromRecording(path, map);
  Table table = bags::IsMat(path) ? FromMat(path, map) : FromCsv(path, map);
  table.has = OtherColumns(table.numbers.ignored);
  return table;
}

}  // namespace armcal::logs
