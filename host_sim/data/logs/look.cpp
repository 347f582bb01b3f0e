// logs - reads all columns of a log.
#include "host_sim/data/logs/look.hpp"

#include <fmt/format.h>

#include "host_sim/data/bags/mat.hpp"
#include "host_sim/data/bags/recording.hpp"
#include "host_sim/data/logs/table.hpp"

namespace armcal::logs {

Look LookAt(const std::filesystem::path& path, const std::vector<std::filesystem::path>& definitions) {
  Look look;
  if (bags::IsRecording(path)) {
    bags::Recording recording = bags::ReadRecording(path, {{}, definitions, false});
    look.format = "recording", look.notes = std::move(recording.notes);
    for (bags::Stream& stream : recording.streams)
      look.sights.push_back({stream.topic, stream.type, SeriesOf(stream, stream.stamp_ns[0])});
    return look;
  }
  Sight& all = look.sights.emplace_back();
  if (bags::IsMat(path)) {
    look.format = "MATLAB";
    all.series.numbers = bags::ReadMat(path, {});
    if (const auto& ignored = all.series.numbers.ignored; !ignored.empty())
      look.notes.push_back(fmt::format("left out, because not arrays of {} numbers a column: {}",
                                       all.series.numbers.values.rows(), fmt::join(ignored, ", ")));
    return look;
  }
  look.format = "CSV";
  const std::vector<std::string> numeric = files::NumericColumns(path);
  all.series.numbers = files::ReadCsv(
      path,
      [&numeric](const std::string& name) { return std::find(numeric.begin(), numeric.end(), name) != numeric.end(); },
      files::Missing::kNan);
  return look;
}

}  // namespace armcal::logs
