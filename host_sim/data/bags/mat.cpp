// bags - finds vectors and matrices in a MATLAB file.
#include "host_sim/data/bags/mat.hpp"

#include <fmt/format.h>
#include <matio.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/bags/child.hpp"
#include "host_sim/data/bags/cursor.hpp"
#include "host_sim/data/bags/flat.hpp"
#include "host_sim/data/bags/mapped_file.hpp"
#include "host_sim/data/bags/one_line.hpp"
#include "host_sim/data/bags/unpack.hpp"
#include "host_sim/data/bags/whole_mat.hpp"

namespace armcal::bags {

namespace {

constexpr int kDeepestStruct = 8;
constexpr std::size_t kMostColumnsOfFile = 4096;

struct CloseMat {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};

void SayNothing(int, char*) {}

// What a program sees of a variable, without its memory.
struct Array {
  std::vector<std::size_t> size;  // of each dimension
  std::size_t count = 1;
};

Array ArrayOf(const matvar_t& variable) {
  Array out;
  for (int d = 0; d < variable.rank; ++d) {
    out.size.push_back(variable.dims[d]);
    if (__builtin_mul_overflow(out.count, out.size.back(), &out.count)) throw io::InputError("a size is too large");
  }
  return out;
}

std::size_t BytesOfClass(matio_classes kind) {
  switch (kind) {
    case MAT_C_DOUBLE:
    case MAT_C_INT64:
    case MAT_C_UINT64:
      return 8;
    case MAT_C_SINGLE:
    case MAT_C_INT32:
    case MAT_C_UINT32:
      return 4;
    case MAT_C_INT16:
    case MAT_C_UINT16:
      return 2;
    case MAT_C_INT8:
    case MAT_C_UINT8:
      return 1;
    default:
      return 0;
  }
}

double NumberAt(const matvar_t& variable, std::size_t k) {
  const auto at = [&variable, k](auto zero) {
    return static_cast<double>(static_cast<const decltype(zero)*>(variable.data)[k]);
  };
  switch (variable.class_type) {
    case MAT_C_DOUBLE:
      return at(double{});
    case MAT_C_SINGLE:
      return at(float{});
    case MAT_C_INT64:
      return at(std::int64_t{});
    case MAT_C_UINT64:
      return at(std::uint64_t{});
    case MAT_C_INT32:
      return at(std::int32_t{});
    case MAT_C_UINT32:
      return at(std::uint32_t{});
    case MAT_C_INT16:
      return at(std::int16_t{});
    case MAT_C_UINT16:
      return at(std::uint16_t{});
    case MAT_C_INT8:
      return at(std::int8_t{});
    default:
      return at(std::uint8_t{});
  }
}

class MatReader {
 public:
  MatReader(const std::filesystem::path& path, const std::vector<std::string>& wanted) : wanted_(wanted) {
    Mat_LogInitFunc("armcal", SayNothing);
    std::error_code error;
    most_bytes_ = MostBytes(static_cast<std::size_t>(std::filesystem::file_size(path, error)));
    file_.reset(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
    if (error || !file_) throw io::InputError("is damaged or no MATLAB file");
  }

  files::NumericTable Read() {
    while (matvar_t* const next = Mat_VarReadNextInfo(file_.get())) {
      const std::unique_ptr<matvar_t, FreeVariable> variable(next);
      if (next->name == nullptr) throw io::InputError("is damaged or cut short");
      std::size_t bytes = 0;
      if (!CountBytes(*next, bytes, 0)) {
        if (const std::string what = WhatHoldsNone(*next); !what.empty()) ignored_.push_back(next->name + what);
        continue;
      }
      if (bytes > most_bytes_)
        throw io::InputError(fmt::format("{} claims more numbers than the file can hold", next->name));
      if (Mat_VarReadDataAll(file_.get(), next) != 0) throw io::InputError("is damaged or cut short");
      Visit(*next, next->name, 0);
    }
    return Finish();
  }

 private:
  // Bytes of all numbers in a variable; false: there are none.
  bool CountBytes(const matvar_t& variable, std::size_t& bytes, int depth) const {
    const Array array = ArrayOf(variable);
    if (const std::size_t one = BytesOfClass(variable.class_type); one > 0) {
      std::size_t own = 0;
      if (__builtin_mul_overflow(array.count, one, &own) || __builtin_add_overflow(bytes, own, &bytes))
        throw io::InputError("a size is too large");
      return array.count > 0;
    }
    bool any = false;
    if (variable.class_type == MAT_C_STRUCT && depth < kDeepestStruct)
      ForEachField(variable, array.count, [&](const matvar_t& field, const std::string&) {
        any = CountBytes(field, bytes, depth + 1) || any;
      });
    return any;
  }

  // Of a variable that may well hold numbers, but not as an array.
  static std::string WhatHoldsNone(const matvar_t& variable) {
    switch (variable.class_type) {
      case MAT_C_CELL:
        return " (a cell array)";
      case MAT_C_OBJECT:
      case MAT_C_OPAQUE:
        return " (an object)";
      default:
        return "";
    }
  }

  // Calls each(field, what stands behind the struct's name).
  template <class Each>
  static void ForEachField(const matvar_t& variable, std::size_t count, Each each) {
    const unsigned fields = Mat_VarGetNumberOfFields(const_cast<matvar_t*>(&variable));
    char* const* names = Mat_VarGetStructFieldnames(&variable);
    for (std::size_t k = 0; k < std::min(count, kLongestArray) && names != nullptr; ++k)
      for (unsigned f = 0; f < fields; ++f) {
        const matvar_t* const field = Mat_VarGetStructFieldByIndex(const_cast<matvar_t*>(&variable), f, k);
        if (field == nullptr || names[f] == nullptr) continue;
        each(*field, (count > 1 ? fmt::format("({}).", k + 1) : ".") + names[f]);
      }
  }

  void Visit(const matvar_t& variable, const std::string& name, int depth) {
    const Array array = ArrayOf(variable);
    if (variable.class_type == MAT_C_STRUCT && depth < kDeepestStruct)
      ForEachField(variable, array.count,
                   [&](const matvar_t& field, const std::string& behind) { Visit(field, name + behind, depth + 1); });
    else if (BytesOfClass(variable.class_type) > 0 && variable.isComplex == 0 && variable.data != nullptr &&
             variable.nbytes >= array.count * BytesOfClass(variable.class_type))
      Columns(variable, array, name);
  }

  // The longest dimension is time; the others count columns.
  void Columns(const matvar_t& variable, const Array& array, const std::string& name) {
    const auto& size = array.size;
    if (array.count < 2 || size.size() < 2 || size.size() > 3) return;
    const auto time = static_cast<std::size_t>(std::max_element(size.begin(), size.end()) - size.begin());
    const std::size_t columns = array.count / size[time];
    if (columns > kLongestArray) return;
    std::size_t step = 1;  // from one time to the next, in memory
    for (std::size_t d = 0; d < time; ++d) step *= size[d];
    for (std::size_t c = 0; c < columns; ++c) {
      const std::size_t first = c % step + c / step * step * size[time];
      const std::string column = columns == 1 ? name : name + Place(size, time, c);
      if (!Wants(column)) {
        ignored_.push_back(column);
        continue;
      }
      if (columns_.size() == kMostColumnsOfFile)
        throw io::InputError(fmt::format("has more than {} columns", kMostColumnsOfFile));
      std::vector<double>& values = columns_.emplace_back(column, std::vector<double>()).second;
      for (std::size_t k = 0; k < size[time]; ++k) {
        const double value = NumberAt(variable, first + k * step);
        values.push_back(std::isfinite(value) ? value : NAN);
      }
    }
  }

  // "(:,2)"
  static std::string Place(const std::vector<std::size_t>& size, std::size_t time, std::size_t column) {
    std::string text = "(";
    for (std::size_t d = 0; d < size.size(); ++d) {
      if (d > 0) text += ',';
      if (d == time) {
        text += ':';
        continue;
      }
      text += std::to_string(column % size[d] + 1);
      column /= size[d];
    }
    return text + ")";
  }

  bool Wants(const std::string& column) const {
    return wanted_.empty() || std::find(wanted_.begin(), wanted_.end(), column) != wanted_.end();
  }

  files::NumericTable Finish() {
    if (columns_.empty() && (wanted_.empty() || ignored_.empty()))
      throw io::InputError(ignored_.empty()
                               ? "holds no vector and no matrix of numbers"
                               : fmt::format("holds no vector and no matrix of numbers, only {}; save the numbers "
                                             "themselves, of a timeseries ts.Time and ts.Data",
                                             fmt::join(ignored_, ", ")));
    files::NumericTable table;
    std::map<std::size_t, int> lengths;
    for (const auto& [name, values] : columns_) ++lengths[values.size()];
    std::size_t usual = 0;
    for (const auto& [length, times] : lengths)
      if (usual == 0 || times >= lengths[usual]) usual = length;
    for (const auto& [name, values] : columns_) {
      if (values.size() == usual) table.names.push_back(name);
      else if (wanted_.empty()) ignored_.push_back(name);
      else
        throw io::InputError(fmt::format("'{}' has {} numbers and '{}' has {}, expected the same number", name,
                                         values.size(), FirstOf(usual), usual));
    }
    table.values.resize(static_cast<Eigen::Index>(usual), static_cast<Eigen::Index>(table.names.size()));
    Eigen::Index c = 0;
    for (const auto& [name, values] : columns_)
      if (values.size() == usual)
        table.values.col(c++) = Eigen::Map<const Eigen::VectorXd>(values.data(), table.values.rows());
    table.ignored = std::move(ignored_);
    return table;
  }

  std::string FirstOf(std::size_t length) const {
    for (const auto& [name, values] : columns_)
      if (values.size() == length) return name;
    return {};
  }

  const std::vector<std::string>& wanted_;
  std::size_t most_bytes_ = 0;
  std::unique_ptr<mat_t, CloseMat> file_;
  std::vector<std::pair<std::string, std::vector<double>>> columns_;
  std::vector<std::string> ignored_;
};

template <class Number>
void Put(std::string& bytes, Number number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

// From the child to its parent.
std::string BytesOf(const files::NumericTable& table) {
  std::string bytes;
  for (const auto* names : {&table.names, &table.ignored}) {
    Put(bytes, static_cast<std::uint32_t>(names->size()));
    for (const std::string& name : *names) Put(bytes, static_cast<std::uint32_t>(name.size())), bytes += name;
  }
  Put(bytes, static_cast<std::uint64_t>(table.values.rows()));
  return bytes.append(reinterpret_cast<const char*>(table.values.data()),
                      static_cast<std::size_t>(table.values.size()) * sizeof(double));
}

files::NumericTable TableOf(const std::string& bytes) {
  files::NumericTable table;
  Cursor at(bytes);
  for (auto* names : {&table.names, &table.ignored})
    for (auto k = at.Take<std::uint32_t>(); k > 0; --k) names->emplace_back(at.TakeText());
  table.values.resize(static_cast<Eigen::Index>(at.Take<std::uint64_t>()),
                      static_cast<Eigen::Index>(table.names.size()));
  const Bytes numbers = at.Take(static_cast<std::uint64_t>(table.values.size()) * sizeof(double));
  if (!numbers.empty()) std::memcpy(table.values.data(), numbers.data(), numbers.size());
  return table;
}

}  // namespace

// libmatio 1.5.23 crashes on some damaged files, and runs for ever on others.
files::NumericTable ReadMat(const std::filesystem::path& path, const std::vector<std::string>& columns) {
  constexpr std::uintmax_t kSlowest_bytes_per_s = 10000000, kFree_s = 20;
  std::error_code none;
  const std::uintmax_t size = std::filesystem::file_size(path, none);
  if (none) throw io::InputError(path.string() + ": cannot be opened");
  const auto most_s = static_cast<unsigned>(kFree_s + size / kSlowest_bytes_per_s);
  try {
    CheckWhole(MappedFile(path).bytes());
    return TableOf(InChild([&] { return BytesOf(MatReader(path, columns).Read()); }, most_s));
  } catch (const io::InputError& error) {
    throw io::InputError(path.string() + ": " + OneLine(error.what()));
  }
}

}  // namespace armcal::bags
