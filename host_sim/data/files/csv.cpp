// files - reads and prints CSV.
#include "host_sim/data/files/csv.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string_view>
#include <unordered_set>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/watch.hpp"
#include "host_sim/data/files/files.hpp"

namespace armcal::files {
namespace {

constexpr std::size_t kMostColumns = 4096;

std::string_view Trim(std::string_view s) {
  constexpr std::string_view kBlank = " \t\r";
  const auto first = s.find_first_not_of(kBlank);
  return first == s.npos ? std::string_view{} : s.substr(first, s.find_last_not_of(kBlank) - first + 1);
}

// Walks over the lines of a file and over the fields of a line without copying.
class Scanner {
 public:
  Scanner(std::string where, std::string_view text) : where_(std::move(where)), rest_(text) {
    if (rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);
  }

  bool NextLine() {
    io::CancellationPoint();
    if (rest_.empty()) return false;
    const auto end = rest_.find('\n');
    line_ = rest_.substr(0, end);
    rest_.remove_prefix(end == rest_.npos ? rest_.size() : end + 1);
    ++number_;
    return true;
  }

  std::string_view line() const { return line_; }
  bool blank() const { return Trim(line_).empty(); }

  // Takes the next field off the line; false behind the last one.
  bool NextField(std::string_view& field) {
    if (line_.data() == nullptr) return false;
    const auto end = line_.find(',');
    field = line_.substr(0, end);
    line_ = end == line_.npos ? std::string_view{} : line_.substr(end + 1);
    return true;
  }

  [[noreturn]] void Fail(const std::string& what) const {
    throw io::InputError(where_ + (number_ > 0 ? ":" + std::to_string(number_) : "") + ": " + what);
  }

 private:
  std::string where_;
  std::string_view rest_;
  std::string_view line_;
  int number_ = 0;
};

// A table of another program, such as .xlsx, has bytes that no text has.
bool IsText(std::string_view line) {
  return std::all_of(line.begin(), line.end(),
                     [](char c) { return static_cast<unsigned char>(c) >= ' ' || c == '\t' || c == '\r'; });
}

bool IsNumber(std::string_view field) {
  double value = 0;
  const char* const stop = field.data() + field.size();
  const auto [end, error] = std::from_chars(field.data(), stop, value);
  return end == stop && error == std::errc();
}

std::vector<std::string> ScanHeader(Scanner& scan) {
  if (!scan.NextLine() || scan.blank()) scan.Fail("is empty, expected a header line with column names");
  if (!IsText(scan.line())) scan.Fail("is no text, expected a CSV file");
  if (scan.line().find(',') == std::string_view::npos) {
    if (scan.line().find(';') != std::string_view::npos)
      scan.Fail("columns are separated by ';', expected ',' (and '.' in numbers)");
    if (scan.line().find('\t') != std::string_view::npos) scan.Fail("columns are separated by tabs, expected ','");
  }
  std::vector<std::string> names;
  std::unordered_set<std::string> known;
  std::string_view field;
  while (scan.NextField(field)) {
    const std::string name(Trim(field));
    if (IsNumber(name) && name.find('.') != name.npos)  // a column may be called 0
      scan.Fail("'" + name + "' is a number, expected a header line with column names");
    if (names.size() == kMostColumns) scan.Fail("more than " + std::to_string(kMostColumns) + " columns");
    if (name.empty()) scan.Fail("column " + std::to_string(names.size() + 1) + " has no name");
    if (!known.insert(name).second) scan.Fail("column '" + name + "' appears twice, expected a name for each column");
    names.push_back(name);
  }
  return names;
}

// Empty, or NaN as the common programs write it.
bool IsMissing(std::string_view field) {
  if (field.starts_with('-') || field.starts_with('+')) field.remove_prefix(1);
  return field.empty() || field == "nan" || field == "NaN" || field == "NAN" || field == "NA";
}

double Number(const Scanner& scan, std::string_view field, const std::string& name, Missing missing) {
  field = Trim(field);
  if (missing == Missing::kNan && IsMissing(field)) return NAN;
  if (field.starts_with('+')) field.remove_prefix(1);
  double value = NAN;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (end != field.data() + field.size() || field.empty() || error == std::errc::invalid_argument) {
    scan.Fail("column '" + name + "': '" + std::string(field) + "', expected a number");
  }
  if (error == std::errc::result_out_of_range) value = std::strtod(std::string(field).c_str(), nullptr);
  if (!std::isfinite(value)) scan.Fail("column '" + name + "': '" + std::string(field) + "', expected a finite number");
  return value;
}

// Reads large decimal numbers as differences to the first one, whole and broken part each for itself.
class ClockColumn {
 public:
  double Read(const Scanner& scan, std::string_view field, const std::string& name, Missing missing) {
    const double value = Number(scan, field, name, missing);
    if (std::isnan(value)) return value;
    field = Trim(field);
    const auto point = std::min(field.find('.'), field.size());
    std::int64_t whole = 0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + point, whole);
    const bool plain = error == std::errc() && end == field.data() + point && whole >= 0 &&
                       field.find_first_not_of("0123456789", std::min(point + 1, field.size())) == field.npos;
    if (!begin_) begin_ = plain && value >= kLargeTime ? whole : 0;
    if (*begin_ == 0) return value;
    if (!plain) return value - static_cast<double>(*begin_);
    const std::string part = "0" + std::string(field.substr(point)) + "0";
    return static_cast<double>(whole - *begin_) + (point < field.size() ? std::strtod(part.c_str(), nullptr) : 0);
  }

 private:
  std::optional<std::int64_t> begin_;
};

}  // namespace

NumericTable ReadCsv(const std::filesystem::path& path, const std::function<bool(const std::string& name)>& wanted,
                     Missing missing, const std::string& clock) {
  const std::string text = ReadWholeFile(path);
  Scanner scan(path.string(), text);
  const std::vector<std::string> header = ScanHeader(scan);
  const std::size_t columns = header.size();

  NumericTable table;
  std::vector<bool> keep(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    keep[c] = !wanted || wanted(header[c]);
    (keep[c] ? table.names : table.ignored).push_back(header[c]);
  }

  const std::size_t clock_at =
      clock.empty() ? columns
                    : static_cast<std::size_t>(std::find(header.begin(), header.end(), clock) - header.begin());
  ClockColumn times;
  std::vector<double> flat;  // row after row
  flat.reserve(table.names.size() * static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n') + 1));
  Eigen::Index rows = 0;
  while (scan.NextLine()) {
    if (scan.blank()) {
      while (scan.NextLine()) {
        if (!scan.blank()) scan.Fail("follows a blank line, expected the end of the file");
      }
      break;
    }
    std::string_view field;
    std::size_t c = 0;
    for (; scan.NextField(field); ++c) {
      if (c >= columns || !keep[c]) continue;
      flat.push_back(c == clock_at ? times.Read(scan, field, header[c], missing)
                                   : Number(scan, field, header[c], missing));
    }
    if (c != columns) {
      scan.Fail("has " + std::to_string(c) + " fields, expected " + std::to_string(columns) + " as in the header");
    }
    ++rows;
  }
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  table.values = Eigen::Map<const RowMajor>(flat.data(), rows, static_cast<Eigen::Index>(table.names.size()));
  return table;
}

std::vector<std::string> NumericColumns(const std::filesystem::path& path) {
  const std::string text = ReadWholeFile(path);
  Scanner scan(path.string(), text);
  const std::vector<std::string> header = ScanHeader(scan);
  enum Kind { kUnknown, kNumbers, kOther };
  std::vector<Kind> kind(header.size(), kUnknown);
  std::size_t open = header.size();
  while (open > 0 && scan.NextLine()) {
    std::string_view field;
    for (std::size_t c = 0; scan.NextField(field) && c < header.size(); ++c) {
      field = Trim(field);
      if (kind[c] != kUnknown || IsMissing(field)) continue;
      kind[c] = IsNumber(field) ? kNumbers : kOther;
      --open;
    }
  }
  std::vector<std::string> names;
  for (std::size_t c = 0; c < header.size(); ++c)
    if (kind[c] == kNumbers) names.push_back(header[c]);
  return names;
}

void WriteCsv(const std::filesystem::path& path, const NumericTable& table, const std::vector<int>& digits) {
  std::string text;
  text.reserve(static_cast<std::size_t>(table.values.size()) * 12 + 4096);
  for (const std::string& name : table.names) (text += name) += ',';
  text.back() = '\n';
  char number[40];
  for (Eigen::Index r = 0; r < table.values.rows(); ++r) {
    for (Eigen::Index c = 0; c < table.values.cols(); ++c) {
      const int precision = digits.empty() ? 9 : digits[static_cast<std::size_t>(c)];
      const double value = table.values(r, c);
      char* const room = number + sizeof number;
      const auto end = std::isnan(value) ? number
                       : precision == 0  ? std::to_chars(number, room, value).ptr
                                        : std::to_chars(number, room, value, std::chars_format::general, precision).ptr;
      text.append(number, end) += ',';
    }
    text.back() = '\n';
  }
  WriteWholeFile(path, text);
}

}  // namespace armcal::files
