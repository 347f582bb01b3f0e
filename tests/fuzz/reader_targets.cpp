// fuzz - readers of files. The bytes lie in memory, under a name of the kernel.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/robot/robot.hpp"
#include "host_sim/client/table_backup.hpp"
#include "host_sim/data/bags/recording.hpp"
#include "host_sim/data/files/csv.hpp"
#include "host_sim/data/files/files.hpp"
#include "host_sim/diagnose/verdict/verdict_file.hpp"
#include "tests/fuzz/targets.hpp"

namespace armcal::fuzz {
namespace {

// Reads the bytes as a file; bad input is what a reader may say. One file in memory serves all inputs.
template <class Read>
void AsFile(const std::uint8_t* bytes, std::size_t count, Read read) {
  static const int file = ::memfd_create("fuzz", MFD_CLOEXEC);
  static const std::string name = "/proc/self/fd/" + std::to_string(file);
  if (::ftruncate(file, 0) != 0 || ::pwrite(file, bytes, count, 0) != static_cast<ssize_t>(count)) {
    std::fprintf(stderr, "no file in memory\n");
    std::abort();
  }
  try {
    read(name);
  } catch (const io::InputError&) {
  }
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

void Json(const std::uint8_t* bytes, std::size_t count) {
  AsFile(bytes, count, [](const std::string& path) {
    const auto verdict = verdict::ReadVerdict(path);  // never bad input: a file without a verdict is a failed one
    for (const auto& term : verdict.value("terms", nlohmann::ordered_json::array()))
      (void)verdict::JointText(term.at("joint"));
    (void)client::ReadBackup(path);
  });
}

}  // namespace armcal::fuzz
