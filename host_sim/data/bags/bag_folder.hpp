// bags - lists the files of a recording: rosbag2 splits one into several files in a folder.
#pragma once

#include <filesystem>
#include <vector>

namespace armcal::bags {

// The file itself, or the files of a folder: those that its metadata.yaml names, or, without one, all that end in
// .mcap, .db3, or one of these and .zst or .zstd. InputError: a named file is missing, or there is none.
std::vector<std::filesystem::path> FilesOfRecording(const std::filesystem::path& path);

}  // namespace armcal::bags
