// tool - armcal excite: writes an excitation trajectory, and prints how good it is.
#include <fmt/format.h>

#include <cstdio>
#include <map>

#include <unistd.h>

#include "host_sim/diagnose/analysis/excited.hpp"
#include "host_sim/tool/command_line.hpp"
#include "host_sim/tool/interrupt.hpp"
#include "host_sim/tool/verb.hpp"
#include "host_sim/tool/watched.hpp"

namespace armcal::tool {
namespace {

struct ExciteOptions {
  std::string robot, out, json;
  analysis::ExciteOptions how = {};
};

void PrintClearance(const collision::Clearance& clearance, const collision::Nearest& nearest,
                    const std::vector<double>& too_far_m) {
  if (clearance.pairs() == 0) fmt::print("collisions: no pair of solids to check\n");
  else
    fmt::print("collisions: {} pairs keep {:.1f} mm; nearest {:.1f} mm at {:.3f} s, {} and {}\n", clearance.pairs(),
               1e3 * clearance.margin_m(), 1e3 * nearest.distance_m,
               excitation::kCheckStep_s * static_cast<double>(nearest.sample), nearest.a, nearest.b);
  for (const double distance : too_far_m) fmt::print("  no motion was found that keeps {:.1f} mm\n", 1e3 * distance);
  std::map<std::string, std::vector<std::string>> by_reason;
  for (const auto& [a, b, reason] : clearance.unchecked()) by_reason[reason].push_back(a + " - " + b);
  for (const auto& [reason, pairs] : by_reason) fmt::print("  not checked, {}: {}\n", reason, fmt::join(pairs, ", "));
  if (!clearance.shapeless().empty())
    fmt::print("  not checked, no shape on what these joints move: {}\n", fmt::join(clearance.shapeless(), ", "));
}

// Ctrl-C ends the search early, with the best motion so far.
analysis::Excited Search(const codegen::Model& model, const analysis::ExciteOptions& how) {
  Watched line("excite");
  const auto tell = [&line](int starts, const char* name, double figure) {
    line.Note(fmt::format("{} searches, {} {:.4g}", starts, name, figure));
  };
  const InterruptGuard guard;
  return analysis::Excited(model, how, &InterruptGuard::interrupted(), tell);
}

// What was asked to be accurate: one line a parameter, over one period.
void PrintAccuracy(const std::vector<analysis::Excited::Accuracy>& accuracy) {
  if (accuracy.empty()) return;
  fmt::print(
      "after one period at {} samples, all parameters unknown (separation: share of its torque that no other "
      "parameter explains)\n  {:<24} {:>12} {:>12}\n",
      excitation::kPeriodSamples, "parameter", "sd", "separation");
  for (const auto& a : accuracy) fmt::print("  {:<24} {:>12.4g} {:>12.3f}\n", a.parameter, a.sd, a.separation);
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

template <class Number>
CLI::Validator Within(const analysis::Range<Number>& range) {
  return Between(range.lowest, range.highest);
}

int RunExcite(const ExciteOptions& o) {
  const codegen::Model model = LoadModel(o.robot);
  const codegen::Robot& robot = model.robot();
  const analysis::Excited found = Search(model, o.how);
  const excitation::Composed& composed = found.composed;
  trajectory::WriteTrajectory(o.out, composed.trajectory);

  const auto columns = found.observation.columns().size(), rigid = found.without_rotors.columns().size();
  fmt::print("{}: cond(K) {:.3f} over one period, {:.3f} over the whole trajectory ({} searches, seed {}{})\n",
             robot.name, found.condition, found.whole, found.best.starts, o.how.seed,
             found.interrupted ? ", interrupted" : "");
  fmt::print(
      "  columns: the {} filter coordinates that are estimated (rigid base, friction, effects); rows divided by the "
      "joint's torque "
      "noise; columns scaled to unit norm\n",
      columns);
  if (rigid != columns) fmt::print("  without the rotor inertias ({} columns): {:.3f}\n", rigid, found.rigid_only);
  if (!found.observation.left_out().empty())
    fmt::print("  not asked for, motion alone does not excite them: {}\n",
               fmt::join(found.observation.left_out(), ", "));
  if (o.how.criterion != "condition" || !o.how.separate.empty())
    fmt::print("  minimised: {}: {:.4g}\n", excitation::Name(found.target.criterion().kind), found.best.figure);
  PrintAccuracy(found.accuracy);
  PrintPeaks(robot, composed.peaks);
  if (!robot.has_prior)
    fmt::print("  the robot file has prior = \"none\": torque is unknown, its limits are ignored\n");
  fmt::print("sections:");
  for (const auto& s : composed.sections)
    fmt::print(" {} {:.1f}-{:.1f} s{}", s.name, s.begin_s, s.end_s, &s == &composed.sections.back() ? "\n" : ",");
  if (found.clearance) PrintClearance(*found.clearance, composed.nearest, found.too_far_m);
  else fmt::print("collisions are not checked: look at the motion, and run it slowly first\n  {}\n", found.unchecked);
  fmt::print("written: {} ({:.1f} s, {} points, {:g} ms)\n", o.out, composed.trajectory.duration_s(),
             composed.trajectory.q.rows(), 1e3 * composed.trajectory.step_s);

  nlohmann::ordered_json json{{"robot", robot.name}, {"file", o.out}};
  json.update(found.ToJson());
  WriteJson(o.json, json);
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
  verb->add_option("--purpose", o->how.purpose,
                   "train: 4 periods and slow moves; test: another series, 2 periods, few slow moves")
      ->check(OneOf(analysis::kPurposes))
      ->capture_default_str();
  verb->add_option("--seed", o->how.seed, "of the random starting points")->capture_default_str();
  verb->add_option("--periods", o->how.periods, "Fourier periods to play (default: by purpose)")
      ->check(Within(analysis::kPeriods));
  verb->add_option("--period", o->how.period_s, "length of a period in seconds")
      ->check(Within(analysis::kPeriod_s))
      ->capture_default_str();
  verb->add_option("--curve", o->how.curve, "what the period is made of")
      ->check(OneOf(analysis::kCurves))
      ->capture_default_str();
  auto* criterion =
      verb->add_option("--criterion", o->how.criterion,
                       "condition: cond(K); d-optimal: det(K'K); friction: accuracy of friction, low speeds included")
          ->check(OneOf(analysis::kCriteria))
          ->capture_default_str();
  auto* separate =
      verb->add_option("--separate", o->how.separate,
                       "effects to tell apart: NAME, NAME:JOINT or NAME:JOINT-JOINT, ..., names as in docs/effects.md")
          ->delimiter(',')
          ->excludes(criterion);
  verb->add_option("--found", o->how.from, "with --separate: verdict (diagnose --json) with what was found of them")
      ->needs(separate);
  verb->add_option("--search", o->how.search, "gradient, or the survey's genetic algorithm")
      ->check(OneOf(analysis::kSearches))
      ->capture_default_str();
  verb->add_option("--harmonics", o->how.harmonics, "terms of the Fourier series; other curves have twice as many")
      ->check(Within(analysis::kHarmonics))
      ->capture_default_str();
  verb->add_option("--search-seconds", o->how.seconds, "time for the search; Ctrl-C ends it early")
      ->check(Within(analysis::kSeconds))
      ->capture_default_str();
  verb->add_option("--starts", o->how.starts, "searches at most; with time enough the result follows from the seed")
      ->check(Within(analysis::kStarts));
  verb->add_option("--step", o->how.step_s, "grid of the file in seconds")
      ->check(Within(analysis::kStep_s))
      ->capture_default_str();
  verb->add_option("--margin", o->how.margin, "share of every limit that is kept free")
      ->check(Within(analysis::kMargin))
      ->capture_default_str();
  verb->add_option("--cell", o->how.cell,
                   "file with boxes and planes around the arm; the robot needs collision shapes");
  auto* distance = verb->add_option("--clearance", o->how.clearance_m,
                                    "smallest distance in m of links that are no neighbours, and to the cell")
                       ->check(Within(analysis::kClearance_m))
                       ->capture_default_str();
  verb->add_flag("--no-slow", o->how.no_slow, "leave the slow moves out");
  verb->add_option("--json", o->json, "write the figures here");
  verb->callback([o, distance, &action] {
    o->how.clearance_asked = distance->count() > 0;
    action = [o] { return RunExcite(*o); };
  });
}

}  // namespace armcal::tool
