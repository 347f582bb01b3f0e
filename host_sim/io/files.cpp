// io - whole files through zlib and rename; knows no format.
#include "host_sim/io/files.hpp"

#include <unistd.h>
#include <zlib.h>

#include <fstream>
#include <iterator>
#include <memory>

#include "host_sim/io/input_error.hpp"

namespace armcal::io {
namespace {

namespace fs = std::filesystem;

struct CloseGz {
  void operator()(gzFile_s* f) const { gzclose(f); }
};
using GzHandle = std::unique_ptr<gzFile_s, CloseGz>;

void RequireRegular(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) throw InputError(path.string() + ": no such file");
  if (fs::is_directory(path, error)) throw InputError(path.string() + ": is a folder, expected a file");
}

[[noreturn]] void CannotWrite(const fs::path& path) { throw InputError(path.string() + ": cannot be written"); }

void WritePlain(const fs::path& path, std::string_view text) {
  std::ofstream out(path, std::ios::binary);
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
  out.close();
  if (!out) CannotWrite(path);
}

void WriteGzip(const fs::path& path, std::string_view text) {
  GzHandle out(gzopen(path.c_str(), "wb6"));
  if (!out) CannotWrite(path);
  constexpr std::size_t kChunk_bytes = std::size_t{1} << 20;  // gzwrite counts in unsigned int
  for (std::size_t at = 0; at < text.size(); at += kChunk_bytes) {
    const std::string_view part = text.substr(at, kChunk_bytes);
    if (gzwrite(out.get(), part.data(), static_cast<unsigned>(part.size())) <= 0) CannotWrite(path);
  }
  if (gzclose(out.release()) != Z_OK) CannotWrite(path);
}

}  // namespace

std::string ReadWholeFile(const fs::path& path) {
  RequireRegular(path);
  GzHandle in(gzopen(path.c_str(), "rb"));
  if (!in) throw InputError(path.string() + ": cannot be opened");
  gzbuffer(in.get(), 1u << 18);
  std::string content;
  std::size_t used = 0;
  for (;;) {
    content.resize(std::max<std::size_t>(std::size_t{1} << 20, 2 * used));
    const int got = gzread(in.get(), content.data() + used,
                           static_cast<unsigned>(std::min<std::size_t>(content.size() - used, std::size_t{1} << 30)));
    int code = Z_OK;
    gzerror(in.get(), &code);
    if (got < 0 || (code != Z_OK && code != Z_STREAM_END)) {
      throw InputError(path.string() + ": gzip data is damaged or cut short");
    }
    if (got == 0) break;
    used += static_cast<std::size_t>(got);
  }
  content.resize(used);
  return content;
}

void AtomicWrite(const fs::path& path, std::string_view text) {
  std::error_code error;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  const fs::path part = path.string() + ".part" + std::to_string(getpid());
  try {
    if (path.extension() == ".gz") WriteGzip(part, text);
    else WritePlain(part, text);
    fs::rename(part, path, error);
    if (error) CannotWrite(path);
  } catch (const InputError&) {
    fs::remove(part, error);
    CannotWrite(path);
  }
}

std::string FileHash(const fs::path& path) {
  RequireRegular(path);
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(path.string() + ": cannot be opened");
  return Sha256(std::string(std::istreambuf_iterator<char>(in), {}));
}

}  // namespace armcal::io
