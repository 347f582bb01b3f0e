// client - tests the table store on the file that stands for flash memory on Linux.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <memory>
#include <vector>

#include "armcal/table/table_store.hpp"
#include "port/linux/file_storage.hpp"
#include "tests/unit/link/test_device.hpp"

namespace {

using namespace armcal;
using core::Status;

class FileStorage : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }
  const std::string path_ =
      (std::filesystem::temp_directory_path() / ("armcal_storage_" + std::to_string(::getpid()))).string();
};

TEST_F(FileStorage, TableSavedByOneProcess_IsLoadedByTheNext) {
  const auto table = test::MakeTable(4);
  {
    port_linux::FileStorage file(2, 4096, 8);
    ASSERT_EQ(file.Open(path_), Status::kOk);
    table::TableStore store(file.storage(), test::kSchema, test::kTableWords);
    std::vector<std::uint16_t> words(test::kTableWords);
    EXPECT_EQ(store.Load(words.data()), Status::kBlank);
    ASSERT_EQ(store.Save(table.data()), Status::kOk);
    while (store.Step() == Status::kBusy) {
    }
  }
  port_linux::FileStorage file(2, 4096, 8);
  ASSERT_EQ(file.Open(path_), Status::kOk);
  table::TableStore store(file.storage(), test::kSchema, test::kTableWords);
  std::vector<std::uint16_t> words(test::kTableWords);
  EXPECT_EQ(store.Load(words.data()), Status::kOk);
  EXPECT_EQ(words, table);
}

TEST_F(FileStorage, Programming_ClearsBitsOnly_AndEraseSetsThem) {
  port_linux::FileStorage file(2, 256, 4);
  ASSERT_EQ(file.Open(path_), Status::kOk);
  const hardware::Storage storage = file.storage();
  std::uint8_t bytes[4] = {0xF0, 0x0F, 0xFF, 0x00};
  ASSERT_EQ(storage.Program(4, bytes, 4), Status::kOk);
  const std::uint8_t more[4] = {0xFF, 0xFF, 0x55, 0xFF};
  ASSERT_EQ(storage.Program(4, more, 4), Status::kOk);
  ASSERT_EQ(storage.Read(4, bytes, 4), Status::kOk);
  EXPECT_EQ(std::vector<std::uint8_t>(bytes, bytes + 4), (std::vector<std::uint8_t>{0xF0, 0x0F, 0x55, 0x00}));
  ASSERT_EQ(storage.Erase(0), Status::kOk);
  ASSERT_EQ(storage.Read(4, bytes, 4), Status::kOk);
  EXPECT_EQ(bytes[3], 0xFF);
  EXPECT_EQ(storage.Erase(2), Status::kStorageFault);
  EXPECT_EQ(storage.Program(2, bytes, 4), Status::kStorageFault);
  EXPECT_EQ(storage.Read(510, bytes, 4), Status::kStorageFault);
}

TEST_F(FileStorage, ThatAnotherDriveUses_IsBusyUntilThatEnds) {
  auto first = std::make_unique<port_linux::FileStorage>(2, 256, 4);
  ASSERT_EQ(first->Open(path_), Status::kOk);
  EXPECT_EQ(port_linux::FileStorage(2, 256, 4).Open(path_), Status::kBusy);
  first.reset();
  EXPECT_EQ(port_linux::FileStorage(2, 256, 4).Open(path_), Status::kOk);
}

TEST_F(FileStorage, InAFolderThatIsNotThere_IsAFault) {
  port_linux::FileStorage file(2, 256, 4);
  EXPECT_EQ(file.Open(path_ + "/none/here"), Status::kStorageFault);
}

}  // namespace
