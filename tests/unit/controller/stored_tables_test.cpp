// controller - stored tables of layout version 1: a record that a firmware of that version wrote boots on this one.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "armcal/controller/controller.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "codegen/generated/emps/model.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "codegen/generated/kuka_kr300/model.hpp"
#include "codegen/generated/kuka_lwr4/model.hpp"
#include "codegen/generated/puma560/model.hpp"
#include "codegen/generated/two_link/model.hpp"
#include "codegen/generated/ur10/model.hpp"
#include "tests/unit/controller/bench.hpp"
#include "tests/unit/table/nor_flash.hpp"

namespace armcal::stored_tables {
namespace {

using core::Status;

// What tests/unit/controller/version_1 holds of a robot. The firmware that knew version 1 alone wrote it: the torques
// that it fed forward, as the bits of float32, and the bytes of the slot.
struct Golden {
  std::vector<std::vector<std::uint32_t>> torque;
  std::vector<std::uint8_t> record;

  explicit Golden(const std::string& robot) {
    std::ifstream file("tests/unit/controller/version_1/" + robot + ".txt");
    std::string line;
    bool torques = true;
    while (std::getline(file, line)) {
      if (line == "torque") continue;
      if (line == "record") {
        torques = false;
      } else if (torques) {
        torque.emplace_back();
        for (std::size_t at = 0; at < line.size(); at += 9)
          torque.back().push_back(static_cast<std::uint32_t>(std::stoul(line.substr(at, 8), nullptr, 16)));
      } else {
        for (std::size_t at = 0; at < line.size(); at += 2)
          record.push_back(static_cast<std::uint8_t>(std::stoul(line.substr(at, 2), nullptr, 16)));
      }
    }
  }
};

// The set-points of the golden torques. All numbers are exact in float32.
template <int n>
controller::SetPoint<n> SetPointOf(int k) {
  controller::SetPoint<n> set;
  for (int i = 0; i < n; ++i) {
    const float sign = (i + k) % 2 == 0 ? 1.0f : -1.0f;
    set.q[i] = sign * 0.125f * static_cast<float>(i + k + 1);
    set.qd[i] = -sign * 0.25f * static_cast<float>(k + 1);
    set.qdd[i] = 0.5f * static_cast<float>(i - k);
  }
  return set;
}

template <class Model>
void ExpectBootsAsBefore(const char* robot) {
  constexpr int n = Model::kJoints;
  const Golden golden(robot);
  ASSERT_EQ(golden.torque.size(), 4u) << robot;
  test::NorFlash flash{{2, 8192, 8, 0xFF}};
  std::copy(golden.record.begin(), golden.record.end(), flash.cells().begin());
  std::uint32_t now = 0;
  const auto count = [](void* t) { return *static_cast<std::uint32_t*>(t); };
  using Drive = controller::Controller<Model, filter::ForgettingFilter<Model>>;
  const auto drive = std::make_unique<Drive>(flash.storage(), hardware::Clock{&now, count, count});
  ASSERT_EQ(drive->Boot(), Status::kOk) << robot;
  for (const float gate : drive->adopted().gate_sigma) EXPECT_EQ(gate, 5.0f) << robot;
  float temperature_degC[n], tau_Nm[n];
  for (float& t : temperature_degC) t = 25.0f;
  for (int k = 0; k < 4; ++k, ++now) {
    ASSERT_EQ(drive->FeedForward(SetPointOf<n>(k), temperature_degC, tau_Nm), Status::kOk) << robot;
    std::uint32_t bits[n];
    std::memcpy(bits, tau_Nm, sizeof bits);
    EXPECT_EQ(std::vector<std::uint32_t>(bits, bits + n), golden.torque[k]) << robot << ", set-point " << k;
  }
  // What is served is the table as it was stored.
  link::Words<link::reg::kTableBlock> form;
  const link::Span block = SpanOf(link::reg::kTableBlock);
  ASSERT_EQ(drive->map().Read(block.kind, block.first, block.count, form.data()), Status::kOk);
  EXPECT_EQ(form.Get<link::reg::kActiveWords>(), Drive::kFirstWords);
  EXPECT_EQ(form.Get<link::reg::kTableRoom>(), Drive::kFirstWords + 2 * n + 40);
  std::uint16_t served[100];
  ASSERT_EQ(drive->map().Read(link::RegisterKind::kHolding, link::reg::kActiveTable.address, 100, served), Status::kOk);
  for (int w = 0; w < 100; ++w) ASSERT_EQ(served[w], core::GetBytes16(&golden.record[20 + 2 * w])) << robot << w;
}

TEST(StoredTables, OfVersion1_BootWithTheSameTorqueBits) {
  ExpectBootsAsBefore<generated::Emps>("emps");
  ExpectBootsAsBefore<generated::Er20Like>("er20_like");
  ExpectBootsAsBefore<generated::KukaKr300>("kuka_kr300");
  ExpectBootsAsBefore<generated::KukaLwr4>("kuka_lwr4");
  ExpectBootsAsBefore<generated::Puma560>("puma560");
  ExpectBootsAsBefore<generated::TwoLink>("two_link");
  ExpectBootsAsBefore<generated::Ur10>("ur10");
}

// A client of layout version 1 reads table_words registers of the table in force, also of a drive without a stored one,
// changes some, and flashes them with this length.
TEST(StoredTables, AnOlderClient_ReadsTheDefaultsAndFlashesThem) {
  const auto drive = std::make_unique<test::Bench<filter::ForgettingFilter<generated::Er20Like>>>();
  ASSERT_EQ(drive->booted, Status::kBlank);
  const std::uint16_t size = drive->Value<link::reg::kTableWords>();
  std::vector<std::uint16_t> words = drive->Read(SpanOf(link::reg::kActiveTable, size));
  EXPECT_EQ(words[2], 1);
  EXPECT_EQ(drive->Value<link::reg::kActiveCrc>(), core::Crc32Words(words.data(), words.size()));
  core::PutF32(&words[16], 1.5f * core::GetF32(&words[16]));  // sigma of joint 1
  ASSERT_EQ(drive->Flash(words), Status::kOk);
  EXPECT_EQ(drive->Read(SpanOf(link::reg::kActiveTable, size)), words);
  EXPECT_EQ(drive->Value<link::reg::kActiveCrc>(), core::Crc32Words(words.data(), words.size()));
  EXPECT_EQ(drive->controller.adopted().sigma_Nm[0], core::GetF32(&words[16]));
}

}  // namespace
}  // namespace armcal::stored_tables
