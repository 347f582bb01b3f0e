// replay - runs a log's torque through a model and compares the positions.
#include "host_sim/identify/replay/position_error.hpp"

#include <algorithm>
#include <cmath>

namespace armcal::replay {

namespace {
constexpr double kAfter_s[] = {1, 5, 25};
}  // namespace

PositionError Replay(const codegen::Model& model, const Record& log, const Parameters& p, int start_samples,
                     double step_s) {
  const int n = model.joints();
  FreeRun run(model, step_s);
  PositionError out;
  out.first = (start_samples - 1) / 2;
  const State start = StateFromFirst(log, start_samples);
  const int stride = run.Stride(log);
  out.q = run.Run(log, out.first, log.samples() - 1, start, p);
  out.start_s = log.t[out.first];
  out.rms.setZero(n), out.most.setZero(n);
  Eigen::VectorXd error;
  std::size_t next = 0;
  int count = 0;
  for (Eigen::Index i = 0; i < out.q.rows(); ++i) {
    const int k = out.first + static_cast<int>(i) * stride;
    const double since_s = log.t[k] - out.start_s;
    if (!out.q.row(i).allFinite()) {
      out.ran_away_s = since_s;
      break;
    }
    error = out.q.row(i) - log.q.row(k);
    out.rms += error.cwiseAbs2(), ++count;
    out.most = out.most.cwiseMax(error.cwiseAbs());
    out.length_s = since_s;
    for (int j = 0; j < n && out.left_limits_s == 0; ++j) {
      const auto& limit = model.robot().joint[static_cast<std::size_t>(j)].position_limit_rad;
      if (out.q(i, j) < limit[0] || out.q(i, j) > limit[1]) out.left_limits_s = since_s;
    }
    if (next < std::size(kAfter_s) && since_s >= kAfter_s[next] - 1e-9) out.after.push_back({kAfter_s[next++], error});
  }
  out.rms = (out.rms / count).cwiseSqrt();
  if (out.after.empty() || out.after.back().seconds < out.length_s) out.after.push_back({out.length_s, error});
  return out;
}

}  // namespace armcal::replay
