// calibration - solves least squares from normal equations, or from rows that stream by where those would lose too
// much; knows no model.
#pragma once

#include <Eigen/Core>

namespace armcal::calibration {

// Condition number of the scaled normal equations up to which they are used. Their relative error in the worst
// determined direction is about condition x 1.1e-16: at 1e9 it is float32's rounding, which is what a table carries,
// and far below what noise leaves. Beyond, orthogonal factorisation, whose error grows with the root of that number
// only.
inline constexpr double kNormalLimit = 1e9;

struct Solved {
  Eigen::VectorXd x;
  double condition = 0;     // of the Gram matrix with unit diagonal, 1-norm estimate; infinite if singular
  bool orthogonal = false;  // true: by StreamingQr
  int rank = 0;             // columns determined; the others' part of x is the smallest that fits
};

// gram x = right with columns scaled to unit diagonal, LDL' and one step of refinement. A column of zeros gets x = 0.
// Worth using while condition <= kNormalLimit.
Solved SolveNormal(const Eigen::MatrixXd& gram, const Eigen::VectorXd& right);

// Least squares by orthogonal transformations of blocks of rows (TSQR); holds one triangle and one block, whatever the
// number of rows. scale: what each column is multiplied by, 1 / its norm; 0 leaves it out.
class StreamingQr {
 public:
  StreamingQr(const Eigen::VectorXd& scale, int block_rows);

  // a: [columns] one row, y its right-hand side, weight: what both are multiplied by.
  void AddRow(const Eigen::VectorXd& a, double y, double weight = 1);
  Solved Solve();

 private:
  int columns() const { return static_cast<int>(scale_.size()); }
  void Reduce();

  Eigen::VectorXd scale_;
  Eigen::MatrixXd stack_;  // [columns + 1 + block x columns + 1]: the triangle of all rows so far, then new rows
  int filled_;
};

}  // namespace armcal::calibration
