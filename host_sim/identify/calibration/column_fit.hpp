// calibration - fits the declared model with free bodies to a few rows of logs whose columns are exchanged or turned.
#pragma once

#include <vector>

#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::calibration {

// Which column of the log each joint reads, with which factor or sign. Time runs `pace` times as fast.
struct ColumnChange {
  std::vector<int> q, tau;      // [n] 0-based columns
  std::vector<double> q_scale;  // [n] of positions, speeds and accelerations
  std::vector<int> tau_sign;    // [n] +1 or -1
  double pace = 1;

  explicit ColumnChange(int joints);
  bool same_motion(const ColumnChange& other) const;
  // Positions, speeds and accelerations as they read under this change.
  codegen::Signals Moved(const codegen::Signals& signals) const;
};

// Least squares of all joints together, each weighted by what it leaves.
struct ColumnFitResult {
  double log_left = 0;         // sum over joints of the log of the share of variance left
  Eigen::VectorXd left;        // [n] RMS left, N m (N)
  Eigen::VectorXd spread;      // [n] RMS of the torque about its mean
  Eigen::VectorXd x;           // [columns]
  Eigen::MatrixXd covariance;  // of x, as if the rows were independent
};

inline constexpr double kBraked = 0.01;  // of the torque limit: the torque of a joint that a brake holds varies less

class ColumnFit {
 public:
  // Takes about `rows` rows, evenly out of all logs; a row counts if any joint's row of the log may be used. Declared
  // effects that read the committed torque stay zero.
  ColumnFit(const codegen::Model& model, const std::vector<const Dataset*>& data, int rows);

  int rows() const { return signals_.samples(); }
  int joints() const { return static_cast<int>(tau_.cols()); }
  const codegen::Signals& signals() const { return signals_; }
  const Eigen::MatrixXd& tau() const { return tau_; }

  // The regressor of one motion, and its Gram matrices. All changes of torque columns share it.
  struct Motion {
    std::vector<std::vector<int>> column;  // [n] filter columns that joint has
    std::vector<Eigen::MatrixXd> A;        // [n] rows x those columns
    std::vector<Eigen::MatrixXd> gram;     // [n]
    int columns = 0;                       // of the model, and of what was added
    void Remove(int joint, const std::vector<int>& columns_of_the_model);
    void Add(int joint, const Eigen::MatrixXd& columns_of_that_row);
  };
  Motion Move(const ColumnChange& change) const;
  ColumnFitResult Fit(const Motion& motion, const ColumnChange& change) const;

 private:
  const codegen::Model& model_;
  codegen::Signals signals_;
  Eigen::MatrixXd tau_;
  std::vector<char> braked_;  // [n] torque column of a joint that a brake holds: it does not follow the load
};

}  // namespace armcal::calibration
