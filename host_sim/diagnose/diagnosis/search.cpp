// diagnosis - searches a grid of nonlinear parameters, and does what every search needs.
#include "host_sim/diagnose/diagnosis/search.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_sim/diagnose/diagnosis/diagnose.hpp"
#include "host_sim/diagnose/diagnosis/searcher.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
constexpr int kSweeps = 4;                              // of a pattern search at one step size
constexpr double kWorthAStep = 0.3;                     // of chi^2: less is below what noise moves it by
constexpr int kOnAGrid = 3;                             // unknowns at most; further ones start at their initial value
constexpr std::size_t kStarts = 2, kStartsOffGrid = 6;  // that climb; more where not every unknown is on the grid
constexpr int kClimbs = 12;                             // along a valley, at most
constexpr double kLongest = 0.2, kSlopeStep = 1e-3;     // of an unknown's range
}  // namespace

Searcher::Searcher(Candidate& candidate, const Ground& ground, const Found* simpler)
    : c_(candidate), simpler_(simpler), g_(ground), e_(ground.evidence) {
  best_.candidate = &candidate;
  best_.eta = candidate.Initial();
}

Found Searcher::Run() {
  const codegen::SearchWay how = c_.record().search.how;
  best_.rough = how != codegen::SearchWay::kSpectral &&
                how != codegen::SearchWay::kWindow;  // these look for what is over within an averaged row
  if (how == codegen::SearchWay::kSpectral) Spectral();
  else if (how == codegen::SearchWay::kSpline) Spline();
  else if (how == codegen::SearchWay::kOnset) Onset();
  else if (how == codegen::SearchWay::kWindow) Windows();
  else if (c_.unknowns().empty()) Consider(best_.eta);
  else Profile();
  return Scored();
}

Found Searcher::Finish(const Found& rough) {
  if (!rough.rough) return rough;
  best_ = rough;
  best_.rough = false, best_.gain = Gain{};
  Consider(rough.eta);
  if (c_.record().search.how == codegen::SearchWay::kProfile && !c_.unknowns().empty() && Promising())
    RefineBest(GridStep() / 16, 1);
  return Scored();
}

Found Searcher::Scored() const {
  Found f = best_;
  f.penalty = PenaltyOf(f.gain.rank + f.searched, c_, e_);
  if (f.gain.gain > 0 && c_.record().search.how == codegen::SearchWay::kSpline) {
    const int rows = c_.is_surface() ? static_cast<int>(c_.record().linear.size()) : 1;
    f.curve = std::make_shared<CurveOdds>(metric().OddsOf(seen_, static_cast<int>(seen_.g.size()) / rows));
  }
  Rate(f, f.gain.gain);
  return f;
}

double Searcher::Consider(const std::vector<double>& eta) {
  Projection projection = metric().Project(Gather(eta));
  const Gain g = Value(projection);
  if (g.gain > best_.gain.gain) best_.gain = g, best_.eta = eta, seen_ = std::move(projection);
  return g.gain;
}

Gain Searcher::Value(const Projection& projection) const {
  Gain g = metric().Try(projection);
  if (g.amplitude.size() == 1 && c_.column(0).fixed_amplitude) HoldAmplitude(g);
  const bool rival = !c_.record().replaces.empty();
  if (!AmplitudesInBounds(g) || (rival && !metric().InBounds(g, c_.rows()))) g.gain = 0;
  if (best_.rough) g.gain /= g_.thinned.share();
  return g;
}

bool Searcher::AmplitudesInBounds(const Gain& gain) const {
  for (int c = 0; c < gain.amplitude.size(); ++c) {
    const auto& column = c_.column(c);
    const double slack = 2 * gain.sd[c];  // a bound may be touched within the estimate's own uncertainty
    if (gain.amplitude[c] < column.lower - slack || gain.amplitude[c] > column.upper + slack) return false;
  }
  return true;
}

double Searcher::Needed(int rank) const {
  Found f = best_;
  f.gain.rank = rank;
  f.penalty = PenaltyOf(rank + best_.searched, c_, e_);
  return GainOfChance(f, kLogLikely);
}

void Searcher::HoldAmplitude(Gain& g) const {
  if (g.rank == 0) return;
  const double off = (c_.column(0).amplitude - g.amplitude[0]) / g.sd[0];
  g.gain -= off * off;
  g.rank = 0;
}

double Searcher::FromUnit(int k, double u) const {
  const auto& p = c_.unknowns()[k % c_.unknowns().size()];
  return p.logarithmic ? p.lower * std::pow(p.upper / p.lower, u) : p.lower + u * (p.upper - p.lower);
}

double Searcher::ToUnit(int k, double v) const {
  const auto& p = c_.unknowns()[k % c_.unknowns().size()];
  return p.logarithmic ? std::log(v / p.lower) / std::log(p.upper / p.lower) : (v - p.lower) / (p.upper - p.lower);
}

std::vector<double> Searcher::Refine(std::vector<double> eta, double step, int rounds,
                                     const Evaluator& evaluate) const {
  double value = evaluate(eta);
  for (int round = 0; round < rounds; ++round, step /= 2)
    for (int sweep = 0, better = 1; better && sweep < kSweeps; ++sweep) {
      better = 0;
      for (std::size_t k = 0; k < eta.size(); ++k)
        for (const double sign : {-1.0, 1.0}) {
          std::vector<double> next = eta;
          const double u = ToUnit(static_cast<int>(k), eta[k]) + sign * step;
          if (u < 0 || u > 1) continue;
          next[k] = FromUnit(static_cast<int>(k), u);
          if (const double v = evaluate(next); v > value + kWorthAStep) value = v, eta = next, better = 1;
        }
    }
  return eta;
}

void Searcher::RefineBest(double step, int rounds) {
  Refine(best_.eta, step, rounds, [this](const auto& eta) { return Consider(eta); });
}

std::vector<double> Searcher::Climb(std::vector<double> eta) const {
  const int count = static_cast<int>(eta.size());
  const auto moved = [&](int k, double by) {
    std::vector<double> next = eta;
    next[k] = FromUnit(k, std::clamp(ToUnit(k, eta[k]) + std::clamp(by, -kLongest, kLongest), 0.0, 1.0));
    return next;
  };
  Gain here = Try(eta);
  for (int climb = 0, better = 1; better && here.amplitude.size() && climb < kClimbs; ++climb) {
    Columns all = Gather(eta);
    const int own = all.count();
    for (MatrixXd& block : all.block) block.conservativeResize(Eigen::NoChange, own + count);
    for (int k = 0; k < count; ++k) {
      const std::vector<double> up = moved(k, kSlopeStep), down = moved(k, -kSlopeStep);
      const Columns above = Gather(up), below = Gather(down);
      const double apart = ToUnit(k, up[k]) - ToUnit(k, down[k]);
      for (std::size_t r = 0; r < all.block.size(); ++r)
        all.block[r].col(own + k) = (above.block[r] - below.block[r]) * here.amplitude / apart;
    }
    const VectorXd to = metric().Try(all).amplitude.tail(count);
    better = 0;
    for (double share = 1; share > 0.01 && !better; share /= 4) {
      std::vector<double> next = eta;
      for (int k = 0; k < count; ++k) next[k] = moved(k, share * to[k])[k];
      const Gain there = Try(next);
      if (there.gain > here.gain + kWorthAStep) eta = next, here = there, better = 1;
    }
  }
  return eta;
}

// A coarse grid; its best points climb.
void Searcher::Profile() {
  const int count = static_cast<int>(c_.unknowns().size());
  std::vector<int> points(count, 4);
  points[0] = c_.record().search.grid;
  for (int k = kOnAGrid; k < count; ++k) points[k] = 1;
  best_.searched = count;
  best_.tried = 1;
  for (const int p : points) best_.tried *= p;
  std::vector<std::pair<double, std::vector<double>>> tried;
  std::vector<double> eta(count);
  std::vector<char> known(count, 0);
  for (std::size_t k = 0; simpler_ && k < simpler_->eta.size(); ++k)
    for (int own = 0; own < count; ++own)
      if (c_.unknowns()[own].key == simpler_->candidate->unknowns()[k].key)
        eta[own] = std::clamp(simpler_->eta[k], FromUnit(own, 0), FromUnit(own, 1)), known[own] = 1;
  const std::function<void(int)> visit = [&](int k) {
    if (k == count) return void(tried.emplace_back(Try(eta).gain, eta));
    if (known[k]) return visit(k + 1);
    for (int i = 0; i < points[k]; ++i) {
      eta[k] = points[k] > 1 ? FromUnit(k, static_cast<double>(i) / (points[k] - 1)) : c_.unknowns()[k].initial;
      visit(k + 1);
    }
  };
  visit(0);
  std::sort(tried.rbegin(), tried.rend());
  const auto gain = [this](const auto& e) { return Try(e).gain; };
  // A delay gains nothing a little off the right place, far below a step of the grid: it must be looked for closer.
  Consider(Refine(tried[0].second, GridStep(), c_.delay() >= 0 ? 7 : 2, gain));
  if (!Promising()) return;
  Consider(Climb(best_.eta));
  const std::size_t starts = count > kOnAGrid ? kStartsOffGrid : kStarts;
  for (std::size_t k = 1; k < std::min(starts, tried.size()); ++k) Consider(Climb(tried[k].second));
}

double PenaltyOf(int parameters, const Candidate& candidate, const Evidence& evidence) {
  int rows = 0;
  for (const int j : candidate.rows()) rows += evidence.index[j].size();
  return parameters * std::log(std::max(2, rows));
}

double PriceOf(const Found& found, double gain) {
  if (found.curve) return gain - found.curve->Evidence(gain);
  const int parameters = found.gain.rank + found.searched;
  if (parameters == 0) return 0;
  return std::min(found.penalty, parameters * std::max(1.0, std::log(std::max(gain, 1e-300) / parameters)));
}

double Score(const Found& found, double gain) {
  return gain - PriceOf(found, gain) - 2 * std::log(found.tried) - found.candidate->record().generic_penalty;
}

namespace {
// The smallest gain that is enough.
template <class IsEnough>
double LeastGain(const IsEnough& enough) {
  double low = 0, high = 1;
  while (!enough(high)) low = high, high *= 2;
  for (int k = 0; k < 40; ++k) (enough(0.5 * (low + high)) ? high : low) = 0.5 * (low + high);
  return high;
}
}  // namespace

double GainOfScore(const Found& found) {
  return LeastGain([&](double gain) { return Score(found, gain) > 0; });
}

void Rate(Found& found, double gain) {
  found.rated = gain, found.score = Score(found, gain), found.log_chance = LogChance(found, gain);
  if (found.curve) (void)found.curve->Evidence(gain, &found.precision);
}

double LogUpperTail(int degrees, double x) {
  const double half = 0.5 * x;
  if (half <= 0) return 0;
  const bool odd = degrees % 2 != 0;
  double sum = 0;  // of the tail, times exp(half); far out erfc has no digits left
  if (odd) sum = half < 300 ? std::exp(half) * std::erfc(std::sqrt(half)) : 1 / std::sqrt(std::numbers::pi * half);
  for (int d = odd ? 3 : 2; d <= degrees; d += 2)
    sum += std::exp((0.5 * d - 1) * std::log(half) - std::lgamma(0.5 * d));
  return std::min(0.0, std::log(sum) - half);
}

double LogChance(const Found& found, double gain) {
  const double own = found.candidate->record().generic_penalty;
  if (found.curve) return -0.5 * (Score(found, gain) + own);
  // What was searched moves with the noise as an amplitude does.
  const int degrees = std::max(1, found.gain.rank + found.searched);
  return std::log(found.tried) + LogUpperTail(degrees, gain - own);
}

double GainOfChance(const Found& found, double log_chance) {
  return LeastGain([&](double gain) { return LogChance(found, gain) <= log_chance; });
}

Found SearchCandidate(Candidate& candidate, const Ground& ground, const Found* simpler) {
  return Searcher(candidate, ground, simpler).Run();
}

Found Finish(const Found& rough, const Ground& ground) {
  return Searcher(*rough.candidate, ground, nullptr).Finish(rough);
}

}  // namespace armcal::diagnosis
