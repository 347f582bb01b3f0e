// report - holds a table of text cells, for a page or for the terminal.
#pragma once

#include <string>
#include <vector>

namespace armcal::report {

struct Table {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
  std::string caption{};
  std::vector<std::string> link{};  // of each row's first cell, a path beside the page; empty: none
};

// Whether column c holds numbers only (blank and "-" count as such): those are set flush right.
bool IsNumeric(const Table& table, std::size_t column);

// For a terminal: columns two blanks apart, a rule below the header, each line ended. UTF-8 letters count as one.
std::string Text(const Table& table);

}  // namespace armcal::report
