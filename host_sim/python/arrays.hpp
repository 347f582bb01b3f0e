// python - reads numpy arrays into the matrices of the rooms, and hands results out as numpy arrays.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <Eigen/Core>
#include <vector>

namespace armcal::python {

namespace nb = nanobind;

// Any strides; the array itself is read in place, once, into the column order that the rooms compute in.
// ValueError, one line that begins with `name`: no numpy array, another dtype than float64, another shape, a value that
// is not finite. rows or columns -1: any.
Eigen::MatrixXd ReadMatrix(nb::handle array, const char* name, Eigen::Index rows, Eigen::Index columns);
Eigen::VectorXd ReadVector(nb::handle array, const char* name, Eigen::Index size);

// C order; numpy owns the memory. Rows: row[i] is [N x c], the result (N, rows, c).
nb::object ToArray(const Eigen::VectorXd& v);
nb::object ToArray(const Eigen::MatrixXd& m);
nb::object ToArray(const std::vector<Eigen::MatrixXd>& row);

}  // namespace armcal::python
