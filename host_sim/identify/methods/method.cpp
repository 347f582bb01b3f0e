// methods - the list of methods, and what all of them start from: prior, ranges, stacked rows.
#include "host_sim/identify/methods/method.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

std::span<const double> Head(const VectorXd& z, int count) { return {z.data(), static_cast<std::size_t>(count)}; }
std::span<const double> Tail(const VectorXd& z, int count) {
  return {z.data() + z.size() - count, static_cast<std::size_t>(count)};
}

// A parameter that was never measured lies anywhere in its range. Its deviation is a quarter of the range, or of the
// range's logarithm where that is the scale.
double UnknownDeviation(const codegen::EffectUnknown& u, double value) {
  return u.logarithmic ? value * 0.25 * std::log(u.upper / u.lower) : 0.25 * (u.upper - u.lower);
}

}  // namespace

const std::vector<Method>& Methods() {
  static const std::vector<Method> methods = {
      // name, title, equation, nonlinear, online, needs_loop, needs_prior, needs_ranges
      {"pseudo_inverse", "pseudo-inverse", "(15)", false, false, false, false, false, PseudoInverse},
      {"weighted_pseudo_inverse", "weighted pseudo-inverse", "(15)", false, false, false, false, false,
       WeightedPseudoInverse},
      {"instrumental_variable", "IDIM-IV", "(17)", false, false, true, false, false, InstrumentalVariable},
      {"kalman", "Kalman filter", "(19)", false, true, false, false, false, Kalman},
      {"extended_kalman", "extended Kalman filter", "(21)", true, true, false, false, false, ExtendedKalman},
      {"forgetting", "exponential forgetting", "(23), (24)", true, true, false, false, false, Forgetting},
      {"gradient_descent", "gradient descent", "(25)", true, false, false, false, true, GradientDescent},
      {"genetic", "genetic algorithm", "(25)", true, false, false, false, true, Genetic},
      {"particle_filter", "particle filter", "(25)", true, false, false, false, true, ParticleFilter},
      {"map_barrier", "MAP with CAD prior and barrier", "", true, false, false, true, false, MapBarrier},
      {"variable_projection", "variable projection", "", true, false, false, false, false, VariableProjection},
      {"log_ekf", "iterated EKF in logarithms", "", true, true, false, true, false, LogEkf},
      {"stribeck_basis", "fixed Stribeck basis", "", true, false, false, false, false, StribeckBasis},
      {"multiple_model", "three Kalman filters", "", false, true, false, true, false, MultipleModel},
      {"didim", "DIDIM", "", false, false, true, false, false, Didim},
      {"robust", "robust weights", "", false, false, false, false, false, Robust},
      {"parallel_decimation", "parallel decimation", "", false, false, false, false, false, ParallelDecimation},
      {"fourier_fit", "Fourier fit of periodic motion", "", true, false, false, false, false, FourierFitted},
  };
  return methods;
}

const Method& FindMethod(const std::string& name) {
  std::string known;
  for (const Method& m : Methods()) {
    if (name == m.name) return m;
    known += (known.empty() ? "" : ", ") + std::string(m.name);
  }
  throw io::InputError("method \"" + name + "\": expected one of " + known);
}

const Method& LeastSquaresFor(const codegen::Model& model) {
  return FindMethod(model.nonlinear() > 0 ? "variable_projection" : "weighted_pseudo_inverse");
}

Solution Solve(const Method& method, const Problem& problem) {
  const std::string name = std::string("method ") + method.name;
  if (!method.nonlinear && problem.model->nonlinear() > 0)
    throw io::InputError(name + ": expected a model that is linear in its parameters; " +
                         problem.model->unknowns()[0].name + " is not");
  if (method.needs_loop && !problem.closed_loop)
    throw io::InputError(name + ": expected a [control] table in the robot file and logs with qref1..qrefN");
  if (method.needs_prior && problem.covariance.size() == 0)
    throw io::InputError(name + ": expected a robot file with a prior");
  return method.solve(problem);
}

Problem MakeProblem(const codegen::Model& model, std::vector<const Dataset*> train) {
  const int columns = model.columns(), unknowns = model.nonlinear(), size = columns + unknowns;
  const Prior prior = MakePrior(model);
  Problem p;
  p.model = &model;
  p.train = std::move(train);
  p.sigma_Nm.resize(model.joints());
  for (int j = 0; j < model.joints(); ++j) p.sigma_Nm[j] = model.robot().joint[j].torque_noise_Nm;
  p.start = VectorXd::Zero(size);
  p.start.head(columns) = prior.mean.head(columns);
  VectorXd sd = VectorXd::Constant(size, std::numeric_limits<double>::infinity());
  p.lower = -sd, p.upper = sd;
  if (prior.informative) {
    p.covariance = MatrixXd::Zero(size, size);
    p.covariance.topLeftCorner(columns, columns) = prior.covariance.topLeftCorner(columns, columns);
    sd.head(columns) = p.covariance.diagonal().head(columns).cwiseMax(0).cwiseSqrt();
  }
  for (int c = 0; c < columns; ++c) {
    p.lower[c] = p.start[c] - 3 * sd[c];
    p.upper[c] = p.start[c] + 3 * sd[c];
    if (model.is_rigid(c)) continue;
    const codegen::TableParameter& t = model.table()[model.table_index(c)];
    p.lower[c] = std::max(p.lower[c], t.lower);
    p.upper[c] = std::min(p.upper[c], t.upper);
  }
  for (int k = 0; k < unknowns; ++k) {
    const codegen::EffectUnknown& u = model.unknowns()[k];
    const int i = columns + k;
    p.start[i] = model.table()[model.parameters() - unknowns + k].mean;
    p.lower[i] = u.lower, p.upper[i] = u.upper;
    if (prior.informative) p.covariance(i, i) = std::pow(UnknownDeviation(u, p.start[i]), 2);
  }
  return p;
}

Problem Along(const Problem& problem, const std::vector<Dataset>& logs) {
  Problem other = problem;
  other.train.clear();
  for (const Dataset& log : logs) other.train.push_back(&log);
  return other;
}

Rows StackRows(const Problem& problem, const VectorXd& z) {
  const codegen::Model& model = *problem.model;
  const int columns = model.columns();
  Rows rows;
  for (std::size_t l = 0; l < problem.train.size(); ++l)
    for (int k = 0; k < problem.train[l]->samples(); ++k)
      for (int j = 0; j < model.joints(); ++j)
        if (problem.train[l]->used(k, j)) {
          rows.joint.push_back(j);
          rows.log.push_back(static_cast<int>(l));
          rows.sample.push_back(k);
        }
  if (rows.joint.empty())
    throw io::InputError("no row of the training logs may be used: expected a moving, settled joint");
  rows.K.resize(static_cast<Eigen::Index>(rows.joint.size()), columns);
  rows.tau.resize(rows.K.rows());
  std::vector<MatrixXd> row;
  for (std::size_t begin = 0, end = 0; begin < rows.joint.size(); begin = end) {
    const Dataset& data = *problem.train[rows.log[begin]];
    while (end < rows.joint.size() && rows.log[end] == rows.log[begin]) ++end;
    model.Regressor(data.s, Head(z, columns), Tail(z, model.nonlinear()), row);
    for (std::size_t r = begin; r < end; ++r)
      rows.tau[static_cast<Eigen::Index>(r)] = data.tau(rows.sample[r], rows.joint[r]);
    for (int c = 0; c < columns; ++c)  // column by column, as both matrices lie in memory
      for (std::size_t r = begin; r < end; ++r)
        rows.K(static_cast<Eigen::Index>(r), c) = row[rows.joint[r]](rows.sample[r], c);
  }
  return rows;
}

VectorXd ResidualNoise(const Problem& problem, const VectorXd& z) {
  const Rows rows = StackRows(problem, z);
  const VectorXd residual = rows.tau - rows.K * z.head(problem.model->columns());
  VectorXd square = VectorXd::Zero(problem.sigma_Nm.size()), count = square;
  for (std::size_t r = 0; r < rows.joint.size(); ++r) {
    square[rows.joint[r]] += std::pow(residual[static_cast<Eigen::Index>(r)], 2);
    count[rows.joint[r]] += 1;
  }
  const double all = count.sum(), free = std::max(1.0, all - static_cast<double>(FreeCoordinates(problem).size()));
  VectorXd sigma = problem.sigma_Nm;
  for (Eigen::Index j = 0; j < sigma.size(); ++j)
    if (square[j] > 0) sigma[j] = std::sqrt(square[j] / count[j] * all / free);
  return sigma;
}

MatrixXd StackJacobian(const Problem& problem, const VectorXd& z, const Rows& rows) {
  const codegen::Model& model = *problem.model;
  MatrixXd J(rows.K.rows(), model.nonlinear());
  if (J.cols() == 0) return J;
  std::vector<MatrixXd> row;
  int of_log = -1;
  for (std::size_t r = 0; r < rows.joint.size(); ++r) {
    if (rows.log[r] != of_log) {
      of_log = rows.log[r];
      const auto p = Head(z, model.columns());
      model.Jacobian(problem.train[of_log]->s, p, p, Tail(z, model.nonlinear()), row);
    }
    J.row(static_cast<Eigen::Index>(r)) = row[rows.joint[r]].row(rows.sample[r]);
  }
  return J;
}

}  // namespace armcal::calibration
