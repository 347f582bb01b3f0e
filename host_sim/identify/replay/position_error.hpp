// replay - how far a free run is from the log.
#pragma once

#include "host_sim/identify/replay/free_run.hpp"

namespace armcal::replay {

// Simulated minus measured position, joint units.
struct PositionError {
  struct After {
    double seconds;
    Eigen::VectorXd error;  // [n] at the first sample that is this long after the start
  };
  std::vector<After> after;   // 1, 5 and 25 s as far as the log reaches, and the end
  Eigen::VectorXd rms, most;  // [n] over the record; most: the largest size
  double start_s = 0, length_s = 0;
  double ran_away_s = 0;  // above 0: the motion ran away that long after the start; rms and most are of what was before
  double left_limits_s = 0;  // above 0: a joint was beyond its position limits that long after the start
  Eigen::MatrixXd q;         // [N x n] the simulated positions, from sample `first` on
  int first = 0;
};

// Free run from the state of the first start_samples samples to the end of the log.
PositionError Replay(const codegen::Model& model, const Record& log, const Parameters& p, int start_samples,
                     double step_s);

}  // namespace armcal::replay
