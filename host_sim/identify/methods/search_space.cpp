// methods - ranges and physical bodies; knows no objective.
#include "host_sim/identify/methods/search_space.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/linearised.hpp"

namespace armcal::calibration {

using Eigen::Matrix4d;
using Eigen::VectorXd;

namespace {

constexpr int kHalvings = 20;  // of the way back to the start: to a millionth of it

}  // namespace

SearchSpace::SearchSpace(const Problem& problem, const char* method) : model_(*problem.model), start_(problem.start) {
  std::vector<double> lower, upper;
  for (const int c : FreeCoordinates(problem)) {
    const double range = problem.upper[c] - problem.lower[c];
    if (!std::isfinite(range))
      throw io::InputError(
          std::string(method) + ": expected a range for every parameter; " +
          (c < model_.columns() ? model_.column_name(c) : model_.unknowns()[c - model_.columns()].name) + " of " +
          model_.robot().name + " has none");
    if (range <= 0) continue;
    free_.push_back(c), lower.push_back(problem.lower[c]), upper.push_back(problem.upper[c]);
  }
  lower_ = Eigen::Map<const VectorXd>(lower.data(), static_cast<Eigen::Index>(lower.size()));
  upper_ = Eigen::Map<const VectorXd>(upper.data(), static_cast<Eigen::Index>(upper.size()));
  width_ = upper_ - lower_;
  // ReadOutBodies is affine: its value at zero, and the rest column by column.
  offset_ = ReadOutBodies(model_, VectorXd::Zero(model_.rigid()));
  map_.resize(offset_.size(), model_.rigid());
  for (int k = 0; k < model_.rigid(); ++k)
    map_.col(k) = ReadOutBodies(model_, VectorXd::Unit(model_.rigid(), k)) - offset_;
  if (!model_.robot().has_prior) return;
  const VectorXd bodies = Bodies(start_);
  for (int j = 0; j < model_.joints(); ++j)
    if (!IsPhysical(bodies.segment(11 * j, 11)))
      throw io::InputError(std::string(method) + ": link " + std::to_string(j + 1) + " of " + model_.robot().name +
                           " before any data: expected a body that can exist");
  VectorXd ignored;
  start_log_det_ = -Barrier(start_, ignored);
}

VectorXd SearchSpace::Point(const VectorXd& u) const {
  VectorXd z = start_;
  for (int i = 0; i < size(); ++i) z[free_[i]] = std::min(lower_[i] + width_[i] * u[i], upper_[i]);
  return z;
}

VectorXd SearchSpace::Place(const VectorXd& z) const {
  VectorXd u(size());
  for (int i = 0; i < size(); ++i) u[i] = (z[free_[i]] - lower_[i]) / width_[i];
  return u;
}

VectorXd SearchSpace::Gradient(const VectorXd& dz) const {
  VectorXd du(size());
  for (int i = 0; i < size(); ++i) du[i] = width_[i] * dz[free_[i]];
  return du;
}

VectorXd SearchSpace::Bodies(const VectorXd& z) const {
  return offset_ + map_ * z.segment(model_.front(), model_.rigid());
}

VectorXd SearchSpace::Possible(const VectorXd& z) const {
  if (!model_.robot().has_prior) return z;
  const VectorXd there = Bodies(z);
  if (IsPhysical(there)) return z;
  const VectorXd here = Bodies(start_);
  double share = 0, step = 0.5;  // of the way from the start
  for (int k = 0; k < kHalvings; ++k, step /= 2)
    if (IsPhysical(here + (share + step) * (there - here))) share += step;
  return start_ + share * (z - start_);
}

double SearchSpace::Barrier(const VectorXd& z, VectorXd& gradient) const {
  gradient.setZero(z.size());
  if (!model_.robot().has_prior) return 0;
  const VectorXd bodies = Bodies(z);
  VectorXd slope = VectorXd::Zero(bodies.size());
  double value = start_log_det_;
  for (int j = 0; j < model_.joints(); ++j) {
    const Matrix4d J = PseudoInertia(bodies.data() + 11 * j);
    const Eigen::LLT<Matrix4d> factor(J);
    if (factor.info() != Eigen::Success || bodies[11 * j + 10] < 0) return std::numeric_limits<double>::infinity();
    value -= 2 * Matrix4d(factor.matrixL()).diagonal().array().log().sum();
    const Matrix4d inverse = J.inverse();
    for (int k = 0; k < 10; ++k) {
      const VectorXd unit = VectorXd::Unit(10, k);
      slope[11 * j + k] = -inverse.cwiseProduct(PseudoInertia(unit.data())).sum();
    }
  }
  gradient.segment(model_.front(), model_.rigid()) = map_.transpose() * slope;
  return value;
}

std::string SearchSpace::AtEnds(const VectorXd& z) const {
  const VectorXd u = Place(z);
  const auto count = ((u.array() < 1e-6) || (u.array() > 1 - 1e-6)).count();
  return count ? std::to_string(count) + " of " + std::to_string(size()) + " at an end of their range" : "";
}

}  // namespace armcal::calibration
