// report - prints tables as plain text.
#include "host_sim/data/report/table.hpp"

#include <algorithm>
#include <cstdlib>
#include <string_view>

namespace armcal::report {
namespace {

std::size_t Letters(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

// A number, with a unit of % or an interval behind it.
bool LooksNumeric(const std::string& cell) {
  if (cell.empty() || cell == "-") return true;
  char* end = nullptr;
  std::strtod(cell.c_str(), &end);
  const std::string_view rest = end;
  if (end != cell.c_str() && (rest.starts_with(" ±") || rest.starts_with(" [") || rest.starts_with(" to ")))
    return true;
  return *end == '\0' || (*end == '%' && end[1] == '\0') || (*end == ' ' && end[1] == '%' && end[2] == '\0');
}

void Line(std::string& out, const std::vector<std::string>& cells, const std::vector<std::size_t>& width,
          const std::vector<bool>& right) {
  std::string line;
  for (std::size_t c = 0; c < width.size(); ++c) {
    const std::string cell = c < cells.size() ? cells[c] : "";
    const std::string space(width[c] - Letters(cell), ' ');
    line += (c == 0 ? "" : "  ") + (right[c] ? space + cell : cell + space);
  }
  line.erase(line.find_last_not_of(' ') + 1);
  out += line + '\n';
}

}  // namespace

bool IsNumeric(const Table& table, std::size_t column) {
  bool numbers = false;
  for (const auto& row : table.rows) {
    if (column >= row.size()) continue;
    if (!LooksNumeric(row[column])) return false;
    numbers = numbers || !row[column].empty();
  }
  return numbers;
}

std::string Text(const Table& table) {
  std::size_t columns = table.header.size();
  for (const auto& row : table.rows) columns = std::max(columns, row.size());
  std::vector<std::size_t> width(columns);
  std::vector<bool> right(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    if (c < table.header.size()) width[c] = Letters(table.header[c]);
    for (const auto& row : table.rows) width[c] = std::max(width[c], c < row.size() ? Letters(row[c]) : 0);
    right[c] = IsNumeric(table, c);
  }
  std::string out;
  if (!table.caption.empty()) out += table.caption + '\n';
  if (!table.header.empty()) {
    Line(out, table.header, width, right);
    std::vector<std::string> rule;
    for (const std::size_t w : width) rule.emplace_back(w, '-');
    Line(out, rule, width, right);
  }
  for (const auto& row : table.rows) Line(out, row, width, right);
  return out;
}

}  // namespace armcal::report
