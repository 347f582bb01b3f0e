// io - writes a file so that a reader sees the old file or the new one.
#pragma once

#include <filesystem>
#include <string_view>

namespace armcal::io {

// With its parents, if they are missing. InputError: cannot be made.
void MakeFolder(const std::filesystem::path& folder);

// What AtomicWrite would say of this path, before the work that makes the bytes. InputError: the path is a folder or a
// device that cannot be written to, or what it lies in is no folder or cannot be written to. Nothing is made.
void CheckWritable(const std::filesystem::path& path);

// Writes the bytes beside the target and renames the file, so that no reader sees a part of it. Missing parent folders
// are made. A symbolic link stays, and the file that it names is replaced. A device, a pipe and a descriptor of this
// program (/dev/stdout, /dev/fd/1) are written to as they are. InputError: cannot be written; the old file is still
// there.
void AtomicWrite(const std::filesystem::path& path, std::string_view bytes);

}  // namespace armcal::io
