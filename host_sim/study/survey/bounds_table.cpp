// survey - base parameters against the least error that their rows, prior and weights allow, and whether the intervals
// hold the truth.
#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "codegen/src/generator/emit.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"
#include "host_sim/machine/plant/random.hpp"
#include "host_sim/study/survey/online_run.hpp"
#include "host_sim/study/survey/platform.hpp"
#include "host_sim/study/survey/tables.hpp"

namespace armcal::survey {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMotions = 10, kDrawsOfMotion = 20, kSearchStarts = 4;
constexpr double kPlant_s = 20, kBlock_s = 0.25;  // the longest derivative filter reaches over less than a block
constexpr double kNoPrior = 30;                   // times the file's widths: as good as no prior
constexpr double kInside = 1.96;
constexpr std::uint64_t kSeeds = 4001;

// What one log says of the free coordinates. Rows are over the noise.
struct Seen {
  Seen(const codegen::Model& model, const calibration::Dataset& log)
      : problem(calibration::MakeProblem(model, {&log})) {
    free = calibration::FreeCoordinates(problem);
    rows = calibration::StackRows(problem, problem.start);
    A = rows.K(Eigen::all, free);
    for (Eigen::Index r = 0; r < A.rows(); ++r) A.row(r) /= problem.sigma_Nm[rows.joint[static_cast<std::size_t>(r)]];
  }
  MatrixXd Information() const { return A.transpose() * A; }

  calibration::Problem problem;
  std::vector<int> free;
  calibration::Rows rows;
  MatrixXd A;
};

// Covariance of least squares with a prior, which may be empty.
MatrixXd LeastCovariance(const MatrixXd& information, const MatrixXd& prior_information) {
  const MatrixXd sum = prior_information.size() ? MatrixXd(information + prior_information) : information;
  return sum.ldlt().solve(MatrixXd::Identity(sum.rows(), sum.cols()));
}

// The joint whose own column this is; -1: a column that several joints share.
int JointOfColumn(const codegen::Model& model, int column) {
  for (int j = 0; j < model.joints(); ++j)
    if (column >= model.front_begin(j) && column < model.front_begin(j + 1)) return j;
  return -1;
}

// [begin, end) of the rows of sample k, which follow those that end at `begin`.
std::size_t EndOfSample(const Seen& seen, std::size_t begin, int k) {
  while (begin < seen.rows.sample.size() && seen.rows.sample[begin] == k) ++begin;
  return begin;
}

// Error covariance of a Kalman filter that expects its parameters to change while they do not: its gains belong to P,
// and its error does not grow by the process noise. Truths are drawn from the prior.
MatrixXd DriftingCovariance(const Seen& seen, const codegen::Model& model, const MatrixXd& prior) {
  const auto p = static_cast<Eigen::Index>(seen.free.size());
  MatrixXd P = prior, error = prior;
  const calibration::Dataset& log = *seen.problem.train[0];
  std::size_t begin = 0, end = 0;
  for (int k = 0; k < log.samples(); ++k, begin = end) {
    end = EndOfSample(seen, begin, k);
    const auto count = static_cast<Eigen::Index>(end - begin);
    const MatrixXd A = seen.A.middleRows(static_cast<Eigen::Index>(begin), count), PA = P * A.transpose();
    const MatrixXd gain = (A * PA + MatrixXd::Identity(count, count)).llt().solve(PA.transpose()).transpose();
    const MatrixXd kept = MatrixXd::Identity(p, p) - gain * A;
    P = kept * P;
    error = kept * error * kept.transpose() + gain * gain.transpose();
    for (Eigen::Index i = 0; i < p; ++i) {
      const int c = seen.free[static_cast<std::size_t>(i)], j = JointOfColumn(model, c);
      if (!model.is_rigid(c) && j >= 0 && log.used(k, j)) P(i, i) += model.table()[model.table_index(c)].process_noise;
    }
  }
  return error;
}

// Error covariance of least squares whose triangle forgets as the firmware's does: after each sample the rows of a
// joint's own columns if the joint moves, the other rows if all joints move. The noise that the triangle holds goes
// along with it. Truths are drawn from the prior.
MatrixXd ForgettingCovariance(const Seen& seen, const codegen::Model& model, const MatrixXd& prior_information) {
  const auto p = static_cast<Eigen::Index>(seen.free.size());
  MatrixXd U = MatrixXd::Zero(p, p), noise = MatrixXd::Zero(p, p);
  std::vector<int> joint_of(seen.free.size(), -1);
  std::vector<double> keeps(seen.free.size());
  for (std::size_t i = 0; i < seen.free.size(); ++i) {
    const int c = seen.free[i];
    joint_of[i] = JointOfColumn(model, c);
    keeps[i] = std::sqrt(codegen::kForgetting[model.is_rigid(c) ? 0 : model.table()[model.table_index(c)].group]);
  }
  const calibration::Dataset& log = *seen.problem.train[0];
  std::size_t begin = 0, end = 0;
  for (int k = 0; k < log.samples(); ++k, begin = end) {
    end = EndOfSample(seen, begin, k);
    const auto count = static_cast<Eigen::Index>(end - begin);
    if (count > 0) {
      MatrixXd stack(p + count, p), of_noise = MatrixXd::Zero(p + count, p + count);
      stack << U, seen.A.middleRows(static_cast<Eigen::Index>(begin), count);
      of_noise.topLeftCorner(p, p) = noise;
      of_noise.bottomRightCorner(count, count).setIdentity();
      const Eigen::HouseholderQR<MatrixXd> qr(stack);
      U = qr.matrixQR().topRows(p).triangularView<Eigen::Upper>();
      of_noise.applyOnTheLeft(qr.householderQ().transpose());
      of_noise.applyOnTheRight(qr.householderQ());
      noise = of_noise.topLeftCorner(p, p);
    }
    const bool all = log.used.row(k).minCoeff() == 1;
    for (Eigen::Index i = 0; i < p; ++i) {
      const int j = joint_of[static_cast<std::size_t>(i)];
      if (j < 0 ? !all : log.used(k, j) == 0) continue;
      const double keep = keeps[static_cast<std::size_t>(i)];
      U.row(i) *= keep, noise.row(i) *= keep, noise.col(i) *= keep;
    }
  }
  const MatrixXd least = LeastCovariance(U.transpose() * U, prior_information);
  return least * (U.transpose() * noise * U + prior_information) * least;
}

// Covariance of least squares from what is left in blocks of time. Each block's residual is taken as if the block had
// not been fitted, so that a fit of few blocks does not look better than it is.
class Blocks {
 public:
  Blocks(const Seen& seen, double step_s) {
    least_ = LeastCovariance(seen.Information(), {});
    const int length = std::max(1, static_cast<int>(std::lround(kBlock_s / step_s)));
    for (std::size_t begin = 0, end = 0; begin < seen.rows.sample.size(); begin = end) {
      const int number = seen.rows.sample[begin] / length;
      while (end < seen.rows.sample.size() && seen.rows.sample[end] / length == number) ++end;
      const auto first = static_cast<Eigen::Index>(begin), count = static_cast<Eigen::Index>(end - begin);
      const MatrixXd A = seen.A.middleRows(first, count);
      const MatrixXd kept = MatrixXd::Identity(count, count) - A * least_ * A.transpose();
      first_.push_back(first);
      score_.push_back(kept.ldlt().solve(A).transpose());
    }
  }
  VectorXd Deviations(const VectorXd& residual) const {
    MatrixXd middle = MatrixXd::Zero(least_.rows(), least_.cols());
    for (std::size_t b = 0; b < score_.size(); ++b) {
      const VectorXd s = score_[b] * residual.segment(first_[b], score_[b].cols());
      middle += s * s.transpose();
    }
    const auto count = static_cast<double>(score_.size());
    return ((count - 1) / count * least_ * middle * least_).diagonal().cwiseMax(0).cwiseSqrt();
  }

 private:
  MatrixXd least_;
  std::vector<Eigen::Index> first_;
  std::vector<MatrixXd> score_;
};

// One estimator over motions and draws.
struct Tally {
  Tally(std::string of, std::string told, std::string against, std::string judge)
      : estimator(std::move(of)), prior(std::move(told)), bound(std::move(against)), truth(std::move(judge)) {}

  void Add(int motion, const VectorXd& error, const VectorXd& sd, const MatrixXd& asked) {
    square[motion] += error.dot(asked * error), ++draws[motion];
    if (inside.size() == 0) inside = VectorXd::Zero(error.size());
    inside += (error.cwiseAbs().array() <= kInside * sd.array()).cast<double>().matrix();
  }
  // Torque error of each motion over the bound.
  std::vector<double> Ratios() const {
    std::vector<double> out;
    for (int m = 0; m < kMotions; ++m)
      if (draws[m] > 0) out.push_back(std::sqrt(square[m] / draws[m]) / least[m]);
    std::sort(out.begin(), out.end());
    return out;
  }
  int Draws() const {
    int sum = 0;
    for (const int d : draws) sum += d;
    return sum;
  }

  std::string estimator, prior, bound, truth;
  double square[kMotions] = {}, least[kMotions] = {};
  int draws[kMotions] = {};
  VectorXd inside;  // of each parameter
};

enum BoundRow {
  kLeastSquares,
  kKalmanFree,
  kKalmanTold,
  kKalmanDrifts,
  kForgettingTold,
  kPlantSquares,
  kPlantKalman,
  kRows
};

struct BoundGoals {
  double median, worst, lowest, highest, one;  // NaN: not asked
};

calibration::Dataset MovingRows(calibration::Dataset log, const codegen::Robot& robot) {
  for (int k = 0; k < log.samples(); ++k)
    for (int j = 0; j < log.joints(); ++j)
      log.used(k, j) = Moves(log.s.qd(k, j), robot.joint[static_cast<std::size_t>(j)]);
  return log;
}

// Of the torque on another motion, per row, in squares of sigma.
MatrixXd Asked(const codegen::Model& model, const excitation::Series& other) {
  const codegen::Signals s = Sampled(other);
  const Seen seen(model, Measured(s, MatrixXd::Zero(s.samples(), model.joints())));
  return seen.Information() / static_cast<double>(seen.A.rows());
}

double TorqueOf(const MatrixXd& covariance, const MatrixXd& asked) {
  return std::sqrt(covariance.cwiseProduct(asked).sum());
}

class BoundTrial {
 public:
  BoundTrial(const Settings& settings, const Motions& motions, const codegen::Model& model,
             const codegen::Model& drifting, const codegen::Model& wide)
      : settings_(settings), model_(model), drifting_(drifting), wide_(wide), asked_(Asked(model, motions.other)) {}

  void Analytic(const excitation::Series& series, int motion, int draws, std::vector<Tally>& out) const {
    const codegen::Signals s = Sampled(series);
    calibration::Dataset log = MovingRows(Measured(s, MatrixXd::Zero(s.samples(), model_.joints())), settings_.robot);
    Seen seen(model_, log);
    const MatrixXd prior = seen.problem.covariance(seen.free, seen.free);
    const MatrixXd told = LeastCovariance(prior, {}), root = calibration::CovarianceRoot(prior);
    const MatrixXd free_bound = LeastCovariance(seen.Information(), {});
    out[kLeastSquares].least[motion] = out[kKalmanFree].least[motion] = TorqueOf(free_bound, asked_);
    out[kKalmanTold].least[motion] = TorqueOf(LeastCovariance(seen.Information(), told), asked_);
    out[kKalmanDrifts].least[motion] = TorqueOf(DriftingCovariance(seen, drifting_, prior), asked_);
    out[kForgettingTold].least[motion] = TorqueOf(ForgettingCovariance(seen, model_, told), asked_);
    for (int d = 0; d < draws && !settings_.Stopped(); ++d) {
      const std::uint64_t seed = SeedOf(motion, d);
      plant::Random random(seed);
      VectorXd z = seen.problem.start;
      z(seen.free) += root * VectorXd::NullaryExpr(root.cols(), [&] { return random.Normal(); });
      log.tau = Torque(model_, s, z) + Noise(log.samples(), seen.problem.sigma_Nm, seed + 1);
      const calibration::Solution found = LeastSquares(seen.problem);
      const auto add = [&](BoundRow row, const VectorXd& estimate, const VectorXd& sd) {
        out[row].Add(motion, estimate(seen.free) - z(seen.free), sd(seen.free), asked_);
      };
      add(kLeastSquares, found.z, found.covariance.diagonal().cwiseMax(0).cwiseSqrt());
      const auto online = [&](BoundRow row, const codegen::Model& prior_model, OnlineFilter filter) {
        const OnlineResult got = RunOnTarget(prior_model, log, seen.problem.sigma_Nm, filter);
        add(row, got.filter, got.filter_sd);
      };
      online(kKalmanFree, wide_, OnlineFilter::kKalman);
      online(kKalmanTold, model_, OnlineFilter::kKalman);
      online(kKalmanDrifts, drifting_, OnlineFilter::kKalman);
      online(kForgettingTold, model_, OnlineFilter::kForgetting);
    }
  }

  void Plant(const excitation::Series& series, int motion, int draws, std::vector<Tally>& out) const {
    PlantSettings plant;
    plant.friction = plant.torque_constant = plant.noise = 0, plant.seconds = kPlant_s;
    calibration::Dataset log =
        calibration::Prepare(model_, RunPlant(settings_.robot, series, plant), {kPlantCutoff_Hz});
    const MatrixXd clean = log.tau;
    Seen seen(model_, log);
    const Blocks blocks(seen, log.s.t[1] - log.s.t[0]);
    out[kPlantSquares].least[motion] = out[kPlantKalman].least[motion] =
        TorqueOf(LeastCovariance(seen.Information(), {}), asked_);
    const VectorXd truth = SetParameters(model_);
    for (int d = 0; d < draws && !settings_.Stopped(); ++d) {
      log.tau = clean + Noise(log.samples(), seen.problem.sigma_Nm, SeedOf(motion, d) + 2);
      const calibration::Solution found = LeastSquares(seen.problem);
      const calibration::Linearised left = calibration::Linearise(seen.problem, found.z);
      const VectorXd error = found.z(seen.free) - truth(seen.free);
      out[kPlantSquares].Add(motion, error, blocks.Deviations(left.residual), asked_);
      const OnlineResult got = RunOnTarget(wide_, log, seen.problem.sigma_Nm, OnlineFilter::kKalman);
      out[kPlantKalman].Add(motion, got.filter(seen.free) - truth(seen.free), got.filter_sd(seen.free), asked_);
    }
  }

 private:
  std::uint64_t SeedOf(int motion, int draw) const {
    return (settings_.seed * kSeeds + static_cast<std::uint64_t>(motion)) * 1000 + 4 * static_cast<std::uint64_t>(draw);
  }
  static calibration::Solution LeastSquares(calibration::Problem problem) {
    problem.covariance.resize(0, 0);
    return calibration::Solve(calibration::FindMethod("weighted_pseudo_inverse"), problem);
  }

  const Settings& settings_;
  const codegen::Model &model_, &drifting_, &wide_;
  MatrixXd asked_;
};

codegen::Robot WithoutPrior(codegen::Robot robot) {
  for (double* width :
       {&robot.link_relative_sd, &robot.center_floor_m, &robot.inertia_floor_ratio, &robot.friction_relative_sd})
    *width *= kNoPrior;
  return robot;
}

void AskFor(const Tally& tally, const BoundGoals& goals, double median, double worst, double pooled, double one,
            Findings& out) {
  const std::string where =
      "Table bounds, " + tally.truth + " truth, " + tally.estimator + ", prior " + tally.prior + ": ";
  out.goals.push_back({where + "torque error over the bound, median of the motions", median, goals.median, true});
  if (!std::isnan(goals.worst))
    out.goals.push_back({where + "torque error over the bound, worst motion", worst, goals.worst, true});
  if (std::isnan(goals.lowest)) return;
  out.goals.push_back({where + "share of truths in the 95 % interval, at least", pooled, goals.lowest, false});
  out.goals.push_back({where + "share of truths in the 95 % interval, at most", pooled, goals.highest, true});
  if (!std::isnan(goals.one))
    out.goals.push_back({where + "share of truths in the 95 % interval, worst parameter", one, goals.one, false});
}

}  // namespace

void ShowBounds(const Settings& settings, const Motions& motions, Findings& out) {
  Sheet sheet{
      "bounds",
      "base parameters and friction against the least error possible, ten motions",
      {"truth", "estimator", "prior", "bound", "draws", "error over the bound, median motion", "worst motion",
       "truth in the 95 % interval", "worst parameter", "bound / sigma, median"},
      {},
      {"Error: torque on another motion, truth against estimate, root mean square over draws. Rows with 100 samples a "
       "second for 10 s (analytic) or 125 for 20 s (plant), Table 7's noise on each sample.",
       "Analytic truth: K z of armcal's own regressor, z drawn from the robot file's prior. Plant: the file's arm, "
       "which the plant reads by itself; the bound is that of the rows with Table 7's noise alone.",
       "Bounds: Cramer-Rao without a prior; Bayesian with the prior that is told, over truths drawn from it. The "
       "truth does not change, and a Kalman filter is told so, but for one row: with the process noise that ships, its "
       "bound is the error covariance that its own gains give. For forgetting it is that of its own weights.",
       "Kalman filter without a prior: the file's widths times 30. Its interval on the plant is its own; that of "
       "least squares there comes from what blocks of 0.25 s leave.",
       "Seed of motion m and draw d: (" + std::to_string(settings.seed * kSeeds) + " + m) 1000 + 4 d."}};
  const codegen::Catalogue constant = WithoutProcessNoise(settings.records);
  const codegen::Model model(settings.robot, constant), drifting(settings.robot, settings.records),
      wide(WithoutPrior(settings.robot), constant);
  if (!CompiledFor(model, OnlineFilter::kKalman)) {
    sheet.notes = {"The estimators in this program are compiled for er20_like."};
    out.sheets.push_back(sheet);
    return;
  }
  const BoundTrial trial(settings, motions, model, drifting, wide);
  const int draws = std::min(settings.draws, kDrawsOfMotion);
  const std::string kalman = "Kalman filter, firmware", squares = "weighted least squares";
  const std::vector<Tally> empty{{squares, "none", "Cramer-Rao", "analytic"},
                                 {kalman, "none", "Cramer-Rao", "analytic"},
                                 {kalman, "the file's", "Bayesian", "analytic"},
                                 {kalman + ", process noise", "the file's", "of its gains", "analytic"},
                                 {"forgetting, firmware", "the file's", "of its weights", "analytic"},
                                 {squares, "none", "Cramer-Rao", "plant"},
                                 {kalman, "none", "Cramer-Rao", "plant"}};
  std::vector<std::vector<Tally>> of_motion(kMotions, empty);
  ForEachDraw(settings, "bounds", kMotions, [&](int m) {
    ExcitedBy excited;
    Excite(settings.robot, settings.records,
           {settings.search_s, settings.seed + 100 + static_cast<std::uint64_t>(m), settings.stop, kSearchStarts},
           excited);
    trial.Analytic(excited.series, m, draws, of_motion[static_cast<std::size_t>(m)]);
    trial.Plant(excited.series, m, draws, of_motion[static_cast<std::size_t>(m)]);
  });
  if (settings.Stopped()) return;
  std::vector<Tally> all = of_motion[0];
  for (std::size_t m = 1; m < of_motion.size(); ++m)
    for (std::size_t r = 0; r < all.size(); ++r) {
      all[r].square[m] = of_motion[m][r].square[m], all[r].least[m] = of_motion[m][r].least[m];
      all[r].draws[m] = of_motion[m][r].draws[m], all[r].inside += of_motion[m][r].inside;
    }
  const BoundGoals analytic{1.10, 1.20, 0.93, 0.97, 0.88}, plant{1.3, NAN, 0.90, 0.97, NAN},
      error_alone{1.3, NAN, NAN, NAN, NAN};
  for (std::size_t r = 0; r < all.size(); ++r) {
    const Tally& tally = all[r];
    const std::vector<double> ratios = tally.Ratios();
    std::vector<double> least(std::begin(tally.least), std::end(tally.least));
    std::sort(least.begin(), least.end());
    const VectorXd share = tally.inside / tally.Draws();
    const double median = (ratios[(ratios.size() - 1) / 2] + ratios[ratios.size() / 2]) / 2;
    sheet.rows.push_back({tally.truth, tally.estimator, tally.prior, tally.bound, static_cast<double>(tally.Draws()),
                          median, ratios.back(), share.mean(), share.minCoeff(), least[kMotions / 2]});
    AskFor(tally,
           r < kPlantSquares    ? analytic
           : r == kPlantSquares ? plant
                                : error_alone,
           median, ratios.back(), share.mean(), share.minCoeff(), out);
  }
  out.sheets.push_back(sheet);
}

}  // namespace armcal::survey
