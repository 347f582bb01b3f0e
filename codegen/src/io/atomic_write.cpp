// io - writes a file beside its target and renames it.
#include "codegen/src/io/atomic_write.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <system_error>

#include "codegen/src/io/input_error.hpp"

namespace armcal::io {

void MakeFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw InputError(folder.string() + ": this folder cannot be made: " + error.message() + "; choose another place");
}

namespace {

namespace fs = std::filesystem;

InputError CannotBeWritten(const fs::path& path, const std::error_code& error) {
  const std::string why = error ? ": " + error.message() : "";
  return InputError(path.string() + ": cannot be written" + why + "; choose another place");
}

// Where bytes for a path go.
struct Target {
  fs::path path;        // no symbolic link
  bool direct = false;  // a device or a pipe: it takes the bytes, and no file may stand in its place
  int descriptor = -1;  // of this program, if the path names one, as /dev/stdout and /dev/fd/1 do
};

// InputError: the path is a folder or a loop of links.
Target TargetOf(const fs::path& path) {
  constexpr int kMostLinks = 40;
  std::error_code error;
  const fs::path descriptors = fs::canonical("/proc/self/fd", error);
  Target target{path};
  for (int link = 0; link < kMostLinks && fs::is_symlink(fs::symlink_status(target.path, error)); ++link) {
    const fs::path folder = fs::absolute(target.path).parent_path();
    if (fs::canonical(folder, error) == descriptors) {  // its link may say "pipe:[7]"
      target.direct = true;
      target.descriptor = std::stoi(target.path.filename().string());
      return target;
    }
    target.path = folder / fs::read_symlink(target.path, error);
  }
  const fs::file_type type = fs::status(target.path, error).type();
  if (type == fs::file_type::none) throw CannotBeWritten(path, error);
  if (type == fs::file_type::directory) throw CannotBeWritten(path, std::make_error_code(std::errc::is_a_directory));
  target.direct = type != fs::file_type::regular && type != fs::file_type::not_found;
  return target;
}

// The error if it fails.
std::error_code WriteDirectly(const Target& target, std::string_view bytes) {
  if (target.descriptor >= 0) std::fflush(stdout);  // what was printed before comes first
  const int file = target.descriptor >= 0 ? dup(target.descriptor) : open(target.path.c_str(), O_WRONLY | O_CLOEXEC);
  std::FILE* out = file < 0 ? nullptr : fdopen(file, "wb");
  bool good = out != nullptr && std::fwrite(bytes.data(), 1, bytes.size(), out) == bytes.size();
  if (out != nullptr && std::fclose(out) != 0) good = false;
  return good ? std::error_code() : std::error_code(errno, std::generic_category());
}

}  // namespace

void CheckWritable(const fs::path& path) {
  const Target target = TargetOf(path);
  std::error_code none;
  if (target.direct) {
    if (access(target.path.c_str(), W_OK) != 0) throw CannotBeWritten(path, {errno, std::generic_category()});
    return;
  }
  // Of the folders above it the nearest that is there decides; the others can be made in it.
  fs::path above = fs::absolute(target.path).parent_path();
  while (!fs::exists(fs::symlink_status(above, none)) && above.has_relative_path()) above = above.parent_path();
  if (!fs::is_directory(above, none)) throw CannotBeWritten(path, std::make_error_code(std::errc::not_a_directory));
  if (access(above.c_str(), W_OK) != 0) throw CannotBeWritten(path, {errno, std::generic_category()});
}

void AtomicWrite(const fs::path& path, std::string_view bytes) {
  const Target target = TargetOf(path);
  if (target.direct) {
    if (const std::error_code error = WriteDirectly(target, bytes)) throw CannotBeWritten(path, error);
    return;
  }
  std::error_code error;
  if (target.path.has_parent_path()) fs::create_directories(target.path.parent_path(), error);
  // Hosts that share a folder may have processes of one number.
  char host[65] = {};
  gethostname(host, sizeof host - 1);
  const fs::path part = target.path.string() + ".part." + host + "." + std::to_string(getpid());
  errno = 0;
  std::ofstream out(part, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  error = out ? std::error_code() : std::error_code(errno, std::generic_category());
  if (out) fs::rename(part, target.path, error);
  if (out && !error) return;
  const InputError cannot = CannotBeWritten(path, error);
  fs::remove(part, error);
  throw cannot;
}

}  // namespace armcal::io
