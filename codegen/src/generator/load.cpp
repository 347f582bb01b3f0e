// generator - looks for the checkout and for files in it.
#include "codegen/src/generator/load.hpp"

#include <cstdlib>
#include <set>

#include "codegen/src/io/input_error.hpp"

namespace armcal::codegen {

namespace fs = std::filesystem;

namespace {
fs::path& InstalledHome() {
  static fs::path folder;
  return folder;
}
}  // namespace

void SetInstalledHome(const fs::path& folder) { InstalledHome() = folder; }

fs::path Home() {
  const auto holds = [](const fs::path& p) {
    return fs::is_directory(p / "codegen" / "robots") && fs::is_directory(p / "codegen" / "effects");
  };
  if (const char* home = std::getenv("ARMCAL_HOME")) {
    if (!holds(home))
      throw io::InputError(std::string("ARMCAL_HOME: ") + home + ": expected a folder that holds codegen/robots");
    return home;
  }
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (fs::path start : {fs::current_path(), program})
    for (; !start.empty(); start = start.parent_path()) {
      if (holds(start)) return start;
      if (start == start.root_path()) break;
    }
  for (const fs::path& installed : {program.parent_path() / "share" / "armcal", InstalledHome()})
    if (!installed.empty() && holds(installed)) return installed;
  throw io::InputError(
      "codegen/robots: not found from here; set ARMCAL_HOME to the armcal checkout or to PREFIX/share/armcal");
}

fs::path NamedFile(const std::string& what, const std::string& name_or_path, const fs::path& folder) {
  if (fs::is_regular_file(name_or_path)) return name_or_path;
  std::set<std::string> names;
  for (const auto& e : fs::directory_iterator(folder))
    if (e.path().extension() == ".toml") names.insert(e.path().stem().string());
  if (names.contains(name_or_path)) return folder / (name_or_path + ".toml");
  std::string known;
  for (const std::string& name : names) known += (known.empty() ? "" : ", ") + name;
  throw io::InputError(what + " " + name_or_path + ": no such file or name, expected a file or one of " + known);
}

fs::path RobotPath(const std::string& name_or_path) {
  return NamedFile("robot", name_or_path, Home() / "codegen" / "robots");
}

Catalogue LoadCatalogue() { return ReadCatalogue(Home() / "codegen" / "effects"); }

Model LoadModel(const std::string& robot) { return {ReadRobot(RobotPath(robot)), LoadCatalogue()}; }

}  // namespace armcal::codegen
