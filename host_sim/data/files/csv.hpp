// files - reads and writes a table of numbers with a header line, as CSV or gzip CSV.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace armcal::files {

struct NumericTable {
  std::vector<std::string> names;
  Eigen::MatrixXd values;            // [rows x names]
  std::vector<std::string> ignored;  // names in the file that were not wanted
};

// What a field without a number means: an empty one, or "nan".
enum class Missing { kRefused, kNan };

inline constexpr double kLargeTime = 1e8;  // in any unit: such as a time since 1970

// Reads the columns whose name is `wanted` (all of them without it), in the order of the file. Fields are separated by
// commas; blanks around a field, CRLF and a byte-order mark are accepted; blank lines at the end too.
// InputError with file, line, column and what was expected: unreadable file, empty or repeated name, a row of another
// length than the header, a wanted field that is not a finite number (with Missing::kNan a missing one reads as NaN).
// Unwanted fields are not read at all. If the first number of the column `clock` is kLargeTime or more, the column is
// read as the difference to the whole part of this number, because a double does not hold all its digits.
NumericTable ReadCsv(const std::filesystem::path& path, const std::function<bool(const std::string& name)>& wanted = {},
                     Missing missing = Missing::kRefused, const std::string& clock = {});

// The columns whose first field that is not empty is a number. InputError: as ReadCsv has it for the header.
std::vector<std::string> NumericColumns(const std::filesystem::path& path);

// Writes atomically, gzip if the name ends in ".gz". digits[c] significant digits in column c (9 if `digits` is empty);
// 0 digits: as many as it takes to read the same number again. A missing number becomes an empty field.
void WriteCsv(const std::filesystem::path& path, const NumericTable& table, const std::vector<int>& digits = {});

}  // namespace armcal::files
