// end-to-end tests - record over a serial line that is slow, late and noisy, from a drive that does not wait.
#include <cstdlib>

#include "tests/e2e/tool.hpp"
#include "tests/unit/client/serial_cable.hpp"

namespace armcal::tests {
namespace {

std::string Seconds() {
  const char* const given = std::getenv("ARMCAL_LINE_SECONDS");  // for runs by hand
  return given ? given : "4";
}

struct Line {
  explicit Line(const std::string& name, const test::Cable& how)
      : folder(FreshFolder(name + std::to_string(how.seed))), cable(how) {}

  Outcome Record(std::vector<std::string> more, const std::string& baud = "", const std::string& seconds = Seconds()) {
    std::vector<std::string> words = {"record",
                                      "--connect",
                                      cable.client() + baud,
                                      "--robot",
                                      "er20_like",
                                      "--seconds",
                                      seconds,
                                      "--out",
                                      (folder / "log.csv").string(),
                                      "--json",
                                      (folder / "log.json").string()};
    words.insert(words.end(), more.begin(), more.end());
    return Tool(words);
  }
  nlohmann::json Json() const { return ReadJson(folder / "log.json"); }

  fs::path folder;
  test::SerialCable cable;
  RunningDrive drive{folder, "none", {"--real-time", "--serial", cable.drive()}};
};

unsigned Seed() {
  const char* const given = std::getenv("ARMCAL_LINE_SEED");
  return given ? static_cast<unsigned>(std::atoi(given)) : 1;
}

TEST(SlowLine, PackedRecordsAtTheSampleRate_AllArriveThroughLatencyAndErrors) {
  Line line("slow_line_packed", {10473, 0.016, 3e-4, Seed()});
  const Outcome o = line.Record({"--lean"});
  ASSERT_EQ(o.code, 0) << o.err << o.out;
  const auto json = line.Json();
  EXPECT_TRUE(json["packed"]);
  EXPECT_FALSE(json["partial"]);
  EXPECT_EQ(json["decimation"], 8) << "125 records a second: " << o.out;
  EXPECT_EQ(json["positions_not_told"], 0);
  EXPECT_NEAR(json["samples"], 125 * std::stod(Seconds()), 130);
  std::printf("%s s: %d damaged bytes, %d repeated requests\n", Seconds().c_str(), line.cable.errors(),
              static_cast<int>(json["repeated_requests"]));
}

TEST(SlowLine, RecordsThatItCannotCarry_AreThinnedBeforeTheRecordingBegins) {
  Line line("slow_line_thinned", {90909, 0.004, 3e-5, Seed()});
  const Outcome o = line.Record({"--decimation", "1"}, ":1000000", "2");
  ASSERT_EQ(o.code, 0) << o.err << o.out;
  EXPECT_NE(o.out.find("cannot carry"), std::string::npos) << o.out;
  const auto json = line.Json();
  EXPECT_FALSE(json["partial"]);
  EXPECT_EQ(json["wanted_decimation"], 1);
  EXPECT_GT(json["decimation"], 2) << "66 registers a millisecond are 132 kB/s";
}

}  // namespace
}  // namespace armcal::tests
