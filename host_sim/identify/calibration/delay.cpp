// calibration - four-point interpolation of the motion signals.
#include "host_sim/identify/calibration/delay.hpp"

#include <algorithm>

namespace armcal::calibration {

Dataset Delayed(const Dataset& data, double delay_s) {
  Dataset out = data;
  const Eigen::VectorXd& t = data.s.t;
  const Eigen::Index last = t.size() - 1;
  Eigen::Index k = 0;  // t[k] <= time < t[k + 1]
  for (Eigen::Index i = 0; i <= last; ++i) {
    const double time = std::clamp(t[i] - delay_s, t[0], t[last]);
    k = std::min(k, last - 1);
    while (k + 1 < last && t[k + 1] <= time) ++k;
    while (k > 0 && t[k] > time) --k;
    out.used.row(i) = data.used.row(i).cwiseMin(data.used.row(k).cwiseMin(data.used.row(k + 1)));
    const Eigen::Index first = std::clamp<Eigen::Index>(k - 1, 0, last - 3);
    double weight[4];
    for (int a = 0; a < 4; ++a) {
      weight[a] = 1;
      for (int b = 0; b < 4; ++b)
        if (b != a) weight[a] *= (time - t[first + b]) / (t[first + a] - t[first + b]);
    }
    for (const auto& [from, to] :
         {std::pair{&data.s.q, &out.s.q}, std::pair{&data.s.qd, &out.s.qd}, std::pair{&data.s.qdd, &out.s.qdd}}) {
      to->row(i).setZero();
      for (int a = 0; a < 4; ++a) to->row(i) += weight[a] * from->row(first + a);
    }
  }
  return out;
}

}  // namespace armcal::calibration
