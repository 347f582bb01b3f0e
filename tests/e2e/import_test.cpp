// end-to-end tests - a URDF as it comes: import, generate, excite, identify, diagnose, with no editing between.
#include <algorithm>
#include <fstream>
#include <regex>
#include <sstream>

#include "tests/e2e/own_arms.hpp"

namespace armcal::tests {
namespace {

class Import : public testing::Test {
 protected:
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }

  void Through(const std::string& name, const ImportedArm& arm, int expected_joints) {
    folder_ = FreshFolder("import_" + name);
    std::ofstream(Path("arm.urdf")) << arm.urdf;
    Outcome o = Tool({"import", Path("arm.urdf"), "-o", Path(name + ".toml"), "--json", Path("import.json")});
    ASSERT_EQ(o.code, 0) << o.err << o.out;
    EXPECT_EQ(ReadJson(Path("import.json")).at("joints").size(), static_cast<std::size_t>(expected_joints)) << o.out;
    const std::string robot = Path(name + ".toml");
    o = Tool({"generate", "--robot", robot, "--out", Path("generated")});
    ASSERT_EQ(o.code, 0) << o.err << o.out;
    o = Tool({"excite", "--robot", robot, "--search-seconds", "2", "--no-slow", "--out", Path("motion.csv")});
    ASSERT_EQ(o.code, 0) << o.err << o.out;
    const UrdfArm truth(arm.truth, arm.moving, arm.joints, arm.drive, arm.held);
    logs::WriteLog(Path("train.csv"), truth.Run(40, 125, 13));
    logs::WriteLog(Path("test.csv"), truth.Run(20, 125, 14));
    o = Tool({"identify", "--robot", robot, "--train", Path("train.csv"), "--test", Path("test.csv"), "--json",
              Path("fit.json")});
    ASSERT_EQ(o.code, 0) << o.err << o.out;
    const nlohmann::json fit = ReadJson(Path("fit.json"));
    for (std::size_t j = 0; j < arm.joints.size(); ++j)
      EXPECT_LE(fit["held_out"]["rms_moving"][j].get<double>(), 1.05 * arm.drive[j].noise_Nm) << "joint " << j + 1;
    for (const auto& row : fit.at("columns"))
      for (std::size_t j = 0; j < arm.joints.size(); ++j)
        if (row.at("name") == "Fv" + std::to_string(j + 1)) {
          EXPECT_NEAR(row.at("value").get<double>(), arm.drive[j].viscous_Nmsprad, 0.03 * arm.drive[j].viscous_Nmsprad);
        }
    o = Tool({"diagnose", "--robot", robot, "--train", Path("train.csv"), "--test", Path("test.csv"), "--json",
              Path("verdict.json")});
    ASSERT_EQ(o.code, 0) << o.err << o.out;
    EXPECT_EQ(ReadJson(Path("verdict.json")).at("verdict"), "none") << o.out;
  }
  Outcome Try(const std::string& urdf, std::vector<std::string> options = {}) {
    folder_ = FreshFolder("import_try");
    std::ofstream(Path("arm.urdf")) << urdf;
    options.insert(options.begin(), {"import", Path("arm.urdf"), "-o", Path("arm.toml"), "--json", Path("out.json")});
    return Tool(options);
  }
  fs::path folder_;
};

TEST_F(Import, OfAScara_GoesStraightThrough) { Through("scara", Scara(), 4); }

TEST_F(Import, OfAGantry_GoesStraightThrough) { Through("gantry", Gantry(), 4); }

TEST_F(Import, OfAnArmWithAMimicGripperAndABranch_HoldsThem) {
  Through("gripper", WithGripper(), 5);
  const nlohmann::json said = ReadJson(Path("import.json"));
  EXPECT_EQ(said.at("tip"), "a5");
  EXPECT_NEAR(said.at("fixed").at("finger_left").get<double>(), 0.01, 1e-12);  // the limit nearest to zero
  EXPECT_EQ(said.at("fixed").at("camera_pan"), 0.0);
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, text.npos) << from;
  return text.replace(at, from.size(), to);
}

TEST_F(Import, WhereTwoChainsAreEquallyLong_AsksForATip) {
  const UrdfJoint other{"revolute", "s1", "twin", "xyz=\"0 0.3 0\"", "0 0 1", -1, 1, 20, 3, 0, "", ""};
  UrdfJoint again = other;
  again.parent = "twin", again.child = "twin_2";
  UrdfJoint end = again;
  end.parent = "twin_2", end.child = "twin_3";
  const std::string urdf =
      Replaced(Scara().urdf, "</robot>",
               LinkText("twin", 1, "0 0 0.1", "0.01 0 0 0.01 0 0.01") +
                   LinkText("twin_2", 1.1, "0 0 0.1", "0.01 0 0 0.01 0 0.01") +
                   LinkText("twin_3", 1.2, "0 0 0.1", "0.01 0 0 0.01 0 0.01") + JointText("t1", other, "") +
                   JointText("t2", again, "") + JointText("t3", end, "") + "</robot>");
  ExpectOneLine(Try(urdf), 2, "--tip with one of \"s4\", \"twin_3\"");
  const Outcome o = Try(urdf, {"--tip", "twin_3", "--fixed", "quill=0.05"});
  ASSERT_EQ(o.code, 0) << o.err;
  const nlohmann::json json = ReadJson(Path("out.json"));
  EXPECT_EQ(json.at("joints"), nlohmann::json({"turn_1", "t1", "t2", "t3"}));
  EXPECT_EQ(json.at("fixed").at("quill"), 0.05);
}

// What cannot be used is said, and the file is written so that it can be.
TEST_F(Import, OfBadBodiesAndMissingLimits_SaysSoAndGoesOn) {
  std::string urdf = Replaced(Scara().urdf, "lower=\"-2.2\" upper=\"2.2\" effort=\"60\" velocity=\"6\"",
                              "effort=\"0\" velocity=\"0\"");
  urdf = Replaced(urdf, "<inertia ixx=\"0.02\"", "<inertia ixx=\"0.2\"");
  const Outcome o = Try(urdf);
  ASSERT_EQ(o.code, 0) << o.err;
  const nlohmann::json json = ReadJson(Path("out.json"));
  EXPECT_FALSE(json.at("prior").get<bool>());
  EXPECT_NE(o.out.find("link \"s2\": expected principal moments of inertia"), o.out.npos) << o.out;
  int guessed = 0;
  for (const auto& g : json.at("guessed"))
    for (const char* key : {"position_limit_deg", "speed_limit_degps", "torque_limit_Nm"})
      guessed += g.at("key") == key && g.at("joint") == "turn_1";
  EXPECT_EQ(guessed, 3);
  const std::string file = ReadText(Path("arm.toml"));
  for (const auto& g : json.at("guessed"))
    EXPECT_NE(file.find(g.at("key").get<std::string>().substr(g.at("key").get<std::string>().rfind('.') + 1) + " = " +
                        g.at("value").get<std::string>()),
              file.npos)
        << g;
  EXPECT_EQ(Tool({"generate", "--robot", Path("arm.toml"), "--out", Path("generated")}).code, 0);
  ExpectOneLine(Tool({"import", Path("arm.urdf"), "-o", Path("arm.toml")}), 2, "--overwrite");
}

// The parser of URDFs refuses joints without <limit>.
TEST_F(Import, OfJointsWithoutALimit_GuessesOfEach) {
  std::string urdf = Replaced(Scara().urdf, "<limit lower=\"-2.2\" upper=\"2.2\" effort=\"60\" velocity=\"6\"/>",
                              "<!-- <limit lower=\"-9\" upper=\"9\" effort=\"1\" velocity=\"1\"/> -->");
  const Outcome o = Try(urdf);
  ASSERT_EQ(o.code, 0) << o.err;
  int guessed = 0;
  const nlohmann::json json = ReadJson(Path("out.json"));
  for (const auto& g : json.at("guessed"))
    for (const char* key : {"position_limit_deg", "speed_limit_degps", "torque_limit_Nm"})
      guessed += g.at("key") == key && g.at("joint") == "turn_1" &&
                 g.at("why").dump().find("the URDF has none") != std::string::npos;
  EXPECT_EQ(guessed, 3);
}

// Published inertias are rounded. One that is a little beyond what a body can have is no reason to drop them all.
TEST_F(Import, OfARoundedInertiaAndAFrameWithInertia_KeepsTheBodies) {
  const std::string frame =
      "<link name=\"frame\"><inertial><mass value=\"0\"/><inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" "
      "iyy=\"0.1\" iyz=\"0\" izz=\"0.1\"/></inertial></link>" +
      JointText("to_frame", {"fixed", "s4", "frame", "xyz=\"0 0 0.1\"", "0 0 1", 0, 0, 0, 0, 0, "", ""}, "");
  const Outcome o =
      Try(Replaced(Replaced(Scara().urdf, "izz=\"0.1\"", "izz=\"0.125\""), "</robot>", frame + "</robot>"));
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_TRUE(ReadJson(Path("out.json")).at("prior").get<bool>()) << o.out;
  EXPECT_NE(o.out.find("joint \"turn_1\": the body that it moves lacks principal moments"), o.out.npos) << o.out;
  EXPECT_NE(o.out.find("the nearest body that can exist is taken"), o.out.npos) << o.out;
  EXPECT_NE(o.out.find("link \"frame\" has an inertia but no mass: it counts as a frame"), o.out.npos) << o.out;
  EXPECT_EQ(Tool({"generate", "--robot", Path("arm.toml"), "--out", Path("generated")}).code, 0);
}

// Bodies that can exist and that nobody built: they are said, and taken.
TEST_F(Import, OfMassesInGramsAndOfEqualLinks_SaysSo) {
  const Outcome o =
      Try(std::regex_replace(Scara().urdf, std::regex("<mass value=\"([0-9.]+)\"/>"), "<mass value=\"$1e3\"/>"));
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_NE(o.out.find(" mm: a mass in grams, or a placeholder?"), o.out.npos) << o.out;
  EXPECT_NE(o.out.find(": gravity can ask for "), o.out.npos) << o.out;
  std::string twins = Scara().urdf;
  for (const char* link : {"s1", "s2"}) {
    const auto begin = twins.find(std::string("<link name=\"") + link + "\">"), end = twins.find("</link>", begin) + 7;
    ASSERT_NE(begin, twins.npos);
    twins.replace(begin, end - begin, LinkText(link, 3, "0 0 0.1", "0.1 0 0 0.1 0 0.1"));
  }
  EXPECT_NE(Try(twins).out.find("links s1 and s2 have the same inertia: equal parts, or a placeholder?"),
            std::string::npos);
}

TEST_F(Import, OfLimitsInDegrees_TakesThemAsAGuess) {
  const Outcome o = Try(Replaced(Scara().urdf, "lower=\"-2.2\" upper=\"2.2\"", "lower=\"-91\" upper=\"115\""));
  ASSERT_EQ(o.code, 0) << o.err;
  const nlohmann::json json = ReadJson(Path("out.json"));
  const auto limit = std::find_if(json.at("guessed").begin(), json.at("guessed").end(),
                                  [](const auto& g) { return g.at("key") == "position_limit_deg"; });
  ASSERT_NE(limit, json.at("guessed").end());
  EXPECT_EQ(limit->at("value"), "[-91.0, 115.0]");
  EXPECT_NE(o.out.find("the URDF has -91 to 115 rad (degrees?)"), o.out.npos) << o.out;
}

TEST_F(Import, OfWhatIsNoArm_SaysEveryFaultOnce) {
  ExpectOneLine(Try("<robot"), 2, "expected a URDF robot");
  ExpectOneLine(Try(Scara().urdf, {"--tip", "s5"}), 2,
                "link \"s5\": expected a link of the URDF as the tip; the nearest is");
  ExpectOneLine(Try(Scara().urdf, {"--fixed", "quil"}), 2,
                "joint \"quil\": expected a joint of the URDF to hold; the nearest is quill");
  ExpectOneLine(Try(Scara().urdf, {"--fixed", "quill=5"}), 2,
                "joint \"quill\": expected to be held within its limits, ");
  ExpectOneLine(Try(Scara().urdf, {"--fixed", "quill=low"}), 2, "expected JOINT or JOINT=POSITION");
  const Outcome o = Try(
      Replaced(Replaced(Scara().urdf, "xyz=\"0 0 0.4\"", "xyz=\"0 0 400\""), "xyz=\"0.325 0 0\"", "xyz=\"325 0 0\""));
  EXPECT_EQ(o.code, 2);
  EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 2) << o.err;
}

}  // namespace
}  // namespace armcal::tests
