// end-to-end tests - find the gains of drives and a payload in two runs of a simulated drive with a known truth.
#include <fstream>

#include "host_sim/machine/plant/truth.hpp"
#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

constexpr int kSeed = 4;

std::string Scenario(const std::string& more) {
  return "title = \"t\"\nrobot = \"er20_like\"\ntruth_seed = " + std::to_string(kSeed) + "\nnoise_seed = 1\n" + more;
}

class Payload : public testing::Test {
 protected:
  std::string Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return (folder_ / name).string();
  }
  // A run of `scenario` along a trajectory of its own.
  std::string Record(const std::string& name, const std::string& scenario, const std::string& purpose) {
    const std::string trajectory = (folder_ / (name + "_path.csv")).string(),
                      log = (folder_ / (name + ".csv.gz")).string();
    const Outcome made = Tool({"excite", "--robot", "er20_like", "--purpose", purpose, "--starts", "3",
                               "--search-seconds", "60", "--out", trajectory});
    EXPECT_EQ(made.code, 0) << made.err;
    fs::create_directories(folder_ / name);
    const RunningDrive drive(folder_ / name, Write(name + ".toml", scenario));
    const Outcome ran = Tool(
        {"record", "--robot", "er20_like", "--connect", drive.address(), "--trajectory", trajectory, "--out", log});
    EXPECT_EQ(ran.code, 0) << ran.err;
    return log;
  }
  void Refuse(std::vector<std::string> words, const std::string& named) const {
    words.insert(words.begin(), {"identify", "--robot", "er20_like"});
    ExpectOneLine(Tool(words), 2, named);
  }
  fs::path folder_ = FreshFolder("payload");
};

TEST_F(Payload, GivesTheDrivesGainsIfKnown_AndItselfIfNot) {
  const std::string without = Record("bare", Scenario(""), "train");
  const std::string with = Record("laden",
                                  Scenario("[[effect]]\nkind = \"payload_step\"\nmass_kg = 8.0\n"
                                           "center_m = [0.03, -0.02, 0.10]\n"
                                           "inertia_kgm2 = [0.05, 0.0, 0.0, 0.04, 0.0, 0.03]\nfrom_s = 0.0\n"),
                                  "test");
  const std::string known = Write("known.toml", "[payload]\nmass_kg = 8.0\n");
  const fs::path json = folder_ / "out.json", table = folder_ / "table.toml", found = folder_ / "found.toml";
  const Outcome gains = Tool({"identify", "--robot", "er20_like", "--with", with, "--without", without, "--payload",
                              known, "--json", json.string(), "--table-out", table.string()});
  ASSERT_EQ(gains.code, 0) << gains.err;
  const plant::RobotFile file = plant::ReadRobotFile("codegen/robots/er20_like.toml");
  const plant::Truth truth = plant::DrawTruth(file, {}, kSeed);
  const nlohmann::json result = ReadJson(json);
  for (std::size_t j = 0; j < 6; ++j) {
    const auto& g = result.at("gains")[j];
    const double sd = g.at("sd").get<double>(), expected = truth.torque_constant_NmpA[j];
    EXPECT_TRUE(g.at("determined").get<bool>()) << j + 1;
    EXPECT_LT(sd, 0.012) << j + 1;  // the file's tolerance, 3 %, is 0.017 as a standard deviation
    EXPECT_NEAR(g.at("torque_constant_NmpA").get<double>() / expected, 1, 4 * sd) << j + 1;
  }
  EXPECT_EQ(Tool({"identify", "--robot", "er20_like", "--train", without, "--json", json.string()}).code, 0);
  EXPECT_NE(ReadText(table).find("torque_scale"), std::string::npos);

  const Outcome load =
      Tool({"identify", "--robot", "er20_like", "--with", with, "--without", without, "--json", json.string(),
            "--payload-out", found.string(), "--ros-out", (folder_ / "ros.json").string()});
  ASSERT_EQ(load.code, 0) << load.err;
  const double expected[] = {8, 0.03, -0.02, 0.10, 0.05, 0, 0, 0.04, 0, 0.03};
  const nlohmann::json identified = ReadJson(json);
  for (std::size_t k = 0; k < 10; ++k) {
    const auto& row = identified.at("load")[k];
    EXPECT_NEAR(row.at("value").get<double>(), expected[k], 4 * row.at("sd").get<double>()) << row.at("name");
    EXPECT_LT(row.at("interval_95")[0].get<double>(), row.at("value").get<double>()) << row.at("name");
    EXPECT_GT(row.at("interval_95")[1].get<double>(), row.at("value").get<double>()) << row.at("name");
  }
  // The message's fields, as ROS has them.
  const nlohmann::json ros = ReadJson(folder_ / "ros.json");
  EXPECT_EQ(ros.size(), 8U);
  EXPECT_NEAR(ros.at("m").get<double>(), 8, 0.3);
  EXPECT_NEAR(ros.at("com").at("x").get<double>(), 0.03, 0.005);
  EXPECT_NEAR(ros.at("com").at("y").get<double>(), -0.02, 0.005);
  EXPECT_NEAR(ros.at("com").at("z").get<double>(), 0.10, 0.005);
  EXPECT_NEAR(ros.at("ixx").get<double>(), 0.05, 0.01);
  EXPECT_NEAR(ros.at("iyy").get<double>(), 0.04, 0.01);
  EXPECT_NEAR(ros.at("izz").get<double>(), 0.03, 0.01);
  for (const char* product : {"ixy", "ixz", "iyz"}) EXPECT_NEAR(ros.at(product).get<double>(), 0, 0.01) << product;
  // What was found is a part of a robot file, and of a call that takes it as known.
  const std::string laden =
      Write("er20_laden.toml", ReadText("codegen/robots/er20_like.toml") + "\n" + ReadText(found));
  EXPECT_EQ(Tool({"identify", "--robot", laden, "--train", with}).code, 0);
  EXPECT_EQ(
      Tool({"identify", "--robot", "er20_like", "--with", with, "--without", without, "--payload", found.string()})
          .code,
      0);

  Refuse({"--with", without, "--without", without, "--payload", known}, "no load is seen");
  // The laden log does not fit the bodies of the file: a line asks for a load before the error.
  const Outcome exchanged = Tool({"identify", "--robot", "er20_like", "--with", without, "--without", with});
  EXPECT_EQ(exchanged.code, 2);
  EXPECT_NE(exchanged.err.find("does the arm carry a load"), std::string::npos) << exchanged.err;
  EXPECT_NE(exchanged.err.find("exchanged"), std::string::npos) << exchanged.err;
  Refuse({"--with", with, "--without", without, "--payload", Write("none.toml", "[payload]\n")}, "payload.mass_kg");
  Refuse({"--with", with, "--without", without, "--payload", (folder_ / "absent.toml").string()}, "absent.toml");
  Refuse({"--with", with, "--without", without, "--payload", known, "--ros-out", "x.json"}, "--ros-out");
  Refuse({"--with", with}, "--without");
  Refuse({"--without", without, "--payload", known}, "--with");
  Refuse({"--with", with, "--without", without, "--table-out", table.string()}, "--payload");
  Refuse({"--with", with, "--without", without, "--train", without}, "--train");
  ExpectOneLine(Tool({"identify", "--robot", "two_link", "--with", with, "--without", without}), 2, "6 joints");
}

}  // namespace
}  // namespace armcal::tests
