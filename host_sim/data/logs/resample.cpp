// logs - interpolates the columns of slower and faster topics.
#include "host_sim/data/logs/resample.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "host_sim/data/logs/steps.hpp"

namespace armcal::logs {

namespace {

constexpr double kGapSteps = 5;
constexpr double kAsSlow = 1.01;  // steps that differ by less are the same

bool Holds(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool HoldsAnyOf(const Series& series, const std::vector<std::string>& main) {
  const auto& names = series.numbers.names;
  return std::any_of(names.begin(), names.end(), [&main](const std::string& name) { return Holds(main, name); });
}

std::size_t ChooseGrid(const std::vector<Series>& series, const std::vector<std::string>& main) {
  std::size_t grid = series.size();
  double slowest = 0;
  for (std::size_t s = 0; s < series.size(); ++s) {
    if (!HoldsAnyOf(series[s], main)) continue;
    const double step = MedianStep(series[s].t);
    if (grid == series.size() || step > kAsSlow * slowest) grid = s, slowest = step;
  }
  return grid == series.size() ? 0 : grid;
}

std::string Rate(double step_s) { return step_s > 0 ? fmt::format("{:.4g} Hz", 1 / step_s) : "one time"; }

// Says where a series has gaps.
void NoteGaps(const Series& series, double step_s, std::vector<std::string>& notes) {
  int count = 0;
  double longest_s = 0, at_s = 0;
  for (Eigen::Index k = 1; k < series.t.size(); ++k) {
    const double gap_s = series.t[k] - series.t[k - 1];
    if (gap_s <= kGapSteps * step_s) continue;
    ++count;
    if (gap_s > longest_s) longest_s = gap_s, at_s = series.t[k - 1] - series.t[0];
  }
  if (count > 0)
    notes.push_back(
        fmt::format("{}: {}, the longest {:.3g} s, {:.4g} s after its first time; nothing is interpolated "
                    "there",
                    series.name, count == 1 ? "1 gap" : fmt::format("{} gaps", count), longest_s, at_s));
}

// Writes the columns of a series at times `t` into `out`. True: each of these times is a time of the series, too.
bool Interpolate(const Series& series, double step_s, const Eigen::VectorXd& t, const std::vector<std::string>& held,
                 Eigen::Ref<Eigen::MatrixXd> out) {
  bool exact = true;
  Eigen::Index next = 0;  // the first time of the series behind t[k]
  for (Eigen::Index k = 0; k < t.size(); ++k) {
    while (next < series.t.size() && series.t[next] <= t[k]) ++next;
    const bool same = next > 0 && series.t[next - 1] == t[k];
    exact = exact && same;
    if (same) {
      out.row(k) = series.numbers.values.row(next - 1);
      continue;
    }
    if (next == 0 || next == series.t.size() || series.t[next] - series.t[next - 1] > kGapSteps * step_s) {
      out.row(k).setConstant(NAN);
      continue;
    }
    const double share = (t[k] - series.t[next - 1]) / (series.t[next] - series.t[next - 1]);
    for (Eigen::Index c = 0; c < out.cols(); ++c) {
      const double from = series.numbers.values(next - 1, c), to = series.numbers.values(next, c);
      out(k, c) = Holds(held, series.numbers.names[static_cast<std::size_t>(c)]) ? from : from + share * (to - from);
    }
  }
  return exact;
}

}  // namespace

std::vector<Series> SplitByEmptyCells(const files::NumericTable& table, const Eigen::VectorXd& t) {
  std::map<std::vector<bool>, std::vector<Eigen::Index>> group;  // columns by the rows that have a number
  std::vector<std::vector<bool>> order;
  for (Eigen::Index c = 0; c < table.values.cols(); ++c) {
    std::vector<bool> present(static_cast<std::size_t>(t.size()));
    for (Eigen::Index k = 0; k < t.size(); ++k)
      present[static_cast<std::size_t>(k)] = !std::isnan(table.values(k, c)) && !std::isnan(t[k]);
    auto& columns = group[present];
    if (columns.empty()) order.push_back(present);
    columns.push_back(c);
  }
  std::vector<Series> out;
  for (const std::vector<bool>& present : order) {
    const std::vector<Eigen::Index>& columns = group[present];
    std::vector<Eigen::Index> rows;
    for (Eigen::Index k = 0; k < t.size(); ++k)
      if (present[static_cast<std::size_t>(k)]) rows.push_back(k);
    std::stable_sort(rows.begin(), rows.end(), [&t](Eigen::Index a, Eigen::Index b) { return t[a] < t[b]; });
    Series& series = out.emplace_back();
    for (const Eigen::Index c : columns) series.numbers.names.push_back(table.names[static_cast<std::size_t>(c)]);
    series.name = "column '" + series.numbers.names[0] + "'";
    if (columns.size() > 1) series.name += fmt::format(" and {} more", columns.size() - 1);
    series.t = t(rows);
    series.numbers.values = table.values(rows, columns);
  }
  return out;
}

Common OnCommonTimes(const std::vector<Series>& series, const std::vector<std::string>& main,
                     const std::vector<std::string>& held) {
  Common out{ChooseGrid(series, main), {}};
  const Series& grid = series[out.grid];
  Eigen::Index columns = 0;
  for (const Series& one : series) columns += one.numbers.values.cols();
  out.numbers.values.resize(grid.t.size(), columns);
  Eigen::Index at = 0;
  for (const Series& one : series) {
    const double step_s = MedianStep(one.t);
    out.numbers.names.insert(out.numbers.names.end(), one.numbers.names.begin(), one.numbers.names.end());
    auto block = out.numbers.values.middleCols(at, one.numbers.values.cols());
    at += one.numbers.values.cols();
    const bool own = &one == &grid;
    if (own) {
      block = one.numbers.values;
    } else if (Interpolate(one, step_s, grid.t, held, block)) {
      if (HoldsAnyOf(one, main) && static_cast<double>(one.t.size()) > kAsSlow * static_cast<double>(grid.t.size()))
        out.notes.push_back(fmt::format("{}: of its {} times the {} count at which {} has numbers, too", one.name,
                                        one.t.size(), grid.t.size(), grid.name));
      continue;
    } else {
      out.notes.push_back(fmt::format("{} ({}): interpolated at the times of {} ({})", one.name, Rate(step_s),
                                      grid.name, Rate(MedianStep(grid.t))));
    }
    NoteGaps(one, step_s, out.notes);
  }
  return out;
}

}  // namespace armcal::logs
