// port_template tests - the template works as it is: with lib's table store, and byte by byte.
#include <gtest/gtest.h>

#include <array>

#include "armcal/table/table_store.hpp"
#include "port/template/clock.hpp"
#include "port/template/serial.hpp"
#include "port/template/storage.hpp"

namespace armcal::port::target {
namespace {

using core::Status;

TEST(Template, Storage_KeepsTheRulesOfFlash) {
  const hardware::Storage storage = TargetStorage();
  const std::array<std::uint8_t, 8> bytes = {1, 2, 3, 4, 5, 6, 7, 8};
  ASSERT_EQ(storage.Erase(0), Status::kOk);
  EXPECT_EQ(storage.Program(8, bytes.data(), 8), Status::kOk);
  EXPECT_EQ(storage.Program(8, bytes.data(), 8), Status::kStorageFault) << "a unit is written once per erase";
  EXPECT_EQ(storage.Program(4, bytes.data(), 8), Status::kStorageFault) << "not on a unit";
  EXPECT_EQ(storage.Program(2 * 4096, bytes.data(), 8), Status::kStorageFault) << "beyond the end";
  EXPECT_EQ(storage.Erase(2), Status::kStorageFault);
  std::array<std::uint8_t, 8> back = {};
  EXPECT_EQ(storage.Read(8, back.data(), 8), Status::kOk);
  EXPECT_EQ(back, bytes);
}

TEST(Template, Storage_CarriesATable) {
  const hardware::Storage storage = TargetStorage();
  ASSERT_EQ(storage.Erase(0), Status::kOk);
  ASSERT_EQ(storage.Erase(1), Status::kOk);
  constexpr std::uint32_t kSchema = 0xC0FFEE, kWords = 500;
  std::array<std::uint16_t, kWords> saved, loaded = {};
  for (std::uint32_t k = 0; k < kWords; ++k) saved[k] = static_cast<std::uint16_t>(k * 77);
  table::TableStore store(storage, kSchema, kWords);
  EXPECT_EQ(store.Load(loaded.data()), Status::kBlank);
  ASSERT_EQ(store.Save(saved.data()), Status::kOk);
  Status status = Status::kBusy;
  for (int k = 0; k < 10000 && status == Status::kBusy; ++k) status = store.Step();
  ASSERT_EQ(status, Status::kOk);
  table::TableStore after_reset(storage, kSchema, kWords);
  EXPECT_EQ(after_reset.Load(loaded.data()), Status::kOk);
  EXPECT_EQ(loaded, saved);
}

TEST(Template, Serial_PassesBytesInOrderAndTakesNoMoreThanItHolds) {
  const hardware::Serial serial = TargetSerial();
  for (int k = 0; k < 300; ++k) OnReceived(static_cast<std::uint8_t>(k));
  std::array<std::uint8_t, 300> bytes = {};
  EXPECT_EQ(serial.Read(bytes.data(), 100), 100u);
  EXPECT_EQ(bytes[99], 99);
  EXPECT_EQ(serial.Read(bytes.data(), bytes.size()), 156u);
  EXPECT_EQ(bytes[0], 100);
  EXPECT_EQ(serial.Write(bytes.data(), bytes.size()), 256u);
  std::uint8_t byte = 0;
  int sent = 0;
  while (NextToSend(byte)) EXPECT_EQ(byte, bytes[static_cast<std::size_t>(sent++)]);
  EXPECT_EQ(sent, 256);
}

TEST(Template, Clock_CountsTicksAndMilliseconds) {
  const hardware::Clock clock = TargetClock();
  const std::uint32_t tick = clock.Ticks(), ms = clock.Ms();
  for (std::uint32_t k = 1; k <= 5 * kTickRate_Hz; ++k) EXPECT_EQ(CountTick(), tick + k);
  EXPECT_EQ(clock.Ms() - ms, 5000u);
}

}  // namespace
}  // namespace armcal::port::target
