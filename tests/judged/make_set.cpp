// judged set - writes cases with a known truth: CASES/robots/*.json, CASES/<case>/{case.json,truth.json,*.csv.gz}.
//   judged_set FOLDER SEED GROUP COUNT [tuning|report FIRST]; GROUP of set I: controls, singles, pairs, unknowns,
//   detection; of set II: those of GroupsOfSetTwo(). FIRST: the number of the first case.
// Shares nothing with the records and the regressor that a diagnosis uses: KDL, finite physics, its own random numbers.
#include <fmt/core.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "tests/judged/effects.hpp"
#include "tests/judged/log.hpp"
#include "tests/judged/noise.hpp"
#include "tests/judged/set_two.hpp"

namespace {

namespace fs = std::filesystem;
using namespace armcal::judged;
using armcal::plant::Random;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using nlohmann::json;

constexpr double kRate_Hz = 250, kTrain_s = 40, kTest_s = 30, kIgnored_s = 0.5;
constexpr int kTestDraws = 40;  // of which the one that stays nearest to what training shows is taken
constexpr double kSizeError = 0.05;
constexpr int kStrengths = 16;     // tried, where an effect's size is not proportional to its strength
constexpr double kSmallest = 0.1;  // size of an effect over the noise
constexpr int kThin = 10;          // every tenth sample decides what the declared model absorbs

struct Case {
  std::string name, noise_class = "white";
  std::vector<Effect> effects;
  std::vector<double> size;  // visible RMS over the torque noise, of each effect on its joint
};

// What the declared model leaves of a torque, as every tenth sample shows it.
class Declared {
 public:
  Declared(const Arm& arm, const Motion& train, const VectorXd& sigma, Random& random) : sigma_(sigma) {
    const Motion thin = Every(train, kThin);
    const auto rows = DeclaredRows(arm, thin, random);
    samples_ = thin.samples();
    MatrixXd A(samples_ * arm.joints(), rows[0].cols());
    for (int j = 0; j < arm.joints(); ++j)
      A.middleRows(j * samples_, samples_) = rows[static_cast<std::size_t>(j)] / sigma[j];
    const VectorXd scale = A.colwise().norm().cwiseMax(1e-12);
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(A * scale.cwiseInverse().asDiagonal());
    const auto rank = (qr.matrixR().diagonal().cwiseAbs().array() > 1e-9 * qr.maxPivot()).count();
    basis_ = qr.householderQ() * MatrixXd::Identity(A.rows(), rank);
  }

  // Its RMS per joint, over the noise.
  VectorXd Visible(const MatrixXd& torque) const {
    VectorXd rest(basis_.rows());
    for (Eigen::Index j = 0; j < sigma_.size(); ++j)
      for (int k = 0; k < samples_; ++k) rest[j * samples_ + k] = torque(kThin * k, j) / sigma_[j];
    rest -= basis_ * (basis_.transpose() * rest).eval();
    VectorXd out(sigma_.size());
    for (Eigen::Index j = 0; j < sigma_.size(); ++j)
      out[j] = std::sqrt(rest.segment(j * samples_, samples_).squaredNorm() / samples_);
    return out;
  }

 private:
  VectorXd sigma_;
  int samples_;
  MatrixXd basis_;
};

VectorXd DerivedFloor(const Case& c, const std::vector<double>& gain, const Arm& arm, const Motion& m,
                      const MatrixXd& q, const MatrixXd& tau) {
  const int edge = static_cast<int>(kIgnored_s * kRate_Hz), scored = m.samples() - 2 * edge;
  const MatrixXd rest = Rest(m, q, tau, edge, [&](const Motion& derived) {
    const MatrixXd links = LinkTorque(arm, derived);
    MatrixXd sum = DeclaredTorque(arm, derived, links);
    for (std::size_t e = 0; e < gain.size(); ++e) sum += gain[e] * c.effects[e].torque(derived, links);
    return sum;
  });
  return (rest.middleRows(edge, scored).colwise().squaredNorm() / scored).cwiseSqrt();
}

Motion DrawTest(const Arm& arm, const Motion& train, Random& random) {
  Motion best = DrawMotion(arm, kTest_s, kRate_Hz, random);
  for (int k = 0; k < kTestDraws; ++k) {
    Motion next = DrawMotion(arm, kTest_s, kRate_Hz, random);
    if (Unseen(train, next) < Unseen(train, best)) best = std::move(next);
  }
  return best;
}

// False, and nothing is written, if an effect stays below the smallest size at its largest strength.
bool MakeCaseOfSetOne(const fs::path& folder, const Case& c, const Arm& arm, Random& random) {
  const Motion train = DrawMotion(arm, kTrain_s, kRate_Hz, random);
  const VectorXd sigma = arm.sigma_Nm * (c.noise_class == "quiet" ? 0.1 : 1.0);
  const MatrixXd train_links = LinkTorque(arm, train);
  const Declared declared(arm, train, sigma, random);
  json effects = json::array();
  bool temperature = random.Uniform(0, 1) < 0.3;
  std::vector<double> gain;
  for (std::size_t e = 0; e < c.effects.size(); ++e) {
    const Effect& effect = c.effects[e];
    // Effects of the whole arm count where they are seen best.
    const bool one_joint = !effect.joint.is_string();
    VectorXd seen;
    const auto size = [&] {
      seen = declared.Visible(effect.torque(train, train_links));
      return one_joint ? seen[effect.seen_on] : seen.maxCoeff();
    };
    if (effect.strength) {
      const double first = std::exchange(*effect.strength, effect.most);
      if (size() < 0.95 * kSmallest) return false;
      *effect.strength = first;
    }
    double found = size(), low = 0, high = effect.most;
    for (int k = 0; effect.strength && k < kStrengths && std::abs(found / c.size[e] - 1) > kSizeError; ++k) {
      double& strength = *effect.strength;
      (found < c.size[e] ? low : high) = strength;
      strength = low == 0 ? 0.5 * strength : high == effect.most ? std::min(2 * strength, high) : std::sqrt(low * high);
      found = size();
    }
    if (effect.strength && found < 0.95 * kSmallest) return false;
    gain.push_back(effect.strength ? 1 : c.size[e] / found);
    temperature = temperature || effect.needs_temperature;
    const VectorXd ratio = gain.back() * seen;
    json parameters = effect.others;
    if (!effect.factor.empty()) parameters[effect.factor] = gain.back();
    if (effect.kind == "time_delay") parameters["d"] = *effect.strength;
    effects.push_back({{"kind", effect.kind},
                       {"joint", effect.joint},
                       {"accept_kinds", effect.accept},
                       {"depends_on", effect.signals},
                       {"run_state", effect.run_state},
                       {"held_by_a_record", effect.held_by_a_record},
                       {"parameters", parameters},
                       {"size", gain.back() * found},
                       {"visible_ratio", std::vector<double>(ratio.begin(), ratio.end())}});
  }
  const Motion motion[] = {train, DrawTest(arm, train, random)};
  const MatrixXd links[] = {train_links, LinkTorque(arm, motion[1])};
  const fs::path home = folder / c.name;
  fs::create_directories(home);
  fs::create_directories(folder / "robots");
  WriteJson(folder / "robots" / (arm.name + ".json"), RobotJson(arm));
  std::vector<double> floor;
  VectorXd derived_floor;
  const char* const file[] = {"train.csv.gz", "test.csv.gz"};
  for (int part = 0; part < 2; ++part) {
    const Motion& m = motion[part];
    MatrixXd tau = DeclaredTorque(arm, m, links[part]), q = m.q;
    for (std::size_t e = 0; e < c.effects.size(); ++e) tau += gain[e] * c.effects[e].torque(m, links[part]);
    const int edge = static_cast<int>(kIgnored_s * kRate_Hz);
    for (int j = 0; j < arm.joints(); ++j) {
      const VectorXd noise = DrawNoise(c.noise_class, m.samples(), arm.sigma_Nm[j], kRate_Hz, random);
      tau.col(j) += noise;
      const double step = 2 * M_PI / (EncoderCounts(c.noise_class) * arm.gear[j]);
      q.col(j) = step * (q.col(j).array() / step).round();
      const auto scored = noise.segment(edge, noise.size() - 2 * edge);
      if (part == 1) floor.push_back(std::sqrt(scored.squaredNorm() / static_cast<double>(scored.size())));
    }
    if (part == 1) derived_floor = DerivedFloor(c, gain, arm, m, q, tau);
    WriteLog(home / file[part], m, q, tau, temperature);
  }
  WriteJson(home / "truth.json",
            {{"verdict", effects.empty() ? "none" : "effect"},
             {"effects", effects},
             {"noise_class", c.noise_class},
             {"test_floor_noise", floor},
             {"test_floor_derived", std::vector<double>(derived_floor.begin(), derived_floor.end())}});
  WriteJson(home / "case.json", {{"robot", arm.name},
                                 {"fs", kRate_Hz},
                                 {"declared_model",
                                  {{"rigid_body", true},
                                   {"coulomb", true},
                                   {"viscous", true},
                                   {"offset", false},
                                   {"rotor_inertia", true},
                                   {"coulomb_smoothing_velocity", 0.005}}},
                                 {"files", {{"train", file[0]}, {"test", file[1]}}}});
  return true;
}

// Sizes 0.1 to 2 x noise, evenly on a logarithmic scale.
double DrawSize(Random& random) { return kSmallest * std::pow(20, random.Uniform(0, 1)); }

Case DrawCase(const std::string& what, int number, const Arm& arm, Random& random) {
  Case c;
  c.name = fmt::format("{}_{:04}", what, number);
  const auto& classes = NoiseClasses();
  const auto& kinds = Kinds();
  c.noise_class = what == "detection" ? "white" : classes[static_cast<std::size_t>(number) % classes.size()];
  const auto kind = [&](int k) { return kinds[static_cast<std::size_t>(k) % kinds.size()]; };
  if (what == "singles" || what == "detection") {
    c.effects = {DrawEffect(kind(number), arm, random)};
    c.size = {what == "detection" ? kSmallest : DrawSize(random)};
  } else if (what == "unknowns") {
    c.effects = {DrawUnknown(arm, random)};
    c.size = {0.3 * std::pow(6, random.Uniform(0, 1))};
  } else if (what == "pairs") {
    c.effects = {DrawEffect(kind(number), arm, random)};
    for (int k = 1; c.effects.size() < 2; ++k) {
      Effect other = DrawEffect(kind(number + 7 * k), arm, random);
      if (other.kind != c.effects[0].kind && other.joint != c.effects[0].joint) c.effects.push_back(other);
    }
    c.size = {0.3 * std::pow(5, random.Uniform(0, 1)), 0.3 * std::pow(5, random.Uniform(0, 1))};
  } else if (what != "controls") {
    throw std::runtime_error(what + ": no such group");
  }
  return c;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 5 && argc != 7)
    throw std::runtime_error("usage: judged_set FOLDER SEED GROUP COUNT [tuning|report FIRST]");
  const std::string what = argv[3];
  const bool second = std::ranges::count(GroupsOfSetTwo(), what) > 0;
  const int first = argc == 7 ? std::stoi(argv[6]) : 0;
  for (int k = first; k < first + std::stoi(argv[4]); ++k) {
    if (second) {
      MakeCaseOfSetTwo(argv[1], what, k, argc == 7 && argv[5] == std::string("report"), std::stoull(argv[2]));
      continue;
    }
    Random random(1000003ULL * std::stoull(argv[2]) + 7919ULL * static_cast<unsigned>(k) +
                  std::hash<std::string>{}(what));
    for (bool made = false; !made;) {
      Arm arm = DrawArm(random, 0.15);
      arm.name += fmt::format("_{}_{}", what, k);  // numbers repeat
      made = MakeCaseOfSetOne(argv[1], DrawCase(what, k, arm, random), arm, random);
    }
  }
  return 0;
} catch (const std::exception& e) {
  fmt::print(stderr, "judged_set: {}\n", e.what());
  return 2;
}
