// end-to-end tests - pages: made again from the JSON they are the same bytes; names of a robot file do no harm.
#include "host_sim/data/logs/log.hpp"
#include "tests/e2e/tool.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::tests {
namespace {

class Report : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = FreshFolder("report");
    SyntheticArm arm(codegen::ReadRobot("codegen/robots/two_link.toml"), 9);
    Write(arm.Run(20, 90), "train.csv");
    Write(arm.Run(20, 91), "test.csv");
  }
  Outcome Run(const std::string& verb, const std::string& robot) const {
    return Tool({verb, "--robot", robot, "--train", Path("train.csv"), "--test", Path("test.csv"), "--json",
                 Path("result.json"), "--report", Path("page.html")});
  }
  void ExpectTheSamePageAgain() const {
    const Outcome again = Tool({"report", Path("result.json"), "--out", Path("again.html")});
    ASSERT_EQ(again.code, 0) << again.err;
    EXPECT_EQ(ReadText(Path("page.html")), ReadText(Path("again.html")));
  }
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  void Write(const calibration::Dataset& d, const std::string& name) const {
    logs::Log log;
    log.joints = d.joints();
    log.t = d.s.t, log.q = d.s.q, log.tau = d.tau;
    logs::WriteLog(Path(name), log);
  }

  fs::path folder_;
};

TEST_F(Report, OfADiagnosis_IsMadeAgain_UnlessTheFileLacksSomething) {
  const Outcome o = Run("diagnose", "two_link");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_LT(ReadText(Path("page.html")).size(), 1500000u);
  ExpectTheSamePageAgain();

  nlohmann::json json = ReadJson(Path("result.json"));
  json.erase("curves");
  std::ofstream(Path("old.json")) << json;
  const Outcome lacks = Tool({"report", Path("old.json"), "--out", Path("old.html")});
  EXPECT_EQ(lacks.code, 2);
  EXPECT_NE(lacks.err.find("old.json: "), std::string::npos) << lacks.err;
  EXPECT_NE(lacks.err.find("'curves'"), std::string::npos) << lacks.err;
  EXPECT_FALSE(fs::exists(Path("old.html")));
}

// The verdict is green only if every joint was judged and least squares could be trusted.
TEST_F(Report, NothingMissing_IsGreenOnlyIfAllWasJudged) {
  ASSERT_EQ(Run("diagnose", "two_link").code, 0);
  nlohmann::json json = ReadJson(Path("result.json"));
  json["verdict"] = "none", json["terms"] = json["too_short"] = json["at_rest"] = nlohmann::json::array();
  json["exogeneity"]["passed"] = true;
  const auto page = [&](const nlohmann::json& of) {
    std::ofstream(Path("edited.json")) << of;
    EXPECT_EQ(Tool({"report", Path("edited.json"), "--out", Path("edited.html")}).code, 0);
    return ReadText(Path("edited.html"));
  };
  const std::string green = "box good";
  EXPECT_NE(page(json).find(green), std::string::npos);
  nlohmann::json rested = json, biased = json;
  rested["at_rest"] = {2}, biased["exogeneity"]["passed"] = false;
  const std::string of_rested = page(rested), of_biased = page(biased);
  EXPECT_EQ(of_rested.find(green), std::string::npos);
  EXPECT_NE(of_rested.find("at rest in the training logs: joints 2."), std::string::npos);
  EXPECT_EQ(of_biased.find(green), std::string::npos);
  EXPECT_NE(of_biased.find("an effect may be hidden"), std::string::npos);
}

TEST_F(Report, OfAnIdentification_IsMadeAgain) {
  const Outcome o = Run("identify", "two_link");
  ASSERT_EQ(o.code, 0) << o.err;
  ExpectTheSamePageAgain();
}

TEST_F(Report, OfWhatNoVerbWrote_IsRefused) {
  for (const char* text : {"", "[]", "{}", "{\"a\": 1}", "{\"closed\": true}", "{\"columns\": 3}", "{\"terms\": 3}"}) {
    std::ofstream(Path("other.json")) << text;
    const Outcome o = Tool({"report", Path("other.json"), "--out", Path("other.html")});
    EXPECT_EQ(o.code, 2) << text;
    EXPECT_NE(o.err.find("other.json: "), std::string::npos) << text << ": " << o.err;
    EXPECT_FALSE(fs::exists(Path("other.html"))) << text;
  }
}

TEST_F(Report, OfARobotWithHostileNames_ShowsThemAsText) {
  std::string robot = ReadText("codegen/robots/two_link.toml");
  const std::string hostile = "</script><img src=x onerror=alert(1)>";
  for (const char* key : {"\ntitle = \"", "\n[[joint]]\nname = \""}) {
    const auto at = robot.find(key);
    ASSERT_NE(at, robot.npos) << key;
    robot.insert(at + std::string(key).size(), hostile);
  }
  std::ofstream(Path("robot.toml")) << robot;
  for (const char* verb : {"diagnose", "identify"}) {
    const Outcome o = Run(verb, Path("robot.toml"));
    ASSERT_EQ(o.code, 0) << o.err;
    const std::string page = ReadText(Path("page.html"));
    EXPECT_EQ(page.find("<img"), page.npos) << verb;
    EXPECT_NE(page.find("&lt;img src=x"), page.npos) << verb;
  }
}

}  // namespace
}  // namespace armcal::tests
