// methods - minimises (25) along its gradient from Problem::start, within the ranges and among bodies that can exist.
//
// Spectral projected gradient (Birgin, Martinez, Raydan 2000). Every step goes against the gradient, as in the survey.
// Its length is that of Barzilai and Borwein, shortened until the value beats the worst of the last ten. A log-det
// barrier keeps bodies possible.
#include <algorithm>
#include <cmath>
#include <vector>

#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/search_problem.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::VectorXd;

namespace {

constexpr int kLinearSteps = 50000, kNonlinearSteps = 8000;  // some seconds
constexpr int kMemory = 10;                                  // values; a step must beat the worst of them
constexpr double kBarrier = 1e-3;  // of the objective at the start, per unit of log det: far less than what data change
constexpr double kSmallStep = 1e-7;  // of the ranges: a smaller step ends the search

VectorXd Clamped(const VectorXd& u) { return u.cwiseMax(0).cwiseMin(1); }

class Descent {
 public:
  Descent(Objective& objective, const SearchSpace& space, double barrier)
      : objective_(objective), space_(space), barrier_(barrier) {}

  // Value and gradient in u; infinite where a body cannot exist.
  double operator()(const VectorXd& u, VectorXd& gradient) {
    const VectorXd z = space_.Point(u);
    VectorXd slope, of_barrier;
    const double inside = space_.Barrier(z, of_barrier);
    if (!std::isfinite(inside)) return inside;
    const double value = objective_(z, slope) + barrier_ * inside;
    gradient = space_.Gradient(slope + barrier_ * of_barrier);
    return value;
  }

 private:
  Objective& objective_;
  const SearchSpace& space_;
  double barrier_;
};

}  // namespace

Solution GradientDescent(const Problem& problem) {
  const double began = CpuSeconds();
  const SearchSpace space(problem, "gradient descent");
  Objective objective(problem, Criterion::kMeanSpread);
  Descent descent(objective, space, kBarrier * objective(problem.start));
  VectorXd u = Clamped(space.Place(problem.start)), gradient, next_gradient;
  double value = descent(u, gradient), best = value;
  if (!std::isfinite(value)) {  // cut to its ranges, the start has bodies that cannot exist
    u = space.Place(space.Possible(space.Point(u)));
    best = value = descent(u, gradient);
  }
  VectorXd best_u = u;
  std::vector<double> last = {value};
  double length = 1 / std::max(1e-12, gradient.cwiseAbs().maxCoeff());
  const int most = problem.model->nonlinear() ? kNonlinearSteps : kLinearSteps;
  Solution out;
  out.converged = false;
  for (; out.iterations < most && !Stopped(problem); ++out.iterations) {
    const VectorXd direction = Clamped(u - length * gradient) - u;
    if (direction.cwiseAbs().maxCoeff() < kSmallStep) {
      out.converged = true;
      break;
    }
    const double slope = gradient.dot(direction), ceiling = *std::max_element(last.begin(), last.end());
    double share = 1, next = descent(u + direction, next_gradient);
    while (!(next <= ceiling + 1e-4 * share * slope) && share > 1e-12)
      share /= 2, next = descent(u + share * direction, next_gradient);
    if (share <= 1e-12) {
      out.remark = "no step along the gradient improves any more";
      break;
    }
    const VectorXd step = share * direction, change = next_gradient - gradient;
    const double curvature = step.dot(change);
    length = curvature > 0 ? std::clamp(step.squaredNorm() / curvature, 1e-10, 1e10) : 1e10;
    u += step, gradient = next_gradient, value = next;
    if (last.size() == kMemory) last.erase(last.begin());
    last.push_back(value);
    if (value < best) best = value, best_u = u;
    if (problem.progress && out.iterations % 50 == 0)
      problem.progress(static_cast<double>(out.iterations) / most, best);
  }
  out.z = space.Point(best_u);
  out.bodies = space.Bodies(out.z);
  out.memory_bytes = objective.memory_bytes();
  if (const std::string ends = space.AtEnds(out.z); !ends.empty())
    out.remark += (out.remark.empty() ? "" : "; ") + ends;
  Finish(problem, began, out);
  return out;
}

}  // namespace armcal::calibration
