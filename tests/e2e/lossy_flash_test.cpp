// end-to-end tests - flashes tables over a link that damages what it carries. Each session ends with the table before
// or the new one in force, and its exit code and its JSON tell which.
#include <cstdlib>
#include <map>
#include <mutex>

#include "armcal/core/crc.hpp"
#include "codegen/src/generator/load.hpp"
#include "host_sim/client/table_flash.hpp"
#include "host_sim/identify/calibration/table_file.hpp"
#include "tests/e2e/lossy_proxy.hpp"
#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

using Words = std::vector<std::uint16_t>;
constexpr int kOk = 0, kLink = 3, kRefused = 4, kMismatch = 5;
const char* const kDamages[] = {"none", "flip", "insert", "cut", "drop", "duplicate", "delay"};

// One drive, and sessions with it one after the other.
class Sessions {
 public:
  explicit Sessions(int worker)
      : folder_(FreshFolder("lossy_flash_" + std::to_string(worker))),
        running_(folder_),
        direct_("127.0.0.1", running_.port()) {
    calibration::TableFile table = calibration::DefaultTable(codegen::LoadModel("er20_like"));
    for (int k = 0; k < 2; ++k) {
      table.joint[0].sigma_Nm *= 1.1;
      calibration::WriteTable(File(k), table);
      words_[k] = calibration::EncodeTable(table);
    }
    client::FlashTable(direct_, words_[0]);
    LossyProxy proxy(running_.port(), Damage::kNone, 0, 0, 1);
    EXPECT_EQ(Flash(proxy.port(), 0).code, kOk);
    whole_bytes_ = proxy.carried();
  }

  // Returns the exit code.
  int Run(unsigned session) {
    std::mt19937 random(session);
    const auto damage = static_cast<Damage>(1 + session % 6);
    const int at = static_cast<int>(random() % static_cast<unsigned>(whole_bytes_));
    const double further = random() % 5 == 0 ? 0.03 : 0;
    const int next = 1 - now_;
    fs::remove(Json());
    Outcome o;
    {
      LossyProxy proxy(running_.port(), damage, at, further, session);
      o = Flash(proxy.port(), next);
    }
    const auto status = direct_.ReadStatus();
    const Words active = client::ReadActiveTable(direct_);
    const bool is_old = active == words_[now_], is_new = active == words_[next];
    const std::string said = std::string(kDamages[static_cast<int>(damage)]) + " at byte " + std::to_string(at) +
                             " of " + std::to_string(whole_bytes_) + ", session " + std::to_string(session) +
                             ": exit code " + std::to_string(o.code) + ", " + o.err;
    EXPECT_TRUE(is_old || is_new) << said;
    EXPECT_EQ(status.table_status, core::Status::kOk) << said;
    EXPECT_EQ(status.active_crc, core::Crc32Words(active.data(), active.size())) << said;
    EXPECT_TRUE(o.code == kOk || o.code == kLink || o.code == kRefused || o.code == kMismatch) << said;
    EXPECT_TRUE(o.code != kOk || is_new) << said;
    EXPECT_TRUE(o.code != kRefused || is_old) << said;
    EXPECT_TRUE(o.code != kMismatch || !is_new) << said;
    ExpectTrueJson(o, status, said);
    EXPECT_TRUE(o.code != kLink || !is_new || ReadJson(Json()).value("sent", false)) << said;
    if (is_new) now_ = next;
    if (!is_old && !is_new) client::FlashTable(direct_, words_[now_]);
    return o.code;
  }

 private:
  std::string File(int table) const { return (folder_ / ("table" + std::to_string(table) + ".toml")).string(); }
  std::string Json() const { return (folder_ / "flash.json").string(); }
  Outcome Flash(int port, int table) const {
    return Tool({"flash", "--connect", "127.0.0.1:" + std::to_string(port), "--robot", "er20_like", "--table",
                 File(table), "--json", Json()});
  }
  void ExpectTrueJson(const Outcome& o, const client::DriveStatus& status, const std::string& said) const {
    ASSERT_TRUE(fs::exists(Json())) << said;
    const nlohmann::json json = ReadJson(Json());
    EXPECT_EQ(json.at("readback_ok"), o.code == kOk) << said;
    if (o.code == kOk) {
      char crc[9];
      std::snprintf(crc, sizeof crc, "%08X", status.active_crc);
      EXPECT_EQ(json.at("table_crc"), crc) << said;
      EXPECT_EQ(json.at("store_sequence"), status.store_sequence) << said;
      EXPECT_EQ(json.at("generation"), status.generation) << said;
    } else {
      EXPECT_EQ(json.at("exit_code"), o.code) << said;
      EXPECT_NE(o.err.find(json.at("error").get<std::string>()), std::string::npos) << said;
    }
  }

  fs::path folder_;
  RunningDrive running_;
  client::DriveClient direct_;
  Words words_[2];
  int now_ = 0, whole_bytes_ = 0;
};

// Most of the time is spent in waiting, so several drives are flashed at once.
void RunSessions(unsigned count, int workers) {
  std::atomic<unsigned> next{0};
  std::map<int, int> codes;
  std::mutex guard;
  std::vector<std::thread> threads;
  for (int worker = 0; worker < workers; ++worker)
    threads.emplace_back([&, worker] {
      Sessions sessions(worker);
      for (unsigned k = next++; k < count; k = next++) {
        const int code = sessions.Run(k);
        const std::lock_guard lock(guard);
        ++codes[code];
      }
    });
  for (std::thread& thread : threads) thread.join();
  for (const auto& [code, sessions] : codes) std::printf("exit code %d: %d sessions\n", code, sessions);
}

TEST(LossyFlash, EndsWithTheOldTableOrTheNewOne_AndTellsWhich) { RunSessions(18, 6); }

// ARMCAL_LOSSY_SESSIONS: another number, for runs by hand.
TEST(LongLossyFlash, EndsWithTheOldTableOrTheNewOne_AndTellsWhich) {
  const char* const given = std::getenv("ARMCAL_LOSSY_SESSIONS");
  RunSessions(given ? static_cast<unsigned>(std::atoi(given)) : 1000, 8);
}

}  // namespace
}  // namespace armcal::tests
