// io - writes a file beside its target and renames it.
#include "codegen/src/io/atomic_write.hpp"

#include <unistd.h>

#include <cerrno>
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
InputError CannotBeWritten(const std::filesystem::path& path, const std::error_code& error) {
  const std::string why = error ? ": " + error.message() : "";
  return InputError(path.string() + ": cannot be written" + why + "; choose another place");
}
}  // namespace

void CheckWritable(const std::filesystem::path& path) {
  std::error_code none;
  if (std::filesystem::is_directory(path, none))
    throw CannotBeWritten(path, std::make_error_code(std::errc::is_a_directory));
  // Of the folders above it the nearest that is there decides; the others can be made in it.
  std::filesystem::path above = std::filesystem::absolute(path).parent_path();
  while (!std::filesystem::exists(std::filesystem::symlink_status(above, none)) && above.has_relative_path())
    above = above.parent_path();
  if (!std::filesystem::is_directory(above, none))
    throw CannotBeWritten(path, std::make_error_code(std::errc::not_a_directory));
  if (access(above.c_str(), W_OK) != 0) throw CannotBeWritten(path, {errno, std::generic_category()});
}

void AtomicWrite(const std::filesystem::path& path, std::string_view bytes) {
  std::error_code error;
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), error);
  // Hosts that share a folder may have processes of one number.
  char host[65] = {};
  gethostname(host, sizeof host - 1);
  const std::filesystem::path part = path.string() + ".part." + host + "." + std::to_string(getpid());
  errno = 0;
  std::ofstream out(part, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  error = out ? std::error_code() : std::error_code(errno, std::generic_category());
  if (out) std::filesystem::rename(part, path, error);
  if (out && !error) return;
  const InputError cannot = CannotBeWritten(path, error);
  std::filesystem::remove(part, error);
  throw cannot;
}

}  // namespace armcal::io
