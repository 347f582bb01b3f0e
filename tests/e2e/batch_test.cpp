// end-to-end tests - diagnose many logs at once, some of them bad, and the runs of one arm with each held out once.
#include <fstream>

#include "host_sim/data/logs/log.hpp"
#include "tests/e2e/tool.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::tests {
namespace {

constexpr int kPartial = 6, kBadInput = 2;

void WriteRun(const fs::path& path, SyntheticArm& arm, std::uint64_t seed, const Effect& effect) {
  const calibration::Dataset d = arm.Run(10, seed, effect);
  logs::Log log;
  log.joints = d.joints();
  log.t = d.s.t, log.q = d.s.q, log.tau = d.tau;
  logs::WriteLog(path, log);
}

// Two good logs as pairs and one as a folder; "offset" lacks a term on joint 2; two that are bad, each in its own way.
class Batch : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
    fs::create_directories(logs() / "folder");
    const auto pair = [&](const std::string& train, const std::string& test, std::uint64_t seed,
                          const Effect& effect = {}) {
      SyntheticArm arm(robot, seed);
      WriteRun(logs() / train, arm, 10 * seed, effect);
      WriteRun(logs() / test, arm, 10 * seed + 1, effect);
    };
    pair("plain.train.csv", "plain.test.csv", 1);
    pair("offset.train.csv.gz", "offset.test.csv.gz", 2, [](const State& s) { return s.joint == 1 ? 0.8 : 0.0; });
    pair("folder/train.csv.gz", "folder/test.csv.gz", 3);
    SyntheticArm arm(robot, 4);
    WriteRun(logs() / "alone.train.csv", arm, 40, {});
    std::ofstream(logs() / "words.train.csv") << "t,q1,q2,tau1,tau2\nfast,0,0,0,0\n";
    std::ofstream(logs() / "words.test.csv") << "t,q1,q2,tau1,tau2\n";
    std::ofstream(logs() / "notes.txt") << "no log\n";
  }
  static fs::path logs() {
    static const fs::path folder = FreshFolder("batch") / "logs";
    return folder;
  }
  static Outcome Run(std::vector<std::string> words) {
    words.insert(words.begin(), "diagnose");
    return Tool(words);
  }
  static std::string Path(const std::string& name) { return (logs().parent_path() / name).string(); }
};

TEST_F(Batch, GivesEveryLogALine_AndABadOneStopsNoOther) {
  const Outcome o = Run({"--batch", logs().string(), "--robot", "two_link", "--out", Path("verdicts"), "--json",
                         Path("all.json"), "--report", Path("all.html"), "--db", Path("fleet.sqlite")});
  EXPECT_EQ(o.code, kPartial) << o.err << o.out;
  const Outcome history = Tool({"history", "offset", "--db", Path("fleet.sqlite"), "--json", Path("history.json")});
  EXPECT_EQ(history.code, 0) << history.err;
  EXPECT_EQ(ReadJson(Path("history.json")).at("logs").size(), 1U);
  EXPECT_EQ(ReadJson(Path("history.json")).at("logs")[0].at("found"), "torque_offset 2");
  ExpectOneLine(Tool({"history", "alone", "--db", Path("fleet.sqlite")}), kBadInput, "nothing of the arm alone");
  const nlohmann::json s = ReadJson(Path("all.json"));
  EXPECT_EQ(s.at("failed"), 2);
  EXPECT_EQ(s.at("effect").get<int>() + s.at("none").get<int>(), 3);
  std::vector<std::string> names;
  for (const auto& v : s.at("verdicts")) names.push_back(v.at("name"));
  EXPECT_EQ(names, (std::vector<std::string>{"alone", "folder", "offset", "plain", "words"}));
  EXPECT_EQ(s.at("verdicts")[0].at("error"), "no test log");
  EXPECT_NE(s.at("verdicts")[4].at("error").get<std::string>().find("words.train.csv"), std::string::npos);
  EXPECT_EQ(s.at("verdicts")[1].at("verdict"), "none");
  EXPECT_EQ(s.at("verdicts")[3].at("verdict"), "none");
  ASSERT_EQ(s.at("findings").size(), 1u) << s.at("findings");
  EXPECT_EQ(s.at("findings")[0].at("joint"), 2);
  EXPECT_EQ(s.at("findings")[0].at("logs"), nlohmann::json({"offset"}));
  for (const std::string& name : names) {
    EXPECT_NE(o.out.find(name), std::string::npos) << name;
    EXPECT_NE(ReadText(Path("all.html")).find(name), std::string::npos) << name;
  }
  // A log's own verdict is the one that it gets alone.
  ASSERT_EQ(Run({"--robot", "two_link", "--train", (logs() / "offset.train.csv.gz").string(), "--test",
                 (logs() / "offset.test.csv.gz").string(), "--json", Path("alone.json")})
                .code,
            0);
  nlohmann::json alone = ReadJson(Path("alone.json")), together = ReadJson(Path("verdicts/offset.json"));
  for (const char* key : {"terms", "before", "after", "verdict"}) EXPECT_EQ(alone.at(key), together.at(key)) << key;

  // Independent jobs, one at a time: the same verdicts, the same summary.
  const std::vector<std::string> job{"--batch", logs().string(), "--robot", "two_link",
                                     "--out",   Path("jobs"),    "--jobs",  "1"};
  auto part = [&](const std::string& which) {
    std::vector<std::string> words = job;
    words.insert(words.end(), {"--part", which});
    return Run(words);
  };
  part("1/2");
  const std::vector<std::string> merge{"--summary",     Path("jobs"), "--batch",
                                       logs().string(), "--json",     Path("merged.json")};
  EXPECT_EQ(Run(merge).code, kPartial);
  int waiting = 0;
  const nlohmann::json merged = ReadJson(Path("merged.json"));
  for (const auto& v : merged.at("verdicts")) waiting += v.value("error", "").starts_with("no verdict");
  EXPECT_EQ(waiting, 2);  // of the second job's
  part("2/2");
  EXPECT_EQ(Run(merge).code, kPartial);
  EXPECT_EQ(ReadText(Path("merged.json")), ReadText(Path("all.json")));

  // A job that goes on: a verdict stays as it is, even one that no diagnosis gives. A failed or a broken one does not.
  nlohmann::ordered_json planted = nlohmann::ordered_json::parse(ReadText(Path("jobs/folder.json")));
  planted["verdict"] = "effect";
  std::ofstream(Path("jobs/folder.json")) << planted.dump();
  std::ofstream(Path("jobs/offset.json")) << R"({"verdict": "failed", "error": "ended with code 137"})";
  std::ofstream(Path("jobs/plain.json")) << "{";
  std::vector<std::string> words = job;
  words.insert(words.end(), {"--resume", "--json", Path("resumed.json"), "--db", Path("resumed.sqlite")});
  EXPECT_EQ(Run(words).code, kPartial);  // two logs are bad
  EXPECT_EQ(ReadText(Path("jobs/folder.json")), planted.dump());
  for (const char* name : {"jobs/offset.json", "jobs/plain.json"}) {
    nlohmann::json anew = ReadJson(Path(name)), first = ReadJson(Path("verdicts") + std::string(name).substr(4));
    for (const char* key : {"terms", "verdict"}) EXPECT_EQ(anew.at(key), first.at(key)) << name;
  }
  EXPECT_EQ(ReadJson(Path("resumed.json")).at("verdicts")[1].at("verdict"), "effect");
  EXPECT_EQ(Tool({"history", "folder", "--db", Path("resumed.sqlite")}).code, 0);  // kept ones are in the database
}

TEST_F(Batch, LogsOfOtherFormats_AreFound) {
  const std::filesystem::path folder = FreshFolder("batch_formats");
  for (const char* bag : {"bag.train", "inner/train"}) std::filesystem::create_directories(folder / bag);
  for (const char* file : {"rec.train.mcap", "rec.test.mat", "inner/test.db3.zst"})
    std::ofstream(folder / file) << "no log";
  const Outcome o =
      Run({"--batch", folder.string(), "--robot", "two_link", "--out", Path("formats"), "--json", Path("f.json")});
  EXPECT_EQ(o.code, kPartial) << o.err;
  std::map<std::string, std::string> error;
  const nlohmann::json formats = ReadJson(Path("f.json"));
  for (const auto& v : formats.at("verdicts")) error[v.at("name")] = v.at("error");
  ASSERT_EQ(error.size(), 3u);
  EXPECT_EQ(error.at("bag"), "no test log");
  EXPECT_NE(error.at("rec").find("rec.train.mcap"), std::string::npos) << error.at("rec");
  EXPECT_NE(error.at("inner").find("inner/train"), std::string::npos) << error.at("inner");
}

TEST_F(Batch, OptionsThatMakeNoSense_AreRefused) {
  const std::string empty = FreshFolder("batch_empty").string();
  ExpectOneLine(Run({}), kBadInput, "--train");
  ExpectOneLine(Run({"--batch", empty, "--out", empty}), kBadInput, "NAME.train.csv");
  ExpectOneLine(Run({"--batch", empty + "/absent", "--out", empty}), kBadInput, "absent");
  ExpectOneLine(Run({"--batch", logs().string()}), kBadInput, "--out");
  ExpectOneLine(Run({"--batch", logs().string(), "--out", empty, "--part", "3/2"}), kBadInput, "--part 3/2");
  ExpectOneLine(Run({"--batch", logs().string(), "--out", empty, "--test", "x.csv"}), kBadInput, "--test");
  ExpectOneLine(Run({"--summary", empty}), kBadInput, "--summary");
  ExpectOneLine(Run({"--resume", "--summary", empty}), kBadInput, "--resume");
}

// Runs of one arm that lacks an offset on joint 2; the last one lacks one on joint 1, too.
class Splits : public testing::Test {
 protected:
  static fs::path folder() {
    static const fs::path folder = FreshFolder("splits");
    return folder;
  }
  static std::string Run(const std::string& name) { return (folder() / (name + ".csv.gz")).string(); }
  static void SetUpTestSuite() {
    SyntheticArm arm(codegen::ReadRobot("codegen/robots/two_link.toml"), 7);
    const Effect lacking = [](const State& s) { return s.joint == 1 ? 0.8 : 0.0; };
    WriteRun(Run("run_a"), arm, 71, lacking);
    WriteRun(Run("run_b"), arm, 72, lacking);
    WriteRun(Run("run_c"), arm, 73, [=](const State& s) { return s.joint == 0 ? 2.0 : lacking(s); });
  }
};

TEST_F(Splits, ClaimWhatHoldsWhicheverRunIsHeldOut_AndNoMore) {
  const fs::path out = folder() / "out";
  const Outcome o = Tool({"diagnose", "--robot", "two_link", "--splits", Run("run_a") + "," + Run("run_b"),
                          Run("run_c"), "--out", out.string(), "--json", (folder() / "splits.json").string(),
                          "--report", (folder() / "splits.html").string()});
  ASSERT_EQ(o.code, 0) << o.err << o.out;
  const nlohmann::json s = ReadJson(folder() / "splits.json");
  EXPECT_EQ(s.at("splits").at("run_a").at("train"), nlohmann::json({"run_c"}));  // never its own group
  EXPECT_EQ(s.at("splits").at("run_c").at("train"), nlohmann::json({"run_a", "run_b"}));
  ASSERT_EQ(s.at("holds").size(), 1u) << s.at("holds");
  EXPECT_EQ(s.at("holds")[0].at("joint"), "2");
  for (const auto& [run, split] : s.at("holds")[0].at("splits").items()) {
    EXPECT_EQ(split.at("torque_of"), 2) << run;
    EXPECT_LT(split.at("after").get<double>(), 0.5 * split.at("before").get<double>()) << run;
  }
  for (const auto& d : s.at("does_not_hold")) EXPECT_EQ(d.at("joint"), "1") << d;  // the offset of one run
  for (const char* picture : {"errors.svg", "term_1.svg"}) {
    const std::string svg = ReadText(out / picture);
    EXPECT_TRUE(svg.starts_with("<svg xmlns=")) << picture;
    EXPECT_EQ(svg.find("var(--"), std::string::npos) << picture;
  }
  EXPECT_NE(ReadText(folder() / "splits.html").find("joint 2"), std::string::npos);
}

TEST_F(Splits, OptionsThatMakeNoSense_AreRefused) {
  const auto run = [](std::vector<std::string> words) {
    words.insert(words.begin(), {"diagnose", "--robot", "two_link", "--out", folder().string(), "--splits"});
    return Tool(words);
  };
  ExpectOneLine(run({Run("run_a") + "," + Run("run_b")}), kBadInput, "two groups");
  ExpectOneLine(run({Run("run_a"), Run("run_a")}), kBadInput, "one run of this name");
  ExpectOneLine(run({Run("run_a"), Run("run_b"), "--test", "x.csv"}), kBadInput, "--test");
}

}  // namespace
}  // namespace armcal::tests
