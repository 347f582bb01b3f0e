// fuzz - readers of files. The bytes lie in memory, under a name of the kernel.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <string>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/robot/robot.hpp"
#include "host_sim/data/bags/recording.hpp"
#include "host_sim/data/files/csv.hpp"
#include "host_sim/data/files/files.hpp"
#include "tests/fuzz/targets.hpp"

namespace armcal::fuzz {
namespace {

// Reads the bytes as a file of this name; bad input is what a reader may say.
template <class Read>
void AsFile(const std::uint8_t* bytes, std::size_t count, Read read) {
  const int file = ::memfd_create("fuzz", MFD_CLOEXEC);
  if (file < 0) return;
  for (std::size_t done = 0; done < count;) {
    const ssize_t written = ::write(file, bytes + done, count - done);
    if (written <= 0) break;
    done += static_cast<std::size_t>(written);
  }
  try {
    read("/proc/self/fd/" + std::to_string(file));
  } catch (const io::InputError&) {
  }
  ::close(file);
}

}  // namespace

void Csv(const std::uint8_t* bytes, std::size_t count) {
  AsFile(bytes, count, [](const std::string& path) { (void)files::ReadCsv(path, {}, files::Missing::kNan); });
}
void Gzip(const std::uint8_t* bytes, std::size_t count) {
  AsFile(bytes, count, [](const std::string& path) { (void)files::ReadWholeFile(path); });
}
void Robot(const std::uint8_t* bytes, std::size_t count) {
  AsFile(bytes, count, [](const std::string& path) { (void)codegen::ReadRobot(path); });
}
void Mcap(const std::uint8_t* bytes, std::size_t count) {
  AsFile(bytes, count, [](const std::string& path) { (void)bags::ReadRecording(path, {}); });
}

}  // namespace armcal::fuzz
