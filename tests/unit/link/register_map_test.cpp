// link - the declared registers against what the device serves, and the rules of the map.
#include "armcal/link/register_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/unit/link/test_device.hpp"

namespace {

using namespace armcal;
using core::Status;
using link::Register;
using link::RegisterKind;

std::uint32_t EndOf(const Register& item) { return item.address + std::uint32_t{item.count} * WordsOf(item.type); }

TEST(Registers, Items_DoNotOverlap_AndPairsLieOnEvenAddresses) {
  for (int a = 0; a < static_cast<int>(link::kRegisters.size()); ++a) {
    const Register& item = link::kRegisters[a];
    if (item.type != link::RegisterType::kU16) {
      EXPECT_EQ(item.address % 2, 0) << item.name;
    }
    EXPECT_LE(EndOf(item), link::reg::kVendor) << item.name;
    for (int b = 0; b < a; ++b) {
      const Register& other = link::kRegisters[b];
      const bool apart = other.kind != item.kind || EndOf(other) <= item.address || EndOf(item) <= other.address;
      EXPECT_TRUE(apart) << item.name << " and " << other.name;
      EXPECT_STRNE(item.name, other.name);
    }
  }
}

// What is declared and what the device serves meet here: the first word of every register is served, and nothing else.
TEST(Registers, Device_ServesEveryItem_AndNothingBetween) {
  test::TestDevice drive;
  ASSERT_TRUE(drive.all_served);
  for (const RegisterKind kind : {RegisterKind::kInput, RegisterKind::kHolding}) {
    for (std::uint32_t address = 0; address < 0x10000; ++address) {
      const Register* item = nullptr;
      for (const Register& i : link::kRegisters)
        if (i.kind == kind && address >= i.address && address < EndOf(i)) item = &i;
      std::uint16_t word;
      const Status status = drive.device.map().Read(kind, static_cast<std::uint16_t>(address), 1, &word);
      if (item == nullptr) {
        ASSERT_EQ(status, Status::kBadAddress) << address;
      } else if (item->address == address && std::string(item->name).find("_data") == std::string::npos) {
        ASSERT_EQ(status, Status::kOk) << item->name;  // an empty trace page has no data
      }
    }
  }
}

TEST(Registers, Access_IsWhatTheListSays) {
  test::TestDevice drive;
  const std::uint16_t zeros[64] = {};
  for (const Register& item : link::kRegisters) {
    if (item.kind != RegisterKind::kHolding) continue;
    const Status status = drive.device.map().Write(item.address, WordsOf(item.type), zeros);
    if (item.access == link::Access::kRead) {
      EXPECT_EQ(status, Status::kReadOnly) << item.name;
    } else if (item.access == link::Access::kWriteBlock) {
      EXPECT_EQ(status, Status::kWrongSize) << item.name;
    } else {
      EXPECT_NE(status, Status::kReadOnly) << item.name;
      EXPECT_NE(status, Status::kWrongSize) << item.name;
    }
  }
}

// The compiler makes this checksum out of the declarations. Another one would mean a map that old clients cannot read.
TEST(Registers, LayoutCrc_IsThatOfMapVersion1_6) {
  EXPECT_EQ(link::reg::kMapMajorValue, 1);
  EXPECT_EQ(link::reg::kMapMinorValue, 6);
  EXPECT_EQ(link::kLayoutCrc, 0x62A5B193u);
}

// Every word of the block has a value of its own, so a wrong place would show.
TEST(Words, ValuesLieWhereTheRegisterIsDeclared) {
  namespace reg = link::reg;
  std::uint16_t raw[reg::kStatusBlock.count];
  for (std::uint16_t i = 0; i < reg::kStatusBlock.count; ++i) raw[i] = static_cast<std::uint16_t>(0x4000 + i);
  const link::Words<reg::kStatusBlock> status(raw);
  EXPECT_EQ(status.Get<reg::kTableStatus>(), 0x4002);
  EXPECT_EQ(status.Get<reg::kTick>(), 0x40064007u);
  EXPECT_EQ((status.Get<reg::kSlotState, 1>()), 0x400F);
  link::Words<reg::kIdentityBlock> identity;
  identity.Set<reg::kProbeFloat>(reg::kProbeFloatValue);
  EXPECT_EQ(core::GetF32(identity.data() + 12), reg::kProbeFloatValue);
  EXPECT_EQ(reg::kTracePageBlock.Of(1).first, 0x6000);
  EXPECT_EQ(SpanOf(reg::kTraceAcknowledge).Of(1).first, 0x011C);
}

TEST(Registers, CountersOfDoubt_EachServeTheirOwn) {
  test::TestDevice drive;
  drive.live.rows_outside[0] = 0x10001, drive.live.rows_outside[1] = 0x20002, drive.live.implausible_ticks = 0x30003;
  std::uint16_t words[8];
  ASSERT_EQ(drive.device.map().Read(RegisterKind::kInput, 0x0068, 8, words), Status::kOk);
  for (std::uint32_t k = 0; k < 3; ++k) EXPECT_EQ(core::GetU32(words + 2 * k), (k + 1) * 0x10001);
  EXPECT_EQ(core::GetU32(words + 6), drive.store.fallbacks());
}

TEST(Registers, FloatsBeyondTheDevicesColumns_AreNotThere) {
  test::TestDevice drive;
  std::uint16_t words[4];
  const std::uint16_t last = link::reg::kEstimateA + 2 * (test::kColumns - 1);
  ASSERT_EQ(drive.device.map().Read(RegisterKind::kInput, last, 2, words), Status::kOk);
  EXPECT_EQ(core::GetF32(words), 0.5f * (test::kColumns - 1));
  EXPECT_EQ(drive.device.map().Read(RegisterKind::kInput, last, 3, words), Status::kBadAddress);
  ASSERT_EQ(drive.device.map().Read(RegisterKind::kInput, link::reg::kDeviationA.address, 2, words), Status::kOk);
  EXPECT_TRUE(std::isnan(core::GetF32(words))) << "no estimate yet";
}

TEST(RegisterMap, Add_RefusesOverlapAndOverflow) {
  link::RegisterMap map;
  const auto read = [](void*, std::uint16_t, std::uint16_t, std::uint16_t*) { return Status::kOk; };
  const auto block = [&](RegisterKind kind, std::uint16_t first, std::uint16_t count) {
    return link::Block{kind, first, count, nullptr, read, nullptr, link::WriteRule::kWords};
  };
  EXPECT_EQ(map.Add(block(RegisterKind::kInput, 10, 10)), Status::kOk);
  EXPECT_EQ(map.Add(block(RegisterKind::kInput, 19, 1)), Status::kBadAddress);
  EXPECT_EQ(map.Add(block(RegisterKind::kInput, 5, 6)), Status::kBadAddress);
  EXPECT_EQ(map.Add(block(RegisterKind::kHolding, 10, 10)), Status::kOk);
  EXPECT_EQ(map.Add(block(RegisterKind::kInput, 0xFFFF, 2)), Status::kOutOfRange);
  EXPECT_EQ(map.Add(block(RegisterKind::kInput, 0xFFFF, 1)), Status::kOk);
  EXPECT_EQ(map.Add(block(RegisterKind::kInput, 30, 0)), Status::kOutOfRange);
  Status status = Status::kOk;
  for (std::uint16_t i = 0; core::IsOk(status); ++i)
    status = map.Add(block(RegisterKind::kInput, static_cast<std::uint16_t>(100 + i), 1));
  EXPECT_EQ(status, Status::kFull);
}

TEST(RegisterMap, ExceptionOf_IsNonZeroForEveryRefusalAndFault) {
  for (int number = 1; number < 64; ++number) EXPECT_NE(link::ExceptionOf(static_cast<Status>(number)), 0) << number;
  EXPECT_EQ(link::ExceptionOf(Status::kOk), 0);
  EXPECT_EQ(link::ExceptionOf(Status::kClamped), 0);
  EXPECT_EQ(link::ExceptionOf(Status::kBusy), 6);
  EXPECT_EQ(link::ExceptionOf(Status::kAxisEnabled), 4);
}

}  // namespace
