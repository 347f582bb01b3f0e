// methods - walks from the minimum along one coordinate until the best fit of all others costs too much.
#include "host_sim/identify/methods/profile_interval.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include <Eigen/Cholesky>

#include "host_sim/identify/methods/row_inputs.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kTwoSided = 1.96;
constexpr double kRise = 0.5 * kTwoSided * kTwoSided;  // of chi^2 / 2 at the ends of a 95 % interval
constexpr double kNear = 1e-3;                         // of the cost, within which a minimum is found
constexpr int kTrials = 240;                           // of the other eta, for one value of a coordinate
constexpr double kFirstMove = 0.05;                    // of an eta's range
constexpr int kDoublings = 14;                         // of a walk's step, before a coordinate counts as unbounded
constexpr int kHalvingsOfEnd = 12;
constexpr double kEndShare = 0.01;       // of an end's distance, within which it is found
constexpr int kScanned[] = {32, 24, 8};  // values of each eta that a scan tries, where a joint has one, two, three
constexpr double kWorthALook = 40;       // of the cost above the least, up to which they are
constexpr double kSame = 1.5;            // cells of a scan: starts that are nearer are one
constexpr double kGain = 0.01;           // of the cost: a minimum that is lower by less is no better
constexpr double kApart = 0.02;          // of an eta's range: two minima that are nearer are one

// The lowest point that one simplex of Nelder and Mead reaches from `start`, inside the unit cube. trials: counts on.
template <class Cost>
std::pair<double, VectorXd> OneSimplex(const VectorXd& start, const Cost& cost, int& trials) {
  const Eigen::Index d = start.size();
  std::vector<std::pair<double, VectorXd>> corner;
  const auto add = [&](VectorXd at) {
    at = at.cwiseMax(0).cwiseMin(1);
    ++trials;
    return std::pair{cost(at), at};
  };
  corner.push_back(add(start));
  for (Eigen::Index i = 0; i < d; ++i) {
    VectorXd at = start;
    at[i] += at[i] + kFirstMove > 1 ? -kFirstMove : kFirstMove;
    corner.push_back(add(at));
  }
  const auto lower = [](const auto& a, const auto& b) { return a.first < b.first; };
  while (trials < kTrials) {
    std::sort(corner.begin(), corner.end(), lower);
    if (corner.back().first - corner.front().first < kNear) break;
    VectorXd middle = VectorXd::Zero(d);
    for (Eigen::Index i = 0; i < d; ++i) middle += corner[static_cast<std::size_t>(i)].second / static_cast<double>(d);
    const VectorXd away = middle - corner.back().second;
    auto moved = add(middle + away);
    if (moved.first < corner.front().first) {
      auto farther = add(middle + 2 * away);
      if (farther.first < moved.first) moved = farther;
    } else if (moved.first >= corner[corner.size() - 2].first) {
      moved = add(middle + (moved.first < corner.back().first ? 0.5 : -0.5) * away);
    }
    if (moved.first < corner.back().first) {
      corner.back() = moved;
      continue;
    }
    for (std::size_t i = 1; i < corner.size(); ++i) corner[i] = add(0.5 * (corner[i].second + corner.front().second));
  }
  return *std::min_element(corner.begin(), corner.end(), lower);
}

// The minimum of `cost` near `start`, inside the unit cube. In a narrow valley a simplex stops short of the minimum, so
// a new one starts where the last one stopped, until that gains nothing.
template <class Cost>
VectorXd SimplexMinimum(const VectorXd& start, const Cost& cost, double& least) {
  int trials = 0;
  auto [reached, best] = OneSimplex(start, cost, trials);
  for (double before = std::numeric_limits<double>::infinity(); before - reached > kNear && trials < kTrials;) {
    before = reached;
    const auto again = OneSimplex(best, cost, trials);
    if (again.first < reached) std::tie(reached, best) = again;
  }
  least = reached;
  return best;
}

// One group's part of the cost, the other joints' eta being fixed.
class GroupProfile {
 public:
  GroupProfile(const Projection& fit, const Projection::Whole& whole, std::size_t group, const VectorXd& z)
      : fit_(fit),
        whole_(whole),
        group_(group),
        z_(z),
        roots_(Roots()),
        tape_(fit.problem().model->graph(), roots_),
        inputs_(fit.problem(), whole.rows, whole.own[group]),
        columns_(static_cast<Eigen::Index>(whole.own[group].size()), static_cast<Eigen::Index>(Own().column.size())) {
    covered_ = std::all_of(roots_.begin(), roots_.end(), [&](codegen::Expr e) { return inputs_.Covers(e); });
    if (!covered_) return;
    least_ = Cost(z, -1, 0);
    minimum_.push_back(z);
    lowest_ = least_ - kGain, lowest_at_ = z;
    AddOtherMinima();
  }

  // z, or a better minimum with other eta of this group.
  const VectorXd& lowest() const { return lowest_at_; }

  // Whether the columns depend on the sample and on the unknowns alone.
  bool covered() const { return covered_; }

  // Ends of the interval of a coordinate; sd: its standard deviation at the minimum. Where other minima cost no more
  // than the ends, the interval holds theirs, too.
  Eigen::Vector2d Interval(int coordinate, double sd) {
    Eigen::Vector2d ends(INFINITY, -INFINITY);
    for (const VectorXd& minimum : minimum_) {
      ends[0] = std::min(ends[0], End(coordinate, sd, -1, minimum));
      ends[1] = std::max(ends[1], End(coordinate, sd, 1, minimum));
    }
    return ends;
  }

 private:
  const Projection::Group& Own() const { return fit_.groups()[group_]; }
  const Problem& problem() const { return fit_.problem(); }
  bool IsEta(int c) const { return c >= problem().model->columns(); }
  std::vector<codegen::Expr> Roots() const {
    std::vector<codegen::Expr> roots;
    for (const int c : Own().column) roots.push_back(problem().model->rows()[Own().joint][c]);
    return roots;
  }

  double Cost(const VectorXd& z, Projection::Solved& solved) {
    std::vector<double*> out;
    for (Eigen::Index k = 0; k < columns_.cols(); ++k) out.push_back(columns_.col(k).data());
    tape_.Evaluate(inputs_.At(z), static_cast<int>(columns_.rows()), out);
    return fit_.OfColumns(whole_, group_, columns_, z, &solved);
  }
  // The cost at z's eta. For a linear coordinate: with this coordinate at `value`; -1: at its best value.
  double Cost(const VectorXd& z, int linear, double value) {
    Projection::Solved solved;
    const double cost = Cost(z, solved);
    if (linear < 0) return cost;
    const VectorXd row = fit_.Whitened(linear).transpose();
    const double off = value - problem().start[linear] - row.dot(solved.w);
    return cost + 0.5 * off * off / row.dot(solved.H.llt().solve(row));
  }

  // The best value of a linear coordinate at z's eta.
  double Best(int linear, const VectorXd& z) {
    Projection::Solved solved;
    Cost(z, solved);
    return problem().start[linear] + fit_.Whitened(linear).dot(solved.w);
  }

  // Where an eta lies in its range, 0 to 1, and back.
  double Place(int c, double value) const {
    const double low = problem().lower[c], high = problem().upper[c];
    return fit_.logarithmic(c) ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
  }
  double Value(int c, double place) const {
    const double low = problem().lower[c], high = problem().upper[c];
    return fit_.logarithmic(c) ? low * std::pow(high / low, place) : low + place * (high - low);
  }

  VectorXd Places(const std::vector<int>& eta, const VectorXd& z) const {
    VectorXd place(static_cast<Eigen::Index>(eta.size()));
    for (std::size_t i = 0; i < eta.size(); ++i) place[static_cast<Eigen::Index>(i)] = Place(eta[i], z[eta[i]]);
    return place;
  }
  void Put(const std::vector<int>& eta, const VectorXd& place, VectorXd& z) const {
    for (std::size_t i = 0; i < eta.size(); ++i) z[eta[i]] = Value(eta[i], place[static_cast<Eigen::Index>(i)]);
  }

  // The least cost over some eta. z: where the search begins, and where it ended. For a linear coordinate: with this
  // coordinate at `value`.
  double Minimise(const std::vector<int>& eta, int linear, double value, VectorXd& z) {
    if (eta.empty()) return Cost(z, linear, value);
    VectorXd trial = z;
    double least = 0;
    const VectorXd best = SimplexMinimum(
        Places(eta, z), [&](const VectorXd& at) { return Put(eta, at, trial), Cost(trial, linear, value); }, least);
    Put(eta, best, z);
    return least;
  }

  // The least cost with the coordinate at `value`.
  double Least(int coordinate, double value, VectorXd& z) {
    std::vector<int> others;
    for (const int c : Own().eta)
      if (c != coordinate) others.push_back(c);
    if (IsEta(coordinate)) z[coordinate] = value;
    return Minimise(others, IsEta(coordinate) ? -1 : coordinate, value, z);
  }

  // Minima that cost no more than the ends of an interval, beside the least one, from a scan of the group's eta.
  void AddOtherMinima() {
    const std::vector<int>& eta = Own().eta;
    if (eta.size() > std::size(kScanned)) return;
    const int side = kScanned[eta.size() - 1];
    int points = 1;
    for (std::size_t i = 0; i < eta.size(); ++i) points *= side;
    std::vector<std::pair<double, VectorXd>> scan;
    VectorXd z = z_;
    for (int k = 0; k < points && !Stopped(problem()); ++k) {
      VectorXd place(static_cast<Eigen::Index>(eta.size()));
      for (int i = 0, left = k; i < place.size(); ++i, left /= side) place[i] = (left % side + 0.5) / side;
      Put(eta, place, z);
      scan.push_back({Cost(z, -1, 0), place});
    }
    // A point is a start if it costs less than both neighbours along some eta: valleys may be narrow and curved.
    std::vector<std::pair<double, VectorXd>> starts;
    for (int k = 0; k < points; ++k)
      for (int i = 0, stride = 1; i < static_cast<int>(eta.size()); ++i, stride *= side) {
        const auto cost = [&](int at) { return scan[static_cast<std::size_t>(at)].first; };
        const int v = k / stride % side;
        if (cost(k) > least_ + kWorthALook) continue;
        if ((v > 0 && cost(k - stride) < cost(k)) || (v + 1 < side && cost(k + stride) < cost(k))) continue;
        starts.push_back(scan[static_cast<std::size_t>(k)]);
        break;
      }
    std::sort(starts.begin(), starts.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<VectorXd> seen;
    for (const auto& [cost, place] : starts) {
      const auto near = [&, at = &place](const VectorXd& other) {
        return (other - *at).cwiseAbs().maxCoeff() < kSame / side;
      };
      if (Stopped(problem()) || std::any_of(seen.begin(), seen.end(), near)) continue;
      seen.push_back(place);
      Put(eta, place, z);
      const double reached = Minimise(eta, -1, 0, z);
      if (reached > least_ + kRise) continue;
      const VectorXd found = Places(eta, z);
      seen.push_back(found);
      if (std::none_of(minimum_.begin(), minimum_.end(), [&](const VectorXd& other) {
            return (Places(eta, other) - found).cwiseAbs().maxCoeff() < kApart;
          }))
        minimum_.push_back(z);
      if (reached < lowest_) lowest_ = reached, lowest_at_ = z;
    }
  }

  // How far the cost has risen, as a number of standard deviations of a normal distribution.
  double Rise(int coordinate, double value, VectorXd& z) {
    return std::sqrt(2 * std::max(0.0, Least(coordinate, value, z) - least_));
  }

  // z: a minimum, where the walk begins.
  double End(int coordinate, double sd, int side, VectorXd z) {
    const bool eta = IsEta(coordinate);
    if (!eta) z[coordinate] = Best(coordinate, z);
    const double here = z[coordinate], begin = eta ? Place(coordinate, here) : here;
    const auto value = [&](double at) { return eta ? Value(coordinate, at) : at; };
    // The first step is a standard deviation, in the coordinate that is walked.
    double step = sd;
    if (eta) step = std::abs(Place(coordinate, std::max(here + sd, problem().lower[coordinate])) - begin);
    if (eta) step = std::clamp(std::isfinite(step) ? step : 1, 0.001, 0.25);
    if (!(step > 0)) return here;
    double inside = begin, outside = begin, rise_inside = Rise(coordinate, here, z), rise_outside = rise_inside;
    for (int k = 0; k == 0 || rise_outside < kTwoSided; ++k, step *= 2) {
      if (k == kDoublings || (eta && k > 0 && (outside <= 0 || outside >= 1)) || Stopped(problem()))
        return side * std::numeric_limits<double>::infinity();
      inside = outside, rise_inside = rise_outside;
      outside = begin + side * step;
      if (eta) outside = std::clamp(outside, 0.0, 1.0);
      rise_outside = Rise(coordinate, value(outside), z);
    }
    for (int k = 0; k < kHalvingsOfEnd && std::abs(outside - inside) > kEndShare * std::abs(outside - begin); ++k) {
      double share = (kTwoSided - rise_inside) / (rise_outside - rise_inside);
      share = std::clamp(share, 0.1, 0.9);
      const double at = inside + share * (outside - inside), rise = Rise(coordinate, value(at), z);
      (rise < kTwoSided ? inside : outside) = at;
      (rise < kTwoSided ? rise_inside : rise_outside) = rise;
    }
    const double share = (kTwoSided - rise_inside) / std::max(rise_outside - rise_inside, 1e-12);
    return value(inside + share * (outside - inside));
  }

  const Projection& fit_;
  const Projection::Whole& whole_;
  std::size_t group_;
  VectorXd z_;
  std::vector<codegen::Expr> roots_;
  codegen::Tape tape_;
  RowInputs inputs_;
  MatrixXd columns_;
  std::vector<VectorXd> minimum_;  // the least one first
  double lowest_ = 0;
  VectorXd lowest_at_;
  bool covered_ = false;
  double least_ = 0;
};

// Linear coordinates that only this joint's rows read, rigid ones left out.
std::vector<int> LinearOf(const Problem& problem, int joint) {
  const codegen::Model& model = *problem.model;
  std::vector<int> out;
  for (const int c : FreeCoordinates(problem)) {
    if (c >= model.columns() || model.is_rigid(c)) continue;
    bool own = true;
    for (int j = 0; j < model.joints(); ++j) own = own && model.rows()[j][c].IsZero() == (j != joint);
    if (own) out.push_back(c);
  }
  return out;
}

}  // namespace

MatrixXd ProfileIntervals(const Projection& fit, const VectorXd& z, const MatrixXd& covariance, VectorXd& better) {
  better = z;
  const Problem& problem = fit.problem();
  const VectorXd sd = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  MatrixXd interval(z.size(), 2);
  interval << z - kTwoSided * sd, z + kTwoSided * sd;
  const Projection::Whole whole = fit.At(z);
  for (std::size_t g = 0; g < fit.groups().size(); ++g) {
    const Projection::Group& group = fit.groups()[g];
    if (group.joint < 0) continue;
    GroupProfile profile(fit, whole, g, z);
    if (!profile.covered()) continue;
    for (const int c : group.eta) better[c] = profile.lowest()[c];
    std::vector<int> coordinates = LinearOf(problem, group.joint);
    coordinates.insert(coordinates.end(), group.eta.begin(), group.eta.end());
    for (const int c : coordinates)
      if (!Stopped(problem) && better == z) interval.row(c) = profile.Interval(c, sd[c]);
  }
  return interval;
}

}  // namespace armcal::calibration
