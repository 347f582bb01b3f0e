// bags - reads the list of files in the metadata of rosbag2.
#include "host_sim/data/bags/bag_folder.hpp"

#include <algorithm>
#include <fstream>
#include <string>

#include "codegen/src/io/input_error.hpp"

namespace armcal::bags {

namespace {

namespace fs = std::filesystem;

// The items of the list `relative_file_paths`. Of YAML this reads one block list of plain or quoted words, which is
// what rosbag2 writes.
std::vector<std::string> NamedFiles(const fs::path& metadata) {
  std::ifstream in(metadata);
  std::vector<std::string> names;
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    const auto first = line.find_first_not_of(" \t");
    if (first == line.npos) continue;
    if (inside && line.compare(first, 2, "- ") == 0) {
      std::string name = line.substr(first + 2);
      std::erase_if(name, [](char c) { return c == '"' || c == '\'' || c == '\r'; });
      names.push_back(name.substr(0, name.find_last_not_of(' ') + 1));
    } else if (inside) {
      break;
    } else {
      inside = line.compare(first, std::string::npos, "relative_file_paths:") == 0;
    }
  }
  return names;
}

bool IsBagFile(const fs::path& path) {
  const fs::path end = path.extension(), name = end == ".zst" || end == ".zstd" ? path.stem() : path.filename();
  return name.extension() == ".mcap" || name.extension() == ".db3";
}

}  // namespace

std::vector<fs::path> FilesOfRecording(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return {path};
  std::vector<fs::path> files;
  for (const std::string& name : NamedFiles(path / "metadata.yaml")) {
    // rosbag2 before 2020 names the file with the folder.
    fs::path file = path / name;
    if (!fs::exists(file, error)) file = path / fs::path(name).filename();
    if (!fs::exists(file, error))
      throw io::InputError((path / "metadata.yaml").string() + ": relative_file_paths: there is no file " +
                           file.string());
    files.push_back(file);
  }
  if (!files.empty()) return files;
  for (const auto& entry : fs::directory_iterator(path, error))
    if (IsBagFile(entry.path())) files.push_back(entry.path());
  if (files.empty())
    throw io::InputError(path.string() + ": is a folder without files .mcap or .db3, expected a log or a bag's folder");
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace armcal::bags
