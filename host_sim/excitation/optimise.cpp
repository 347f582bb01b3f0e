// excitation - random starts and local searches on threads; knows no file and no drive.
#include "host_sim/excitation/optimise.hpp"

#include <chrono>
#include <cmath>
#include <exception>
#include <mutex>
#include <random>
#include <thread>

#include "host_sim/excitation/minimise.hpp"
#include "host_sim/excitation/peaks.hpp"
#include "host_sim/io/input_error.hpp"

namespace armcal::excitation {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kTries = 50;  // starts without a series within the limits, when time is up, before giving up

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
  Best() { found_.condition = std::numeric_limits<double>::infinity(); }

  void Offer(const Fourier& series, double condition, int start, const OptimiseSettings& settings) {
    const std::lock_guard lock(mutex_);
    ++found_.starts;
    if (condition < found_.condition || (condition == found_.condition && start < start_))
      found_.series = series, found_.condition = condition, start_ = start;
    if (settings.progress) settings.progress(found_.starts, found_.condition);
  }
  bool empty() {
    const std::lock_guard lock(mutex_);
    return !std::isfinite(found_.condition);
  }
  const Optimum& found() const { return found_; }  // when the threads are done

 private:
  std::mutex mutex_;
  Optimum found_;
  int start_ = 0;
};

}  // namespace

double PeriodCondition(const Observation& observation, const Fourier& series) {
  constexpr int kSamples = 1000;
  const double period = series.period_s();
  return observation.ConditionNumber(
      series.At(Eigen::VectorXd::LinSpaced(kSamples, 0, period * (kSamples - 1) / kSamples)));
}

bool RandomSeries(const Observation& observation, const OptimiseSettings& settings, std::uint64_t seed,
                  Fourier& series) {
  Objective objective(observation, settings.shape, 1 - settings.margin);
  series = objective.Series(RandomStart(objective.size(), seed));
  return ScaleToLimits(observation, 1 - settings.margin, series);
}

Optimum Optimise(const Observation& observation, const OptimiseSettings& settings) {
  const auto end =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(settings.seconds));
  const auto stop = [&] { return Clock::now() >= end || (settings.stop && *settings.stop); };
  MinimiseSettings local;
  local.stop = stop;
  Best best;
  std::atomic<int> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;

  const auto search = [&] {
    try {
      Objective objective(observation, settings.shape, 1 - settings.margin);
      // Out of time, starts are still scaled to the limits until one keeps them: there is an answer whatever the time.
      for (int start; (start = next++) < settings.starts && (!stop() || (start < kTries && best.empty()));) {
        Eigen::VectorXd u = RandomStart(objective.size(), StartSeed(settings.seed, start));
        Minimise(std::ref(objective), local, u);
        Fourier series = objective.Series(u);
        if (ScaleToLimits(observation, 1 - settings.margin, series))
          best.Offer(series, PeriodCondition(observation, series), start, settings);
      }
    } catch (...) {
      const std::lock_guard lock(failure_mutex);
      failure = std::current_exception();
    }
  };
  std::vector<std::thread> helpers;
  for (int k = 1; k < settings.threads; ++k) helpers.emplace_back(search);
  search();
  for (std::thread& helper : helpers) helper.join();
  if (failure) std::rethrow_exception(failure);
  if (best.empty())
    throw io::InputError(
        observation.model().robot().path +
        ": no motion within the joints' limits that shows every parameter was found; expected limits that allow one");
  return best.found();
}

}  // namespace armcal::excitation
