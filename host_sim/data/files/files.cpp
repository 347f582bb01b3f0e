// files - reads, writes and hashes whole files, plain or gzip.
#include "host_sim/data/files/files.hpp"

#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>
#include <set>

#include "armcal/core/sha256.hpp"
#include "codegen/src/io/atomic_write.hpp"
#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/json.hpp"
#include "codegen/src/io/require_file.hpp"

namespace armcal::files {
namespace {

namespace fs = std::filesystem;

struct CloseGz {
  void operator()(gzFile_s* f) const { gzclose(f); }
};
using GzHandle = std::unique_ptr<gzFile_s, CloseGz>;

// Text of numbers shrinks to a third or a fifth. A file made to fill the memory shrinks to a thousandth.
constexpr std::size_t kExpansion = 60, kExpansionFree_bytes = std::size_t{16} << 20;

// What is read of a file at a time. Small files are many: robot files, tables, and what a fuzzer makes.
std::size_t PortionOf(const fs::path& path) {
  constexpr std::uintmax_t kLeast_bytes = 1 << 12, kMost_bytes = 1 << 16;
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  return static_cast<std::size_t>(error ? kMost_bytes : std::clamp(size, kLeast_bytes, kMost_bytes));
}

// The text as a gzip file without name and time, so that equal texts give equal bytes.
std::string Compressed(std::string_view text) {
  z_stream stream = {};
  constexpr int kLevel = 6, kGzipFormat = 15 + 16, kMemory = 8;
  if (deflateInit2(&stream, kLevel, Z_DEFLATED, kGzipFormat, kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  std::string out;
  constexpr std::size_t kChunk_bytes = std::size_t{1} << 20;  // zlib counts in unsigned int
  std::size_t at = 0;
  int code = Z_OK;
  do {
    const std::string_view part = text.substr(at, kChunk_bytes);
    at += part.size();
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(part.data()));
    stream.avail_in = static_cast<unsigned>(part.size());
    do {
      const std::size_t used = out.size();
      out.resize(used + kChunk_bytes);
      stream.next_out = reinterpret_cast<Bytef*>(out.data() + used);
      stream.avail_out = static_cast<unsigned>(kChunk_bytes);
      code = deflate(&stream, at == text.size() ? Z_FINISH : Z_NO_FLUSH);
      out.resize(out.size() - stream.avail_out);
    } while (stream.avail_out == 0);
  } while (code != Z_STREAM_END);
  deflateEnd(&stream);
  return out;
}

}  // namespace

std::string ReadWholeFile(const fs::path& path) {
  io::RequireFile(path);
  GzHandle in(gzopen(path.c_str(), "rb"));
  if (!in) throw io::InputError(path.string() + ": cannot be opened");
  const std::size_t portion = PortionOf(path);
  gzbuffer(in.get(), static_cast<unsigned>(portion));
  std::string content;
  std::size_t used = 0;
  for (;;) {
    // Judged by what has been read of the file, so that the memory stays small.
    const std::size_t most = kExpansion * static_cast<std::size_t>(gzoffset(in.get())) + kExpansionFree_bytes;
    if (used > most)
      throw io::InputError(path.string() + ": grows to more than " + std::to_string(kExpansion) +
                           " times its size when it is decompressed, which no log does");
    content.resize(std::max(portion, used + used / 2));
    const int got = gzread(in.get(), content.data() + used,
                           static_cast<unsigned>(std::min<std::size_t>(content.size() - used, std::size_t{1} << 30)));
    int code = Z_OK;
    gzerror(in.get(), &code);
    if (got < 0 || (code != Z_OK && code != Z_STREAM_END)) {
      throw io::InputError(path.string() + ": gzip data is damaged or cut short; copy or record it again");
    }
    if (got == 0) break;
    used += static_cast<std::size_t>(got);
  }
  content.resize(used);
  return content;
}

nlohmann::ordered_json ReadJsonFile(const fs::path& path) { return io::ParseJson(ReadWholeFile(path)); }

void WriteWholeFile(const fs::path& path, std::string_view text) {
  if (path.extension() == ".gz") io::AtomicWrite(path, Compressed(text));
  else io::AtomicWrite(path, text);
}

namespace {

std::string Hex(core::Sha256& hash) {
  std::uint8_t digest[core::Sha256::kDigestBytes];
  hash.Finish(digest);
  std::string out;
  for (const std::uint8_t byte : digest) out += {"0123456789abcdef"[byte >> 4], "0123456789abcdef"[byte & 0xF]};
  return out;
}

void Add(std::string_view text, core::Sha256& hash) {
  hash.Add(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
}

}  // namespace

std::string Sha256(std::string_view text) {
  core::Sha256 hash;
  hash.Begin();
  Add(text, hash);
  return Hex(hash);
}

std::string FileHash(const fs::path& path) {
  std::error_code none;
  if (fs::is_directory(path, none)) {
    std::set<std::string> lines;
    for (const auto& entry : fs::directory_iterator(path))
      if (entry.is_regular_file()) lines.insert(entry.path().filename().string() + ' ' + FileHash(entry.path()) + '\n');
    std::string text;
    for (const std::string& line : lines) text += line;
    return Sha256(text);
  }
  io::RequireFile(path);
  std::ifstream in(path, std::ios::binary);
  if (!in) throw io::InputError(path.string() + ": cannot be opened");
  core::Sha256 hash;
  hash.Begin();
  std::string part(std::size_t{1} << 16, '\0');
  do {
    in.read(part.data(), static_cast<std::streamsize>(part.size()));
    Add(std::string_view(part).substr(0, static_cast<std::size_t>(in.gcount())), hash);
  } while (in);
  return Hex(hash);
}

}  // namespace armcal::files
