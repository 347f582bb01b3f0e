// logs - leaves out rows that are no measurement: padding, filler, repeats, and times that do not rise.
#include "host_sim/data/logs/rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/logs/steps.hpp"

namespace armcal::logs {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMissingShare = 0.1;  // of the rows between the log's ends
constexpr double kUnorderedShare = 0.01;
constexpr Index kFewUnordered = 5;
constexpr double kSlowest_Hz = 1, kFastest_Hz = 50e3;            // of any controller that moves an arm
constexpr double kUsualSlowest_Hz = 10, kUsualFastest_Hz = 2e4;  // to guess a unit
constexpr double kJump = 100;   // median steps: a step this long is a pause, or a stamp that is wrong
constexpr Index kJumpRows = 3;  // rows that must be gained to believe in a jump
constexpr Index kFillerRows = 4;
constexpr double kRegular = 0.8;  // share of repeats of one length that makes them regular
constexpr double kOneStep = 0.5;  // share of changes by one step of the encoder that makes repeats its resolution
constexpr double kEvener = 0.5;   // an even grid must halve the error of positions that are read off their neighbours
constexpr double kJitter = 0.02;  // of a step: below this stamps are even enough

[[noreturn]] void Fail(const RawRows& rows, const std::string& what) {
  throw io::InputError(rows.source + ": " + what);
}

std::string Rows(Index count) { return count == 1 ? "1 row" : fmt::format("{} rows", count); }

// Works on the rows that are left, one kind of fault after another.
class Chooser {
 public:
  explicit Chooser(const RawRows& rows) : rows_(rows) {
    for (Index k = 0; k < rows.t.size(); ++k) out_.row.push_back(k);
  }

  Samples Choose() {
    LeaveOutMissing();
    LeaveOutTwins();
    LeaveOutUnordered();
    LeaveOutFiller();
    LeaveOutZeros();
    LeaveOutRepeats();
    out_.t = rows_.t(out_.row);
    CheckRate();
    MakeEven();
    return std::move(out_);
  }

 private:
  Index size() const { return static_cast<Index>(out_.row.size()); }
  Index row(Index i) const { return out_.row[static_cast<std::size_t>(i)]; }
  Index line(Index i) const { return row(i) + rows_.first_line; }
  double time(Index i) const { return rows_.t[row(i)]; }
  bool SameQ(Index a, Index b) const { return rows_.q.row(row(a)) == rows_.q.row(row(b)); }
  bool SameTau(Index a, Index b) const { return rows_.tau.row(row(a)) == rows_.tau.row(row(b)); }
  bool Same(Index a, Index b) const { return SameQ(a, b) && SameTau(a, b); }

  // Keeps the rows that are not marked. Notes why, with the number of marked rows and their first line.
  Index Drop(const std::vector<char>& marked, const std::string& why) {
    std::vector<Index> kept;
    Index first = -1;
    for (Index i = 0; i < size(); ++i) {
      if (!marked[static_cast<std::size_t>(i)]) kept.push_back(row(i));
      else if (first < 0) first = line(i);
    }
    const Index dropped = size() - static_cast<Index>(kept.size());
    if (dropped > 0 && !why.empty())
      out_.notes.push_back(fmt::format("{} left out ({} {})", Rows(dropped), why, first));
    out_.row = std::move(kept);
    return dropped;
  }
  std::vector<char> Unmarked() const { return std::vector<char>(out_.row.size(), 0); }

  void LeaveOutMissing() {
    const auto missing = [this](Index i) { return rows_.missing[row(i)] != 0; };
    Index begin = 0, end = size();
    while (begin < end && missing(begin)) ++begin;
    while (end > begin && missing(end - 1)) --end;
    std::vector<char> ends = Unmarked(), between = Unmarked();
    for (Index i = 0; i < size(); ++i) ends[static_cast<std::size_t>(i)] = i < begin || i >= end;
    Drop(ends, "no number, at an end of the log, from line");
    between = Unmarked();
    Index count = 0, first = -1;
    for (Index i = 0; i < size(); ++i)
      if (missing(i)) between[static_cast<std::size_t>(i)] = 1, ++count, first = first < 0 ? i : first;
    if (static_cast<double>(count) > kMissingShare * static_cast<double>(size()))
      Fail(rows_,
           fmt::format("line {}: column '{}' has no number, and so have {} of {} rows; expected a number in nearly "
                       "all rows",
                       line(first), MissingColumn(row(first)), count, size()));
    Drop(between, "a number is missing, first line");
  }

  std::string MissingColumn(Index k) const {
    const Index n = rows_.q.cols();
    for (Index c = 0; c < 2 * n; ++c)
      if (std::isnan(c < n ? rows_.q(k, c) : rows_.tau(k, c - n))) return rows_.columns[static_cast<std::size_t>(c)];
    return std::isnan(rows_.t[k]) ? rows_.time_column : "another";
  }

  // The same row twice says nothing new, however often it occurs.
  void LeaveOutTwins() {
    std::vector<char> twin = Unmarked();
    for (Index i = 1; i < size(); ++i) twin[static_cast<std::size_t>(i)] = time(i) == time(i - 1) && Same(i, i - 1);
    Drop(twin, "they stand in the file twice, first line");
  }

  struct Run {
    Index begin, end;  // rows [begin, end) with rising times and no jump
    Index length() const { return end - begin; }
  };

  std::vector<Run> RisingRuns(double jump_s, Index& unordered, Index& first) const {
    std::vector<Run> run;
    unordered = 0, first = -1;
    Index begin = 0;
    for (Index i = 1; i <= size(); ++i) {
      if (i < size() && time(i) > time(i - 1) && time(i) - time(i - 1) <= jump_s) continue;
      if (i < size() && time(i) <= time(i - 1)) ++unordered, first = first < 0 ? i : first;
      run.push_back({begin, i});
      begin = i;
    }
    return run;
  }

  // The longest chain of runs with rising times. Where two runs overlap, the one with less to lose is trimmed.
  void LeaveOutUnordered() {
    if (size() < 2) return;
    Index unordered = 0, first = -1;
    const double jump_s = kJump * MedianStep(rows_.t(out_.row));
    const std::vector<Run> run = RisingRuns(jump_s, unordered, first);
    const Index allowed = std::max(kFewUnordered, static_cast<Index>(kUnorderedShare * static_cast<double>(size())));
    if (unordered == 0 && run.size() == 1) return;
    if (unordered > allowed) FailUnordered(first, unordered);
    struct Link {
      Index kept, from, head, tail;  // rows kept up to here; run before, and what the two lose of head and tail
    };
    std::vector<Link> best;
    for (std::size_t r = 0; r < run.size(); ++r) {
      best.push_back({run[r].length(), -1, 0, 0});
      // A pause is rare, so the runs that may precede are among the last few hundred.
      for (std::size_t s = r > 300 ? r - 300 : 0; s < r; ++s) {
        Index head = 0, tail = 0;
        while (head < run[r].length() && time(run[r].begin + head) <= time(run[s].end - 1)) ++head;
        while (tail < run[s].length() && time(run[s].end - 1 - tail) >= time(run[r].begin)) ++tail;
        if (head == run[r].length() && tail == run[s].length()) continue;
        const bool trim_head = tail == run[s].length() || (head < run[r].length() && head <= tail);
        (trim_head ? tail : head) = 0;
        const double step_s = time(run[r].begin + head) - time(run[s].end - 1 - tail);
        const Index kept = best[s].kept + run[r].length() - head - tail - (step_s > jump_s ? kJumpRows : 0);
        if (kept > best[r].kept) best[r] = {kept, static_cast<Index>(s), head, tail};
      }
    }
    std::size_t last = 0;
    for (std::size_t r = 1; r < best.size(); ++r)
      if (best[r].kept > best[last].kept) last = r;
    std::vector<char> drop(out_.row.size(), 1);
    Index end = run[last].end;
    for (Index r = static_cast<Index>(last); r >= 0;) {
      const Link& link = best[static_cast<std::size_t>(r)];
      const Run& one = run[static_cast<std::size_t>(r)];
      for (Index i = one.begin + link.head; i < end; ++i) drop[static_cast<std::size_t>(i)] = 0;
      r = link.from;
      if (r >= 0) end = run[static_cast<std::size_t>(r)].end - link.tail;
    }
    const Index dropped = std::count(drop.begin(), drop.end(), 1);
    if (dropped > allowed)
      FailUnordered(first < 0 ? std::find(drop.begin(), drop.end(), 1) - drop.begin() : first, dropped);
    Drop(drop, "their time is repeated, goes back or leaps, first line");
  }

  [[noreturn]] void FailUnordered(Index i, Index count) const {
    throw io::InputError(fmt::format("{}:{}: column '{}': time {} (such rows: {}), expected it to rise", rows_.source,
                                     line(i), rows_.time_column,
                                     i == 0 || time(i) > time(i - 1) ? "leaps"
                                     : time(i) == time(i - 1)        ? "is repeated"
                                                                     : "goes back",
                                     count));
  }

  void LeaveOutFiller() {
    Index begin = 0, end = size();
    while (begin + 1 < size() && Same(begin + 1, begin)) ++begin;
    while (end > 1 && Same(end - 2, end - 1)) --end;
    begin = begin + 1 >= kFillerRows ? begin + 1 : 0;
    end = size() - end + 1 >= kFillerRows ? end - 1 : size();
    if (begin >= end) return;  // nothing changes at all; the checks of each joint say so
    std::vector<char> filler = Unmarked();
    for (Index i = 0; i < size(); ++i) filler[static_cast<std::size_t>(i)] = i < begin || i >= end;
    Drop(filler, "positions and torques stay the same to the last digit at an end of the log, from line");
  }

  void LeaveOutZeros() {
    std::vector<char> zero = Unmarked();
    Index count = 0;
    for (Index i = 0; i < size(); ++i)
      if (rows_.q.row(row(i)).isZero(0) && rows_.tau.row(row(i)).isZero(0))
        zero[static_cast<std::size_t>(i)] = 1, ++count;
    if (2 * count < size()) Drop(zero, "all positions and torques are 0, first line");
  }

  // Rows from one fresh value to the next, and whether its changes are steps of a coarse encoder.
  struct Holding {
    Index times = 1;  // how often each value stands in the file
    bool regular = false;
  };

  Holding FindHolding(const MatrixXd& value) const {
    std::vector<double> distance;
    Index last = 0;
    std::vector<std::vector<double>> change(static_cast<std::size_t>(value.cols()));
    for (Index i = 1; i < size(); ++i) {
      const auto moved = (value.row(row(i)) - value.row(row(i - 1))).cwiseAbs().eval();
      if (moved.isZero(0)) continue;
      distance.push_back(static_cast<double>(i - last));
      last = i;
      for (Index c = 0; c < value.cols(); ++c)
        if (moved[c] > 0) change[static_cast<std::size_t>(c)].push_back(moved[c]);
    }
    constexpr std::size_t kEnough = 50;
    if (distance.size() < kEnough) return {};
    const double median = Median(distance);
    const auto share = [&distance](auto is) {
      return static_cast<double>(std::count_if(distance.begin(), distance.end(), is)) /
             static_cast<double>(distance.size());
    };
    if (median < 2 || share([](double d) { return d < 2; }) > 1 - kRegular ||
        share([&](double d) { return std::abs(d - median) < 1.5; }) < kRegular)
      return {};
    std::size_t changes = 0, small = 0;
    for (const auto& column : change) {
      if (column.empty()) continue;
      const double least = *std::min_element(column.begin(), column.end());
      changes += column.size();
      small += static_cast<std::size_t>(
          std::count_if(column.begin(), column.end(), [&](double x) { return x < 1.1 * least; }));
    }
    if (static_cast<double>(small) > kOneStep * static_cast<double>(changes)) return {};
    return {static_cast<Index>(median), true};
  }

  void LeaveOutRepeats() {
    if (size() < 3) return;
    const double step_s = MedianStep(rows_.t(out_.row));
    const Holding q = FindHolding(rows_.q), tau = FindHolding(rows_.tau);
    std::vector<char> stale = Unmarked();
    if (q.regular || tau.regular) {
      const bool by_torque = tau.times > q.times;
      const Index times = std::max(q.times, tau.times);
      for (Index i = 1; i < size(); ++i)
        stale[static_cast<std::size_t>(i)] = by_torque ? SameTau(i, i - 1) : SameQ(i, i - 1);
      Drop(stale, "");
      out_.notes.push_back(fmt::format(
          "each {} stands in {} rows, so the sample rate is {:.4g} Hz and not {:.4g}; only rows with a fresh one stay",
          q.times == tau.times ? "row of values"
          : by_torque          ? "torque"
                               : "position",
          times, 1 / (step_s * static_cast<double>(times)), 1 / step_s));
      return;
    }
    // At rest a row may repeat the one before. While the arm moves it cannot: behind the repeats the positions are as
    // many steps further on.
    for (Index i = 1; i + 1 < size();) {
      Index end = i;
      while (end < size() && Same(end, i - 1)) ++end;
      const Index repeats = end - i;
      if (repeats > 0 && end + 1 < size()) {
        const double behind = (rows_.q.row(row(end)) - rows_.q.row(row(i - 1))).norm(),
                     next = (rows_.q.row(row(end + 1)) - rows_.q.row(row(end))).norm();
        if (next > 0 && behind > 0.5 * static_cast<double>(repeats + 1) * next)
          std::fill(stale.begin() + i, stale.begin() + end, 1);
      }
      i = std::max(end, i + 1);
    }
    Drop(stale, "they repeat the row before while the arm moves on, first line");
  }

  void CheckRate() const {
    if (size() < 3) return;
    const double step_s = MedianStep(out_.t), rate_Hz = 1 / step_s;
    if (rate_Hz > 1.001 * kSlowest_Hz && rate_Hz <= kFastest_Hz) return;
    std::string looks;
    for (const auto& [wrong, factor] : {std::pair{"ms read as s, us as ms or ns as us", 1e3},
                                        std::pair{"us read as s or ns as ms", 1e6}, std::pair{"ns read as s", 1e9}}) {
      const double as_s = rate_Hz * factor, as_less = rate_Hz / factor;
      if (as_s >= kUsualSlowest_Hz && as_s <= kUsualFastest_Hz)
        looks = fmt::format("; it looks like {} ({:.4g} Hz)", wrong, as_s);
      else if (as_less >= kUsualSlowest_Hz && as_less <= kUsualFastest_Hz)
        looks = fmt::format("; it looks {:g} times too short ({:.4g} Hz)", factor, as_less);
      if (!looks.empty()) break;
    }
    Fail(rows_,
         fmt::format("column '{}': the time step is {:.4g} s ({:.3g} Hz), expected a sample rate of {:g} Hz to {:g} "
                     "kHz{}",
                     rows_.time_column, step_s, rate_Hz, kSlowest_Hz, kFastest_Hz / 1e3, looks));
  }

  // Stamps may be those of the program that wrote the file, while the drive has sampled evenly. Then positions follow
  // from their neighbours better by number than by stamp.
  void MakeEven() {
    const Index count = size();
    if (count < 8) return;
    std::vector<char> cut = Unmarked();  // before these rows
    for (const int lost : LostBehind(out_.t)) cut[static_cast<std::size_t>(lost) + 1] = 1;
    std::vector<Run> stretch;
    Index begin = 0;
    for (Index i = 1; i <= count; ++i) {
      if (i < count && !cut[static_cast<std::size_t>(i)] && row(i) == row(i - 1) + 1) continue;
      stretch.push_back({begin, i});
      begin = i;
    }
    std::vector<double> by_stamp, by_number;
    for (const Run& run : stretch)
      for (Index i = run.begin + 2; i + 2 < run.end; ++i) AddReading(i, by_stamp, by_number);
    if (by_stamp.size() < 50) return;
    const double stamp = Median(std::move(by_stamp)), number = Median(std::move(by_number));
    if (number >= kEvener * stamp) return;
    VectorXd even = out_.t;
    for (const Run& run : stretch) {
      if (run.length() < 8) continue;
      const VectorXd k = VectorXd::LinSpaced(run.length(), 0, static_cast<double>(run.length() - 1));
      const VectorXd part = out_.t.segment(run.begin, run.length());
      const double slope = (k.array() - k.mean()).matrix().dot(part) / (k.array() - k.mean()).square().sum();
      even.segment(run.begin, run.length()) = part.mean() + slope * (k.array() - k.mean());
    }
    for (Index i = 1; i < count; ++i)
      if (even[i] <= even[i - 1]) return;
    const double step_s = MedianStep(out_.t),
                 jitter_s = std::sqrt((even - out_.t).squaredNorm() / static_cast<double>(count));
    if (jitter_s < kJitter * step_s) return;
    out_.notes.push_back(
        fmt::format("stamps jitter by {:.2g} s where the joints are sampled evenly; the mean step of {:.4g} "
                    "s is used",
                    jitter_s, step_s));
    out_.t = even;
  }

  // How far each joint that moves is from the cubic through its four neighbours, by stamp and by number.
  void AddReading(Index i, std::vector<double>& by_stamp, std::vector<double>& by_number) const {
    constexpr int at[] = {-2, -1, 1, 2};
    constexpr double even[] = {-1.0 / 6, 4.0 / 6, 4.0 / 6, -1.0 / 6};
    double weight[4];
    for (int a = 0; a < 4; ++a) {
      weight[a] = 1;
      for (int b = 0; b < 4; ++b)
        if (b != a) weight[a] *= (out_.t[i] - out_.t[i + at[b]]) / (out_.t[i + at[a]] - out_.t[i + at[b]]);
    }
    for (Index j = 0; j < rows_.q.cols(); ++j) {
      double stamp = -rows_.q(row(i), j), number = stamp;
      for (int a = 0; a < 4; ++a) {
        stamp += weight[a] * rows_.q(row(i + at[a]), j);
        number += even[a] * rows_.q(row(i + at[a]), j);
      }
      if (std::abs(rows_.q(row(i + 2), j) - rows_.q(row(i - 2), j)) == 0) continue;
      by_stamp.push_back(std::abs(stamp));
      by_number.push_back(std::abs(number));
    }
  }

  const RawRows& rows_;
  Samples out_;
};

}  // namespace

Samples ChooseSamples(const RawRows& rows) { return Chooser(rows).Choose(); }

}  // namespace armcal::logs
