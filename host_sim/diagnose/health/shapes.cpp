// health - fits shapes by weighted least squares, one after the other.
#include "host_sim/diagnose/health/shapes.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

namespace armcal::health {
namespace {

constexpr int kMostTerms = 3;
constexpr double kSigmas = 5;           // some hundred joints a day are asked
constexpr double kSmallestShare = 0.1;  // of the whole: below, a term only mends what the first one's form lacks
constexpr double kAsGood = 0.05;        // of the best gain: no cause has exactly a shape's form
constexpr double kIndependent = 1e-4;   // of a column's square must be left beside the terms chosen

// Columns and torque in units of their standard deviation; what was chosen is projected out as it is chosen.
class Regression {
 public:
  explicit Regression(const std::vector<Evidence>& evidence)
      : column_(evidence.size(), kShapes), torque_(evidence.size()) {
    for (Eigen::Index b = 0; b < torque_.size(); ++b) {
      const Evidence& e = evidence[static_cast<std::size_t>(b)];
      const double weight = 1 / std::sqrt(e.variance);
      torque_[b] = weight * e.torque_Nm;
      for (int k = 0; k < kShapes; ++k) column_(b, k) = weight * e.shape[static_cast<std::size_t>(k)];
    }
    whole_ = column_.colwise().squaredNorm();
  }

  bool Independent(int k) const { return whole_[k] > 0 && column_.col(k).squaredNorm() > kIndependent * whole_[k]; }
  double Gain(int k) const {
    if (!Independent(k)) return 0;
    const double along = column_.col(k).dot(torque_), square = column_.col(k).squaredNorm();
    const double most = ShapeOf(k).most;
    return most > 0 && std::abs(along) > most * square ? 0 : along * along / square;
  }
  void Choose(int k) {
    const Eigen::VectorXd direction = column_.col(k).normalized();
    torque_ -= direction * direction.dot(torque_);
    column_ -= direction * (direction.transpose() * column_);
  }
  double ChiSquared() const { return torque_.squaredNorm(); }

 private:
  Eigen::MatrixXd column_;
  Eigen::VectorXd torque_;
  Eigen::RowVectorXd whole_;
};

// chi^2 per degree of freedom that all shapes together leave, not below 1: what they leave is noise of a kind.
double NoiseFactor(Regression all, std::size_t bins) {
  int used = 0;
  for (int k = 0; k < kShapes; ++k)
    if (all.Independent(k)) all.Choose(k), ++used;
  const int freedom = static_cast<int>(bins) - used;
  return freedom > 0 ? std::max(1.0, all.ChiSquared() / freedom) : 1.0;
}

// Values and standard deviations of all chosen shapes together.
void Fit(const std::vector<Evidence>& evidence, double noise, std::vector<Term>& terms) {
  const auto count = static_cast<Eigen::Index>(terms.size());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(count), x(count), square = Eigen::VectorXd::Zero(count);
  double rows = 0;
  for (const Evidence& e : evidence) {
    for (Eigen::Index i = 0; i < count; ++i) x[i] = e.shape[terms[static_cast<std::size_t>(i)].shape];
    normal += x * x.transpose() / e.variance;
    right += x * (e.torque_Nm / e.variance);
    square += e.rows * x.cwiseAbs2();
    rows += e.rows;
  }
  const Eigen::MatrixXd covariance = noise * normal.inverse();
  const Eigen::VectorXd value = normal.ldlt().solve(right);
  for (Eigen::Index i = 0; i < count; ++i) {
    Term& t = terms[static_cast<std::size_t>(i)];
    t.value = value[i];
    t.sd = std::sqrt(covariance(i, i));
    t.rms_Nm = std::abs(value[i]) * std::sqrt(square[i] / rows);
  }
}

}  // namespace

const Shape& ShapeOf(int index) {
  constexpr double kRatio = 0.3;  // three prior deviations of the records: no gain is off by more, no gear loses more
  static const Shape shapes[kShapes] = {{"torque offset", "torque_offset", "To", "N*m", 0},
                                        {"Coulomb friction", "coulomb_viscous", "Fc", "N*m", 0},
                                        {"viscous friction", "coulomb_viscous", "Fv", "N*m*s/rad", 0},
                                        {"torque gain", "torque_gain_error", "g", "1", kRatio},
                                        {"load-dependent friction", "load_friction", "mu", "1", kRatio},
                                        {"torque by position", "position_torque", "slope", "N*m/rad", 0},
                                        {"Coulomb friction by temperature", "temp_coulomb", "slope", "N*m/K", 0},
                                        {"viscous friction by temperature", "temp_viscous", "slope", "N*m*s/rad/K", 0}};
  return shapes[index];
}

Explanation Explain(const std::vector<Evidence>& evidence, double smallest_Nm) {
  Explanation found;
  Regression left(evidence);
  const double all = left.ChiSquared(), noise = NoiseFactor(left, evidence.size());
  while (all > 0 && found.terms.size() < kMostTerms) {
    ShapeMeans gain{};
    for (int k = 0; k < kShapes; ++k) gain[static_cast<std::size_t>(k)] = left.Gain(k);
    const auto best = std::max_element(gain.begin(), gain.end());
    const double significant = kSigmas * kSigmas * noise;
    if (*best < std::max(significant, kSmallestShare * all)) break;
    Term term;
    term.shape = static_cast<int>(best - gain.begin());
    for (int k = 0; k < kShapes; ++k)
      if (k != term.shape && gain[static_cast<std::size_t>(k)] > *best - std::max(significant, kAsGood * *best))
        term.also.push_back(k);
    std::vector<Term> with = found.terms;
    with.push_back(term);
    Fit(evidence, noise, with);
    if (with.back().rms_Nm < smallest_Nm) break;
    found.terms = with;
    left.Choose(term.shape);
    found.share = 1 - left.ChiSquared() / all;
  }
  return found;
}

}  // namespace armcal::health
