// tool - armcal excite: searches an excitation trajectory, checks it against the limits, and writes it.
#include <fmt/format.h>

#include <cstdio>
#include <map>
#include <optional>

#include <unistd.h>

#include "host_sim/diagnose/verdict/json.hpp"
#include "host_sim/identify/collision/clearance.hpp"
#include "host_sim/identify/excitation/compose.hpp"
#include "host_sim/identify/excitation/optimise.hpp"
#include "host_sim/identify/excitation/target.hpp"
#include "host_sim/tool/command_line.hpp"
#include "host_sim/tool/interrupt.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

struct ExciteOptions {
  std::string robot, out, json, from, cell;
  std::string purpose = "train", curve = "fourier", criterion = "condition", search = "gradient";
  std::vector<std::string> separate;
  std::uint64_t seed = 1;
  int periods = 0, harmonics = 5, starts = 0;
  double seconds = 20, period_s = 10, step_s = 0.004, margin = 0.05, clearance_m = 0.02;
  bool no_slow = false, clearance_asked = false;
};

constexpr int kTrainPeriods = 4, kTestPeriods = 2, kTrainSpeeds = 6, kTestSpeeds = 2;

excitation::Target MakeTarget(const codegen::Robot& robot, const ExciteOptions& o) {
  using Kind = excitation::Criterion::Kind;
  const codegen::Catalogue records = LoadCatalogue();
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

void PrintClearance(const collision::Clearance& clearance, const collision::Nearest& nearest) {
  if (clearance.pairs() == 0) fmt::print("collisions: no pair of solids to check\n");
  else
    fmt::print("collisions: {} pairs keep {:.1f} mm; nearest {:.1f} mm at {:.3f} s, {} and {}\n", clearance.pairs(),
               1e3 * clearance.margin_m(), 1e3 * nearest.distance_m,
               excitation::kCheckStep_s * static_cast<double>(nearest.sample), nearest.a, nearest.b);
  std::map<std::string, std::vector<std::string>> by_reason;
  for (const auto& [a, b, reason] : clearance.unchecked()) by_reason[reason].push_back(a + " - " + b);
  for (const auto& [reason, pairs] : by_reason) fmt::print("  not checked, {}: {}\n", reason, fmt::join(pairs, ", "));
  if (!clearance.shapeless().empty())
    fmt::print("  not checked, no shape on what these joints move: {}\n", fmt::join(clearance.shapeless(), ", "));
}

nlohmann::ordered_json ClearanceJson(const collision::Clearance& clearance, const collision::Nearest& nearest) {
  nlohmann::ordered_json json{{"margin_m", clearance.margin_m()}, {"pairs", clearance.pairs()}};
  if (clearance.pairs() > 0)
    json["nearest"] = {{"distance_m", nearest.distance_m},
                       {"t_s", excitation::kCheckStep_s * static_cast<double>(nearest.sample)},
                       {"pair", {nearest.a, nearest.b}}};
  json["unchecked"] = nlohmann::ordered_json::array();
  for (const auto& [a, b, reason] : clearance.unchecked())
    json["unchecked"].push_back({{"pair", {a, b}}, {"why", reason}});
  json["without_shape"] = clearance.shapeless();
  return json;
}

excitation::Optimum Search(const excitation::Target& target, const collision::Clearance* clearance,
                           const ExciteOptions& o) {
  excitation::OptimiseSettings s;
  s.shape.family = excitation::FamilyNamed(o.curve);
  s.shape.period_s = o.period_s;
  s.shape.terms = 2 * o.harmonics;
  if (target.observation().model().nonlinear() > 0) s.shape.samples = 250;
  s.shape.samples = std::max(s.shape.samples, 16 * o.harmonics);
  s.criterion = target.criterion();
  s.search = o.search == "genetic" ? excitation::Search::kGenetic : excitation::Search::kGradient;
  s.margin = o.margin;
  s.clearance = clearance;
  s.seconds = o.seconds;
  if (o.starts > 0) s.starts = o.starts;
  s.seed = 2 * o.seed + (o.purpose == "test" ? 1 : 0);  // one seed, two different trajectories
  s.stop = &InterruptGuard::interrupted();
  if (isatty(STDERR_FILENO))
    s.progress = [&](int starts, double figure) {
      fmt::print(stderr, "\r{} searches, {} {:.4g}  ", starts, excitation::Name(target.criterion().kind), figure);
    };
  const InterruptGuard guard;
  excitation::Optimum best = Optimise(target.observation(), s);
  if (s.progress) fmt::print(stderr, "\n");
  return best;
}

// What was asked to be accurate: one line a parameter, over one period.
nlohmann::ordered_json PrintAccuracy(const excitation::Target& target, const excitation::Series& series) {
  auto list = nlohmann::ordered_json::array();
  if (target.criterion().about.empty()) return list;
  const excitation::Observation& observation = target.observation();
  const Eigen::MatrixXd gram = PeriodGram(observation, series);
  const Eigen::VectorXd sd = excitation::Deviations(gram), separation = excitation::Separation(gram);
  fmt::print(
      "after one period at {} samples, all parameters unknown (separation: share of its torque that no other "
      "parameter explains)\n  {:<24} {:>12} {:>12}\n",
      excitation::kPeriodSamples, "parameter", "sd", "separation");
  for (const int place : target.criterion().about) {
    const std::string name = observation.model().column_name(observation.columns()[static_cast<std::size_t>(place)]);
    fmt::print("  {:<24} {:>12.4g} {:>12.3f}\n", name, sd[place], separation[place]);
    list.push_back({{"parameter", name}, {"sd", sd[place]}, {"separation", separation[place]}});
  }
  return list;
}

constexpr double kHardlyMoves = 0.05;  // of a joint's range

void PrintPeaks(const codegen::Robot& robot, const std::vector<excitation::JointPeaks>& peaks) {
  fmt::print("peaks on a {:g} ms grid (share of the limit); rad, rad/s, rad/s^2, N m (m, m/s, m/s^2, N)\n",
             1e3 * excitation::kCheckStep_s);
  fmt::print("  {:<10} {:>17} {:>5} {:>8} {:>5} {:>8} {:>5} {:>8} {:>5}\n", "joint", "position", "", "speed", "",
             "accel.", "", "torque", "");
  for (std::size_t j = 0; j < peaks.size(); ++j) {
    const auto& p = peaks[j];
    fmt::print("  {:<10} {:>8.3f} {:>8.3f} {:>4.0f}% {:>8.3f} {:>4.0f}% {:>8.2f} {:>4.0f}%", robot.joint[j].name,
               p.lowest_rad, p.highest_rad, 100 * p.position_share, p.speed_radps, 100 * p.speed_share,
               p.acceleration_radps2, 100 * p.acceleration_share);
    if (robot.has_prior) fmt::print(" {:>8.1f} {:>4.0f}%\n", p.torque_Nm, 100 * p.torque_share);
    else fmt::print(" {:>8} {:>5}\n", "unknown", "");
  }
  for (std::size_t j = 0; j < peaks.size(); ++j) {
    const auto [low, high] = robot.joint[j].position_limit_rad;
    const double share = (peaks[j].highest_rad - peaks[j].lowest_rad) / (high - low);
    if (share < kHardlyMoves)
      fmt::print("  {} moves over {:.1f} % of its range only: such a log says little of it\n", robot.joint[j].name,
                 100 * share);
  }
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

nlohmann::ordered_json Rows(const Eigen::MatrixXd& m) {
  auto list = nlohmann::ordered_json::array();
  for (Eigen::Index r = 0; r < m.rows(); ++r) list.push_back(std::vector<double>(m.row(r).begin(), m.row(r).end()));
  return list;
}

int RunExcite(const ExciteOptions& o) {
  const codegen::Model model = LoadModel(o.robot);
  const codegen::Robot& robot = model.robot();
  const excitation::Observation observation(model);
  const excitation::Observation without_rotors(model, excitation::Observation::Rotors::kLeftOut);
  const excitation::Target target = MakeTarget(robot, o);
  std::string unchecked;
  const auto checked = MakeClearance(robot, o, unchecked);
  const collision::Clearance* const clearance = checked ? &*checked : nullptr;
  const excitation::Optimum best = Search(target, clearance, o);
  const double condition = PeriodCondition(observation, best.series);

  excitation::ComposeSettings compose;
  const bool test = o.purpose == "test";
  compose.periods = o.periods > 0 ? o.periods : test ? kTestPeriods : kTrainPeriods;
  compose.slow_speeds = o.no_slow ? 0 : test ? kTestSpeeds : kTrainSpeeds;
  compose.step_s = o.step_s, compose.margin = o.margin;
  compose.clearance = clearance;
  const excitation::Composed composed = Compose(observation, best.series, compose);
  const double sample_s = robot.sample_ticks / robot.tick_rate_Hz;
  const double whole =
      observation.ConditionNumber(excitation::Sampled(trajectory::TrajectorySpline(composed.trajectory), sample_s));
  const double rigid_only = PeriodCondition(without_rotors, best.series);
  trajectory::WriteTrajectory(o.out, composed.trajectory);

  const auto columns = observation.columns().size();
  fmt::print("{}: cond(K) {:.3f} over one period, {:.3f} over the whole trajectory ({} searches, seed {}{})\n",
             robot.name, condition, whole, best.starts, o.seed, InterruptGuard::interrupted() ? ", interrupted" : "");
  fmt::print(
      "  columns: the {} filter coordinates that are estimated (rigid base, friction, effects); rows divided by the "
      "joint's torque "
      "noise; columns scaled to unit norm\n",
      columns);
  if (without_rotors.columns().size() != columns)
    fmt::print("  without the rotor inertias ({} columns): {:.3f}\n", without_rotors.columns().size(), rigid_only);
  if (!observation.left_out().empty())
    fmt::print("  not asked for, motion alone does not excite them: {}\n", fmt::join(observation.left_out(), ", "));
  if (o.criterion != "condition" || !o.separate.empty())
    fmt::print("  minimised: {}: {:.4g}\n", excitation::Name(target.criterion().kind), best.figure);
  const auto accuracy = PrintAccuracy(target, best.series);
  PrintPeaks(robot, composed.peaks);
  if (!robot.has_prior)
    fmt::print("  the robot file has prior = \"none\": torque is unknown, its limits are ignored\n");
  fmt::print("sections:");
  for (const auto& s : composed.sections)
    fmt::print(" {} {:.1f}-{:.1f} s{}", s.name, s.begin_s, s.end_s, &s == &composed.sections.back() ? "\n" : ",");
  if (clearance) PrintClearance(*clearance, composed.nearest);
  else fmt::print("collisions are not checked: look at the motion, and run it slowly first\n  {}\n", unchecked);
  fmt::print("written: {} ({:.1f} s, {} points, {:g} ms)\n", o.out, composed.trajectory.duration_s(),
             composed.trajectory.q.rows(), 1e3 * composed.trajectory.step_s);

  auto sections = nlohmann::ordered_json::array();
  for (const auto& s : composed.sections)
    sections.push_back({{"name", s.name}, {"begin_s", s.begin_s}, {"end_s", s.end_s}});
  nlohmann::ordered_json collisions;
  if (clearance) collisions = ClearanceJson(*clearance, composed.nearest);
  else collisions["why_not"] = unchecked;
  WriteJson(o.json, {{"robot", robot.name},
                     {"file", o.out},
                     {"purpose", o.purpose},
                     {"seed", o.seed},
                     {"searches", best.starts},
                     {"interrupted", InterruptGuard::interrupted().load()},
                     {"cond_period", condition},
                     {"cond_whole", whole},
                     {"cond_period_without_rotors", rigid_only},
                     {"columns", columns},
                     {"left_out", observation.left_out()},
                     {"row_weight", "1/torque_noise"},
                     {"column_scaling", "unit norm"},
                     {"duration_s", composed.trajectory.duration_s()},
                     {"step_s", composed.trajectory.step_s},
                     {"torque_limits_checked", robot.has_prior},
                     {"collisions_checked", clearance != nullptr},
                     {"collisions", collisions},
                     {"sections", sections},
                     {"peaks", PeaksJson(composed.peaks)},
                     {"minimised", excitation::Name(target.criterion().kind)},
                     {"figure", best.figure},
                     {"accuracy", accuracy},
                     {"series",
                      {{"curve", o.curve},
                       {"period_s", best.series.period_s},
                       {"rows", "coefficients (Fourier: a1..aL, b1..bL in rad/s), then q0"},
                       {"coefficient", Rows(best.series.coefficient)}}}});
  return kOk;
}

}  // namespace

void AddExcite(CLI::App& app, Action& action) {
  auto* verb =
      app.add_subcommand("excite",
                         "make a trajectory that shows the parameters, and that keeps the arm off itself and its cell\n"
                         "example: armcal excite --robot er20_like --out train.csv\n"
                         "         armcal excite --robot er20_like --out test.csv --purpose test");
  auto o = std::make_shared<ExciteOptions>();
  verb->add_option("--robot", o->robot, "robot file, or a name in codegen/robots")->required();
  verb->add_option("--out", o->out, "trajectory file to write: t,q1..qn")->required();
  verb->add_option("--purpose", o->purpose,
                   "train: 4 periods and slow moves; test: another series, 2 periods, few slow moves")
      ->check(OneOf({"train", "test"}))
      ->capture_default_str();
  verb->add_option("--seed", o->seed, "of the random starting points")->capture_default_str();
  verb->add_option("--periods", o->periods, "Fourier periods to play (default: by purpose)")->check(Between(1, 100));
  verb->add_option("--period", o->period_s, "length of a period in seconds")
      ->check(Between(1.0, 1000.0))
      ->capture_default_str();
  verb->add_option("--curve", o->curve, "what the period is made of")
      ->check(OneOf({"fourier", "sine", "polynomial", "spline"}))
      ->capture_default_str();
  auto* criterion =
      verb->add_option("--criterion", o->criterion,
                       "condition: cond(K); d-optimal: det(K'K); friction: accuracy of friction, low speeds included")
          ->check(OneOf({"condition", "d-optimal", "friction"}))
          ->capture_default_str();
  auto* separate =
      verb->add_option("--separate", o->separate,
                       "effects to tell apart: NAME, NAME:JOINT or NAME:JOINT-JOINT, ..., names as in docs/effects.md")
          ->delimiter(',')
          ->excludes(criterion);
  verb->add_option("--from", o->from, "with --separate: verdict (diagnose --json) with what was found of them")
      ->needs(separate);
  verb->add_option("--search", o->search, "gradient, or the survey's genetic algorithm")
      ->check(OneOf({"gradient", "genetic"}))
      ->capture_default_str();
  verb->add_option("--harmonics", o->harmonics, "terms of the Fourier series; other curves have twice as many")
      ->check(Between(1, 20))
      ->capture_default_str();
  verb->add_option("--seconds", o->seconds, "time for the search; Ctrl-C ends it early")
      ->check(Between(0.0, 1e6))
      ->capture_default_str();
  verb->add_option("--starts", o->starts, "searches at most; with time enough the result follows from the seed")
      ->check(Between(1, 1000000));
  verb->add_option("--step", o->step_s, "grid of the file in seconds")
      ->check(Between(0.0005, 0.05))
      ->capture_default_str();
  verb->add_option("--margin", o->margin, "share of every limit that is kept free")
      ->check(Between(0.01, 0.9))
      ->capture_default_str();
  verb->add_option("--cell", o->cell, "file with boxes and planes around the arm; the robot needs collision shapes");
  auto* distance = verb->add_option("--clearance", o->clearance_m,
                                    "smallest distance in m of links that are no neighbours, and to the cell")
                       ->check(Between(0.0, 1.0))
                       ->capture_default_str();
  verb->add_flag("--no-slow", o->no_slow, "leave the slow moves out");
  verb->add_option("--json", o->json, "write the figures here");
  verb->callback([o, distance, &action] {
    o->clearance_asked = distance->count() > 0;
    action = [o] { return RunExcite(*o); };
  });
}

}  // namespace armcal::tool
