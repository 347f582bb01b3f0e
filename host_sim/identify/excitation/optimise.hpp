// excitation - searches the series that a criterion rates best among those that keep the limits.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>

#include "host_sim/identify/excitation/criterion.hpp"
#include "host_sim/identify/excitation/observation.hpp"
#include "host_sim/identify/excitation/peaks.hpp"
#include "host_sim/identify/excitation/series.hpp"

namespace armcal::excitation {

struct SeriesShape {
  Family family = Family::kFourier;
  double period_s = 10;  // as in the survey
  int terms = 10;        // coefficients a joint beside its offset; kFourier: two a harmonic
  int samples = 80;      // of one period, at which K is evaluated; a model with exponentials needs 250 or more
};

// What a series is searched for: a criterion of K, and penalties on the limits, with gradient. The unknowns u are the
// series' coefficients, joint after joint, in units of what the joint's limits allow (order 1). The object keeps its
// working memory: one a thread.
class Objective {
 public:
  // The observation and the clearance must outlive the objective.
  Objective(const Observation& observation, const Criterion& criterion, const SeriesShape& shape, const Limits& limits);

  int size() const { return static_cast<int>(unit_.size()); }
  excitation::Series Series(const Eigen::VectorXd& u) const;

  // Logarithm of the criterion's figure, smoothed, plus quadratic penalties on position, speed, acceleration, torque,
  // and distance where the limits have a clearance.
  // Infinite if K is singular.
  double operator()(const Eigen::VectorXd& u, Eigen::VectorXd& gradient);
  double operator()(const Eigen::VectorXd& u);  // 3 n times cheaper

 private:
  struct Adjoint {
    Eigen::MatrixXd q, qd, qdd;  // d value / d state, [samples x joints]
  };
  codegen::Signals Motion(const Eigen::VectorXd& u) const;
  double SmoothFigure(Eigen::MatrixXd& d_gram) const;
  double Penalties(const codegen::Signals& s, Adjoint& adjoint) const;
  double TorquePenalty(Eigen::MatrixXd& d_torque) const;
  double ClearancePenalty(const Eigen::MatrixXd& coefficient, Eigen::MatrixXd& d_coefficient) const;
  void Perturb(const codegen::Signals& s);
  double Shift(int variable) const;

  const Observation& observation_;
  Criterion criterion_;
  SeriesShape shape_;
  Limits limits_;
  Eigen::VectorXd t_;
  Eigen::MatrixXd basis_[3];     // derivative 0, 1, 2
  Eigen::MatrixXd fine_;         // derivative 0 where distances are measured
  Eigen::MatrixXd unit_, zero_;  // coefficient = zero + unit * u, [terms + 1 x joints]
  codegen::Signals perturbed_;
  std::vector<Eigen::MatrixXd> row_;  // of the perturbed motion; the first `samples` rows belong to the motion itself
};

enum class Search {
  kGradient,  // local searches from random series
  kGenetic    // the survey's genetic algorithm, repeated
};

struct OptimiseSettings {
  SeriesShape shape;
  Criterion criterion;
  Search search = Search::kGradient;
  double margin = 0.05;                             // of every limit, kept free
  const collision::Clearance* clearance = nullptr;  // none: collisions are not checked
  double seconds = 20;                              // of wall clock
  int starts =
      std::numeric_limits<int>::max();  // random starts at most; given enough time, the seed decides the result
  int threads = 2;
  std::uint64_t seed = 1;
  const std::atomic<bool>* stop = nullptr;  // set: return the best so far
  // Called from any of the threads, one at a time, after each start.
  std::function<void(int starts_done, double best_figure)> progress;
};

struct Optimum {
  excitation::Series series;
  double figure = 0;  // the criterion's, of one period at kPeriodSamples
  int starts = 0;
};
inline constexpr int kPeriodSamples = 1000;

// The best of searches by `seed`. InputError: no series within the limits was found.
Optimum Optimise(const Observation& observation, const OptimiseSettings& settings);

// A random series within the limits (the searches' kind of start). False: not found within the limits for this seed.
bool RandomSeries(const Observation& observation, const OptimiseSettings& settings, std::uint64_t seed,
                  excitation::Series& series);

// G of one period on kPeriodSamples, and its cond(K).
Eigen::MatrixXd PeriodGram(const Observation& observation, const excitation::Series& series);
double PeriodCondition(const Observation& observation, const excitation::Series& series);

}  // namespace armcal::excitation
