// methods - Stribeck friction (4) by a fixed linear basis; (Fs - Fc, q_s) are read out of it afterwards.
//
// For delta <= 2, exp(-(v / q_s)^delta) is a mixture of Gaussians of v. So the terms w_k sgn(v) exp(-(v / q_k)^2) with
// a few fixed q_k span it. The work along the samples is then linear and cannot diverge: the sums H and g. Read-out:
// the linear parameters are eliminated (Schur complement), which leaves a quadratic in w. For each joint w = (Fs - Fc)
// c(q_s, delta), with c by least squares. Levenberg-Marquardt then searches log(Fs - Fc), log q_s and delta, with the
// prior where there is one.
#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;
namespace {
constexpr double kRatio = 1.8;  // of neighbouring q_k: the mixture is wrong by at most 0.022
constexpr int kMostBasis = 10, kGrid = 240, kSpeedsTried = 10, kBasisSteps = 60;
constexpr double kUnknownLog = 1.5;  // prior deviation of log(Fs - Fc) where its mean is zero: a factor of 4.5

// One joint's law: where its parameters stand in z, its basis.
struct Law {
  int joint, amplitude, speed, exponent;  // exponent -1: the record has none, it is 2
  VectorXd q;                             // [basis]
  int begin = 0;                          // of its weights among all
  MatrixXd weights;                       // [basis x grid] least-squares weights of a function on the grid
  VectorXd grid;

  void MakeBasis(double lower, double upper) {
    const int count = std::min(kMostBasis, 1 + static_cast<int>(std::ceil(std::log(upper / lower) / std::log(kRatio))));
    q = VectorXd::LinSpaced(std::max(2, count), std::log(lower), std::log(upper)).array().exp();
    grid = VectorXd::LinSpaced(kGrid, std::log(0.3 * lower), std::log(3 * upper)).array().exp();
    MatrixXd B(kGrid + q.size(), q.size());
    for (Eigen::Index k = 0; k < q.size(); ++k) B.col(k).head(kGrid) = (-(grid / q[k]).array().square()).exp();
    B.bottomRows(q.size()) = 1e-4 * MatrixXd::Identity(q.size(), q.size());  // neighbours are alike: small weights win
    weights = B.completeOrthogonalDecomposition().solve(MatrixXd(MatrixXd::Identity(B.rows(), kGrid)));
  }
  // c and its derivatives by log q_s and delta: [basis x 3].
  MatrixXd Shape(double q_s, double delta) const {
    MatrixXd f(kGrid, 3);
    for (int i = 0; i < kGrid; ++i) {
      const double x = std::pow(grid[i] / q_s, delta), value = std::exp(-x);
      f.row(i) << value, value * delta * x, -value * x * std::log(grid[i] / q_s);
    }
    return weights * f;
  }
};

std::vector<Law> FindLaws(const Problem& problem) {
  const codegen::Model& model = *problem.model;
  const int columns = model.columns();
  std::vector<Law> laws;
  int begin = 0;
  for (int c = 0; c < columns; ++c) {
    if (model.is_rigid(c) || model.table()[model.table_index(c)].effect != "stribeck") continue;
    Law law{model.column_joint(c), c, -1, -1, {}, begin, {}, {}};
    for (int k = 0; k < model.nonlinear(); ++k) {
      if (const auto& entry = model.table()[model.parameters() - model.nonlinear() + k];
          entry.effect != "stribeck" || entry.joint != law.joint)
        continue;
      (model.unknowns()[k].key == "vs" ? law.speed : law.exponent) = columns + k;
    }
    law.MakeBasis(problem.lower[law.speed], problem.upper[law.speed]);
    begin += static_cast<int>(law.q.size());
    laws.push_back(std::move(law));
  }
  if (laws.empty())
    throw io::InputError("method stribeck_basis: expected a model with the effect \"stribeck\" (survey, (4))");
  return laws;
}

// What all samples say about the weights w after the linear parameters are eliminated: w'S w / 2 - g'w.
struct Reduced {
  MatrixXd S, back;  // back, offset: p = offset - back w
  VectorXd g, offset;
};

Reduced Reduce(const Problem& problem, const std::vector<Law>& laws) {
  const int columns = problem.model->columns();
  const int basis = laws.back().begin + static_cast<int>(laws.back().q.size());
  Rows rows = StackRows(problem, problem.start);
  MatrixXd B = MatrixXd::Zero(rows.K.rows(), basis);
  for (const Law& law : laws) rows.K.col(law.amplitude).setZero();
  for (Eigen::Index r = 0; r < rows.K.rows(); ++r) {
    const int j = rows.joint[r];
    const double weight = 1 / problem.sigma_Nm[j];
    for (const Law& law : laws)
      if (law.joint == j) {
        const double qd = problem.train[rows.log[r]]->s.qd(rows.sample[r], j), sign = qd > 0 ? 1 : qd < 0 ? -1 : 0;
        for (Eigen::Index k = 0; k < law.q.size(); ++k)
          B(r, law.begin + k) = weight * sign * std::exp(-std::pow(qd / law.q[k], 2));
      }
    rows.K.row(r) *= weight;
    rows.tau[r] *= weight;
  }
  // p = start + L v, v of unit covariance. Without a prior: columns of unit norm, and a tiny prior.
  MatrixXd L;
  double floor = 1;
  if (problem.covariance.size() > 0) {
    L = PriorFactor(problem).topRows(columns);
  } else {
    L = MatrixXd::Zero(columns, columns);
    for (const int c : FreeCoordinates(problem))
      if (c < columns && rows.K.col(c).norm() > 0) L(c, c) = 1 / rows.K.col(c).norm();
    floor = 1e-12;
  }
  for (const Law& law : laws) L.row(law.amplitude).setZero();
  const VectorXd p0 = problem.start.head(columns);
  const MatrixXd A = rows.K * L;
  const VectorXd target = rows.tau - rows.K * p0;
  MatrixXd H = A.transpose() * A;
  H.diagonal().array() += floor;
  const Eigen::LDLT<MatrixXd> factor(H);
  const MatrixXd cross = A.transpose() * B, solved = factor.solve(cross);
  const VectorXd v = factor.solve(VectorXd(A.transpose() * target));
  return {B.transpose() * B - cross.transpose() * solved, L * solved, B.transpose() * target - cross.transpose() * v,
          p0 + L * v};
}

// The read-out's unknowns, three a joint: log(Fs - Fc), log q_s, delta.
class ReadOut {
 public:
  ReadOut(const Problem& problem, const std::vector<Law>& laws, const Reduced& reduced)
      : laws_(laws), reduced_(reduced) {
    const auto count = static_cast<Eigen::Index>(3 * laws.size());
    start_.resize(count), information_.setZero(count), lower_.resize(count), upper_.resize(count);
    const std::vector<int> free = FreeCoordinates(problem);
    const auto held = [&](int c) { return c < 0 || std::find(free.begin(), free.end(), c) == free.end(); };
    for (std::size_t i = 0; i < laws.size(); ++i) {
      const Law& law = laws[i];
      const auto a = static_cast<Eigen::Index>(3 * i);
      const bool prior = problem.covariance.size() > 0;
      const auto deviation = [&](int c) { return prior ? std::sqrt(problem.covariance(c, c)) : 0; };
      const double sd = deviation(law.amplitude), mean = problem.start[law.amplitude];
      start_[a] = std::log(mean > 0 ? mean
                           : sd > 0 ? 0.1 * sd
                                    : 0.05 * problem.model->robot().joint[law.joint].torque_limit_Nm);
      const double spread =
          mean > 0 && sd > 0 ? std::min(kUnknownLog, std::sqrt(std::log1p(sd * sd / (mean * mean)))) : kUnknownLog;
      if (prior) information_[a] = 1 / (spread * spread);
      lower_[a] = start_[a] - 6, upper_[a] = start_[a] + 6;
      const double q = problem.start[law.speed], q_sd = deviation(law.speed);
      start_[a + 1] = std::log(q), lower_[a + 1] = std::log(problem.lower[law.speed]),
                 upper_[a + 1] = std::log(problem.upper[law.speed]);
      if (q_sd > 0) information_[a + 1] = q * q / (q_sd * q_sd);
      if (held(law.speed)) lower_[a + 1] = upper_[a + 1] = start_[a + 1];
      start_[a + 2] = lower_[a + 2] = upper_[a + 2] = law.exponent < 0 ? 2 : problem.start[law.exponent];
      if (held(law.exponent)) continue;
      lower_[a + 2] = problem.lower[law.exponent], upper_[a + 2] = problem.upper[law.exponent];
      if (const double d = deviation(law.exponent); d > 0) information_[a + 2] = 1 / (d * d);
    }
    start_ = start_.cwiseMax(lower_).cwiseMin(upper_);
  }

  double Speed(Eigen::Index k, double share) const { return lower_[k] + share * (upper_[k] - lower_[k]); }
  const VectorXd& start() const { return start_; }
  VectorXd Weights(const VectorXd& theta, MatrixXd* slope = nullptr) const {
    VectorXd w(reduced_.g.size());
    if (slope) slope->setZero(w.size(), theta.size());
    for (std::size_t i = 0; i < laws_.size(); ++i) {
      const auto a = static_cast<Eigen::Index>(3 * i);
      const Law& law = laws_[i];
      const double amplitude = std::exp(theta[a]);
      const MatrixXd c = law.Shape(std::exp(theta[a + 1]), theta[a + 2]);
      w.segment(law.begin, law.q.size()) = amplitude * c.col(0);
      if (slope) slope->block(law.begin, a, law.q.size(), 3) = amplitude * c;
    }
    return w;
  }
  double Cost(const VectorXd& theta) const {
    const VectorXd w = Weights(theta);
    return 0.5 * w.dot(reduced_.S * w) - reduced_.g.dot(w) + 0.5 * information_.dot((theta - start_).cwiseAbs2());
  }
  // One Levenberg-Marquardt step; false where nothing is left to gain.
  bool Step(VectorXd& theta, double& cost, double& damping) const {
    MatrixXd slope;
    const VectorXd w = Weights(theta, &slope);
    for (Eigen::Index k = 0; k < theta.size(); ++k)
      if (lower_[k] == upper_[k]) slope.col(k).setZero();
    const VectorXd gradient =
        slope.transpose() * (reduced_.S * w - reduced_.g) + information_.cwiseProduct(theta - start_);
    MatrixXd H = slope.transpose() * reduced_.S * slope;
    H.diagonal() += information_ + VectorXd::Constant(theta.size(), 1e-9);
    for (int attempt = 0; attempt < 12; ++attempt) {
      MatrixXd damped = H;
      damped.diagonal() *= 1 + damping;
      const VectorXd trial = (theta - damped.ldlt().solve(gradient)).cwiseMax(lower_).cwiseMin(upper_);
      if (const double now = Cost(trial); now < cost) {
        const bool more = cost - now > 1e-7;
        theta = trial, cost = now, damping = std::max(1e-9, damping / 10);
        return more;
      }
      damping = std::max(1e-6, damping * 10);
    }
    return false;
  }

 private:
  const std::vector<Law>& laws_;
  const Reduced& reduced_;
  VectorXd start_, information_, lower_, upper_;
};
}  // namespace

Solution StribeckBasis(const Problem& problem) {
  const double began = CpuSeconds();
  const codegen::Model& model = *problem.model;
  const std::vector<Law> laws = FindLaws(problem);
  const Reduced reduced = Reduce(problem, laws);
  const ReadOut fit(problem, laws, reduced);
  VectorXd theta = fit.start();
  double cost = fit.Cost(theta), damping = 1e-3;
  for (std::size_t i = 0; i < laws.size(); ++i)  // a q_s that is far off has no slope, so several are tried
    for (int k = 0; k < kSpeedsTried; ++k)
      for (const double amplitude : {0.3, 1.0, 3.0}) {
        const auto a = static_cast<Eigen::Index>(3 * i);
        VectorXd trial = theta;
        trial[a] = fit.start()[a] + std::log(amplitude);
        trial[a + 1] = fit.Speed(a + 1, (k + 0.5) / kSpeedsTried);
        if (const double now = fit.Cost(trial); now < cost) cost = now, theta = trial;
      }
  Solution solution;
  solution.converged = false;
  for (; solution.iterations < kBasisSteps && !solution.converged; ++solution.iterations)
    solution.converged = !fit.Step(theta, cost, damping);
  solution.z = problem.start;
  solution.z.head(model.columns()) = reduced.offset - reduced.back * fit.Weights(theta);
  for (std::size_t i = 0; i < laws.size(); ++i) {
    const auto a = static_cast<Eigen::Index>(3 * i);
    solution.z[laws[i].amplitude] = std::exp(theta[a]);
    solution.z[laws[i].speed] = std::exp(theta[a + 1]);
    if (laws[i].exponent >= 0) solution.z[laws[i].exponent] = theta[a + 2];
  }
  const Linearised here = Linearise(problem, solution.z);
  SolveRegularised(problem, here.A.transpose() * here.A, here.A.transpose() * here.residual, &solution.covariance);
  const std::size_t size = static_cast<std::size_t>(model.columns() + reduced.g.size());  // of the sums
  solution.memory_bytes = size * size * sizeof(double);
  if (!solution.converged) solution.remark = "the read-out stopped before its last step was small";
  Finish(problem, began, solution);
  return solution;
}

}  // namespace armcal::calibration
