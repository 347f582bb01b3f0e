// logs - looks at a log of any format without knowing what its columns mean.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host_sim/data/logs/resample.hpp"

namespace armcal::logs {

// Columns with common times: those of a topic, or all of a file.
struct Sight {
  std::string name, type;  // of the topic; empty: a file without topics
  Series series;           // times of a topic in s; those of a file are not known, so t is empty
};

struct Look {
  std::string format;  // "CSV", "MATLAB", "recording"
  std::vector<Sight> sights;
  std::vector<std::string> notes;
};

// All columns that hold numbers. InputError: as the readers of the formats have it.
Look LookAt(const std::filesystem::path& path, const std::vector<std::filesystem::path>& definitions);

}  // namespace armcal::logs
