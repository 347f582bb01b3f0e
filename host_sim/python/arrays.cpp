// python - reads numpy arrays and makes them.
#include "host_sim/python/arrays.hpp"

#include <cmath>
#include <initializer_list>
#include <memory>
#include <string>

namespace armcal::python {

namespace {

using Array = nb::ndarray<nb::ro>;

[[noreturn]] void Refuse(const char* name, const std::string& what) {
  throw nb::value_error((std::string(name) + ": " + what).c_str());
}

std::string Shape(const Array& a) {
  std::string text = "(";
  for (std::size_t i = 0; i < a.ndim(); ++i) text += (i ? ", " : "") + std::to_string(a.shape(i));
  return text + (a.ndim() == 1 ? ",)" : ")");
}

std::string Wanted(Eigen::Index size, const char* any) { return size < 0 ? any : std::to_string(size); }

Array Checked(nb::handle object, const char* name, std::initializer_list<Eigen::Index> shape) {
  Array a;
  if (!nb::try_cast(object, a, false)) Refuse(name, "expected a numpy array of float64");
  if (a.dtype() != nb::dtype<double>()) Refuse(name, "expected dtype float64");
  bool fits = a.ndim() == shape.size();
  std::size_t i = 0;
  std::string wanted = "(";
  for (const Eigen::Index size : shape) {
    fits = fits && (size < 0 || a.shape(i) == static_cast<std::size_t>(size));
    wanted += (i ? ", " : "") + Wanted(size, i ? "joints" : "samples");
    ++i;
  }
  wanted += i == 1 ? ",)" : ")";
  if (!fits) Refuse(name, "shape " + Shape(a) + ", expected " + wanted);
  return a;
}

// Numpy frees `data` with the array.
nb::object Owned(std::unique_ptr<double[]> data, std::initializer_list<std::size_t> shape) {
  double* const first = data.get();
  const nb::capsule owner(first, [](void* p) noexcept { delete[] static_cast<double*>(p); });
  (void)data.release();
  return nb::cast(nb::ndarray<nb::numpy, double>(first, shape, owner));
}

}  // namespace

Eigen::MatrixXd ReadMatrix(nb::handle array, const char* name, Eigen::Index rows, Eigen::Index columns) {
  const Array a = Checked(array, name, {rows, columns});
  const auto* data = static_cast<const double*>(a.data());
  Eigen::MatrixXd out(a.shape(0), a.shape(1));
  for (Eigen::Index k = 0; k < out.rows(); ++k)
    for (Eigen::Index j = 0; j < out.cols(); ++j) {
      out(k, j) = data[k * a.stride(0) + j * a.stride(1)];
      if (!std::isfinite(out(k, j)))
        Refuse(name, "not a finite number at [" + std::to_string(k) + ", " + std::to_string(j) + "]");
    }
  return out;
}

Eigen::VectorXd ReadVector(nb::handle array, const char* name, Eigen::Index size) {
  const Array a = Checked(array, name, {size});
  const auto* data = static_cast<const double*>(a.data());
  Eigen::VectorXd out(a.shape(0));
  for (Eigen::Index k = 0; k < out.size(); ++k) {
    out[k] = data[k * a.stride(0)];
    if (!std::isfinite(out[k])) Refuse(name, "not a finite number at [" + std::to_string(k) + "]");
  }
  return out;
}

nb::object ToArray(const Eigen::VectorXd& v) {
  auto data = std::make_unique<double[]>(static_cast<std::size_t>(v.size()));
  Eigen::VectorXd::Map(data.get(), v.size()) = v;
  return Owned(std::move(data), {static_cast<std::size_t>(v.size())});
}

nb::object ToArray(const Eigen::MatrixXd& m) {
  auto data = std::make_unique<double[]>(static_cast<std::size_t>(m.size()));
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(data.get(), m.rows(), m.cols()) =
      m;
  return Owned(std::move(data), {static_cast<std::size_t>(m.rows()), static_cast<std::size_t>(m.cols())});
}

nb::object ToArray(const std::vector<Eigen::MatrixXd>& row) {
  const Eigen::Index n = static_cast<Eigen::Index>(row.size()), samples = n ? row[0].rows() : 0;
  const Eigen::Index columns = n ? row[0].cols() : 0;
  auto data = std::make_unique<double[]>(static_cast<std::size_t>(samples * n * columns));
  for (Eigen::Index j = 0; j < n; ++j)
    for (Eigen::Index k = 0; k < samples; ++k)
      for (Eigen::Index c = 0; c < columns; ++c)
        data[static_cast<std::size_t>((k * n + j) * columns + c)] = row[static_cast<std::size_t>(j)](k, c);
  return Owned(std::move(data),
               {static_cast<std::size_t>(samples), static_cast<std::size_t>(n), static_cast<std::size_t>(columns)});
}

}  // namespace armcal::python
