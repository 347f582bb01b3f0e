// excitation - random starts and searches on threads; knows no file and no drive.
#include "host_sim/identify/excitation/optimise.hpp"

#include <chrono>
#include <cmath>
#include <mutex>
#include <random>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/excitation/peaks.hpp"
#include "host_sim/identify/search/genetic.hpp"
#include "host_sim/identify/search/minimise.hpp"
#include "host_sim/identify/search/parallel.hpp"

namespace armcal::excitation {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kRange = 2;  // of the genes, in units of u: beyond, some limit is passed
constexpr int kTries = 50;    // starts without a series within the limits, when time is up, before giving up

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

// The best series so far; equal ones in favour of the earlier start, so that threads do not decide.
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
  Objective objective(observation, settings.criterion, settings.shape, 1 - settings.margin);
  series = objective.Series(RandomStart(objective.size(), seed));
  return ScaleToLimits(observation, 1 - settings.margin, series);
}

Optimum Optimise(const Observation& observation, const OptimiseSettings& settings) {
  const auto end =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(settings.seconds));
  const auto stop = [&] { return Clock::now() >= end || (settings.stop && *settings.stop); };
  Best best;
  std::atomic<int> next{0};

  search::InParallel(settings.threads, settings.threads, [&](int) {
    Objective objective(observation, settings.criterion, settings.shape, 1 - settings.margin);
    // Out of time, starts are still scaled to the limits until one keeps them: there is an answer whatever the time.
    for (int start; (start = next++) < settings.starts && (!stop() || (start < kTries && best.empty()));) {
      Series series = objective.Series(SearchFrom(objective, settings.search, StartSeed(settings.seed, start), stop));
      if (ScaleToLimits(observation, 1 - settings.margin, series))
        best.Offer(series, Figure(settings.criterion, PeriodGram(observation, series)), start, settings);
    }
  });
  if (best.empty())
    throw io::InputError(
        observation.model().robot().path +
        ": no motion within the joints' limits that shows every parameter was found; expected limits that allow one");
  return best.found();
}

}  // namespace armcal::excitation
