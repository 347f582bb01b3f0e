// generator - decides the rank from random states, in long double and without scaling the columns.
#include "codegen/src/generator/base_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include <Eigen/QR>

#include "codegen/src/generator/tape.hpp"

namespace armcal::codegen {
namespace {

using Real = long double;
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

// Inputs are of order one, so are the columns; a dependent column leaves about 1e-17, a true one more than 1e-4.
constexpr Real kIndependent = 1e-9L;

Matrix RandomColumns(const Graph& graph, const BodyRows& row, const BodyRows& extra) {
  std::vector<Expr> roots;
  for (const auto& rows : {row, extra})
    for (const auto& r : rows) roots.insert(roots.end(), r.begin(), r.end());
  const Tape tape(graph, roots);
  const int n = static_cast<int>(row.size() + extra.size()), p = static_cast<int>(row[0].size());
  const int states = 3 * p / n + 10;
  Matrix W(states * n, p);
  std::mt19937_64 random(1);
  for (int k = 0; k < states; ++k) {
    std::vector<Real> inputs(graph.inputs().size());
    for (Real& x : inputs) x = 6.0L * (static_cast<Real>(random() >> 11) / 9007199254740992.0L) - 3.0L;
    const auto values = tape.EvaluateAt<Real>(inputs);
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < p; ++c) W(k * n + i, c) = values[i * p + c];
  }
  return W;
}

std::vector<int> Preference(const Robot& robot) {
  std::vector<int> order = robot.parameters.prefer;
  const auto& omit = robot.parameters.omit;
  const int n = robot.joints();
  const auto add = [&](int j, std::initializer_list<int> kinds) {
    for (const int k : kinds) order.push_back(kBodyBlock * j + k);
  };
  for (int j = 0; j < n; ++j)
    if (robot.joint[j].kinematics.type == JointType::kPrismatic) add(j, {0});
  for (int j = 0; j < n; ++j) add(j, {9, 4, 5, 6, 8, 1, 2});
  for (int j = 0; j < n; ++j) add(j, {10});
  for (int j = n - 1; j >= 0; --j) add(j, {7, 3});
  for (int j = n - 1; j >= 0; --j)
    if (robot.joint[j].kinematics.type == JointType::kRevolute) add(j, {0});
  std::vector<int> once;
  for (const int c : order)
    if (std::count(once.begin(), once.end(), c) + std::count(omit.begin(), omit.end(), c) == 0) once.push_back(c);
  return once;
}

// Fourteen digits: far above the long double noise, so that the same file gives the same bytes everywhere.
double Rounded(Real value) {
  if (std::abs(value) < 1e-11L) return 0;
  char text[40];
  std::snprintf(text, sizeof text, "%.14Lg", value);
  return std::strtod(text, nullptr);
}

struct Choice {
  std::vector<int> column;  // in the order taken
  Matrix merge;             // [column.size() x all]: every column as a sum of the taken ones
};

Choice TakeIndependent(const Matrix& W, const std::vector<int>& order, bool keep_dependent) {
  const int p = static_cast<int>(W.cols());
  Choice out;
  std::vector<Vector> q;                  // orthonormal basis of the chosen columns
  Matrix r = Matrix::Zero(p, p);          // chosen columns in that basis (upper triangle), by column
  Matrix dependent = Matrix::Zero(p, p);  // all columns in that basis
  for (const int c : order) {
    Vector v = W.col(c);
    Vector h = Vector::Zero(p);
    for (int pass = 0; pass < 2 && !keep_dependent; ++pass)  // twice is enough
      for (std::size_t k = 0; k < q.size(); ++k) {
        const Real s = q[k].dot(v);
        h[k] += s;
        v -= s * q[k];
      }
    dependent.col(c) = h;
    const Real norm = v.norm() / std::sqrt(static_cast<Real>(v.size()));
    if (norm < kIndependent) continue;
    h[q.size()] = v.norm();
    dependent.col(c) = h;
    r.col(q.size()) = h;
    q.push_back(v / v.norm());
    out.column.push_back(c);
  }
  const int rank = static_cast<int>(q.size());
  out.merge = r.topLeftCorner(rank, rank).template triangularView<Eigen::Upper>().solve(dependent.topRows(rank));
  return out;
}

}  // namespace

std::vector<int> IndependentColumns(const Graph& graph, const BodyRows& row, const Robot& robot,
                                    const BodyRows& extra) {
  auto column = TakeIndependent(RandomColumns(graph, row, extra), Preference(robot), robot.parameters.standard).column;
  std::sort(column.begin(), column.end());
  return column;
}

BaseParameters FindBaseParameters(const Graph& graph, const BodyRows& row, const Robot& robot, const BodyRows& extra) {
  const Choice choice = TakeIndependent(RandomColumns(graph, row, extra), Preference(robot), robot.parameters.standard);
  std::vector<int> order(choice.column.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return choice.column[a] < choice.column[b]; });
  BaseParameters base;
  base.map.resize(static_cast<Eigen::Index>(order.size()), choice.merge.cols());
  for (std::size_t i = 0; i < order.size(); ++i) {
    base.column.push_back(choice.column[order[i]]);
    base.map.row(static_cast<Eigen::Index>(i)) = choice.merge.row(order[i]).unaryExpr(&Rounded);
  }
  base.map *= SlideMap(robot);
  return base;
}

Eigen::VectorXd BodiesFromBase(const BaseParameters& base, const Eigen::VectorXd& value,
                               const Eigen::VectorXd& reference) {
  return reference + base.map.completeOrthogonalDecomposition().solve(value - base.map * reference);
}

}  // namespace armcal::codegen
