// files - reads a whole file (plain or gzip), writes one, and gives its hash.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace armcal::files {

// The whole content; gzip is recognised by its content, not by the name. InputError: cannot be opened, is
// cut short, or grows to more than 60 times its size and 16 MB.
std::string ReadWholeFile(const std::filesystem::path& path);

// The value in a JSON file; is_discarded() if it holds no JSON. Throws as ReadWholeFile.
nlohmann::ordered_json ReadJsonFile(const std::filesystem::path& path);

// Writes the text so that a reader sees the old file or the new one, never a part. A name that ends in ".gz" is
// compressed; equal texts give equal bytes. Missing parent folders are made. InputError: cannot be written.
void WriteWholeFile(const std::filesystem::path& path, std::string_view text);

// SHA-256 of the file's bytes as they lie on disk, 64 hex digits. Of a folder: of the names and hashes of its files.
// InputError: cannot be opened.
std::string FileHash(const std::filesystem::path& path);

// SHA-256 of a text, 64 hex digits (FIPS 180-4).
std::string Sha256(std::string_view text);

}  // namespace armcal::files
