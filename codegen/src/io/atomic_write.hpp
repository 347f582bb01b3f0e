// io - writes a file so that a reader sees the old file or the new one.
#pragma once

#include <filesystem>
#include <string_view>

namespace armcal::io {

// With its parents, if they are missing. InputError: cannot be made.
void MakeFolder(const std::filesystem::path& folder);

// Writes the bytes beside the target and renames the file, so that no reader sees a part of it. Missing parent folders
// are made. InputError: cannot be written; the old file is still there.
void AtomicWrite(const std::filesystem::path& path, std::string_view bytes);

}  // namespace armcal::io
