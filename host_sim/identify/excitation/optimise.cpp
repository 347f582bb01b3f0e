// excitation - the objective with its gradient, and the searches from random starts on several threads.
#include "host_sim/identify/excitation/optimise.hpp"
#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <random>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/watch.hpp"
#include "host_sim/identify/excitation/peaks.hpp"
#include "host_sim/identify/search/minimise.hpp"
#include "host_sim/identify/search/parallel.hpp"

namespace armcal::excitation {

namespace {

constexpr double kPenalty =
    100;  // per sample and unit of squared excess: 1 % too far costs as much as 1 % of cond gains
constexpr double kClearanceStep_s = 0.025;  // a fast arm moves some centimetres between two looks at its distances
constexpr double kRelativeShift = 1e-7;     // of a joint's limit, for the derivative of the regressor by its state

// kPenalty * excess^2 of |x - middle| / half over `share`; adds the derivative by x.
double Excess(double x, double middle, double half, double share, double& derivative) {
  const double used = (x - middle) / half, excess = std::abs(used) / share - 1;
  if (excess <= 0) return 0;
  derivative += 2 * kPenalty * excess * std::copysign(1 / (share * half), used);
  return kPenalty * excess * excess;
}

}  // namespace

Objective::Objective(const Observation& observation, const Criterion& criterion, const SeriesShape& shape,
                     const Limits& limits)
    : observation_(observation), criterion_(criterion), shape_(shape), limits_(limits) {
  const codegen::Robot& robot = observation.model().robot();
  t_ = Eigen::VectorXd::LinSpaced(shape.samples, 0, shape.period_s * (shape.samples - 1) / shape.samples);
  for (int order = 0; order < 3; ++order) basis_[order] = Basis(shape.family, t_, shape.period_s, shape.terms, order);
  if (limits.clearance) {
    const auto looks = static_cast<Eigen::Index>(std::ceil(shape.period_s / kClearanceStep_s));
    const double last = shape.period_s * static_cast<double>(looks - 1) / static_cast<double>(looks);
    fine_ = Basis(shape.family, Eigen::VectorXd::LinSpaced(looks, 0, last), shape.period_s, shape.terms, 0);
  }
  zero_ = Eigen::MatrixXd::Zero(shape.terms + 1, robot.joints());
  unit_ = zero_;
  Eigen::RowVectorXd peak[3];  // of each term
  for (int order = 0; order < 3; ++order) peak[order] = basis_[order].cwiseAbs().colwise().maxCoeff();
  for (int j = 0; j < robot.joints(); ++j) {
    const codegen::Joint& joint = robot.joint[j];
    const auto [low, high] = joint.position_limit_rad;
    for (int i = 0; i < shape.terms; ++i)
      unit_(i, j) = std::min({(high - low) / (2 * peak[0][i]), joint.speed_limit_radps / peak[1][i],
                              joint.acceleration_limit_radps2 / peak[2][i]}) /
                    2;
    unit_(shape.terms, j) = (high - low) / 4;
    zero_(shape.terms, j) = (low + high) / 2;
  }
}

Series Objective::Series(const Eigen::VectorXd& u) const {
  const Eigen::Map<const Eigen::MatrixXd> table(u.data(), unit_.rows(), unit_.cols());
  return {shape_.family, shape_.period_s, zero_ + unit_.cwiseProduct(table)};
}

codegen::Signals Objective::Motion(const Eigen::VectorXd& u) const {
  const Eigen::MatrixXd coefficient = Series(u).coefficient;
  codegen::Signals s;
  s.t = t_;
  s.q = basis_[0] * coefficient, s.qd = basis_[1] * coefficient, s.qdd = basis_[2] * coefficient;
  return s;
}

// d_gram: derivative by the Gram matrix of all model columns (zero where a column is not asked for).
double Objective::SmoothFigure(Eigen::MatrixXd& d_gram) const {
  Eigen::MatrixXd d_asked;
  const double value = excitation::SmoothFigure(criterion_, observation_.Gram(row_, shape_.samples), d_asked);
  if (!std::isfinite(value)) return value;
  d_gram.setZero(observation_.model().columns(), observation_.model().columns());
  d_gram(observation_.columns(), observation_.columns()) = d_asked;
  return value;
}

double Objective::Penalties(const codegen::Signals& s, Adjoint& adjoint) const {
  double sum = 0;
  for (int j = 0; j < unit_.cols(); ++j) {
    const codegen::Joint& joint = observation_.model().robot().joint[j];
    const auto [low, high] = joint.position_limit_rad;
    for (Eigen::Index k = 0; k < s.q.rows(); ++k) {
      sum += Excess(s.q(k, j), (low + high) / 2, (high - low) / 2, limits_.share, adjoint.q(k, j));
      sum += Excess(s.qd(k, j), 0, joint.speed_limit_radps, limits_.share, adjoint.qd(k, j));
      sum += Excess(s.qdd(k, j), 0, joint.acceleration_limit_radps2, limits_.share, adjoint.qdd(k, j));
    }
  }
  return sum;
}

double Objective::TorquePenalty(Eigen::MatrixXd& d_torque) const {
  double sum = 0;
  if (!observation_.model().robot().has_prior) return sum;
  for (int i = 0; i < unit_.cols(); ++i) {
    const Eigen::VectorXd torque = row_[i].topRows(shape_.samples) * observation_.mean();
    for (Eigen::Index k = 0; k < torque.size(); ++k)
      sum += Excess(torque[k], 0, observation_.model().robot().joint[i].torque_limit_Nm, limits_.share, d_torque(k, i));
  }
  return sum;
}

// Adds to d_coefficient. The penalty of all looks weighs as much as that of the samples, if all are alike.
double Objective::ClearancePenalty(const Eigen::MatrixXd& coefficient, Eigen::MatrixXd& d_coefficient) const {
  if (!limits_.clearance) return 0;
  const double weight = kPenalty * shape_.samples / static_cast<double>(fine_.rows());
  const Eigen::MatrixXd q = fine_ * coefficient;
  Eigen::MatrixXd d_q = Eigen::MatrixXd::Zero(q.rows(), q.cols());
  const double sum = weight * limits_.clearance->Penalty(q, weight, d_q);
  d_coefficient += fine_.transpose() * d_q;
  return sum;
}

// How far state variable 0..3n-1 (q, qd, qdd of each joint) is moved for its difference quotient.
double Objective::Shift(int variable) const {
  const int n = static_cast<int>(unit_.cols());
  const codegen::Joint& joint = observation_.model().robot().joint[variable % n];
  const double limit = variable < n       ? joint.position_limit_rad[1] - joint.position_limit_rad[0]
                       : variable < 2 * n ? joint.speed_limit_radps
                                          : joint.acceleration_limit_radps2;
  return kRelativeShift * limit;
}

// The motion, and below it once more with each state variable shifted: 1 + 3n blocks of `samples` rows.
void Objective::Perturb(const codegen::Signals& s) {
  const int n = static_cast<int>(unit_.cols()), blocks = 1 + 3 * n;
  perturbed_.t = s.t.replicate(blocks, 1);
  perturbed_.q = s.q.replicate(blocks, 1);
  perturbed_.qd = s.qd.replicate(blocks, 1);
  perturbed_.qdd = s.qdd.replicate(blocks, 1);
  for (int v = 0; v < 3 * n; ++v) {
    Eigen::MatrixXd& part = v < n ? perturbed_.q : v < 2 * n ? perturbed_.qd : perturbed_.qdd;
    part.col(v % n).segment((v + 1) * shape_.samples, shape_.samples).array() += Shift(v);
  }
}

double Objective::operator()(const Eigen::VectorXd& u, Eigen::VectorXd& gradient) {
  const int n = static_cast<int>(unit_.cols()), samples = shape_.samples;
  const codegen::Signals s = Motion(u);
  Perturb(s);
  observation_.Rows(perturbed_, row_);

  Eigen::MatrixXd d_gram, d_torque = Eigen::MatrixXd::Zero(samples, n);
  Adjoint adjoint{d_torque, d_torque, d_torque};
  const double figure = SmoothFigure(d_gram);
  if (!std::isfinite(figure)) return figure;
  Eigen::MatrixXd d_coefficient = Eigen::MatrixXd::Zero(unit_.rows(), unit_.cols());
  const double value =
      figure + Penalties(s, adjoint) + TorquePenalty(d_torque) + ClearancePenalty(Series(u).coefficient, d_coefficient);

  // A state variable changes the rows of its own sample only. So the derivative is that of the value by the rows, times
  // the difference quotient of the rows.
  for (int i = 0; i < n; ++i) {
    const auto here = row_[i].topRows(samples);
    const Eigen::MatrixXd d_row =
        2 * observation_.weight(i) * here * d_gram + d_torque.col(i) * observation_.mean().transpose();
    for (int v = 0; v < 3 * n; ++v) {
      Eigen::MatrixXd& part = v < n ? adjoint.q : v < 2 * n ? adjoint.qd : adjoint.qdd;
      const auto shifted = row_[i].middleRows((v + 1) * samples, samples);
      Eigen::VectorXd change = Eigen::VectorXd::Zero(samples);
      for (Eigen::Index c = 0; c < d_row.cols(); ++c)  // by columns, as they lie in memory
        change += (shifted.col(c) - here.col(c)).cwiseProduct(d_row.col(c));
      part.col(v % n) += change / Shift(v);
    }
  }
  d_coefficient +=
      basis_[0].transpose() * adjoint.q + basis_[1].transpose() * adjoint.qd + basis_[2].transpose() * adjoint.qdd;
  const Eigen::MatrixXd d_u = unit_.cwiseProduct(d_coefficient);
  gradient = Eigen::Map<const Eigen::VectorXd>(d_u.data(), d_u.size());
  return value;
}

double Objective::operator()(const Eigen::VectorXd& u) {
  const codegen::Signals s = Motion(u);
  observation_.Rows(s, row_);
  Eigen::MatrixXd d_gram, d_torque = Eigen::MatrixXd::Zero(shape_.samples, unit_.cols());
  Adjoint adjoint{d_torque, d_torque, d_torque};
  const double figure = SmoothFigure(d_gram);
  if (!std::isfinite(figure)) return figure;
  Eigen::MatrixXd d_coefficient = Eigen::MatrixXd::Zero(unit_.rows(), unit_.cols());
  return figure + Penalties(s, adjoint) + TorquePenalty(d_torque) +
         ClearancePenalty(Series(u).coefficient, d_coefficient);
}

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kRange = 2;  // of the genes, in units of u: beyond it some limit is passed
constexpr int kTries = 50;    // starts without a series within the limits before it gives up, when time is up

Eigen::VectorXd RandomStart(int size, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  return Eigen::VectorXd::NullaryExpr(size, [&] { return unit(random); });
}

// Start k of a search: neighbouring seeds and numbers give unrelated generators.
std::uint64_t StartSeed(std::uint64_t seed, int start) {
  std::seed_seq mix{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                    static_cast<std::uint32_t>(start)};
  std::uint32_t word[2];
  mix.generate(word, word + 2);
  return (static_cast<std::uint64_t>(word[1]) << 32) | word[0];
}

// The best series so far. Of equal ones the earlier start wins, so that the order of threads does not matter.
class Best {
 public:
  Best() { found_.figure = std::numeric_limits<double>::infinity(); }

  void Offer(const Series& series, double figure, int start, const OptimiseSettings& settings) {
    const std::lock_guard lock(mutex_);
    ++found_.starts;
    if (figure < found_.figure || (figure == found_.figure && start < start_))
      found_.series = series, found_.figure = figure, start_ = start;
    if (settings.progress) settings.progress(found_.starts, found_.figure);
  }
  bool empty() {
    const std::lock_guard lock(mutex_);
    return !std::isfinite(found_.figure);
  }
  const Optimum& found() const { return found_; }  // when the threads are done

 private:
  std::mutex mutex_;
  Optimum found_;
  int start_ = 0;
};

// The unknowns that one search ends with.
Eigen::VectorXd SearchFrom(Objective& objective, Search search, std::uint64_t seed, const std::function<bool()>& stop) {
  if (search == Search::kGradient) {
    Eigen::VectorXd u = RandomStart(objective.size(), seed);
    search::MinimiseSettings local;
    local.stop = stop;
    search::Minimise([&](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) { return objective(x, gradient); }, local,
                     u);
    return u;
  }
  const auto scaled = [](const Eigen::VectorXd& x) -> Eigen::VectorXd { return kRange * (2 * x.array() - 1); };
  search::GeneticSettings genetic;
  genetic.individuals = 60;
  genetic.seed = seed;
  genetic.stop = stop;
  return scaled(
      search::MinimiseGenetic([&](const Eigen::VectorXd& x) { return objective(scaled(x)); }, objective.size(), genetic)
          .x);
}

}  // namespace

Eigen::MatrixXd PeriodGram(const Observation& observation, const Series& series) {
  return observation.Gram(series.At(
      Eigen::VectorXd::LinSpaced(kPeriodSamples, 0, series.period_s * (kPeriodSamples - 1) / kPeriodSamples)));
}

double PeriodCondition(const Observation& observation, const Series& series) {
  return Figure({}, PeriodGram(observation, series));
}

bool RandomSeries(const Observation& observation, const OptimiseSettings& settings, std::uint64_t seed,
                  Series& series) {
  const Limits limits(1 - settings.margin, settings.clearance);
  Objective objective(observation, settings.criterion, settings.shape, limits);
  series = objective.Series(RandomStart(objective.size(), seed));
  return ScaleToLimits(observation, limits, series);
}

Optimum Optimise(const Observation& observation, const OptimiseSettings& settings) {
  const auto begin = Clock::now(),
             end = begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(settings.seconds));
  const auto stop = [&] {
    const auto now = Clock::now();
    if (now < end) io::SetDone((now - begin) / std::chrono::duration<double>(settings.seconds));
    return now >= end || (settings.stop && *settings.stop);
  };
  Best best;
  std::atomic<int> next{0};

  search::InParallel(settings.threads, settings.threads, [&](int) {
    const Limits limits(1 - settings.margin, settings.clearance);
    Objective objective(observation, settings.criterion, settings.shape, limits);
    // When time is up, starts are still scaled to the limits until one keeps them, so there is always an answer.
    for (int start; (start = next++) < settings.starts && (!stop() || (start < kTries && best.empty()));) {
      io::SetDone(start / static_cast<double>(settings.starts));
      Series series = objective.Series(SearchFrom(objective, settings.search, StartSeed(settings.seed, start), stop));
      if (ScaleToLimits(observation, limits, series))
        best.Offer(series, Figure(settings.criterion, PeriodGram(observation, series)), start, settings);
    }
  });
  if (best.empty())
    throw io::InputError(
        observation.model().robot().path +
        ": no motion within the joints' limits that shows every parameter was found; expected limits that allow one" +
        (settings.clearance ? ", room in the cell, or more time for the search (--search-seconds)" : ""));
  return best.found();
}

}  // namespace armcal::excitation
