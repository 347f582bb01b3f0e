// end-to-end tests - the diagnosis names what the simulated drive has: scenarios drawn from a fixed seed for each kind,
// two logs of excitations played by the drive, a diagnosis of them. Long, but for a sample.
#include <fmt/core.h>

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <set>

#include "tests/e2e/drawn_kinds.hpp"
#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

constexpr int kDraws = 3;
constexpr double kAskedFor = 0.9;  // share of all draws
constexpr std::size_t kMostNames = 3;

struct Count {
  int named = 0, all = 0;
};
Count& Counted() {
  static Count count;
  return count;
}

// The two motions are the same for all scenarios. starts: of their search; one takes a third of the time.
class Motions {
 public:
  explicit Motions(int starts) {
    const fs::path folder = FreshFolder(fmt::format("kinds_motions_{}_{}", starts, getpid()));
    for (const char* purpose : {"train", "test"}) {
      paths_.push_back((folder / (std::string(purpose) + ".csv")).string());
      const Outcome made =
          Tool({"excite", "--robot", "er20_like", "--purpose", purpose, "--starts", std::to_string(starts),
                "--search-seconds", "60", "--margin", "0.25", "--out", paths_.back()});
      if (made.code != 0) throw std::runtime_error(made.err);
    }
    spline_.emplace(trajectory::ReadTrajectory(paths_[0], 6));
  }
  const std::vector<std::string>& paths() const { return paths_; }  // to train, to test
  const trajectory::TrajectorySpline& train() const { return *spline_; }

 private:
  std::vector<std::string> paths_;
  std::optional<trajectory::TrajectorySpline> spline_;
};

nlohmann::json Diagnosed(const fs::path& folder, const std::string& scenario, const Motions& motions) {
  std::ofstream(folder / "scenario.toml") << scenario;
  std::vector<std::string> logs;
  for (const std::string& path : motions.paths()) {
    logs.push_back((folder / (fs::path(path).stem().string() + ".csv.gz")).string());
    fs::remove(folder / "drive.nor");
    const RunningDrive drive(folder, (folder / "scenario.toml").string());
    const Outcome ran = Tool(
        {"record", "--robot", "er20_like", "--connect", drive.address(), "--trajectory", path, "--out", logs.back()});
    EXPECT_EQ(ran.code, 0) << ran.err;
  }
  const std::string json = (folder / "verdict.json").string();
  const Outcome said =
      Tool({"diagnose", "--robot", "er20_like", "--train", logs[0], "--test", logs[1], "--json", json});
  EXPECT_LE(said.code, 1) << said.err;
  return fs::exists(json) ? ReadJson(json) : nlohmann::json();
}

std::set<int> JointsOf(const nlohmann::json& term) {
  std::set<int> joints;
  for (const auto& j : term.at("joints")) joints.insert(j.get<int>());
  return joints;
}

// The first term that counts names the kind or one of its class, on the joint.
bool IsNamed(const nlohmann::json& verdict, const DrawnKind& kind, int joint) {
  if ((kind.kind == "time_delay" || kind.kind == "torque_filter") && !verdict.at("torque_channel").empty()) return true;
  for (const auto& term : verdict.at("terms")) {
    if (!term.at("confirmed").get<bool>() && !term.at("training_only").get<bool>()) continue;
    if (kind.names.empty()) return false;
    std::set<std::string> said{term.at("kind").get<std::string>()};
    for (const auto& also : term.at("also_fits")) said.insert(also.get<std::string>());
    if (said.size() > kMostNames) return false;
    const bool right =
        std::any_of(kind.names.begin(), kind.names.end(), [&](const auto& n) { return said.contains(n); });
    return right && (joint == 0 || kind.any_joint || JointsOf(term).contains(joint));
  }
  return kind.names.empty();
}

std::string Said(const nlohmann::json& verdict) {
  std::string text;
  for (const auto& term : verdict.at("terms")) {
    text += fmt::format("{}{} on {}{}", text.empty() ? "" : "; ", term.at("kind").get<std::string>(),
                        term.at("joint").dump(),
                        term.at("confirmed").get<bool>()       ? ""
                        : term.at("training_only").get<bool>() ? " (training only)"
                                                               : " (not confirmed)");
    for (const auto& also : term.at("also_fits")) text += " or " + also.get<std::string>();
  }
  if (!verdict.at("torque_channel").empty()) text += "; channel " + verdict.at("torque_channel").dump();
  return text.empty() ? "nothing" : text;
}

bool Draw(const DrawnKind& kind, std::uint64_t seed, const Motions& motions) {
  const fs::path folder = FreshFolder(fmt::format("kinds_{}_{}", kind.kind, seed));
  const DrawnScenario drawn = DrawScenario(kind, seed, motions.train());
  const nlohmann::json verdict = Diagnosed(folder, drawn.text, motions);
  const bool named = !verdict.is_null() && IsNamed(verdict, kind, drawn.joint);
  fmt::print("{} seed {} joint {} size {:.1f}: {}; said {}\n", named ? "named " : "MISSED", seed, drawn.joint,
             drawn.size, kind.kind, verdict.is_null() ? "refused" : Said(verdict));
  std::fflush(stdout);
  return named;
}

// Each kind has its own, so that joints and sizes differ.
std::uint64_t SeedOf(const DrawnKind& kind, int draw) {
  const auto& all = DrawnKinds();
  const auto same = [&](const DrawnKind& k) { return k.kind == kind.kind; };
  const auto number = std::find_if(all.begin(), all.end(), same) - all.begin();
  return 10 * static_cast<std::uint64_t>(number + 1) + static_cast<std::uint64_t>(draw);
}

class EachKind : public testing::TestWithParam<DrawnKind> {
 protected:
  static void TearDownTestSuite() {
    const Count& c = Counted();
    fmt::print("{} of {} draws named\n", c.named, c.all);
    EXPECT_GE(c.named, kAskedFor * c.all);
  }
};

TEST_P(EachKind, IsNamedOnItsJoint) {
  static const Motions motions(3);
  for (int k = 0; k < kDraws; ++k) {
    ++Counted().all;
    if (Draw(GetParam(), SeedOf(GetParam(), k), motions)) ++Counted().named;
  }
}

INSTANTIATE_TEST_SUITE_P(Long, EachKind, testing::ValuesIn(DrawnKinds()),
                         [](const auto& kind) { return kind.param.kind; });

// One that two joints share, and one that shows in flight alone, on a joint without gravity.
TEST(Kinds, OfASample_AreNamedOnTheirJoint) {
  const Motions motions(1);
  for (const auto& [name, draw] : {std::pair{"wrist_coupling", 0}, std::pair{"backlash", 1}}) {
    const auto& all = DrawnKinds();
    const auto kind = std::find_if(all.begin(), all.end(), [&](const DrawnKind& k) { return k.kind == name; });
    ASSERT_NE(kind, all.end());
    EXPECT_TRUE(Draw(*kind, SeedOf(*kind, draw), motions)) << name;
  }
}

}  // namespace
}  // namespace armcal::tests
