// methods - sums for linear models, kept rows for nonlinear ones; knows no search.
#include "host_sim/identify/methods/objective.hpp"

#include <Eigen/QR>
#include <cmath>
#include <map>
#include <string>

#include "codegen/src/generator/rigid_body.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/minimum_norm.hpp"

namespace armcal::calibration {

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
  std::vector<int> index;
  for (std::size_t r = 0; r < rows.joint.size(); ++r)
    if (rows.joint[r] == j) index.push_back(static_cast<int>(r));
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
  Bind(problem, rows, index, joint);
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

// What the graph reads, at this joint's rows alone.
void Objective::Bind(const Problem& problem, const Rows& rows, const std::vector<int>& index, Joint& joint) const {
  const auto count = static_cast<Eigen::Index>(index.size());
  const auto log = [&](Eigen::Index r) -> const codegen::Signals& { return problem.train[rows.log[index[r]]]->s; };
  const auto gather = [&](MatrixXd codegen::Signals::*signal) {
    MatrixXd out = MatrixXd::Zero(count, model_.joints());
    for (Eigen::Index r = 0; r < count; ++r)
      if (const MatrixXd& whole = log(r).*signal; whole.cols() == out.cols())
        out.row(r) = whole.row(rows.sample[index[r]]);
    return out;
  };
  codegen::Signals& s = joint.signals;
  s.q = gather(&codegen::Signals::q), s.qd = gather(&codegen::Signals::qd);
  s.qdd = gather(&codegen::Signals::qdd), s.temp = gather(&codegen::Signals::temp);
  s.t.setZero(count);
  for (Eigen::Index r = 0; r < count; ++r)
    if (log(r).t.size()) s.t[r] = log(r).t[rows.sample[index[r]]];
  std::map<codegen::InputId, const double*> column = {{{codegen::Quantity::kTime}, s.t.data()}};
  for (int i = 0; i < model_.joints(); ++i) {
    column[{codegen::Quantity::kPosition, i}] = s.q.col(i).data();
    column[{codegen::Quantity::kSpeed, i}] = s.qd.col(i).data();
    column[{codegen::Quantity::kAcceleration, i}] = s.qdd.col(i).data();
    column[{codegen::Quantity::kTemperature, i}] = s.temp.col(i).data();
  }
  std::map<codegen::InputId, int> coordinate;
  for (int c = 0; c < model_.columns(); ++c)
    coordinate[{.quantity = codegen::Quantity::kCoordinate, .parameter = c}] = c;
  for (int k = 0; k < model_.nonlinear(); ++k)
    coordinate[codegen::SymbolId(model_.unknowns()[k].name)] = model_.columns() + k;
  for (const codegen::InputId& name : model_.graph().inputs()) {
    if (coordinate.contains(name)) joint.unknown.push_back({static_cast<int>(joint.input.size()), coordinate[name]});
    joint.input.push_back({column.contains(name) ? column[name] : nullptr, 0});
  }
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
  for (const auto& [i, coordinate] : joint.unknown) joint.input[i].value = z[coordinate];
  std::vector<double*> column, slope;
  for (const int i : joint.varying) column.push_back(joint.K.col(i).data());
  for (Eigen::Index k = 0; k < joint.slope_value.cols(); ++k) slope.push_back(joint.slope_value.col(k).data());
  const int rows = static_cast<int>(joint.tau.size());
  joint.column_tape->Evaluate(joint.input, rows, column);
  if (gradient) joint.slope_tape->Evaluate(joint.input, rows, slope);
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
    numbers += static_cast<std::size_t>(j.K.size() + j.factor.size() + 4 * j.signals.q.size() + j.slope_value.size());
  return sizeof(double) * numbers;
}

}  // namespace armcal::calibration
