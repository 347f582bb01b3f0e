// survey - whether friction laws are found again in logs of the plant, and whether their intervals hold the truth.
#include <Eigen/Cholesky>
#include <cmath>
#include <map>

#include "host_sim/identify/choice/fit_model.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"
#include "host_sim/machine/plant/random.hpp"
#include "host_sim/study/survey/law_draw.hpp"
#include "host_sim/study/survey/plant_run.hpp"
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

// The torque error of each joint, and the least that the rows allow.
// A: whitened rows at the truth; error: of the fit's torque, whitened.
void TorqueErrors(const MatrixXd& A, const VectorXd& error, const std::vector<int>& of_row,
                  std::vector<OfJoint>& joints) {
  MatrixXd H = A.transpose() * A;
  const VectorXd scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  H = scale.asDiagonal() * H * scale.asDiagonal();
  H.diagonal().array() += 1e-12;
  const MatrixXd W = A * scale.asDiagonal();
  const MatrixXd solved = H.llt().solve(W.transpose());
  VectorXd rows = VectorXd::Zero(static_cast<Eigen::Index>(joints.size()));
  for (Eigen::Index r = 0; r < A.rows(); ++r) {
    const int j = of_row[static_cast<std::size_t>(r)];
    OfJoint& joint = joints[static_cast<std::size_t>(j)];
    joint.error += error[r] * error[r], joint.bound += W.row(r).dot(solved.col(r));
    rows[j] += 1;
  }
  for (std::size_t j = 0; j < joints.size(); ++j)
    joints[j].error /= rows[static_cast<Eigen::Index>(j)], joints[j].bound /= rows[static_cast<Eigen::Index>(j)];
}

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
  TorqueErrors(A, at_fit.residual - at_truth.residual, at_fit.joint, out.joint);
  for (int j = 0; j < model.joints(); ++j) {
    OfJoint& joint = out.joint[static_cast<std::size_t>(j)];
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

constexpr int kPayloads = 3;
constexpr double kPayloadRun_s = 14;

// (9): one arm in three runs, each with a payload of its own that is declared. All runs share the arm's parameters and
// f1 of each joint, while f1's column belongs to the run. A model has one payload for all logs, so the column is made
// here: the payload's torque by the last link's body columns.
OfDraw RecoverLoad(const Settings& settings, const Motions& motions, std::uint64_t seed) {
  plant::Random random(seed);
  const codegen::Model model(Variant(settings.robot, Law::kCoulombViscous, Bodies::kBase, {}), settings.records);
  const int n = model.joints(), columns = model.columns();
  PlantSettings plant;
  plant.friction = plant.torque_constant = 0;
  plant.truth_seed = seed, plant.noise_seed = kPayloads * seed, plant.seconds = kPayloadRun_s;
  plant.load_loss.resize(n);
  for (double& f1 : plant.load_loss) f1 = random.Uniform(0.02, 0.1);
  VectorXd truth(columns + n);
  truth << SetParameters(model), plant.load_loss;
  const VectorXd sigma = SampleNoise(settings.robot);
  MatrixXd A;  // whitened
  VectorXd tau;
  std::vector<int> joint;
  for (int k = 0; k < kPayloads; ++k, ++plant.noise_seed) {
    plant::Body body;
    body.mass_kg = random.Uniform(1, 5) + 4 * k;
    body.center_m = {random.Uniform(-0.05, 0.05), random.Uniform(-0.05, 0.05), random.Uniform(0.05, 0.2)};
    const double inertia = body.mass_kg * random.Uniform(1e-3, 4e-3);
    body.inertia_kgm2 = {inertia, 0, 0, inertia, 0, inertia};
    plant.payload = body;
    const calibration::Dataset log =
        WithoutRotors(settings.robot, model, RunPlant(settings.robot, motions.nonlinear.series, plant));
    VectorXd about_centre(10);
    about_centre << body.mass_kg, body.center_m[0], body.center_m[1], body.center_m[2], inertia, 0, 0, inertia, 0,
        inertia;
    const VectorXd declared = calibration::ToOrigin(about_centre);
    const calibration::Problem problem = calibration::MakeProblem(model, {&log});
    const calibration::Rows rows = calibration::StackRows(problem, problem.start);
    std::vector<MatrixXd> of_body;
    model.BodyColumns(log.s, n - 1, of_body);
    const Eigen::Index first = A.rows(), count = rows.K.rows();
    A.conservativeResize(first + count, columns + n), tau.conservativeResize(first + count);
    A.bottomRows(count) << rows.K, MatrixXd::Zero(count, n);
    for (Eigen::Index r = 0; r < count; ++r) {
      const int j = rows.joint[static_cast<std::size_t>(r)];
      const double load =
          of_body[static_cast<std::size_t>(j)].row(rows.sample[static_cast<std::size_t>(r)]).dot(declared);
      A(first + r, columns + j) = load;
      A.row(first + r) /= sigma[j];
      tau[first + r] = (rows.tau[r] - load) / sigma[j];
      joint.push_back(j);
    }
  }
  const Eigen::LDLT<MatrixXd> solver(MatrixXd(A.transpose() * A));
  const VectorXd found = solver.solve(A.transpose() * tau);
  const MatrixXd covariance = solver.solve(MatrixXd::Identity(columns + n, columns + n));
  const VectorXd sd = covariance.diagonal().cwiseSqrt();
  OfDraw out;
  out.joint.resize(static_cast<std::size_t>(n));
  out.above_truth = 0.5 * ((tau - A * found).squaredNorm() - (tau - A * truth).squaredNorm());
  TorqueErrors(A, A * (found - truth), joint, out.joint);
  for (int j = 0; j < n; ++j)
    for (const int c :
         {PlaceOf(model, "Fc" + std::to_string(j + 1)), PlaceOf(model, "Fv" + std::to_string(j + 1)), columns + j}) {
      OfJoint& of = out.joint[static_cast<std::size_t>(j)];
      ++of.intervals;
      of.inside += std::abs(found[c] - truth[c]) <= kTwoSided * sd[c];
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
  // A joint has one law of seven, but here all joints of an arm have (9).
  std::vector<OfDraw> loads(static_cast<std::size_t>((settings.draws + 6) / 7));
  ForEachDraw(settings, "laws, (9)", static_cast<int>(loads.size()), [&](int d) {
    loads[static_cast<std::size_t>(d)] =
        RecoverLoad(settings, motions, settings.seed * 104723 + static_cast<std::uint64_t>(d));
  });
  if (settings.Stopped()) return;
  std::map<std::string, OfLaw> of_law;
  int above = 0;
  double largest = -INFINITY;
  const auto count = [&](const OfDraw& draw, const auto& name_of) {
    above += !(draw.above_truth <= 0);
    largest = std::max(largest, draw.above_truth);
    for (std::size_t j = 0; j < draw.joint.size(); ++j) {
      const OfJoint& joint = draw.joint[j];
      OfLaw& sum = of_law[name_of(j)];
      ++sum.draws, sum.inside += joint.inside, sum.intervals += joint.intervals, sum.open += joint.open;
      sum.error += joint.error, sum.bound += joint.bound;
    }
  };
  for (std::size_t d = 0; d < found.size(); ++d)
    count(found[d], [&](std::size_t j) {
      const choice::FrictionLaw& law = laws[d][j];
      return law.equation.empty() ? law.name : law.equation + " " + law.name;
    });
  for (const OfDraw& draw : loads) count(draw, [](std::size_t) { return std::string("(9) load"); });
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
       "linear. Open: the logs do not bound the parameter on one side or on both.",
       "(9): all joints of an arm, in three runs of 14 s with a declared payload of 1 to 13 kg each."}};
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
