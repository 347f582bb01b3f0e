// analysis - searches a series, composes the trajectory around it, and says what was found.
#include "host_sim/diagnose/analysis/excited.hpp"

#include <algorithm>

#include "codegen/src/generator/load.hpp"
#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/watch.hpp"
#include "host_sim/diagnose/verdict/json.hpp"

namespace armcal::analysis {

namespace {

constexpr int kTrainPeriods = 4, kTestPeriods = 2, kTrainSpeeds = 6, kTestSpeeds = 2;
constexpr double kSearchShare = 0.9;  // of the time that all takes, about
constexpr double kNearest_m = 0.005;  // the smallest distance that is tried where none was asked for

excitation::Target MakeTarget(const codegen::Robot& robot, const ExciteOptions& o) {
  using Kind = excitation::Criterion::Kind;
  const codegen::Catalogue records = codegen::LoadCatalogue();
  if (!o.separate.empty()) return {robot, records, o.separate, verdict::ReadFound(o.from, o.separate)};
  if (o.criterion == "friction") return excitation::Target::Friction(robot, records);
  return {robot, records, o.criterion == "d-optimal" ? Kind::kDOptimal : Kind::kCondition};
}

// What checks for collisions. Empty: nothing can; `why` says what is missing. InputError: but it was asked for.
std::optional<collision::Clearance> MakeClearance(const codegen::Robot& robot, const ExciteOptions& o,
                                                  std::string& why) {
  why = collision::WhyUncheckable(robot);
  if (!why.empty() && (!o.cell.empty() || o.clearance_asked))
    throw io::InputError(robot.path + ": collisions cannot be checked: " + why);
  if (!why.empty()) return std::nullopt;
  try {
    return collision::Clearance(robot, o.cell.empty() ? collision::Cell() : collision::ReadCell(o.cell), o.clearance_m);
  } catch (const io::InputError& e) {
    if (!o.cell.empty() || o.clearance_asked) throw;
    why = e.what();  // a mesh of a kind that is not read
    return std::nullopt;
  }
}

excitation::OptimiseSettings SearchSettings(const excitation::Target& target, const ExciteOptions& o) {
  excitation::OptimiseSettings s;
  s.shape.family = excitation::FamilyNamed(o.curve);
  s.shape.period_s = o.period_s;
  s.shape.terms = 2 * o.harmonics;
  if (target.observation().model().nonlinear() > 0) s.shape.samples = 250;
  s.shape.samples = std::max(s.shape.samples, 16 * o.harmonics);
  s.criterion = target.criterion();
  s.search = o.search == "genetic" ? excitation::Search::kGenetic : excitation::Search::kGradient;
  s.margin = o.margin;
  s.seconds = o.seconds;
  if (o.starts > 0) s.starts = o.starts;
  s.seed = 2 * o.seed + (o.purpose == "test" ? 1 : 0);  // one seed, two different trajectories
  return s;
}

std::vector<Excited::Accuracy> AccuracyOf(const excitation::Target& target, const excitation::Series& series) {
  std::vector<Excited::Accuracy> out;
  if (target.criterion().about.empty()) return out;
  const excitation::Observation& observation = target.observation();
  const Eigen::MatrixXd gram = PeriodGram(observation, series);
  const Eigen::VectorXd sd = excitation::Deviations(gram), separation = excitation::Separation(gram);
  for (const int place : target.criterion().about)
    out.push_back({observation.model().column_name(observation.columns()[static_cast<std::size_t>(place)]), sd[place],
                   separation[place]});
  return out;
}

nlohmann::ordered_json PeaksJson(const std::vector<excitation::JointPeaks>& peaks) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& p : peaks)
    list.push_back({{"position_rad", {p.lowest_rad, p.highest_rad}},
                    {"position_share", p.position_share},
                    {"speed_radps", p.speed_radps},
                    {"speed_share", p.speed_share},
                    {"acceleration_radps2", p.acceleration_radps2},
                    {"acceleration_share", p.acceleration_share},
                    {"torque_Nm", p.torque_Nm},
                    {"torque_share", p.torque_share}});
  return list;
}

nlohmann::ordered_json RowsJson(const Eigen::MatrixXd& m) {
  auto list = nlohmann::ordered_json::array();
  for (Eigen::Index r = 0; r < m.rows(); ++r) list.push_back(std::vector<double>(m.row(r).begin(), m.row(r).end()));
  return list;
}

}  // namespace

Excited::Excited(const codegen::Model& model, const ExciteOptions& given, const std::atomic<bool>* stop,
                 const Tell& tell)
    : options(given),
      observation(model),
      without_rotors(model, excitation::Observation::Rotors::kLeftOut),
      target(MakeTarget(model.robot(), given)),
      clearance(MakeClearance(model.robot(), given, unchecked)) {
  while (!FindMotion(stop, tell)) {
    too_far_m.push_back(clearance->margin_m());
    clearance.emplace(model.robot(), collision::Cell(), clearance->margin_m() / 2);
  }
  condition = PeriodCondition(observation, best.series);
  const double sample_s = model.robot().sample_ticks / model.robot().tick_rate_Hz;
  whole = observation.ConditionNumber(excitation::Sampled(trajectory::TrajectorySpline(composed.trajectory), sample_s));
  rigid_only = PeriodCondition(without_rotors, best.series);
  accuracy = AccuracyOf(target, best.series);
  interrupted = stop && *stop;
}

bool Excited::FindMotion(const std::atomic<bool>* stop, const Tell& tell) {
  excitation::OptimiseSettings search = SearchSettings(target, options);
  search.clearance = clearance ? &*clearance : nullptr;
  search.stop = stop;
  if (tell)
    search.progress = [&](int searches, double figure) {
      tell(searches, excitation::Name(target.criterion().kind), figure);
    };
  const bool test = options.purpose == "test";
  excitation::ComposeSettings compose;
  compose.periods = options.periods > 0 ? options.periods : test ? kTestPeriods : kTrainPeriods;
  compose.slow_speeds = options.no_slow ? 0 : test ? kTestSpeeds : kTrainSpeeds;
  compose.step_s = options.step_s, compose.margin = options.margin;
  compose.clearance = search.clearance;
  try {
    {
      const io::Stage stage(0, kSearchShare);
      best = Optimise(target.observation(), search);
    }
    composed = Compose(observation, best.series, compose);
    return true;
  } catch (const io::InputError&) {
    const bool may_be_nearer = clearance && !options.clearance_asked && options.cell.empty();
    if (!may_be_nearer || clearance->margin_m() < 2 * kNearest_m) throw;
    return false;
  }
}

codegen::Signals Excited::Motion() const {
  const trajectory::Trajectory& points = composed.trajectory;
  const trajectory::TrajectorySpline spline(points);
  codegen::Signals s;
  s.t = Eigen::VectorXd::LinSpaced(points.q.rows(), 0, points.duration_s());
  s.q = points.q, s.qd = s.qdd = points.q;
  for (Eigen::Index k = 0; k < s.t.size(); ++k) {
    s.qd.row(k) = spline.Speed(s.t[k]);
    s.qdd.row(k) = spline.Acceleration(s.t[k]);
  }
  return s;
}

nlohmann::ordered_json Excited::ClearanceJson() const {
  if (!clearance) return {{"why_not", unchecked}};
  const collision::Nearest& nearest = composed.nearest;
  nlohmann::ordered_json json{
      {"margin_m", clearance->margin_m()}, {"no_motion_at_m", too_far_m}, {"pairs", clearance->pairs()}};
  if (clearance->pairs() > 0)
    json["nearest"] = {{"distance_m", nearest.distance_m},
                       {"t_s", excitation::kCheckStep_s * static_cast<double>(nearest.sample)},
                       {"pair", {nearest.a, nearest.b}}};
  json["unchecked"] = nlohmann::ordered_json::array();
  for (const auto& [a, b, reason] : clearance->unchecked())
    json["unchecked"].push_back({{"pair", {a, b}}, {"why", reason}});
  json["without_shape"] = clearance->shapeless();
  return json;
}

nlohmann::ordered_json Excited::ToJson() const {
  auto sections = nlohmann::ordered_json::array(), told = sections;
  for (const auto& s : composed.sections)
    sections.push_back({{"name", s.name}, {"begin_s", s.begin_s}, {"end_s", s.end_s}});
  for (const Accuracy& a : accuracy)
    told.push_back({{"parameter", a.parameter}, {"sd", a.sd}, {"separation", a.separation}});
  return {{"purpose", options.purpose},
          {"seed", options.seed},
          {"searches", best.starts},
          {"interrupted", interrupted},
          {"cond_period", condition},
          {"cond_whole", whole},
          {"cond_period_without_rotors", rigid_only},
          {"columns", observation.columns().size()},
          {"left_out", observation.left_out()},
          {"row_weight", "1/torque_noise"},
          {"column_scaling", "unit norm"},
          {"duration_s", composed.trajectory.duration_s()},
          {"step_s", composed.trajectory.step_s},
          {"torque_limits_checked", observation.model().robot().has_prior},
          {"collisions_checked", clearance.has_value()},
          {"collisions", ClearanceJson()},
          {"sections", sections},
          {"peaks", PeaksJson(composed.peaks)},
          {"minimised", excitation::Name(target.criterion().kind)},
          {"figure", best.figure},
          {"accuracy", told},
          {"series",
           {{"curve", options.curve},
            {"period_s", best.series.period_s},
            {"rows", "coefficients (Fourier: a1..aL, b1..bL in rad/s), then q0"},
            {"coefficient", RowsJson(best.series.coefficient)}}}};
}

}  // namespace armcal::analysis
