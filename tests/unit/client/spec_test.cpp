// client - compares SPEC.md with the headers that it describes.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "armcal/link/event_log.hpp"
#include "armcal/link/registers.hpp"
#include "armcal/table/table_store.hpp"
#include "host_sim/client/register_text.hpp"

namespace {

using namespace armcal;

std::string Spec() {
  std::ifstream file("SPEC.md");
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

// On failure: put the table printed here into SPEC.md.
void ExpectInSpec(const std::string& table) {
  EXPECT_NE(Spec().find(table), std::string::npos) << "expected:\n" << table;
}

TEST(Spec, RegisterTables_AreThoseOfTheHeader) { ExpectInSpec(client::RegisterMarkdown()); }

TEST(Spec, StatusTable_IsThatOfTheHeader) { ExpectInSpec(client::StatusMarkdown()); }

TEST(Spec, Numbers_InTheText_AreThoseOfTheHeaders) {
  const auto hex = [](std::uint32_t value) {
    std::ostringstream out;
    out << "0x" << std::hex << std::uppercase << std::setw(8) << std::setfill('0') << value;
    return out.str();
  };
  for (const std::uint32_t value :
       {link::reg::kOpen, link::reg::kCheck, link::reg::kSave, link::reg::kUnlockKey, link::reg::kTrial,
        link::reg::kConfirm, link::reg::kBack, link::reg::kLoad, link::kBootEvent, link::kDropEvent,
        table::kRecordMagic, table::kCommitWord, link::kLayoutCrc})
    ExpectInSpec("`" + hex(value) + "`");
}

TEST(RegisterText, JsonAndCsv_HoldEveryRegister) {
  const auto json = nlohmann::json::parse(client::RegisterJson());
  EXPECT_EQ(json["items"].size(), link::kRegisters.size());
  const std::string csv = client::RegisterCsv();
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), static_cast<long>(link::kRegisters.size()) + 1);
  for (const link::Register& r : link::kRegisters) EXPECT_NE(csv.find(r.name), std::string::npos);
}

TEST(RegisterText, StatusWithoutAName_IsANumber) {
  EXPECT_EQ(client::StatusName(static_cast<core::Status>(200)), "status 200");
  EXPECT_EQ(client::StatusName(core::Status::kLocked), "Locked: the session is not unlocked");
}

}  // namespace
