// faults - copies sources with a switch at the place of every fault; knows text, not what it means.
//   plant_faults FAULTS SOURCES COPY: folders of <room>.toml, of the sources and of their copy
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>

#include "tests/faults/fault_list.hpp"

namespace {

namespace fs = std::filesystem;
using armcal::faults::Fault;

std::string Read(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// A file that is as it should be keeps its time, so that only what changed is compiled again.
void Write(const fs::path& path, const std::string& text) {
  if (fs::exists(path) && Read(path) == text) return;
  fs::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

// A text that ends like a statement is one; any other is an expression.
std::string Switch(const Fault& fault, std::size_t number) {
  const std::string planted = "::armcal::Planted(" + std::to_string(number) + ")";
  if (fault.right.back() == ';') return "if (" + planted + ") { " + fault.wrong + " } else { " + fault.right + " }";
  return "(" + planted + " ? (" + fault.wrong + ") : (" + fault.right + "))";
}

// Places are looked up before anything is replaced: a fault never hits the text of another. What is wrong with a fault
// is a line on stderr, and the answer false.
bool Plant(const std::string& file, const std::vector<Fault>& faults, std::string& source) {
  std::map<std::size_t, std::size_t> at;  // place -> fault
  bool good = true;
  const auto refuse = [&](const Fault& fault, const char* why) {
    std::cerr << "plant_faults: \"" << fault.name << "\": " << why << " in " << file << "\n";
    good = false;
  };
  for (std::size_t k = 0; k < faults.size(); ++k) {
    if (faults[k].file != file) continue;
    const std::size_t place = source.find(faults[k].right);
    if (place == source.npos || source.find(faults[k].right, place + 1) != source.npos)
      refuse(faults[k], "its text is not found exactly once");
    else if (!at.emplace(place, k).second) refuse(faults[k], "it shares its place with another one");
  }
  if (at.empty()) return good;
  std::string copy = "#include \"tests/faults/planted.hpp\"\n";
  std::size_t done = 0;
  for (const auto& [place, k] : at) {
    if (place < done) {
      refuse(faults[k], "it lies inside another one");
      continue;
    }
    copy += source.substr(done, place - done) + Switch(faults[k], k + 1);
    done = place + faults[k].right.size();
  }
  source = copy + source.substr(done);
  return good;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 4) throw std::runtime_error("usage: plant_faults FAULTS SOURCES COPY");
  const std::vector<Fault> faults = armcal::faults::ReadFaults(argv[1]);
  const fs::path sources = argv[2], copy = argv[3];
  bool good = true;
  for (const Fault& fault : faults)
    if (!fs::exists(sources / fault.file))
      throw std::runtime_error("\"" + fault.name + "\": there is no " + fault.file);
  for (const auto& entry : fs::recursive_directory_iterator(sources)) {
    if (!entry.is_regular_file()) continue;
    const std::string file = fs::relative(entry.path(), sources).string();
    std::string text = Read(entry.path());
    good &= Plant(file, faults, text);
    Write(copy / file, text);
  }
  return good ? 0 : 1;
} catch (const std::exception& e) {
  std::cerr << "plant_faults: " << e.what() << "\n";
  return 1;
}
