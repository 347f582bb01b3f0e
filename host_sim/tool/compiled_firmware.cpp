// tool - compiles parts of a robot's firmware. A folder of the cache is complete, or it is not there.
#include "host_sim/tool/compiled_firmware.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "codegen/src/generator/emit.hpp"
#include "codegen/src/generator/load.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/files/files.hpp"
#include "host_sim/tool/process.hpp"

namespace armcal::tool {
namespace {

namespace fs = std::filesystem;

// Of a part: its name, and what is compiled or included, in the checkout. A folder stands for the files in it.
struct Ingredients {
  const char* name;
  std::vector<const char*> sources;
};
Ingredients Of(FirmwarePart part) {
  if (part == FirmwarePart::kEstimators)
    return {"estimators",
            {"lib/armcal", "host_sim/machine/estimate/estimators.hpp", "host_sim/machine/estimate/estimators.cpp"}};
  return {"simulated drive",
          {"lib/armcal", "port/linux", "host_sim/client/vendor_registers.hpp", "host_sim/machine/drive/firmware.hpp",
           "host_sim/machine/drive/firmware.cpp", "host_sim/machine/drive/vendor_block.hpp",
           "host_sim/machine/drive/vendor_block.cpp"}};
}

// As toolchains/armcal.cmake has them.
constexpr const char* kOptions[] = {"-std=c++20",      "-O2",     "-DNDEBUG", "-ffp-contract=off",  "-fno-fast-math",
                                    "-fno-math-errno", "-shared", "-fPIC",    "-fvisibility=hidden"};

std::vector<fs::path> Sources(const fs::path& home, const std::vector<const char*>& names) {
  std::vector<fs::path> files;
  for (const char* name : names) {
    const fs::path path = home / name;
    if (fs::is_regular_file(path)) files.push_back(path);
    else if (!fs::is_directory(path))
      throw io::InputError(path.string() + ": not there, expected the sources of the firmware; set ARMCAL_HOME");
    else
      for (const auto& e : fs::recursive_directory_iterator(path))
        if (e.path().extension() == ".cpp" || e.path().extension() == ".hpp") files.push_back(e.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// FNV-1a, 64 bits.
class Hash {
 public:
  void Add(const std::string& text) {
    for (const char c : text) value_ = (value_ ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    value_ = (value_ ^ 0xff) * 0x100000001b3u;  // where one text ends
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

fs::path Cache() {
  const char* const cache = std::getenv("XDG_CACHE_HOME");
  if (cache && fs::path(cache).is_absolute()) return fs::path(cache) / "armcal";
  const char* const home = std::getenv("HOME");
  if (home && fs::path(home).is_absolute()) return fs::path(home) / ".cache" / "armcal";
  throw io::InputError("XDG_CACHE_HOME: not set, and neither is HOME; expected a folder for compiled firmware");
}

// A program by its path or in PATH; empty if there is none.
fs::path Found(const std::string& program) {
  const auto runs = [](const fs::path& p) { return fs::is_regular_file(p) && access(p.c_str(), X_OK) == 0; };
  if (program.find('/') != program.npos) return runs(program) ? fs::path(program) : fs::path();
  const char* const path = std::getenv("PATH");
  std::string rest = path ? path : "";
  while (!rest.empty()) {
    const auto end = std::min(rest.find(':'), rest.size());
    if (const fs::path p = fs::path(rest.substr(0, end)) / program; runs(p)) return p;
    rest.erase(0, end + 1);
  }
  return {};
}

// what: for messages, as "simulated drive of robot er20_like".
fs::path Compiler(const std::string& what) {
  const char* const chosen = std::getenv("CXX");
  const std::string name = chosen && *chosen ? chosen : "g++";
  if (const fs::path found = Found(name); !found.empty()) return found;
  throw io::InputError(name + ": not found, expected a C++20 compiler for the " + what + ": " +
                       (chosen && *chosen ? "the variable CXX names it" : "apt install g++"));
}

// Held by the one start that compiles; the system takes it back however that start ends.
class Lock {
 public:
  Lock(const fs::path& path, const std::string& what) : file_(open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
    if (file_ < 0) throw io::InputError(path.string() + ": cannot be written");
    if (flock(file_, LOCK_EX | LOCK_NB) == 0) return;
    fmt::print(stderr, "armcal: waiting for another start that compiles the {}\n", what);
    flock(file_, LOCK_EX);
  }
  ~Lock() { close(file_); }
  Lock(const Lock&) = delete;

 private:
  int file_;
};

void Compile(const codegen::GeneratedFiles& generated, const std::string& what, const fs::path& home,
             const std::vector<fs::path>& sources, const fs::path& folder) {
  const fs::path part = folder.string() + ".part", output = folder.string() + ".txt";
  std::vector<std::string> words{Compiler(what).string()};
  fmt::print(stderr, "armcal: compiling the {}, once; kept in {}\n", what, folder.string());
  fs::remove_all(part);  // of a start that was killed
  codegen::WriteFiles(generated, part / "model");
  words.insert(words.end(), std::begin(kOptions), std::end(kOptions));
  for (const fs::path& include : {part / "model", home / "lib", home})
    words.insert(words.end(), {"-I", include.string()});
  words.insert(words.end(), {"-o", (part / "firmware.so").string()});
  for (const fs::path& source : sources)
    if (source.extension() == ".cpp") words.push_back(source.string());
  if (RunProgram(words, output.string()) != 0) {
    fs::remove_all(part);
    throw io::InputError("the " + what + " cannot be compiled, see " + output.string());
  }
  fs::remove(output);
  fs::rename(part, folder);
}

}  // namespace

fs::path CompiledFirmware(const codegen::Model& model, FirmwarePart part) {
  const fs::path home = fs::absolute(codegen::Home());
  const Ingredients of = Of(part);
  const std::vector<fs::path> sources = Sources(home, of.sources);
  const codegen::GeneratedFiles generated = codegen::Emit(model);
  const std::string what = fmt::format("{} of robot {}", of.name, model.robot().name);
  Hash version;
  for (const char* option : kOptions) version.Add(option);
  for (const char* name : {"model.hpp", "selected_model.hpp"}) version.Add(generated.text.at(name));
  for (const fs::path& source : sources) {
    version.Add(source.lexically_relative(home).string());
    version.Add(files::ReadWholeFile(source));
  }
  const fs::path cache = Cache(), folder = cache / fmt::format("{:08X}-{:016x}", generated.schema, version.value()),
                 firmware = folder / "firmware.so";
  if (fs::is_regular_file(firmware)) return firmware;
  try {
    fs::create_directories(cache);
    const Lock lock(folder.string() + ".lock", what);
    if (!fs::is_regular_file(firmware)) Compile(generated, what, home, sources, folder);
  } catch (const fs::filesystem_error& e) {
    throw io::InputError(e.path1().string() + ": " + e.code().message() +
                         "; expected a folder for compiled firmware, see XDG_CACHE_HOME");
  }
  return firmware;
}

}  // namespace armcal::tool
