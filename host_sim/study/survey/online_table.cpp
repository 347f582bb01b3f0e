// survey - how accurate the firmware's estimator is after ten seconds, and whether it reports wrong deviations.
#include <Eigen/Cholesky>
#include <cmath>
#include <memory>

#include "host_sim/identify/calibration/prior.hpp"
#include "host_sim/machine/plant/random.hpp"
#include "host_sim/study/survey/online_run.hpp"
#include "host_sim/study/survey/platform.hpp"
#include "host_sim/study/survey/tables.hpp"

namespace armcal::survey {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// What is drawn, and what the filter is told.
struct Protocol {
  std::string name;
  PriorError error;
  double told = 1;                              // stated width of the prior over the width drawn
  double ripple = 0;                            // undeclared torque, share of tau_max
  OnlineFilter filter = OnlineFilter::kKalman;  // kExtended: the truth of (4) is drawn, too
  bool changes = false;                         // the filter is told so: process noise as in the records that ship
  bool about_friction = false;                  // along the motion that is searched for friction
};

struct Drawn {
  Score score;
  bool inconsistent = false, converged = false;
};

// CAD values as drawn, rotor inertias among them.
codegen::Robot DrawTable(const codegen::Robot& truth, const Protocol& protocol, std::uint64_t seed) {
  codegen::Robot robot = DrawPrior(truth, protocol.error, seed);
  plant::Random random(seed + 1);
  for (codegen::Joint& joint : robot.joint) {
    const double u = random.Uniform(-1, 1);
    const double sign = protocol.error.kind == PriorError::kWorst ? std::copysign(1.0, u) : u;
    joint.motor.rotor_inertia_kgm2 *= 1 + protocol.error.width * sign;
  }
  robot.link_relative_sd *= protocol.told;
  robot.friction_relative_sd *= protocol.told;
  return robot;
}

std::unique_ptr<Truth> DrawTruth(const Settings& settings, const Motions& motions, std::uint64_t seed) {
  const Stribeck drawn = DrawStribeck(settings.robot.joints(), seed);
  return std::make_unique<Truth>(AnalyticTruth(codegen::Model(StribeckArm(settings.robot, drawn), settings.records),
                                               Sampled(motions.nonlinear.series), Sampled(motions.other)));
}

// Torque that no model here has: a wave over each joint's position, sin(20 q).
MatrixXd Ripple(const Truth& truth, const Levels& levels, double share) {
  MatrixXd torque = (20 * truth.train.s.q.array()).sin();
  for (Eigen::Index j = 0; j < torque.cols(); ++j) torque.col(j) *= share * levels.tau_max_Nm[j];
  return torque;
}

// The bound of Cramer and Rao: the least base error (Score::e_base) of any unbiased estimator that sees these rows.
double CramerRao(const Truth& truth) {
  const codegen::Model& model = truth.model;
  std::vector<int> active;
  for (int c = 0; c < model.columns(); ++c)
    if (model.is_rigid(c) || model.table()[model.table_index(c)].state == "estimated") active.push_back(c);
  const auto size = static_cast<Eigen::Index>(active.size());
  MatrixXd seen = MatrixXd::Zero(size, size), asked = seen;
  VectorXd unit = VectorXd::Zero(truth.z.size());
  std::vector<MatrixXd> train, other;
  for (const int c : active) {
    unit.setZero();
    unit[c] = 1;
    train.push_back(Torque(model, truth.train.s, unit));
    other.push_back(Torque(model, truth.other, unit));
  }
  for (int j = 0; j < model.joints(); ++j) {
    const codegen::Joint& joint = model.robot().joint[j];
    MatrixXd rows(truth.train.samples(), size), judged(truth.other.samples(), size);
    for (Eigen::Index c = 0; c < size; ++c) rows.col(c) = train[c].col(j), judged.col(c) = other[c].col(j);
    for (Eigen::Index k = 0; k < rows.rows(); ++k)
      if (!Moves(truth.train.s.qd(k, j), joint)) rows.row(k).setZero();
    const double weight = 1 / (truth.sigma_Nm[j] * truth.sigma_Nm[j]);
    seen += weight * rows.transpose() * rows;
    asked += weight * judged.transpose() * judged;
  }
  const double count = static_cast<double>(truth.other.samples() * model.joints());
  return std::sqrt(seen.ldlt().solve(asked).trace() / count);
}

std::vector<Drawn> RunProtocol(const Settings& settings, const Motions& motions, const Truth& set,
                               const Protocol& protocol) {
  std::vector<Drawn> out(static_cast<std::size_t>(settings.draws));
  const Stribeck believed = BelievedStribeck(settings.robot.joints());
  const codegen::Catalogue records = protocol.changes ? settings.records : WithoutProcessNoise(settings.records);
  const MatrixXd hidden = Ripple(set, settings.levels, protocol.ripple);
  ForEachDraw(settings, "online, " + protocol.name, settings.draws, [&](int d) {
    const std::uint64_t seed = (settings.seed + 23) * 1000003 + 4 * static_cast<std::uint64_t>(d);
    std::unique_ptr<Truth> own;
    if (protocol.filter == OnlineFilter::kExtended) own = DrawTruth(settings, motions, seed + 3);
    const Truth& truth = own ? *own : set;
    codegen::Robot table = DrawTable(settings.robot, protocol, seed);
    if (own) table = StribeckArm(table, believed);  // in the middle of its range, about the drawn friction
    const codegen::Model prior(table, records);
    const MatrixXd measured = truth.train.tau + hidden + Noise(truth.train.samples(), truth.sigma_Nm, seed + 2);
    const OnlineResult got = RunOnTarget(prior, Measured(truth.train.s, measured), truth.sigma_Nm, protocol.filter);
    Drawn& drawn = out[static_cast<std::size_t>(d)];
    drawn.score = Judge(truth, settings.levels, measured, got.solution, calibration::BodyMean(prior));
    drawn.inconsistent = got.inconsistent;
    drawn.converged = got.solution.converged;
  });
  return out;
}

}  // namespace

void ShowOnline(const Settings& settings, const Motions& motions, Findings& out) {
  const Truth truth = AnalyticTruth(codegen::Model(settings.robot, settings.records), Sampled(motions.linear.series),
                                    Sampled(motions.other));
  const double bound = CramerRao(truth);
  const PriorError worst{PriorError::kWorst, 0.2}, uniform{PriorError::kUniform, 0.2}, wide{PriorError::kUniform, 0.5};
  std::vector<Protocol> protocols{
      {"worst case +-20 %", worst},
      {"worst case +-20 %", worst, 1, 0, OnlineFilter::kForgetting},
      {"uniform +-20 %", uniform},
      {"uniform +-50 %", wide},
      {"uniform +-20 %, half of it stated", uniform, 0.5},
      {"worst case +-20 %, half of it stated", worst, 0.5},
      {"uniform +-20 %, ripple of 1 % of tau_max", uniform, 1, 0.01, OnlineFilter::kKalman, true},
      {"uniform +-20 %, process noise as shipped", uniform, 1, 0, OnlineFilter::kKalman, true},
      {"(4), uniform +-20 %", uniform, 1, 0, OnlineFilter::kExtended},
  };
  if (motions.friction.searches > 0)
    protocols.push_back(
        {"(4), uniform +-20 %, motion for friction", uniform, 1, 0, OnlineFilter::kExtended, false, true});
  Sheet sheet{
      "online",
      "the firmware's estimator after 10 s, float32, physical read-out",
      {"prior", "filter", "draws", "e_d", "e_d p95", "e_d / e_d(prior)", "e_f", "share e_f < .2", "J_e",
       "base error / sigma", "over Cramer-Rao", "coverage", "share physical", "share inconsistent", "share converged",
       "time p95 / ms"},
      {},
      {"Samples at 100 Hz with Table 7's noise on each, on the trajectory of Table 8; rotor inertias are drawn and "
       "estimated, too. Coverage: share of base and friction parameters inside their 95 % interval.",
       "The truth does not change, and the filters are told so, as in (18), (19) and (21). The row with a ripple and "
       "one "
       "more have the process noise of the records that ship. Its bound is in the table of bounds.",
       "(4): truths as in Table 9; CAD knows the middle of their range. The motion is that of Table 9, searched for "
       "cond(K), or one searched for small deviations of friction, as `armcal excite --criterion friction` does. Rows "
       "below 0.01 rad/s are "
       "left out; with the robot file's limits of 0.02 and 0.06 less is seen of the law.",
       "base error: torque on another trajectory, truth against estimate; Cramer-Rao: the least that the same rows "
       "allow without a prior."}};
  const codegen::Model stribeck(StribeckArm(settings.robot, BelievedStribeck(settings.robot.joints())),
                                settings.records);
  if (!CompiledFor(truth.model, OnlineFilter::kKalman) || !CompiledFor(stribeck, OnlineFilter::kExtended)) {
    sheet.notes = {"The estimators in this program are compiled for er20_like."};
    out.sheets.push_back(sheet);
    return;
  }
  for (const Protocol& protocol : protocols) {
    const std::vector<Drawn> drawn =
        RunProtocol(settings, protocol.about_friction ? AlongFriction(motions) : motions, truth, protocol);
    if (settings.Stopped()) return;
    std::vector<Score> scores;
    double inconsistent = 0, converged = 0, near = 0;
    for (const Drawn& d : drawn) {
      scores.push_back(d.score);
      scores.back().seconds *= 1e3;
      inconsistent += d.inconsistent, converged += d.converged, near += d.score.e_f < 0.2;
    }
    const double count = static_cast<double>(drawn.size());
    const Statistic e_d = Over(scores, &Score::e_d), base = Over(scores, &Score::e_base);
    const bool extended = protocol.filter == OnlineFilter::kExtended;
    const double over_bound = extended ? std::nan("") : base.mean / bound;  // there the bound depends on the draw
    sheet.rows.push_back({protocol.name, Name(protocol.filter), count, Cell(e_d.mean, e_d.low, e_d.high), e_d.p95,
                          Mean(scores, &Score::e_d_over_prior), Mean(scores, &Score::e_f), near / count,
                          Mean(scores, &Score::J_e), Cell(base.mean, base.low, base.high), over_bound,
                          Mean(scores, &Score::coverage), Over(scores, &Score::physical).mean, inconsistent / count,
                          converged / count, Over(scores, &Score::seconds).p95});
    const std::string where = "Table 8, in the firmware, " + Name(protocol.filter) + ", " + protocol.name + ": ";
    if (extended) {
      if (protocol.about_friction)  // cond(K) does not ask how well friction is seen
        out.goals.push_back({where + "mean e_f", Over(scores, &Score::e_f).mean, 0.06, true});
      out.goals.push_back({where + "share of draws with e_f < .2", near / count, 0.98, false});
      out.goals.push_back({where + "mean J_e", Over(scores, &Score::J_e).mean, 0.3, true});
    }
    if (protocol.error.kind != PriorError::kWorst || protocol.told != 1) continue;
    out.goals.push_back({where + "mean e_d", e_d.mean, 0.19, true});
    out.goals.push_back({where + "95th percentile of e_d", e_d.p95, 0.19, true});
    out.goals.push_back({where + "mean e_d / e_d(prior)", Over(scores, &Score::e_d_over_prior).mean, 0.9, true});
    out.goals.push_back({where + "mean e_f", Over(scores, &Score::e_f).mean, 0.02, true});
    out.goals.push_back({where + "mean J_e", Over(scores, &Score::J_e).mean, 0.25, true});
    out.goals.push_back({where + "share of draws with physical bodies", Over(scores, &Score::physical).mean, 1, false});
    out.goals.push_back({where + "base error over Cramer-Rao", base.mean / bound, 1.15, true});
  }
  out.sheets.push_back(sheet);
}

}  // namespace armcal::survey
