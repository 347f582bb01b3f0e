// logs - brings columns with times of their own to common times.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host_sim/data/files/csv.hpp"

namespace armcal::logs {

// Columns that share their times: those of one topic.
struct Series {
  std::string name;   // for notes
  Eigen::VectorXd t;  // [N] s, never falling
  files::NumericTable numbers;
};

// The columns of a table by which of its cells are empty: columns with numbers in the same rows become a series,
// without the rows that they have no number in. Rows without a time are left out. t: the times of the rows.
std::vector<Series> SplitByEmptyCells(const files::NumericTable& table, const Eigen::VectorXd& t);

struct Common {
  std::size_t grid = 0;                 // the series whose times count
  files::NumericTable numbers;          // its rows, the columns of all series
  std::vector<std::string> notes = {};  // what was interpolated, and where gaps are
};

// All columns at the times of one series: the slowest one of those that hold a column of `main` (the first, if several
// are as slow). Between two of its times a column is a straight line, and a column of `held` keeps its last value. A
// row is NaN where a column has not begun, has ended, or has a gap of more than five of its steps. Equal times give
// equal numbers.
Common OnCommonTimes(const std::vector<Series>& series, const std::vector<std::string>& main,
                     const std::vector<std::string>& held);

}  // namespace armcal::logs
