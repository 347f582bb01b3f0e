// rooms - scans the sources as text.
#include "tests/rooms/house.hpp"

#include <algorithm>
#include <fstream>
#include <functional>
#include <set>
#include <sstream>
#include <string_view>

namespace armcal::house {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHouse[] = {"lib", "port", "codegen", "host_sim", "tests"};
constexpr std::string_view kSources[] = {".hpp", ".cpp", ".h", ".c"};
constexpr std::string_view kTexts[] = {".hpp", ".cpp", ".h",    ".c",     ".md",  ".toml",
                                       ".sh",  ".txt", ".json", ".cmake", ".yml", ".ld"};

template <class List>
bool Contains(const List& list, std::string_view item) {
  return std::find(std::begin(list), std::end(list), item) != std::end(list);
}

bool IsText(const fs::path& path) {
  return Contains(kTexts, path.extension().string()) ||
         (path.extension().empty() && path.parent_path().filename() == ".ci");
}

bool IsSource(const fs::path& path) { return Contains(kSources, path.extension().string()); }

// Visits the wanted files below `top` in a fixed order, with their name from the top and their lines.
using Visit = std::function<void(const std::string& name, const std::vector<std::string>& lines)>;
void ForEachFile(const fs::path& top, bool (*wanted)(const fs::path&), const Visit& visit) {
  std::vector<fs::path> files;
  for (auto it = fs::recursive_directory_iterator(top); it != fs::recursive_directory_iterator(); ++it) {
    const std::string name = it->path().filename().string();
    const bool hidden = name.front() == '.' && name != ".ci";
    if (it->is_directory() && (hidden || name == "build")) it.disable_recursion_pending();
    else if (it->is_regular_file() && wanted(it->path())) files.push_back(it->path());
  }
  std::sort(files.begin(), files.end());
  for (const fs::path& path : files) {
    std::ifstream in(path);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    visit(fs::relative(path, top).string(), lines);
  }
}

std::string At(const std::string& name, std::size_t line, const std::string& what) {
  return name + ":" + std::to_string(line + 1) + ": " + what;
}

// What stands between the marks of an #include line; empty for another line.
std::string Included(const std::string& line, char open, char close) {
  if (line.rfind("#include", 0) != 0) return "";
  const auto begin = line.find(open);
  const auto end = begin == line.npos ? line.npos : line.find(close, begin + 1);
  return end == line.npos ? "" : line.substr(begin + 1, end - begin - 1);
}

// The longest room of the table that holds the folder; empty if none does.
std::string RoomOf(const Edges& edges, const std::string& folder) {
  std::string best;
  for (const auto& [room, may] : edges) {
    const bool holds = room.back() == '/' ? folder.rfind(room, 0) == 0 : folder == room;
    if (holds && room.size() > best.size()) best = room;
  }
  return best;
}

std::string Folder(const std::string& file) { return fs::path(file).parent_path().string(); }

// An edge leads to a folder, to a folder and all below it ("x/"), or to one file.
bool LeadsTo(const std::string& edge, const std::string& file) {
  const std::string folder = Folder(file);
  return edge.back() == '/' ? folder.rfind(edge, 0) == 0 : folder == edge || file == edge;
}

bool Allowed(const Edges& edges, const std::string& room, const std::string& file) {
  if (RoomOf(edges, Folder(file)) == room) return true;
  const auto& may = edges.at(room);
  return std::any_of(may.begin(), may.end(), [&](const std::string& edge) { return LeadsTo(edge, file); });
}

// The file from the top that a line includes; empty for another line.
std::string FileOf(const std::string& line, const Selected& selected) {
  std::string file = Included(line, '"', '"');
  if (file.rfind("armcal/", 0) == 0) file = "lib/" + file;
  const auto it = selected.find(file);
  return it == selected.end() ? file : it->second;
}

bool InHouse(const std::string& name) { return Contains(kHouse, fs::path(name).begin()->string()); }

}  // namespace

std::vector<std::string> CheckIncludes(const fs::path& top, const Edges& edges, const Selected& selected) {
  std::vector<std::string> found;
  ForEachFile(top, IsSource, [&](const std::string& name, const std::vector<std::string>& lines) {
    if (!InHouse(name)) return;
    const std::string room = RoomOf(edges, Folder(name));
    if (room.empty()) found.push_back(At(name, 0, "lies in no room of the table"));
    for (std::size_t k = 0; k < lines.size() && !room.empty(); ++k) {
      const std::string file = FileOf(lines[k], selected);
      if (file.empty()) continue;
      if (!InHouse(file)) found.push_back(At(name, k, "includes \"" + file + "\", which is no path from the top"));
      else if (!Allowed(edges, room, file)) found.push_back(At(name, k, room + " may not include " + file));
    }
  });
  return found;
}

std::vector<std::string> UnusedEdges(const fs::path& top, const Edges& edges, const Selected& selected) {
  std::map<std::string, std::set<std::string>> unused;
  for (const auto& [room, may] : edges) unused[room].insert(may.begin(), may.end());
  ForEachFile(top, IsSource, [&](const std::string& name, const std::vector<std::string>& lines) {
    const auto room = unused.find(RoomOf(edges, Folder(name)));
    if (room == unused.end()) return;
    for (const std::string& line : lines) {
      const std::string file = FileOf(line, selected);
      if (!file.empty() && RoomOf(edges, Folder(file)) != room->first)
        std::erase_if(room->second, [&](const std::string& edge) { return LeadsTo(edge, file); });
    }
  });
  std::vector<std::string> found;
  for (const auto& [room, left] : unused)
    for (const std::string& edge : left) found.push_back(room + " -> " + edge + ": no include uses this edge");
  return found;
}

std::vector<std::string> CheckSystemHeaders(const fs::path& top, const std::vector<std::string>& rooms,
                                            const std::vector<std::string>& allowed) {
  std::vector<std::string> found;
  ForEachFile(top, IsSource, [&](const std::string& name, const std::vector<std::string>& lines) {
    if (std::none_of(rooms.begin(), rooms.end(), [&](const auto& room) { return name.rfind(room, 0) == 0; })) return;
    for (std::size_t k = 0; k < lines.size(); ++k) {
      const std::string header = Included(lines[k], '<', '>');
      if (!header.empty() && !Contains(allowed, header))
        found.push_back(At(name, k, "may not include <" + header + ">"));
    }
  });
  return found;
}

std::vector<std::string> CheckFirstLines(const fs::path& top) {
  std::vector<std::string> found;
  ForEachFile(top, IsSource, [&](const std::string& name, const std::vector<std::string>& lines) {
    if (!InHouse(name)) return;
    const std::string first = lines.empty() ? "" : lines.front();
    const auto dash = first.find(" - ");
    const std::string room = first.rfind("// ", 0) == 0 && dash != first.npos ? first.substr(3, dash - 3) : "";
    const std::string expected = fs::path(name).parent_path().filename().string();
    const bool fits = name.rfind("tests/", 0) == 0 ? !room.empty() : room.find(expected) != room.npos;
    if (!fits) found.push_back(At(name, 0, "the first line must be \"// " + expected + " - what the file is for\""));
  });
  return found;
}

std::vector<std::string> CheckText(const fs::path& top, const std::vector<std::string>& forbidden) {
  std::vector<std::string> found;
  ForEachFile(top, IsText, [&](const std::string& name, const std::vector<std::string>& lines) {
    for (std::size_t k = 0; k < lines.size(); ++k) {
      for (const std::string& text : forbidden) {
        if (lines[k].find(text) != std::string::npos) found.push_back(At(name, k, "names \"" + text + "\""));
      }
    }
  });
  return found;
}

std::vector<std::string> Macros(const fs::path& top, const std::string& prefix) {
  std::set<std::string> names;
  ForEachFile(top, IsSource, [&](const std::string&, const std::vector<std::string>& lines) {
    for (const std::string& line : lines) {
      std::istringstream words(line);
      std::string directive, macro;
      words >> directive >> macro;
      if (directive == "#define" && macro.rfind(prefix, 0) == 0) names.insert(macro.substr(0, macro.find('(')));
    }
  });
  return {names.begin(), names.end()};
}

}  // namespace armcal::house
