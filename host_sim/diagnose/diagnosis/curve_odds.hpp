// diagnosis - weighs a curve, whose coefficients are averaged over instead of fitted.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace armcal::diagnosis {

// Coefficients have a normal prior: neighbours are alike over some length, and all have one size. Length and size are
// those that the data like best. A surface has neighbours in two directions.
class CurveOdds {
 public:
  // S = C'C less what the base explains, and g = C'r. inner: coefficients in a row of a surface; those of a
  // curve are one row.
  CurveOdds(const Eigen::MatrixXd& S, const Eigen::VectorXd& g, int inner);

  // Twice the log evidence if the free coefficients gain so much: the gain less what the freedom that is really used
  // would gain by chance. Where noise is larger than in the rows seen, or has a colour, the gain is smaller.
  // precision: of the coefficients, where that evidence is largest.
  double Evidence(double gain, Eigen::MatrixXd* precision = nullptr) const;

 private:
  struct Prior {
    Eigen::MatrixXd precision;  // at size one
    Eigen::VectorXd seen, u2;   // what the data see of each of its directions, the square of what they say of it
  };

  std::vector<Prior> priors_;
  double free_gain_ = 0;
};

}  // namespace armcal::diagnosis
