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

inline constexpr int kMostOrder = 24;  // at 1 kHz noise that is slow beside a white part needs about twenty

// A row is predicted from the rows before it in its segment. The first rows have fewer of them, and a predictor of
// their own each: no row is lost.
struct NoiseModel {
  Eigen::VectorXd a;                   // e_k = sum a_i e_{k-i} + innovation; empty: white
  double innovation = 1;               // its standard deviation
  std::vector<Eigen::VectorXd> start;  // [order] the predictor of row p of a segment, p coefficients
  std::vector<double> start_sd;        // [order] what it leaves, over `innovation`
  int order() const { return static_cast<int>(a.size()); }
};

// The upper one of the two in the middle, if their number is even; 0 of none.
double Median(std::vector<double> x);

// 1.48 times the median of |e|: the standard deviation of normal noise, whatever a few large values are.
double UsualDeviation(const Eigen::VectorXd& e);

bool IsWhite(const NoiseModel& noise);

// The deviation of white noise that would be as large as this one for what is slow.
double SlowNoise(const NoiseModel& noise);

// Burg's method over the segments (Burg 1975): reflections that leave least of the rows themselves. Autocovariances
// over segments need not be those of any process where the noise is slow, and Yule-Walker then leaves more than there
// was. The order is that of the least deviance with its penalty, zero where the rows are too few or too broken up.
NoiseModel FitNoise(const RowIndex& rows, const Eigen::VectorXd& residual);

// -2 log likelihood of the residual that the model was fitted to, up to a constant, and log(rows) for each coefficient.
double Deviance(const NoiseModel& noise, const RowIndex& rows);

// What is left of each row by its predictor, over the standard deviation of that.
Eigen::VectorXd Whiten(const NoiseModel& noise, const RowIndex& rows, const Eigen::Ref<const Eigen::VectorXd>& v);

// The same of each column.
Eigen::MatrixXd WhitenColumns(const NoiseModel& noise, const RowIndex& rows, const Eigen::MatrixXd& m);

}  // namespace armcal::diagnosis
