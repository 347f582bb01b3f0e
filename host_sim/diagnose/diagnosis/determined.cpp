// diagnosis - compares a term's parameters with their deviations and with the ranges that its record gives them.
#include "host_sim/diagnose/diagnosis/determined.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

#include "host_sim/diagnose/diagnosis/work.hpp"

namespace armcal::diagnosis {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kSure = 3;     // deviations from zero, for a term that has nothing but an unknown
constexpr double kClear = 16;   // chi^2 of all amplitudes: such a torque is there, even if its parameters trade off
constexpr double kEdge = 1e-3;  // of a range: a search that ends at a bound stops this close to it

bool IsSearched(const Term& t) {
  const codegen::SearchWay how = t.record->search.how;
  return t.record->generic_penalty == 0 &&
         (how == codegen::SearchWay::kProfile || how == codegen::SearchWay::kSpectral);
}

// Its coefficients mean nothing one by one: neighbours stand for each other.
bool IsForm(const Term& t) {
  constexpr std::size_t kMany = 4;
  return t.record->generic_penalty > 0 || t.record->search.how == codegen::SearchWay::kSpline ||
         t.columns.size() > kMany;
}

// a' C^-1 a over the directions of C that are not rounding. Every sd is above zero.
double Significance(const VectorXd& a, const MatrixXd& C) {
  const VectorXd sd = C.diagonal().cwiseSqrt();
  const VectorXd scaled = a.cwiseQuotient(sd);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(
      MatrixXd(sd.cwiseInverse().asDiagonal() * C * sd.cwiseInverse().asDiagonal()));
  double sum = 0;
  for (Index k = 0; k < a.size(); ++k)
    if (const double value = eigen.eigenvalues()[k]; value > 1e-9)
      sum += std::pow(eigen.eigenvectors().col(k).dot(scaled), 2) / value;
  return sum;
}

// Of the amplitudes `seen` if the nonlinear parameters were known.
MatrixXd AmplitudeCovariance(const Term& t, std::vector<Index> seen) {
  std::vector<Index> searched;
  for (Index k = 0; k < static_cast<Index>(t.eta.size()); ++k)
    if (t.covariance(k, k) > 0) searched.push_back(k);
  for (Index& at : seen) at += static_cast<Index>(t.eta.size());
  const MatrixXd own = t.covariance(seen, seen);
  if (searched.empty()) return own;
  const MatrixXd across = t.covariance(searched, seen);
  MatrixXd of_searched = t.covariance(searched, searched);
  of_searched.diagonal() *= 1 + 1e-9;
  return own - across.transpose() * of_searched.ldlt().solve(across);
}

std::string MarkedValue(const std::string& name, double value, double sd, const std::string& unit, Mark mark) {
  const std::string with_sd = sd > 0 ? fmt::format("{:.3g} +- {:.2g}", value, sd) : fmt::format("{:.3g}", value);
  return fmt::format("{} = {} {} {}", name, with_sd, unit,
                     mark == Mark::kOnBound ? "is on its bound" : "is not determined");
}

}  // namespace

bool IsAtEdge(const codegen::EffectUnknown& u, double value) {
  if (u.logarithmic && u.lower > 0 && value > 0) {
    const double room = kEdge * std::log(u.upper / u.lower);
    return std::log(value / u.lower) < room || std::log(u.upper / value) < room;
  }
  const double room = kEdge * (u.upper - u.lower);
  return value < u.lower + room || value > u.upper - room;
}

Marks MarkParameters(const Term& t) {
  Marks out{std::vector<Mark>(t.eta.size(), Mark::kNone), std::vector<Mark>(t.columns.size(), Mark::kNone), true};
  int parameters = 0, marked = 0;
  // A delay has no amplitude. Its gain may be large where the noise has another colour than was taken; then its
  // deviation, which blocks of time tell, is large as well.
  const bool any_free =
      std::any_of(t.columns.begin(), t.columns.end(), [](const auto& c) { return !c.fixed_amplitude; });
  const double sure = any_free ? 1 : kSure;
  for (std::size_t k = 0; k < t.eta.size() && IsSearched(t); ++k) {
    const double sd = t.eta_sd[static_cast<Index>(k)];
    if (IsAtEdge(t.unknowns[k], t.eta[k])) out.eta[k] = Mark::kOnBound;
    else if (!(sd > 0) || !(std::abs(t.eta[k]) > sure * sd)) out.eta[k] = Mark::kUndetermined;
    ++parameters, marked += out.eta[k] != Mark::kNone;
  }
  std::vector<Index> seen;  // amplitudes of columns that the logs see at all
  for (std::size_t c = 0; c < t.columns.size(); ++c) {
    const codegen::EffectColumn& column = t.columns[c];
    if (column.fixed_amplitude) continue;
    const double value = t.amplitude[static_cast<Index>(c)], sd = t.sd[static_cast<Index>(c)];
    // What takes the place of the declared law is a change of it, which may have any sign.
    const bool beyond = t.record->replaces.empty() && (value < column.lower || value > column.upper);
    if (!(sd > 0) || !(std::abs(value) > sd)) out.amplitude[c] = Mark::kUndetermined;
    else if (beyond) out.amplitude[c] = Mark::kOnBound;
    ++parameters, marked += out.amplitude[c] != Mark::kNone;
    if (sd > 0) seen.push_back(static_cast<Index>(c));
    if (IsForm(t)) out.amplitude[c] = Mark::kNone;
  }
  // By chance alone chi^2 is about as large as there are amplitudes. Parameters that trade off against each other may
  // all be marked, although their torque is clearly there.
  const double chi2 = seen.empty() ? 0 : Significance(t.amplitude(seen), AmplitudeCovariance(t, seen));
  if (any_free) out.usable = chi2 > static_cast<double>(seen.size());
  const auto on_bound = [](const std::vector<Mark>& marks) {
    return std::find(marks.begin(), marks.end(), Mark::kOnBound) != marks.end();
  };
  const bool only_trade_off = chi2 > kClear && !on_bound(out.eta) && !on_bound(out.amplitude);
  out.usable = out.usable && (IsForm(t) || marked < parameters || only_trade_off);
  return out;
}

std::string MarkText(const Term& t) {
  const Marks marks = MarkParameters(t);
  std::string out;
  const auto add = [&](const std::string& text) { out += (out.empty() ? "" : "; ") + text; };
  for (std::size_t k = 0; k < t.eta.size(); ++k)
    if (marks.eta[k] != Mark::kNone)
      add(MarkedValue(t.unknowns[k].name, t.eta[k], t.eta_sd[static_cast<Index>(k)], t.unknowns[k].unit, marks.eta[k]));
  for (std::size_t c = 0; c < t.columns.size(); ++c)
    if (marks.amplitude[c] != Mark::kNone)
      add(MarkedValue(t.columns[c].name, t.amplitude[static_cast<Index>(c)], t.sd[static_cast<Index>(c)],
                      t.columns[c].unit, marks.amplitude[c]));
  return out;
}

void LeaveOutUndetermined(Diagnosis::Work& w, Finding& finding) {
  for (;;) {
    WriteTerms(w, finding);
    std::size_t k = w.chosen.size();  // sorted, the strongest first
    while (k > 0 && (!w.chosen[k - 1].confirmed || w.chosen[k - 1].candidate->is_event() ||
                     MarkParameters(finding.terms[k - 1]).usable))
      --k;
    if (k == 0) return;
    w.chosen[k - 1].confirmed = false;
    const std::string marked = MarkText(finding.terms[k - 1]);
    w.chosen[k - 1].unconfirmed =
        "the training logs do not determine it" + (marked.empty() ? std::string() : ": " + marked);
    w.Polish();
  }
}

}  // namespace armcal::diagnosis
