// rooms - the rules of the house that a program can check.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace armcal::house {

// Room -> the rooms it may include. Both are folders from the top; a room that ends in '/' stands for all below it.
// A room may always include itself.
using Edges = std::map<std::string, std::vector<std::string>>;

// Names that the build resolves (a program is compiled for one generated model): include -> file from the top.
using Selected = std::map<std::string, std::string>;

// Each answers with one line per violation, "file:line: what"; nothing when all is well. Build folders and hidden
// folders are not looked at.
std::vector<std::string> CheckIncludes(const std::filesystem::path& top, const Edges& edges,
                                       const Selected& selected = {});
// Edges of the table that no include uses, one line each.
std::vector<std::string> UnusedEdges(const std::filesystem::path& top, const Edges& edges,
                                     const Selected& selected = {});
std::vector<std::string> CheckSystemHeaders(const std::filesystem::path& top, const std::vector<std::string>& rooms,
                                            const std::vector<std::string>& allowed);
std::vector<std::string> CheckFirstLines(const std::filesystem::path& top);
std::vector<std::string> CheckText(const std::filesystem::path& top, const std::vector<std::string>& forbidden);

// The distinct names with this prefix that the sources define as macros.
std::vector<std::string> Macros(const std::filesystem::path& top, const std::string& prefix);

}  // namespace armcal::house
