// methods - minimises (25) by particles: weighted by exp(-J / T), resampled and moved, while the temperature T falls.
//
// Particles are drawn from the whole ranges. No initial value is used: Problem::start only lies inside the cone of
// possible bodies. T falls so slowly that most particles keep some weight. A particle moves along the difference of two
// others, so the cloud's own shape is the proposal (ter Braak 2006). The move is accepted with the chance that the
// weights give.
#include <algorithm>
#include <cmath>
#include <random>

#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/search_problem.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kPerUnknown = 6;       // particles per unknown: the cloud must span all directions with some to spare
constexpr double kJitter = 1e-4;     // of the ranges, so that a cloud that has lost a direction finds it again
constexpr double kCollapsed = 1e-6;  // of the objective
constexpr double kTaken = 0.25;      // share of moves to accept; the length of the moves is adapted to it
constexpr double kWholeStep = 0.1;   // share of moves with the whole difference, which lead from one minimum to another

// rounds: of weighting, resampling and moving. say: the effective share of particles that each fall of the temperature
// leaves. A linear model's value takes some microseconds, a nonlinear one's a good part of a millisecond.
struct Schedule {
  int rounds;
  double say;
};
constexpr Schedule kLinearSchedule = {1000, 0.9}, kNonlinearSchedule = {250, 0.8};

double EffectiveShare(const VectorXd& value, double best, double per_temperature) {
  const Eigen::ArrayXd w = (-per_temperature * (value.array() - best)).exp();
  return w.sum() * w.sum() / w.square().sum() / static_cast<double>(value.size());
}

class Cloud {
 public:
  Cloud(Objective& objective, const SearchSpace& space, double say, std::uint64_t seed)
      : objective_(objective),
        space_(space),
        say_(say),
        random_(seed),
        u_(space.size(), kPerUnknown * space.size()),
        value_(u_.cols()),
        best_(std::numeric_limits<double>::infinity()) {
    for (Eigen::Index i = 0; i < u_.cols(); ++i) {
      VectorXd u(space.size());
      for (double& x : u) x = Uniform();
      value_[i] = Value(u);
      u_.col(i) = u;
    }
  }

  // Lowers the temperature, resamples by it, moves every particle once.
  void Round() {
    Cool();
    Resample();
    const auto count = static_cast<int>(u_.cols());
    const MatrixXd before = u_;
    int taken = 0;
    for (int i = 0; i < count; ++i) {
      const int a = static_cast<int>(Uniform() * count), b = static_cast<int>(Uniform() * count);
      const double reach = Uniform() < kWholeStep ? 1 : reach_, part = Uniform();
      VectorXd u = u_.col(i);
      for (Eigen::Index k = 0; k < u.size(); ++k)
        if (Uniform() < part)
          u[k] = Inside(u[k] + reach * (before(k, a) - before(k, b)) + kJitter * reach_ * normal_(random_));
      const double value = Value(u);
      if (Uniform() < std::exp(-per_temperature_ * (value - value_[i]))) value_[i] = value, u_.col(i) = u, ++taken;
    }
    reach_ = std::clamp(reach_ * (taken > kTaken * count ? 1.1 : 1 / 1.1), 1e-3, 1.0);
  }

  double best() const { return best_; }
  // All particles are as good as the best one.
  bool collapsed() const { return value_.maxCoeff() - best_ < kCollapsed * best_; }
  const VectorXd& best_point() const { return best_point_; }
  std::size_t memory_bytes() const {
    return sizeof(double) * static_cast<std::size_t>(2 * u_.size() + 2 * value_.size());
  }

 private:
  double Uniform() { return uniform_(random_); }
  static double Inside(double x) {  // back from the ends of the range
    if (x < 0) x = -x;
    if (x > 1) x = 2 - x;
    return std::clamp(x, 0.0, 1.0);
  }
  // Moves u to bodies that can exist.
  double Value(VectorXd& u) {
    const VectorXd z = space_.Possible(space_.Point(u));
    u = space_.Place(z);
    const double value = objective_(z);
    if (value < best_) best_ = value, best_point_ = z;
    return value;
  }
  void Cool() {
    const double spread = value_.maxCoeff() - value_.minCoeff(), least = value_.minCoeff();
    if (!(spread > 1e-12 * std::abs(least))) return;
    double low = 0, high = 1e3 / spread;  // of the additional 1 / T
    while (EffectiveShare(value_, least, high) > say_ && high < 1e15) high *= 2;
    for (int k = 0; k < 40; ++k) {
      const double middle = 0.5 * (low + high);
      (EffectiveShare(value_, least, middle) > say_ ? low : high) = middle;
    }
    added_ = low;
    per_temperature_ += low;
  }
  // Systematic resampling: one random number; each particle is taken as often as its weight says, within one.
  void Resample() {
    const Eigen::ArrayXd w = (-added_ * (value_.array() - value_.minCoeff())).exp();
    const Eigen::Index count = value_.size();
    const double step = w.sum() / static_cast<double>(count);
    double place = Uniform() * step, sum = 0;
    MatrixXd u = u_;
    VectorXd value = value_;
    Eigen::Index to = 0;
    for (Eigen::Index from = 0; from < count; ++from)
      for (sum += w[from]; to < count && place < sum; place += step, ++to)
        u.col(to) = u_.col(from), value[to] = value_[from];
    u_ = u, value_ = value;
  }

  Objective& objective_;
  const SearchSpace& space_;
  double say_;
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> uniform_{0, 1};
  std::normal_distribution<double> normal_;
  MatrixXd u_;  // a column each
  VectorXd value_;
  double reach_ = 0.5, per_temperature_ = 0, added_ = 0, best_;
  VectorXd best_point_;
};

}  // namespace

Solution ParticleFilter(const Problem& problem) {
  const double began = CpuSeconds();
  const SearchSpace space(problem, "particle filter");
  Objective objective(problem, Criterion::kMeanSpread);
  const Schedule schedule = problem.model->nonlinear() ? kNonlinearSchedule : kLinearSchedule;
  Cloud cloud(objective, space, schedule.say, problem.seed);
  Solution out;
  double earlier = cloud.best();
  for (; out.iterations < schedule.rounds && !cloud.collapsed() && !Stopped(problem); ++out.iterations) {
    if (out.iterations == schedule.rounds * 9 / 10) earlier = cloud.best();
    cloud.Round();
    if (problem.progress && out.iterations % 10 == 0)
      problem.progress(static_cast<double>(out.iterations) / schedule.rounds, cloud.best());
  }
  // The last tenth gained nearly nothing.
  out.converged = cloud.collapsed() || (out.iterations == schedule.rounds && cloud.best() > 0.99 * earlier);
  out.z = cloud.best_point();
  out.bodies = space.Bodies(out.z);
  out.memory_bytes = cloud.memory_bytes() + objective.memory_bytes();
  out.remark = space.AtEnds(out.z);
  Finish(problem, began, out);
  return out;
}

}  // namespace armcal::calibration
