// diagnosis - profile, spectral, spline and onset searches; each maximises the same gain.
#include "host_sim/diagnosis/search.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <unsupported/Eigen/FFT>

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// A signal of the candidate's joint j ("q") or of its other one ("q[k]") in the rows of joint j.
VectorXd OwnSignal(const Candidate& candidate, const Evidence& evidence, std::string name) {
  int j = candidate.joints().empty() ? candidate.rows()[0] : candidate.joints()[0];
  const RowIndex& index = evidence.index[j];
  if (name.ends_with("[k]")) {
    name.resize(name.size() - 3);
    j = candidate.joints().at(1);
  }
  VectorXd out(index.size());
  for (int k = 0; k < index.size(); ++k) {
    const Quantities& log = evidence.logs[index.dataset[k]];
    const auto& s = log.data->s;
    const int at = index.sample[k];
    out[k] = name == "t"      ? s.t[at]
             : name == "q"    ? s.q(at, j)
             : name == "qd"   ? s.qd(at, j)
             : name == "temp" ? (s.temp.cols() > j ? s.temp(at, j) : 0)
                              : log.parts.rigid(at, j);
  }
  return out;
}

bool InBounds(const Candidate& candidate, const Gain& gain) {
  for (int c = 0; c < candidate.columns(); ++c) {
    const auto& column = candidate.instance().columns[c];
    const double slack = 2 * gain.sd[c];  // a bound may be touched within the estimate's own uncertainty
    if (gain.amplitude[c] < column.lower - slack || gain.amplitude[c] > column.upper + slack) return false;
  }
  return true;
}

constexpr int kSweeps = 4;           // of a pattern search at one step size
constexpr double kWorthAStep = 0.3;  // of chi^2: less is below what noise moves it by

class Searcher {
 public:
  Searcher(Candidate& candidate, const Ground& ground) : c_(candidate), g_(ground), e_(ground.evidence) {
    best_.candidate = &candidate;
    best_.eta = candidate.Initial();
    best_.parameters = candidate.columns() + static_cast<int>(candidate.unknowns().size());
  }

  Found Run() {
    const std::string& how = c_.record().search.how;
    if (how == "spectral") Spectral();
    else if (how == "spline") Spline();
    else if (how == "onset") Onset();
    else if (c_.unknowns().empty()) Consider(best_.eta);
    else Profile();
    best_.parameters = best_.gain.rank + searched_;
    best_.score = Score(best_, best_.gain.gain, e_);
    return best_;
  }

 private:
  double Consider(const std::vector<double>& eta) {
    const Gain g = Value(g_.metric, GatherColumns(c_, e_, eta));
    if (g.gain > best_.gain.gain) best_.gain = g, best_.eta = eta;
    return g.gain;
  }
  double ConsiderThinned(const std::vector<double>& eta) const {
    return Value(g_.thin_metric, g_.thinned.Gather(c_, eta)).gain;
  }
  // Amplitudes held, or out of bounds, are counted. A law that could take the declared one's place may stand beside it,
  // as two frictions in one joint do, but not against it.
  Gain Value(const Metric& metric, const Columns& columns) const {
    Gain g = metric.Try(columns);
    if (c_.columns() == 1 && c_.instance().columns[0].fixed_amplitude) HoldAmplitude(g);
    const bool rival = !c_.record().replaces.empty();
    if (!InBounds(c_, g) || (rival && !metric.InBounds(g, c_.rows()))) g.gain = 0;
    return g;
  }
  // Half of what a score above zero needs: what a refinement may still bring.
  bool Promising() const {
    Found f = best_;
    f.parameters = f.gain.rank + searched_;
    return f.gain.gain > -0.5 * Score(f, 0, e_);
  }
  // What the column gains at its record's own amplitude: the parabola about the best one.
  void HoldAmplitude(Gain& g) const {
    if (g.rank == 0) return;
    const double off = (c_.instance().columns[0].amplitude - g.amplitude[0]) / g.sd[0];
    g.gain -= off * off;
    g.rank = 0;
  }
  double FromUnit(int k, double u) const {
    const auto& p = c_.unknowns()[k];
    return p.logarithmic ? p.lower * std::pow(p.upper / p.lower, u) : p.lower + u * (p.upper - p.lower);
  }
  double ToUnit(int k, double v) const {
    const auto& p = c_.unknowns()[k];
    return p.logarithmic ? std::log(v / p.lower) / std::log(p.upper / p.lower) : (v - p.lower) / (p.upper - p.lower);
  }
  using Evaluator = std::function<double(const std::vector<double>&)>;
  // Pattern search in unit coordinates from eta: steps while that helps, then halves them. Returns where it ends.
  std::vector<double> Refine(std::vector<double> eta, double step, int rounds, const Evaluator& evaluate) const {
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
  void RefineBest(double step, int rounds) {
    Refine(best_.eta, step, rounds, [this](const auto& eta) { return Consider(eta); });
  }
  // A coarse grid on the thinned rows; its best points, one of them refined there, are tried on all rows.
  void Profile() {
    const int count = static_cast<int>(c_.unknowns().size());
    std::vector<int> points(count, 4);
    points[0] = c_.record().search.grid;
    searched_ = count;
    best_.tried = 1;
    for (const int p : points) best_.tried *= p;
    std::vector<std::pair<double, std::vector<double>>> tried;
    std::vector<double> eta(count);
    const std::function<void(int)> visit = [&](int k) {
      if (k == count) return void(tried.emplace_back(ConsiderThinned(eta), eta));
      for (int i = 0; i < points[k]; ++i) {
        eta[k] = FromUnit(k, points[k] > 1 ? static_cast<double>(i) / (points[k] - 1) : 0.5);
        visit(k + 1);
      }
    };
    visit(0);
    std::sort(tried.rbegin(), tried.rend());
    const double step = 0.5 / (points[0] - 1);
    Consider(Refine(tried[0].second, step, 2, [this](const auto& e) { return ConsiderThinned(e); }));
    for (std::size_t k = 0; k < 2 && k < tried.size(); ++k) Consider(tried[k].second);
    if (Promising()) RefineBest(step, 5);
  }
  // The record's first column at frequency zero is what multiplies the harmonic; one FFT of residual x that over the
  // signal scans all frequencies.
  void Spectral() {
    const VectorXd signal = OwnSignal(c_, e_, c_.record().search.signal);
    const double lo = signal.minCoeff(), range = signal.maxCoeff() - lo;
    searched_ = 1;
    if (range <= 0) return;
    const auto& k = c_.unknowns()[0];
    const Columns at_zero = GatherColumns(c_, e_, {1e-9});
    const VectorXd residual = g_.metric.RawResidual(at_zero.joints[0]);
    int size = 256;
    while (size < 8 * k.upper * range / (2 * std::numbers::pi)) size *= 2;  // four cells a period at the upper end
    constexpr int kPadding = 4;
    std::vector<double> grid(static_cast<std::size_t>(size) * kPadding, 0.0);
    for (int i = 0; i < signal.size(); ++i)
      grid[std::min(size - 1, static_cast<int>((signal[i] - lo) / range * size))] +=
          residual[i] * at_zero.block[0](i, 0);
    Eigen::FFT<double> fft;
    std::vector<std::complex<double>> spectrum;
    fft.fwd(spectrum, grid);
    const double step = 2 * std::numbers::pi / (range * kPadding);  // 1/rad per bin
    // Below two periods over the range a harmonic is a polynomial: other records' business.
    const double lowest = std::max(k.lower, 2 * 2 * std::numbers::pi / range);
    std::vector<std::pair<double, int>> peaks;
    const int bins = static_cast<int>(spectrum.size()) / 2;
    for (int b = 1; b + 1 < bins; ++b) {
      if (b * step < lowest || b * step > k.upper) continue;
      const double p = std::norm(spectrum[b]);
      if (p >= std::norm(spectrum[b - 1]) && p > std::norm(spectrum[b + 1])) peaks.emplace_back(p, b);
    }
    best_.tried = std::max(1, static_cast<int>((k.upper - lowest) * range / (2 * std::numbers::pi)));
    std::sort(peaks.rbegin(), peaks.rend());
    if (peaks.size() > static_cast<std::size_t>(c_.record().search.grid)) peaks.resize(c_.record().search.grid);
    for (const auto& [power, b] : peaks) {
      double centre = b * step, width = step, value = Consider({centre});
      if (!Promising()) continue;
      for (int round = 0; round < 6; ++round, width /= 2)
        for (const double sign : {-1.0, 1.0}) {
          const double next = Consider({centre + sign * width});
          if (next > value) value = next, centre += sign * width;
        }
    }
  }
  // Knots over the range that was seen; clamped outside, so that the term cannot extrapolate.
  void Spline() {
    const VectorXd signal = OwnSignal(c_, e_, c_.record().search.signal);
    if (signal.size() == 0 || signal.maxCoeff() - signal.minCoeff() <= 0) return;
    if (c_.record().search.signal == "t" && e_.logs.size() != 1) return;  // each run has a time of its own
    Consider({signal.minCoeff(), signal.maxCoeff()});
  }
  // Windows [on, off] on a grid of the log's time, not shorter than the record's minimum; then refined.
  void Onset() {
    const auto& t = e_.logs[0].data->s.t;
    const double begin = t[0], end = t[t.size() - 1], minimum = c_.record().search.minimum_s;
    if (e_.logs.size() != 1 || end - begin < 2 * minimum) return;  // times of several logs have no common origin
    for (auto& u : c_.unknowns()) u.lower = begin - 1, u.upper = end + 1;
    constexpr int kGrid = 12;
    searched_ = 2;
    best_.tried = kGrid * kGrid / 2;
    double most = 0;
    std::vector<double> window;
    for (int i = 0; i <= kGrid; ++i)
      for (int k = i + 1; k <= kGrid + 1; ++k) {
        const double on = begin - 1 + (end - begin + 1) * i / kGrid,
                     off = k > kGrid ? end + 1 : begin + (end - begin) * k / kGrid;
        if (off - on < minimum || (i == 0 && k > kGrid)) continue;  // on all the time is no step
        if (const double value = ConsiderThinned({on, off}); value > most) most = value, window = {on, off};
      }
    if (most > 0) Consider(window);
    if (Promising()) RefineBest(0.5 / kGrid, 6);
    if (best_.eta[1] - best_.eta[0] < minimum) best_.gain = Gain{};
  }

  Candidate& c_;
  const Ground& g_;
  const Evidence& e_;
  Found best_;
  int searched_ = 0;
};

}  // namespace

bool IsExcited(const Candidate& candidate, const Evidence& evidence) {
  const int j = candidate.joints().empty() ? candidate.rows().back() : candidate.joints()[0];
  const auto& joint = evidence.model->robot().joint[j];
  const int rows = evidence.index[j].size();
  if (rows < 200) return false;
  for (const std::string& need : candidate.record().needs) {
    if (need == "low_speed" || need == "high_speed") {
      const VectorXd v = OwnSignal(candidate, evidence, "qd").cwiseAbs();
      const double fastest = v.maxCoeff();
      if (need == "high_speed" && fastest < 0.1 * joint.speed_limit_radps) return false;
      if (need == "low_speed" && ((v.array() < 0.1 * fastest).count() < 30 || fastest < 5 * joint.v_min_radps))
        return false;
    } else if (need == "temp_span") {
      const VectorXd temp = OwnSignal(candidate, evidence, "temp");
      if (temp.maxCoeff() - temp.minCoeff() < 2) return false;
    } else if (need == "load_span") {
      const VectorXd load = OwnSignal(candidate, evidence, "tau_rigid").cwiseAbs();
      if (load.maxCoeff() - load.minCoeff() < 2 * joint.torque_noise_Nm) return false;
    }
  }
  return true;
}

double Score(const Found& found, double gain, const Evidence& evidence) {
  int rows = 0;
  for (const int j : found.candidate->rows()) rows += evidence.index[j].size();
  return gain - found.parameters * std::log(std::max(2, rows)) - 2 * std::log(found.tried) -
         found.candidate->record().generic_penalty;
}

Found SearchCandidate(Candidate& candidate, const Ground& ground) { return Searcher(candidate, ground).Run(); }

}  // namespace armcal::diagnosis
