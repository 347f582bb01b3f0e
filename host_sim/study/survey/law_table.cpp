// survey - whether friction laws are found again in logs of the plant, and whether their intervals hold the truth.
#include <Eigen/Cholesky>
#include <cmath>
#include <map>

#include "host_sim/identify/choice/fit_model.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"
#include "host_sim/study/survey/law_draw.hpp"
#include "host_sim/study/survey/tables.hpp"

namespace armcal::survey {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kTwoSided = 1.96;

// What one draw gives for one joint.
struct OfJoint {
  double error = 0, bound = 0;  // squares of torque in sigma, on the rows that were fitted
  int inside = 0, intervals = 0, open = 0;
};

struct OfDraw {
  std::vector<OfJoint> joint;
  double above_truth = NAN;  // the fit's cost over that of the truth, chi^2 / 2
};

double HalfSquares(const calibration::Linearised& at) { return 0.5 * at.residual.squaredNorm(); }

OfDraw Recover(const Settings& settings, const LawDraw& draw) {
  const codegen::Model model = LawModel(settings, draw);
  const calibration::Dataset log = calibration::Prepare(model, draw.train);
  calibration::Problem problem = calibration::MakeProblem(model, {&log});
  problem.covariance.resize(0, 0);
  problem.sigma_Nm = SampleNoise(settings.robot);
  problem.stop = settings.stop;
  const VectorXd truth = LawTruth(model, draw);
  problem.intervals = true;
  const calibration::Solution found = choice::SolveInRounds(problem);
  OfDraw out;
  out.joint.resize(static_cast<std::size_t>(model.joints()));
  if (!found.z.allFinite()) return out;
  const calibration::Linearised at_truth = calibration::Linearise(problem, truth),
                                at_fit = calibration::Linearise(problem, found.z);
  out.above_truth = HalfSquares(at_fit) - HalfSquares(at_truth);

  const std::vector<int> free = calibration::FreeCoordinates(problem);
  const MatrixXd A = at_truth.A(Eigen::all, free);
  MatrixXd H = A.transpose() * A;
  const VectorXd scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  H = scale.asDiagonal() * H * scale.asDiagonal();
  H.diagonal().array() += 1e-12;
  const MatrixXd W = A * scale.asDiagonal();
  const MatrixXd solved = H.llt().solve(W.transpose());
  VectorXd rows = VectorXd::Zero(model.joints());
  for (std::size_t r = 0; r < at_fit.joint.size(); ++r) {
    OfJoint& joint = out.joint[static_cast<std::size_t>(at_fit.joint[r])];
    const auto k = static_cast<Eigen::Index>(r);
    const double error = at_fit.residual[k] - at_truth.residual[k];
    joint.error += error * error, joint.bound += W.row(k).dot(solved.col(k));
    rows[at_fit.joint[r]] += 1;
  }
  for (int j = 0; j < model.joints(); ++j) {
    OfJoint& joint = out.joint[static_cast<std::size_t>(j)];
    joint.error /= rows[j], joint.bound /= rows[j];
    for (const int c : free) {
      const bool eta = c >= model.columns();
      const std::string& name = eta ? model.unknowns()[c - model.columns()].name : model.column_name(c);
      if ((!eta && model.is_rigid(c)) || name.back() != static_cast<char>('1' + j)) continue;
      const double sd = std::sqrt(std::max(0.0, found.covariance(c, c)));
      const double low = found.interval.size() ? found.interval(c, 0) : found.z[c] - kTwoSided * sd;
      const double high = found.interval.size() ? found.interval(c, 1) : found.z[c] + kTwoSided * sd;
      ++joint.intervals;
      joint.inside += low <= truth[c] && truth[c] <= high;
      joint.open += std::isinf(low) || std::isinf(high);
    }
  }
  return out;
}

// Over the draws of one law.
struct OfLaw {
  int draws = 0, inside = 0, intervals = 0, open = 0;
  double error = 0, bound = 0;
};

}  // namespace

void ShowLaws(const Settings& settings, const Motions& motions, Findings& out) {
  std::vector<OfDraw> found(static_cast<std::size_t>(settings.draws));
  std::vector<std::vector<choice::FrictionLaw>> laws(found.size());
  ForEachDraw(settings, "laws", settings.draws, [&](int d) {
    const LawDraw draw = DrawLaws(settings, motions, settings.seed * 104729 + static_cast<std::uint64_t>(d));
    laws[static_cast<std::size_t>(d)] = draw.law;
    found[static_cast<std::size_t>(d)] = Recover(settings, draw);
  });
  if (settings.Stopped()) return;
  std::map<std::string, OfLaw> of_law;
  int above = 0;
  double largest = -INFINITY;
  for (std::size_t d = 0; d < found.size(); ++d) {
    above += !(found[d].above_truth <= 0);
    largest = std::max(largest, found[d].above_truth);
    for (std::size_t j = 0; j < found[d].joint.size(); ++j) {
      const OfJoint& joint = found[d].joint[j];
      const choice::FrictionLaw& law = laws[d][j];
      OfLaw& sum = of_law[law.equation.empty() ? law.name : law.equation + " " + law.name];
      ++sum.draws, sum.inside += joint.inside, sum.intervals += joint.intervals, sum.open += joint.open;
      sum.error += joint.error, sum.bound += joint.bound;
    }
  }
  Sheet sheet{
      "laws",
      "friction laws found again, logs of the plant (40 s)",
      {"law", "joints", "torque error / sigma", "over the bound", "truth in the 95 % interval", "open intervals"},
      {},
      {"Each joint of each draw has one of seven laws with drawn parameters. The plant has its own form of each "
       "law. The fit knows which law a joint has, and has no prior.",
       "Torque error: torque of the fit against torque of the truth, on the rows that were fitted. Bound: the "
       "least of any unbiased estimator (Cramer and Rao) on these rows, with exact speeds.",
       "Intervals of friction parameters by the profile of the cost, +- 1.96 standard deviations where the law is "
       "linear. Open: the logs do not bound the parameter on one side or on both."}};
  for (const auto& [name, sum] : of_law) {
    const double ratio = std::sqrt(sum.error / sum.bound), inside = static_cast<double>(sum.inside) / sum.intervals;
    sheet.rows.push_back({name, static_cast<double>(sum.draws), std::sqrt(sum.error / sum.draws), ratio, inside,
                          static_cast<double>(sum.open) / sum.intervals});
    const std::string where = "Table laws, " + name + ": ";
    out.goals.push_back({where + "torque error over the bound", ratio, 1.15, true});
    out.goals.push_back({where + "share of truths in the 95 % interval, at least", inside, 0.90, false});
    out.goals.push_back({where + "share of truths in the 95 % interval, at most", inside, 0.98, true});
  }
  out.goals.push_back({"Table laws: fits that cost more than the truth", static_cast<double>(above), 0, true});
  sheet.notes.push_back("Largest cost of a fit over that of the truth, chi^2 / 2: " + std::to_string(largest));
  out.sheets.push_back(sheet);
}

}  // namespace armcal::survey
