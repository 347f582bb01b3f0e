// diagnosis - models the noise of one joint as an autoregressive process.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

namespace armcal::diagnosis {

// Rows of one joint that may be used, log by log in time order. A row is one sample or, where the log's band is
// limited, the average of the samples about that one. segment_begin[k] = 1 where row k does not follow row k-1 in the
// log.
struct RowIndex {
  using Average = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  std::vector<int> dataset, sample;
  std::vector<char> segment_begin;
  std::vector<const Average*> average;  // one a log; null: its rows are samples
  Eigen::VectorXd weight;               // of each row, columns and torque alike; empty: 1
  int size() const { return static_cast<int>(sample.size()); }
  bool averaged() const;
  // Rows [first, last) of a log.
  std::pair<int, int> RowsOf(int log) const;
  // Writes what a column over all samples of a log is at the rows of that log.
  void Take(int log, const Eigen::Ref<const Eigen::VectorXd>& column, Eigen::Ref<Eigen::VectorXd> rows) const;
};

inline constexpr int kArOrder = 8;  // design study: eight terms cover gear and current-loop colour at 100-1000 Hz

struct NoiseModel {
  Eigen::VectorXd a = Eigen::VectorXd::Zero(kArOrder);  // e_k = sum a_i e_{k-i} + innovation
  double innovation = 1;                                // its standard deviation
};

bool IsWhite(const NoiseModel& noise);

// Yule-Walker over segments; white if the rows are too few or too broken up.
NoiseModel FitNoise(const RowIndex& rows, const Eigen::VectorXd& residual);

// out_k = (v_k - sum a_i v_{k-i}) / innovation; zero for the first kArOrder rows of a segment unless the model is
// white.
Eigen::VectorXd Whiten(const NoiseModel& noise, const RowIndex& rows, const Eigen::Ref<const Eigen::VectorXd>& v);

// How many rows Whiten keeps.
int WhitenedRows(const NoiseModel& noise, const RowIndex& rows);

}  // namespace armcal::diagnosis
