// diagnosis - the declared model fitted in whitened rows, and what a further column would gain; knows no record.
//
// Frisch-Waugh: with Q the base's whitened, orthonormal columns and r the residual, columns C gain g' S^-1 g with
// S = C'C - (Q'C)'(Q'C), g = C'r. Trying a column never needs a refit.
#pragma once

#include <Eigen/Cholesky>
#include <memory>
#include <vector>

#include "host_sim/calibration/prior.hpp"
#include "host_sim/diagnosis/candidate.hpp"
#include "host_sim/diagnosis/noise.hpp"

namespace armcal::diagnosis {

// Columns of a term over all used rows of each joint it touches: block[r] is rows(joint) x columns, for joints[r].
struct Columns {
  std::vector<int> joints;
  std::vector<Eigen::MatrixXd> block;
  int count() const { return block.empty() ? 0 : static_cast<int>(block[0].cols()); }
};

struct Gain {
  double gain = 0;                // decrease of chi^2
  int rank = 0;                   // directions that the data see
  Eigen::VectorXd amplitude, sd;  // of the columns
};

// Raw (unwhitened) rows of the base model, shared by all metrics of one pass.
struct BaseRows {
  std::vector<RowIndex> index;          // [n]
  std::vector<Eigen::MatrixXd> design;  // [n] rows x coordinates, in prior-whitened coordinates z (x = mean + L z)
  std::vector<Eigen::VectorXd> target;  // [n] tau minus the prior mean's torque
  bool informative = true;              // z has unit prior
  Eigen::MatrixXd L;                    // x - mean = L z
  Eigen::VectorXd mean;
  int coordinates() const { return static_cast<int>(L.cols()); }
};

class Metric {
 public:
  Metric(const BaseRows& rows, std::vector<NoiseModel> noise);

  Gain Try(const Columns& c) const;
  // chi^2 of joint j's whitened residual after the base fit, and the number of its rows.
  const Eigen::VectorXd& residual(int j) const { return residual_[j]; }  // whitened
  Eigen::VectorXd RawResidual(int j) const;                              // torque units
  const std::vector<NoiseModel>& noise() const { return noise_; }
  const Eigen::VectorXd& z() const { return z_; }
  const BaseRows& rows() const { return rows_; }
  Eigen::MatrixXd WhitenedColumns(const Columns& c, int r) const;

  // Out-of-fold improvement: chi^2 on each of `folds` interleaved folds of `blocks` blocks, without minus with C.
  Eigen::VectorXd CrossValidate(const Columns& c, int blocks, int folds) const;

  // -2 log likelihood (up to a constant) of all joints with C in the model and the noise of its joints fitted anew.
  // If `noise` is given it receives the noise models of all joints, those of c's joints fitted with C in.
  double RefittedDeviance(const Columns& c, std::vector<NoiseModel>* noise = nullptr) const;

  // Gain of `other` on the fitted trace of `fitted` (amplitudes a), and that trace's own chi^2 off the base.
  std::pair<double, double> Imitates(const Columns& other, const Columns& fitted, const Eigen::VectorXd& a) const;

  // Covariance of z (unit noise).
  Eigen::MatrixXd Covariance() const;

 private:
  const BaseRows& rows_;
  std::vector<NoiseModel> noise_;
  std::vector<Eigen::MatrixXd> q_;  // [n] whitened design
  std::vector<Eigen::VectorXd> residual_, y_;
  std::vector<Eigen::MatrixXd> gram_;  // [n]
  Eigen::MatrixXd hessian_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd z_;
};

}  // namespace armcal::diagnosis
