// io - writes a file beside its target and renames it.
#include "codegen/src/io/atomic_write.hpp"

#include <unistd.h>

#include <fstream>

#include "codegen/src/io/input_error.hpp"

namespace armcal::io {

void AtomicWrite(const std::filesystem::path& path, std::string_view bytes) {
  std::error_code error;
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), error);
  const std::filesystem::path part = path.string() + ".part" + std::to_string(getpid());
  std::ofstream out(part, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (out) std::filesystem::rename(part, path, error);
  if (out && !error) return;
  std::filesystem::remove(part, error);
  throw InputError(path.string() + ": cannot be written");
}

}  // namespace armcal::io
