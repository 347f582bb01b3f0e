// judged set - makes the cases of set II.
#include "tests/judged/set_two.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/judged/detection.hpp"
#include "tests/judged/forms.hpp"
#include "tests/judged/log.hpp"
#include "tests/judged/noise.hpp"

namespace armcal::judged {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using nlohmann::json;
using plant::Random;

namespace {

namespace fs = std::filesystem;

constexpr double kTrain_s = 40, kTest_s = 30, kIgnored_s = 0.5;
// The torque is linear between these samples. A filter or a sample off the even times sees how friction turns over
// within a few milliseconds.
constexpr double kFine_Hz = 500, kFinest_Hz = 4000;
constexpr int kTestDraws = 40, kStrengths = 12;
constexpr double kSmallest = 0.1, kLargest = 2;  // sizes over the noise in the band
constexpr double kSizeError = 0.08;

struct Setup {
  double rate_Hz = 250;  // of the rows
  std::string noise = "white";
  Channel channel;
  bool temperature = false;
  double true_rate_Hz() const { return rate_Hz / channel.hold; }
};

struct Planted {
  Effect effect;
  bool report_only = false;
  double gain = 1;
};

// What a motion of the arm leaves in a log.
struct Run {
  Run(const Arm& arm, const Setup& setup, const Motion& motion)
      : fine(motion),
        every(static_cast<int>(std::lround(1 / (setup.true_rate_Hz() * (motion.t[1] - motion.t[0]))))),
        m(Every(motion, every)),
        links(LinkTorque(arm, motion)),
        channel(setup.channel) {}
  // A torque along the fine motion as the log has it.
  MatrixXd Logged(const MatrixXd& torque) const {
    const MatrixXd passed = Passed(channel, torque, fine.t[1] - fine.t[0]);
    return passed(Eigen::seq(0, passed.rows() - 1, every), Eigen::all);
  }
  Motion fine;
  int every;
  Motion m;
  MatrixXd links;
  Channel channel;
};

MatrixXd BaseTorque(const Arm& arm, const Channel& c, const Motion& m, const MatrixXd& links) {
  MatrixXd tau = DeclaredTorque(arm, m, links);
  if (c.fed_joint >= 0) {
    const int j = c.fed_joint;
    tau.col(j).array() -= c.fed * (arm.coulomb[j] * Sign(m.qd.col(j)) + arm.viscous[j] * m.qd.col(j).array());
  }
  return tau;
}

Channel LateChannel(Random& r) {
  Channel c;
  const bool one_for_all = r.Uniform(0, 1) < 0.5;
  const int what = static_cast<int>(r.Uniform(0, 2.999));  // a filter, a delay, both
  c.name = std::vector<std::string>{"filtered", "delayed", "filtered and delayed"}[static_cast<std::size_t>(what)];
  const auto pole = [&] { return what == 1 ? 0 : 2 * std::pow(10, r.Uniform(0, 1)); };
  const auto delay = [&] { return what == 0 ? 0 : r.Uniform(0.004, 0.02); };
  c.pole_Hz = VectorXd::Constant(6, pole()), c.delay_s = VectorXd::Constant(6, delay());
  for (int j = 0; j < 6 && !one_for_all; ++j) c.pole_Hz[j] = pole(), c.delay_s[j] = delay();
  return c;
}

Channel StampChannel(Random& r, int number) {
  Channel c;
  if (number % 3 == 0) c.name = "held samples", c.hold = 3;
  if (number % 3 == 1) c.name = "jittered stamps", c.stamp_jitter = r.Uniform(0.1, 0.3);
  if (number % 3 == 2) c.name = "jittered samples", c.sample_jitter = r.Uniform(0.1, 0.3);
  return c;
}

Setup DrawSetup(const std::string& group, int number, const Arm& arm, Random& r) {
  Setup s;
  const double rates[] = {50, 100, 100, 125, 125, 250, 250, 250, 250, 500, 500, 1000};
  s.rate_Hz = rates[static_cast<int>(r.Uniform(0, 11.999))];
  s.noise = NoiseClasses()[static_cast<std::size_t>(number) % NoiseClasses().size()];
  s.temperature = r.Uniform(0, 1) < 0.4;
  const bool control = group.starts_with("controls"), effects = !control && group != "negative" && group != "payload";
  const double u = r.Uniform(0, 1);
  const auto is = [&](const char* name, double from, double to) {
    return group == std::string("controls_") + name || (effects && u >= from && u < to);
  };
  if (is("slow", 0, 0.12)) s.noise = "slow";
  if (is("quiet", 0.12, 0.22)) s.noise = "very_quiet";
  if (group == "controls_quiet") s.temperature = true;
  if (is("late", 0.22, 0.32)) s.channel = LateChannel(r);
  if (is("stamps", 0.32, 0.44)) s.channel = StampChannel(r, number);
  if (s.channel.hold > 1) s.rate_Hz = 250;
  if (group == "negative") {
    s.channel.name = "friction fed back", s.channel.fed_joint = static_cast<int>(r.Uniform(0, arm.joints() - 1e-9));
    s.channel.fed = r.Uniform(1.3, 2.5);
  }
  return s;
}

double FineRate(const Setup& s) {
  const double least_Hz = s.channel.late() || s.channel.sample_jitter > 0 ? kFinest_Hz : kFine_Hz;
  return s.rate_Hz * std::ceil(least_Hz / s.rate_Hz);
}

// Of many, the motion that stays nearest to what training shows; chosen on a coarse grid, then drawn anew.
Motion DrawTest(const Arm& arm, const Motion& train, double fine_Hz, Random& random) {
  const Motion seen = Every(train, static_cast<int>(std::lround(fine_Hz / 25)));
  Random best = random;
  double least = INFINITY;
  for (int k = 0; k < kTestDraws; ++k) {
    const Random before = random;
    const double unseen = Unseen(seen, DrawMotion(arm, kTest_s, 25, random));
    if (unseen < least) least = unseen, best = before;
  }
  return DrawMotion(arm, kTest_s, fine_Hz, best);
}

MatrixXd NoiseOf(const Arm& arm, const Setup& s, int samples, Random& random) {
  MatrixXd noise(samples, arm.joints());
  for (int j = 0; j < arm.joints(); ++j) {
    const VectorXd drawn = DrawNoise(s.noise, samples, arm.sigma_Nm[j], s.true_rate_Hz(), random);
    noise.col(j) = Passed(s.channel, j, drawn, 1 / s.true_rate_Hz());
    // after the filter the drive rounds
    if (s.channel.late()) noise.col(j) += 0.1 * DrawNoise("white", samples, arm.sigma_Nm[j], 1, random);
  }
  return noise;
}

MatrixXd Encoded(const Arm& arm, const Setup& s, const Motion& m) {
  MatrixXd q = m.q;
  for (int j = 0; j < arm.joints(); ++j) {
    const double step = 2 * kPi / (EncoderCounts(s.noise) * arm.gear[j]);
    q.col(j) = step * (q.col(j).array() / step).round();
  }
  return q;
}

double SizeOf(const Effect& e, const Seen& seen) {
  return e.joint.is_string() ? seen.size.maxCoeff() : seen.size[e.seen_on];
}

// The size that is wanted, of an effect that shows from `limit` on: a tenth too small, four tenths in the lowest fifth
// of the logarithmic range up to the largest. Below 0: no size will do.
double DrawSize(double limit, bool may_hide, Random& r) {
  const double u = r.Uniform(0, 1), along = r.Uniform(0, 1);
  if (may_hide && u < 0.1)
    return std::min(kSmallest, limit) * std::pow(std::min(limit, kLargest) / std::min(kSmallest, limit), along);
  if (limit > 0.8 * kLargest) return -1;
  return limit * std::pow(kLargest / limit, u < 0.5 ? 0.2 * along : 0.2 + 0.8 * along);
}

// Scales an effect to a size; what it says of it goes to `truth`. False if the arm and motion allow none.
bool Plant(Planted& p, const Run& train, const Detector& detector, bool may_hide, Random& random, json& truth) {
  Effect& e = p.effect;
  const auto look = [&] { return detector.Look(train.Logged(e.torque(train.fine, train.links))); };
  Seen seen = look();
  while (e.strength && !(SizeOf(e, seen) > 0) && *e.strength < e.most) {  // no torque reaches a limit yet
    *e.strength = std::min(1.5 * *e.strength, e.most);
    seen = look();
  }
  if (!(SizeOf(e, seen) > 0) || !std::isfinite(seen.score)) return false;
  double limit = SizeOf(e, seen) * std::sqrt(kDetectable / seen.score);
  const double size = DrawSize(limit, may_hide, random);
  if (size < 0) return false;
  if (!e.strength) p.gain = size / SizeOf(e, seen);
  double low = 0, high = e.most;
  for (int k = 0; e.strength && k < kStrengths && std::abs(SizeOf(e, seen) / size - 1) > kSizeError; ++k) {
    double& strength = *e.strength;
    (SizeOf(e, seen) < size ? low : high) = strength;
    strength = low == 0 ? 0.5 * strength : high == e.most ? std::min(2 * strength, high) : std::sqrt(low * high);
    seen = look();
  }
  if (e.strength && std::abs(SizeOf(e, seen) / size - 1) > 3 * kSizeError) return false;
  const double score = p.gain * p.gain * seen.score, reached = p.gain * SizeOf(e, seen);
  limit = reached * std::sqrt(kDetectable / score);
  const VectorXd ratio = p.gain * seen.size;
  json parameters = e.others;
  if (!e.factor.empty()) parameters[e.factor] = p.gain;
  truth = {{"kind", e.kind},
           {"joint", e.joint},
           {"also_joints", e.also_joints},
           {"accept_kinds", e.accept},
           {"depends_on", e.signals},
           {"run_state", e.run_state},
           {"held_by_a_record", e.held_by_a_record},
           {"report_only", p.report_only},
           {"parameters", parameters},
           {"size", reached},
           {"score", score},
           {"detectable", score >= kDetectable},
           {"lowest_fifth", score >= kDetectable && reached <= limit * std::pow(kLargest / limit, 0.2)},
           {"visible_ratio", std::vector<double>(ratio.begin(), ratio.end())}};
  return true;
}

std::vector<Planted> DrawEffects(const std::string& group, int number, bool report, const Arm& arm, Random& random) {
  std::vector<Form> forms = AllForms(report);
  const auto none = [&](auto wrong) { std::erase_if(forms, wrong); };
  if (group == "singles_ii" || group == "payload") none([](const Form& f) { return !f.recorded; });
  if (group == "unrecorded") none([](const Form& f) { return f.recorded; });
  const auto draw = [&](std::size_t k) {
    const Form& f = forms[k % forms.size()];
    return Planted{DrawForm(f, arm, random), f.report_only};
  };
  const auto at = static_cast<std::size_t>(number);
  if (group == "singles_ii" || group == "unrecorded") return {draw(at)};
  if (group == "payload" && number % 2) return {draw(at * 7)};
  std::vector<Planted> all;
  if (group != "several") return all;
  std::set<int> joints;
  while (all.size() < 3 + at % 4) {  // on different joints, so that each is a finding of its own
    Planted next = draw(static_cast<std::size_t>(random.Uniform(0, 1e6)));
    if (next.effect.run_state && next.effect.joint.is_string()) continue;
    if (joints.insert(next.effect.seen_on).second) all.push_back(std::move(next));
  }
  return all;
}

// The body that an arm carries in the held-out run only.
std::optional<plant::Body> DrawPayload(const Arm& arm, const std::string& group, Random& r) {
  if (group != "payload") return std::nullopt;
  double mass = 0;
  for (const plant::Body& b : arm.bodies) mass += b.mass_kg;
  plant::Body body;
  body.mass_kg = mass * r.Uniform(0.02, 0.08);
  body.center_m = {r.Uniform(-0.05, 0.05), r.Uniform(-0.05, 0.05), r.Uniform(0.08, 0.2)};
  body.inertia_kgm2 = {0.004 * body.mass_kg, 0, 0, 0.004 * body.mass_kg, 0, 0.003 * body.mass_kg};
  return body;
}

// Writes what the arm's whole torque along the fine motion shows. Jitter: stamps off the samples, or samples off the
// even times with stamps that say so.
void WriteRun(const fs::path& path, const Arm& arm, const Setup& setup, const Run& run, const MatrixXd& torque,
              const MatrixXd& noise, Random& random) {
  const Channel& c = setup.channel;
  const double fine_s = run.fine.t[1] - run.fine.t[0], step = fine_s * run.every;
  const MatrixXd passed = Passed(c, torque, fine_s);
  Motion m = run.m;
  MatrixXd tau = run.Logged(torque);
  VectorXd stamps;
  if (c.stamp_jitter > 0 || c.sample_jitter > 0) stamps = m.t;
  for (Eigen::Index k = 1; k + 1 < stamps.size(); ++k) {
    const double off_s = step * std::clamp(random.Normal(), -1.5, 1.5) * (c.stamp_jitter + c.sample_jitter);
    stamps[k] += off_s;
    if (c.sample_jitter == 0) continue;
    const auto at = static_cast<Eigen::Index>(stamps[k] / fine_s);  // of the fine motion, the sample before
    const double rest = stamps[k] - fine_s * static_cast<double>(at), share = rest / fine_s;
    m.q.row(k) = run.fine.q.row(at) + rest * run.fine.qd.row(at) + 0.5 * rest * rest * run.fine.qdd.row(at);
    tau.row(k) = (1 - share) * passed.row(at) + share * passed.row(at + 1);
  }
  WriteLog(path, run.m, Encoded(arm, setup, m), tau + noise, setup.temperature, c.hold, stamps);
}

// An arm, how its logs are taken, and what its declared model lacks.
struct Plan {
  Arm arm;
  Setup setup;
  std::vector<Planted> planted;
  std::optional<plant::Body> payload;  // in the held-out run

  // Its whole torque; bare: of the declared model alone.
  MatrixXd Torque(const Motion& m, const MatrixXd& links, bool bare) const {
    MatrixXd sum = BaseTorque(arm, setup.channel, m, links);
    if (bare) return sum;
    for (const Planted& p : planted) sum += p.gain * p.effect.torque(m, links);
    return payload ? MatrixXd(sum + PayloadTorque(arm, m, *payload)) : sum;
  }
  // What the true model leaves of a logged run, and how many samples at either end do not count.
  MatrixXd Left(const Run& run, const MatrixXd& tau, bool bare) const {
    return Rest(run.m, Encoded(arm, setup, run.m), tau, edge(), [&](const Motion& m) {
      return Passed(setup.channel, Torque(m, LinkTorque(arm, m), bare), m.t[1] - m.t[0]);
    });
  }
  int edge() const { return static_cast<int>(kIgnored_s * setup.true_rate_Hz()); }
};

json TruthOf(const Plan& plan, const std::string& group, const json& effects, const VectorXd& floor) {
  const Setup& setup = plan.setup;
  json truth{{"set", 2},
             {"group", group},
             {"verdict", effects.empty() ? "none" : "effect"},
             {"effects", effects},
             {"noise_class", setup.noise},
             {"channel", setup.channel.name},
             {"rate_Hz", setup.rate_Hz},
             {"test_floor_derived", std::vector<double>(floor.begin(), floor.end())}};
  // A late channel is a fact, no fault of the arm.
  if (setup.channel.late()) truth["true_as_well"] = {{{"kinds", {"time_delay"}}, {"joint", "any"}}};
  if (plan.payload) truth["true_as_well"] = {{{"kinds", {"payload_step"}}, {"joint", "flange"}}};
  if (plan.payload) truth["payload_kg"] = plan.payload->mass_kg;
  if (setup.channel.fed_joint >= 0) truth["fed_joint"] = setup.channel.fed_joint + 1;
  return truth;
}

json CaseOf(const Plan& plan) {
  return {{"robot", plan.arm.name},
          {"fs", plan.setup.rate_Hz},
          {"declared_model",
           {{"rigid_body", true},
            {"coulomb", true},
            {"viscous", true},
            {"offset", false},
            {"rotor_inertia", true},
            {"coulomb_smoothing_velocity", 0.005}}},
          {"files", {{"train", "train.csv.gz"}, {"test", "test.csv.gz"}}}};
}

bool MakeCase(const fs::path& folder, const std::string& group, int number, bool report, Random& random) {
  Plan plan{DrawArm(random, 0.15), {}, {}, std::nullopt};
  Arm& arm = plan.arm;
  Setup& setup = plan.setup;
  arm.name += fmt::format("_{}_{}", group, number);
  setup = DrawSetup(group, number, arm, random);
  plan.planted = DrawEffects(group, number, report, arm, random);
  plan.payload = DrawPayload(arm, group, random);
  const Run train(arm, setup, DrawMotion(arm, kTrain_s, FineRate(setup), random));
  const MatrixXd noise = NoiseOf(arm, setup, train.m.samples(), random);
  MatrixXd train_all = plan.Torque(train.fine, train.links, true);
  json effects = json::array();
  if (!plan.planted.empty()) {
    const Detector detector(arm, train.fine, train.m, setup.channel,
                            plan.Left(train, train.Logged(train_all) + noise, true), random);
    for (Planted& p : plan.planted) {
      json truth;
      if (!Plant(p, train, detector, plan.planted.size() == 1, random, truth)) return false;
      train_all += p.gain * p.effect.torque(train.fine, train.links);
      setup.temperature = setup.temperature || p.effect.needs_temperature;
      effects.push_back(truth);
    }
  }
  const Run test(arm, setup, DrawTest(arm, train.fine, FineRate(setup), random));
  const MatrixXd test_all = plan.Torque(test.fine, test.links, false);
  const MatrixXd test_noise = NoiseOf(arm, setup, test.m.samples(), random);
  const MatrixXd left = plan.Left(test, test.Logged(test_all) + test_noise, false);
  const auto scored = left.middleRows(plan.edge(), left.rows() - 2 * plan.edge());
  const VectorXd floor = (scored.colwise().squaredNorm() / static_cast<double>(scored.rows())).cwiseSqrt();

  const fs::path home = folder / fmt::format("{}_{:04}", group, number);
  fs::create_directories(home);
  fs::create_directories(folder / "robots");
  WriteJson(folder / "robots" / (arm.name + ".json"), RobotJson(arm));
  WriteRun(home / "train.csv.gz", arm, setup, train, train_all, noise, random);
  WriteRun(home / "test.csv.gz", arm, setup, test, test_all, test_noise, random);
  WriteJson(home / "truth.json", TruthOf(plan, group, effects, floor));
  WriteJson(home / "case.json", CaseOf(plan));
  return true;
}

}  // namespace

const std::vector<std::string>& GroupsOfSetTwo() {
  static const std::vector<std::string> groups{"controls_plain",  "controls_slow", "controls_quiet", "controls_late",
                                               "controls_stamps", "singles_ii",    "unrecorded",     "several",
                                               "payload",         "negative"};
  return groups;
}

void MakeCaseOfSetTwo(const fs::path& folder, const std::string& group, int number, bool report,
                      unsigned long long seed) {
  Random random(2000003ULL * seed + 7919ULL * static_cast<unsigned>(number) + (report ? 104729ULL : 0ULL) +
                std::hash<std::string>{}(group));
  constexpr int kTries = 200;
  for (int k = 0; k < kTries; ++k)
    if (MakeCase(folder, group, number, report, random)) return;
  throw std::runtime_error(fmt::format("{} {}: no arm of {} shows its effect", group, number, kTries));
}

}  // namespace armcal::judged
