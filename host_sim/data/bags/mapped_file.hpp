// bags - shows a file's bytes without copying them; the system reads the parts that are looked at.
#pragma once

#include <filesystem>

#include "host_sim/data/bags/cursor.hpp"

namespace armcal::bags {

class MappedFile {
 public:
  // InputError: no such file, a folder, or it cannot be opened.
  explicit MappedFile(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  Bytes bytes() const { return {static_cast<const char*>(start_), size_}; }

 private:
  void* start_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace armcal::bags
