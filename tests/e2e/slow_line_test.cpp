// end-to-end tests - record over a serial line that is slow, late and noisy, from a drive that does not wait.
#include <atomic>
#include <cmath>
#include <fstream>

#include "armcal/core/crc.hpp"
#include "tests/e2e/tool.hpp"
#include "tests/unit/client/serial_cable.hpp"

namespace armcal::tests {
namespace {

struct Line {
  explicit Line(const std::string& name, const test::Cable& how)
      : folder(FreshFolder(name + std::to_string(how.seed))), cable(how) {}

  Outcome Record(std::vector<std::string> more, const std::string& baud = "", const std::string& seconds = "4") {
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

// What a commissioning on a common adapter meets: 115200 baud, 16 ms latency, three bytes in 10,000 damaged.
constexpr test::Cable Common(unsigned seed) { return {10473, 0.016, 3e-4, seed}; }

// No record is missing between the first and the last one. How many there are beside the motion's own depends on how
// busy the machine is.
void ExpectNoneMissing(const fs::path& log, double seconds, double rate_Hz) {
  std::ifstream in(log);
  std::string row;
  std::getline(in, row);
  ASSERT_TRUE(row.starts_with("t,")) << row;
  int samples = 0, gaps = 0;
  for (double before = 0; std::getline(in, row); ++samples) {
    const double t = std::stod(row);
    gaps += samples > 0 && std::abs((t - before) * rate_Hz - 1) > 0.5;
    before = t;
  }
  EXPECT_EQ(gaps, 0);
  EXPECT_GE(samples, rate_Hz * seconds);
}

// A lean recording of so many seconds; no record is lost.
void ExpectAllPackedRecords(unsigned seed, double seconds) {
  Line line("slow_line_packed", Common(seed));
  const Outcome o = line.Record({"--lean"}, "", std::to_string(seconds));
  ASSERT_EQ(o.code, 0) << o.err << o.out;
  const auto json = line.Json();
  EXPECT_TRUE(json["packed"]);
  EXPECT_FALSE(json["partial"]);
  EXPECT_EQ(json["decimation"], 8) << "125 records a second: " << o.out;
  EXPECT_EQ(json["positions_not_told"], 0);
  ExpectNoneMissing(line.folder / "log.csv", seconds, 125);
  std::printf("seed %u, %.0f s: %d samples, %d damaged bytes, %d repeated requests\n", seed, seconds,
              static_cast<int>(json["samples"]), line.cable.errors(), static_cast<int>(json["repeated_requests"]));
}

// Plays firmware that knows no packed records: takes their bit out of the capabilities, which the tool reads with the
// identity, 26 registers in one frame of 57 bytes.
void HidePackedRecords(char* bytes, std::size_t count) {
  if (count != 57 || bytes[1] != 4 || bytes[2] != 52) return;
  bytes[3 + 2 * 21] = static_cast<char>(bytes[3 + 2 * 21] & ~1);
  const std::uint16_t crc = core::Crc16(reinterpret_cast<const std::uint8_t*>(bytes), 55);
  bytes[55] = static_cast<char>(crc & 0xFF), bytes[56] = static_cast<char>(crc >> 8);
}

void ExpectAllPlainRecords(unsigned seed, double seconds) {
  test::Cable cable = Common(seed);
  cable.change = HidePackedRecords;
  Line line("slow_line_plain", cable);
  const Outcome o = line.Record({"--lean"}, "", std::to_string(seconds));
  ASSERT_EQ(o.code, 0) << o.err << o.out;
  EXPECT_NE(o.out.find("cannot carry"), std::string::npos) << o.out;
  const auto json = line.Json();
  EXPECT_FALSE(json["packed"]);
  EXPECT_FALSE(json["partial"]);
  ExpectNoneMissing(line.folder / "log.csv", seconds, 1000 / json["decimation"].get<double>());
  std::printf("seed %u, %.0f s without packed records: decimation %d, %d samples, %d damaged bytes\n", seed, seconds,
              static_cast<int>(json["decimation"]), static_cast<int>(json["samples"]), line.cable.errors());
}

// Runs the seeds from 1 on, some at a time: a line spends its time in waiting.
void ForSeeds(unsigned count, void (*expect)(unsigned seed, double seconds)) {
  std::atomic<unsigned> next{1};
  std::vector<std::thread> threads;
  for (int k = 0; k < 4; ++k)
    threads.emplace_back([&] {
      for (unsigned seed = next++; seed <= count; seed = next++) expect(seed, 60);
    });
  for (std::thread& thread : threads) thread.join();
}

TEST(SlowLine, PackedRecordsAtTheSampleRate_AllArriveThroughLatencyAndErrors) { ExpectAllPackedRecords(1, 3); }
TEST(SlowLine, PlainRecordsOfOlderFirmware_AreThinnedAndAllArrive) { ExpectAllPlainRecords(1, 4); }
// The line stalls for longer than several repeated requests take. Then the replies to all of them come at once, and
// none may be taken for the reply to a later request.
TEST(SlowLine, RepliesThatComeLate_AreDropped) {
  test::Cable cable = Common(1);
  cable.stall_at = 8000, cable.stall_s = 5.2;
  Line line("slow_line_late", cable);
  const Outcome o = line.Record({"--lean"}, "", "3");
  ASSERT_EQ(o.code, 0) << o.err << o.out;
  EXPECT_FALSE(line.Json()["partial"]);
  ExpectNoneMissing(line.folder / "log.csv", 3, 125);
}

TEST(LongSlowLine, PackedRecordsOfAMinute_AllArrive_TwentyTimes) { ForSeeds(20, ExpectAllPackedRecords); }
TEST(LongSlowLine, PlainRecordsOfAMinute_AllArrive_EightTimes) { ForSeeds(8, ExpectAllPlainRecords); }

TEST(SlowLine, RecordsThatItCannotCarry_AreThinnedBeforeTheRecordingBegins) {
  Line line("slow_line_thinned", {90909, 0.004, 3e-5, 1});
  // The drive's ring holds most of these records, so a busy machine loses none; it holds an eighth of those asked for.
  const Outcome o = line.Record({"--decimation", "1"}, ":1000000", "1.5");
  ASSERT_EQ(o.code, 0) << o.err << o.out;
  EXPECT_NE(o.out.find("cannot carry"), std::string::npos) << o.out;
  const auto json = line.Json();
  EXPECT_FALSE(json["partial"]);
  EXPECT_EQ(json["wanted_decimation"], 1);
  EXPECT_GT(json["decimation"], 2) << "66 registers a millisecond are 132 kB/s";
}

}  // namespace
}  // namespace armcal::tests
