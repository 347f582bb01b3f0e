// logs - reads the columns that a map names, whatever the format of the file is.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host_sim/data/bags/recording.hpp"
#include "host_sim/data/files/csv.hpp"
#include "host_sim/data/logs/channels.hpp"
#include "host_sim/data/logs/resample.hpp"

namespace armcal::logs {

// A recording (MCAP, rosbag2) has these columns beside those of its topics: the time of each message in s, from the
// first message on. The first one is header.stamp, or the recorder's time where a message has no stamp.
inline constexpr const char* kTimeColumn = "__time";
inline constexpr const char* kRecorderTimeColumn = "__log_time";

struct Table {
  files::NumericTable numbers;          // NaN: no number; the columns of the map as far as the file has them
  std::string where;                    // stands before messages about columns: "log.csv:1"
  std::string has = {};                 // what a missing column could be, for messages
  int first_line = 2;                   // the number that messages give the first row
  std::vector<std::string> notes = {};  // what reading changed or left out
};

// The columns of a topic, with times in s from `begin_ns` on. Takes them out of the stream.
Series SeriesOf(bags::Stream& stream, std::int64_t begin_ns);

// CSV, MCAP, rosbag2 or MATLAB. Columns with times of their own (topics, or empty cells of a CSV) are brought to common
// times, see resample.hpp. InputError: as the readers of the formats have it.
Table ReadTable(const std::filesystem::path& path, const ChannelMap& map);

}  // namespace armcal::logs
