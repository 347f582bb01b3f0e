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

void AtomicWrite(const std::filesystem::path& path, std::string_view bytes) {
  std::error_code error;
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), error);
  const std::filesystem::path part = path.string() + ".part" + std::to_string(getpid());
  errno = 0;
  std::ofstream out(part, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  error = out ? std::error_code() : std::error_code(errno, std::generic_category());
  if (out) std::filesystem::rename(part, path, error);
  if (out && !error) return;
  const std::string why = error ? ": " + error.message() : "";
  std::filesystem::remove(part, error);
  throw InputError(path.string() + ": cannot be written" + why + "; choose another place");
}

}  // namespace armcal::io
