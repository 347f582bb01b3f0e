// methods - evaluates the objective of a search, and maps its coordinates to parameters that can exist.
#include "host_sim/identify/methods/search_problem.hpp"
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "codegen/src/generator/rigid_body.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::Matrix4d;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Objective::Objective(const Problem& problem, Criterion criterion)
    : model_(*problem.model), criterion_(criterion), linear_(model_.nonlinear() == 0) {
  if (!linear_ && (model_.states() > 0 || model_.depends_on_estimate()))
    throw io::InputError(model_.robot().name +
                         ": a search over nonlinear parameters: expected columns without memory that do not depend on "
                         "the estimate");
  const Rows rows = StackRows(problem, problem.start);
  for (int j = 0; j < model_.joints(); ++j) Prepare(problem, rows, j);
}

void Objective::Prepare(const Problem& problem, const Rows& rows, int j) {
  Joint joint;
  std::vector<Eigen::Index> index;
  for (std::size_t r = 0; r < rows.joint.size(); ++r)
    if (rows.joint[r] == j) index.push_back(static_cast<Eigen::Index>(r));
  if (index.empty()) return;
  for (int c = 0; c < model_.columns(); ++c)
    if (!model_.rows()[j][c].IsZero()) joint.column.push_back(c);
  const auto count = static_cast<Eigen::Index>(index.size());
  joint.K = rows.K(index, joint.column);
  joint.tau = rows.tau(index);
  joint.weight = VectorXd::Ones(count);
  joint.smoothing = criterion_ == Criterion::kMeanSpread ? 0.01 * problem.sigma_Nm[j] : 0;
  if (criterion_ == Criterion::kForgetting) {
    std::vector<int> begin = {0};
    for (const Dataset* log : problem.train) begin.push_back(begin.back() + log->samples());
    for (Eigen::Index r = 0; r < count; ++r)
      joint.weight[r] =
          std::pow(problem.forgetting, begin.back() - 1 - begin[rows.log[index[r]]] - rows.sample[index[r]]);
  }
  if (linear_) {
    Condense(joint);
    joint_.push_back(std::move(joint));
    return;
  }
  joint.inputs = std::make_unique<RowInputs>(problem, rows, index);
  std::vector<codegen::Expr> columns, slopes;
  for (std::size_t i = 0; i < joint.column.size(); ++i)
    if (Varies(model_, j, joint.column[i]))
      joint.varying.push_back(static_cast<int>(i)), columns.push_back(model_.rows()[j][joint.column[i]]);
  for (int k = 0; k < model_.nonlinear(); ++k)
    if (!model_.jacobian()[j][k].IsZero()) joint.slope.push_back(k), slopes.push_back(model_.jacobian()[j][k]);
  joint.slope_value.resize(count, static_cast<Eigen::Index>(joint.slope.size()));
  joint.column_tape = std::make_unique<codegen::Tape>(model_.graph(), columns);
  joint.slope_tape = std::make_unique<codegen::Tape>(model_.graph(), slopes);
  joint_.push_back(std::move(joint));
}

// [K tau] -> mean row and triangular factor.
void Objective::Condense(Joint& joint) const {
  const Eigen::Index width = joint.K.cols() + 1, count = joint.K.rows();
  MatrixXd A = MatrixXd::Zero(std::max(count, width), width);
  A.topRows(count) << joint.K, joint.tau;
  joint.mean = A.topRows(count).colwise().mean();
  if (criterion_ == Criterion::kMeanSpread) {
    A.topRows(count).rowwise() -= joint.mean;
    A /= std::sqrt(static_cast<double>(count));
  } else {
    A.topRows(count).array().colwise() *= joint.weight.array().sqrt();
  }
  joint.factor = Eigen::HouseholderQR<MatrixXd>(A).matrixQR().topRows(width).triangularView<Eigen::Upper>();
  joint.K.resize(0, 0), joint.tau.resize(0), joint.weight.resize(0);
}

// mean: of e_i. square: its variance for (25), else the weighted sum of squares.
Objective::Term Objective::Value(double mean, double square, double smoothing) const {
  if (criterion_ != Criterion::kMeanSpread) return {square, 0, 1};
  const double m = std::hypot(mean, smoothing), s = std::sqrt(square + smoothing * smoothing);
  return {m + kSpreadWeight * s, m > 0 ? mean / m : 0, s > 0 ? kSpreadWeight / (2 * s) : 0};
}

double Objective::Linear(const Joint& joint, const VectorXd& z, VectorXd* gradient) const {
  const auto count = static_cast<Eigen::Index>(joint.column.size());
  VectorXd v(count + 1);  // -e = [K tau] v
  for (Eigen::Index i = 0; i < count; ++i) v[i] = z[joint.column[i]];
  v[count] = -1;
  const VectorXd Lv = joint.factor.triangularView<Eigen::Upper>() * v;
  const Term term = Value(joint.mean.dot(v), Lv.squaredNorm(), gradient ? joint.smoothing : 0);
  if (gradient) {
    const VectorXd LLv = joint.factor.triangularView<Eigen::Upper>().transpose() * Lv;
    const VectorXd d = term.d_mean * joint.mean.transpose() + 2 * term.d_square * LLv;
    for (Eigen::Index i = 0; i < count; ++i) (*gradient)[joint.column[i]] += d[i];
  }
  return term.value;
}

double Objective::Direct(Joint& joint, const VectorXd& z, VectorXd* gradient) const {
  const std::span<const codegen::Binding> input = joint.inputs->At(z);
  std::vector<double*> column, slope;
  for (const int i : joint.varying) column.push_back(joint.K.col(i).data());
  for (Eigen::Index k = 0; k < joint.slope_value.cols(); ++k) slope.push_back(joint.slope_value.col(k).data());
  const int rows = static_cast<int>(joint.tau.size());
  joint.column_tape->Evaluate(input, rows, column);
  if (gradient) joint.slope_tape->Evaluate(input, rows, slope);
  VectorXd p(static_cast<Eigen::Index>(joint.column.size()));
  for (Eigen::Index i = 0; i < p.size(); ++i) p[i] = z[joint.column[i]];
  const VectorXd e = joint.tau - joint.K * p;
  const auto count = static_cast<double>(e.size());
  const bool centred = criterion_ == Criterion::kMeanSpread;
  const double mean = e.mean(), divisor = centred ? count : 1;
  const VectorXd off = centred ? VectorXd(e.array() - mean) : e;
  const VectorXd pull = joint.weight.cwiseProduct(off);
  const Term term = Value(mean, pull.dot(off) / divisor, gradient ? joint.smoothing : 0);
  if (gradient) {
    const VectorXd d = (2 * term.d_square / divisor) * pull + VectorXd::Constant(e.size(), term.d_mean / count);
    const VectorXd dp = joint.K.transpose() * d, deta = joint.slope_value.transpose() * d;
    for (Eigen::Index i = 0; i < p.size(); ++i) (*gradient)[joint.column[i]] -= dp[i];
    for (Eigen::Index k = 0; k < deta.size(); ++k) (*gradient)[model_.columns() + joint.slope[k]] -= deta[k];
  }
  return term.value;
}

double Objective::Evaluate(const VectorXd& z, VectorXd* gradient) {
  double sum = 0;
  for (Joint& joint : joint_) sum += linear_ ? Linear(joint, z, gradient) : Direct(joint, z, gradient);
  return sum;
}

double Objective::operator()(const VectorXd& z) { return Evaluate(z, nullptr); }

double Objective::operator()(const VectorXd& z, VectorXd& gradient) {
  gradient.setZero(z.size());
  return Evaluate(z, &gradient);
}

std::size_t Objective::memory_bytes() const {
  std::size_t numbers = 0;
  for (const Joint& j : joint_)
    numbers += static_cast<std::size_t>(j.K.size() + j.factor.size() + j.slope_value.size()) +
               (j.inputs ? j.inputs->numbers() : 0);
  return sizeof(double) * numbers;
}

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
  const codegen::BodyPrior& prior = model_.body_prior();
  map_ = codegen::ReadOut(prior, model_.base_map());
  offset_ = prior.mean - map_ * (model_.base_map() * prior.mean);
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
