// tests - logs with one planted fault each, and what has to be said of them.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "host_sim/data/logs/log.hpp"

namespace armcal::tests {

// `said`: what the one line must contain. Empty: the log is taken; `note` is then what must be remarked, if anything.
struct Mangled {
  std::string name;
  std::function<void(logs::Log&)> mangle;
  std::string said, note = {};
  bool speeds = false;  // the log has speed columns
};

inline void Keep(logs::Log& log, const std::vector<Eigen::Index>& rows) {
  log.t = log.t(rows).eval();
  for (Eigen::MatrixXd* m : {&log.q, &log.tau, &log.qd})
    if (m->rows() > 0) *m = (*m)(rows, Eigen::all).eval();
}

// Each value stands `times` times.
inline void Hold(Eigen::MatrixXd& values, Eigen::Index times) {
  for (Eigen::Index k = 0; k < values.rows(); ++k) values.row(k) = values.row(k - k % times).eval();
}

inline void Shuffle(logs::Log& log, Eigen::Index j) {
  std::mt19937_64 random(3);
  std::vector<double> value(log.tau.col(j).begin(), log.tau.col(j).end());
  std::shuffle(value.begin(), value.end(), random);
  log.tau.col(j) = Eigen::VectorXd::Map(value.data(), log.tau.rows());
}

// The row of the upper half of the log at which joint j is fastest.
inline Eigen::Index Fastest(const logs::Log& log, Eigen::Index j) {
  const Eigen::Index half = log.samples() / 2, quarter = log.samples() / 4;
  Eigen::Index at = 0;
  (log.q.col(j).segment(half + 1, quarter) - log.q.col(j).segment(half, quarter)).cwiseAbs().maxCoeff(&at);
  return half + at;
}

inline constexpr double kDegree = 57.29577951308232;  // a radian in degrees

// Faults of six-axis logs of ten seconds or more, at 50 to 250 Hz.
inline std::vector<Mangled> SixAxisFaults() {
  using logs::Log;
  const auto time = [](double factor) { return [factor](Log& l) { l.t = (l.t.array() - l.t[0]) * factor; }; };
  const auto swap_q = [](int i, int j) { return [i, j](Log& l) { l.q.col(i - 1).swap(l.q.col(j - 1)); }; };
  const auto swap_tau = [](int i, int j) { return [i, j](Log& l) { l.tau.col(i - 1).swap(l.tau.col(j - 1)); }; };
  const auto sign_q = [](int j) { return [j](Log& l) { l.q.col(j - 1) *= -1; }; };
  const auto sign_tau = [](int j) { return [j](Log& l) { l.tau.col(j - 1) *= -1; }; };
  return {
      {"as it is", [](Log&) {}, ""},
      {"time in ms", time(1e3), "looks like ms"},
      {"time in us", time(1e6), "looks like us"},
      {"time in ns", time(1e9), "looks like ns"},
      {"time a million times too short", time(1e-6), "times too short"},
      {"time a hundred times too short", time(1e-2), "is time (step"},
      {"time a tenth, with speeds", time(0.1), "10 times", "", true},
      {"time tenfold, with speeds", time(10), "10 times more slowly", "", true},
      {"one row goes back", [](Log& l) { l.t[300] = l.t[100]; }, "", "1 row left out"},
      {"two rows changed places", [](Log& l) { std::swap(l.t[300], l.t[301]); }, "", "1 row left out"},
      {"one stamp twice", [](Log& l) { l.t[301] = l.t[300]; }, "", "first line 303"},
      {"one stamp from another world", [](Log& l) { l.t[300] = -1e140; }, "", "1 row left out"},
      {"every tenth row goes back",
       [](Log& l) {
         for (Eigen::Index k = 10; k < l.samples(); k += 10) l.t[k] = l.t[k - 2];
       },
       "time goes back"},
      {"NaN at the end", [](Log& l) { l.q.bottomRows(100).setConstant(NAN); }, "", "100 rows left out"},
      {"NaN in ten rows", [](Log& l) { l.tau.middleRows(400, 10).setConstant(NAN); }, "", "10 rows left out"},
      {"NaN in one column", [](Log& l) { l.q.col(3).segment(1, l.samples() - 2).setConstant(NAN); }, "no number"},
      {"filler at the end",
       [](Log& l) {
         for (Eigen::Index k = l.samples() - 50; k < l.samples(); ++k)
           l.q.row(k) = l.q.row(l.samples() - 51), l.tau.row(k).setZero();
       },
       "", "50 rows left out"},
      {"zeros at the end", [](Log& l) { l.q.bottomRows(50).setZero(), l.tau.bottomRows(50).setZero(); }, "", "50 rows"},
      {"zeros in between", [](Log& l) { l.q.middleRows(500, 3).setZero(), l.tau.middleRows(500, 3).setZero(); }, "",
       "3 rows left out"},
      {"all values three times", [](Log& l) { Hold(l.q, 3), Hold(l.tau, 3); }, "", "stands in 3 rows"},
      {"torque twice as slow", [](Log& l) { Hold(l.tau, 2); }, "", "torque stands in 2 rows"},
      {"a few samples missing",
       [](Log& l) {
         std::vector<Eigen::Index> rows;
         for (Eigen::Index k = 0; k < l.samples(); ++k)
           if (k < 500 || k >= 520) rows.push_back(k);
         Keep(l, rows);
       },
       "", "samples are missing"},
      {"a fifth of the samples missing",
       [](Log& l) {
         std::vector<Eigen::Index> rows;
         for (Eigen::Index k = 0; k < l.samples(); ++k)
           if (k % 50 < 40) rows.push_back(k);
         Keep(l, rows);
       },
       "samples are missing"},
      {"the clock jumps",
       [](Log& l) {
         const Eigen::Index at = Fastest(l, 0);
         l.t.tail(l.samples() - at - 1).array() += 3;
       },
       "time jumps by 3"},
      {"1.9 s",
       [](Log& l) {
         std::vector<Eigen::Index> rows;
         for (Eigen::Index k = 0; l.t[k] - l.t[0] < 1.9; ++k) rows.push_back(k);
         Keep(l, rows);
       },
       "expected at least"},
      {"degrees", [](Log& l) { l.q *= kDegree; }, "degrees"},
      {"radians read as degrees", [](Log& l) { l.q /= kDegree; }, "in rad, but are read as deg"},
      {"torque in mN m", [](Log& l) { l.tau *= 1000; }, "mN m"},
      {"a torque that is zero", [](Log& l) { l.tau.col(1).setZero(); }, "joint 2: torque is zero"},
      {"a torque that stays the same", [](Log& l) { l.tau.col(4).setConstant(3.5); }, "joint 5: torque never changes"},
      {"no motion", [](Log& l) { l.q.rowwise() = l.q.row(0).eval(); }, "no joint moves"},
      {"an encoder that never moves", [](Log& l) { l.q.col(1).setConstant(l.q(0, 1)); }, "joint 2: position never"},
      {"an encoder that never moves, with speeds", [](Log& l) { l.q.col(4).setConstant(l.q(0, 4)); },
       "joint 5: position never changes while its logged speed does", "", true},
      {"an encoder that leaps", [](Log& l) { l.q.col(2).tail(l.samples() - 600).array() += 1.0; }, "joint 3: line 602"},
      {"q2 and q3", swap_q(2, 3), "q2 and q3"},
      {"q4 and q5", swap_q(4, 5), "q4 and q5"},
      {"q1 and q2", swap_q(1, 2), "q1 and q2"},
      {"tau2 and tau3", swap_tau(2, 3), "tau2 and tau3"},
      {"tau4 and tau5", swap_tau(4, 5), "tau4 and tau5"},
      {"tau1 and tau6", swap_tau(1, 6), "tau1 and tau6"},
      {"joints 2 and 3", [](Log& l) { l.q.col(1).swap(l.q.col(2)), l.tau.col(1).swap(l.tau.col(2)); }, "2 and 3"},
      {"three torques in turn", [](Log& l) { l.tau.col(1).swap(l.tau.col(2)), l.tau.col(2).swap(l.tau.col(3)); },
       "exchanged"},
      {"sign of q2", sign_q(2), "q2"},
      {"sign of q5", sign_q(5), "q5"},
      {"sign of tau1", sign_tau(1), "tau1"},
      {"sign of tau2", sign_tau(2), "tau2"},
      {"sign of tau6", sign_tau(6), "tau6"},
      {"all signs of torque", [](Log& l) { l.tau *= -1; }, "joint 1"},
      {"shuffled tau3", [](Log& l) { Shuffle(l, 2); }, "joint 3: "},
      {"shuffled tau6", [](Log& l) { Shuffle(l, 5); }, "joint 6: "},
      {"a speed in deg/s", [](Log& l) { l.qd.col(3) *= kDegree; }, "", "joint 4: the logged speed is 57", true},
      {"a gain of 1.1", [](Log& l) { l.tau.col(0) *= 1.1; }, ""},
  };
}

}  // namespace armcal::tests
