// bags tests - which files of a folder belong to a recording.
#include <gtest/gtest.h>

#include "host_sim/data/bags/bag_folder.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::bags {
namespace {

using files::test::ErrorOf;
using files::test::TemporaryFolder;

std::vector<std::string> FilesIn(const TemporaryFolder& folder) {
  std::vector<std::string> names;
  for (const auto& path : FilesOfRecording(folder / "")) names.push_back(path.filename().string());
  return names;
}

TEST(BagFolder, FilesOfTheMetadata_CountAlone) {
  const TemporaryFolder folder;
  for (const char* name : {"b_0.db3", "b_1.db3", "old.db3"}) folder.Write(name, "");
  folder.Write(
      "metadata.yaml",
      "rosbag2_bagfile_information:\n  version: 4\n  relative_file_paths:\n    - \"b_1.db3\"\n    - bag/b_0.db3 \n"
      "  topics:\n    - old.db3\n");
  EXPECT_EQ(FilesIn(folder), (std::vector<std::string>{"b_1.db3", "b_0.db3"}));
}

TEST(BagFolder, WithoutMetadata_AllBagsCount) {
  const TemporaryFolder folder;
  for (const char* name : {"b.db3", "a.mcap", "c.db3.zstd", "d.mcap.zst", "notes.txt", "e.zst"}) folder.Write(name, "");
  EXPECT_EQ(FilesIn(folder), (std::vector<std::string>{"a.mcap", "b.db3", "c.db3.zstd", "d.mcap.zst"}));
}

TEST(BagFolder, MissingFile_IsNamed) {
  const TemporaryFolder folder;
  EXPECT_TRUE(ErrorOf([&] {
                FilesIn(folder);
              }).ends_with("is a folder without files .mcap or .db3, expected a log or a bag's folder"));
  folder.Write("metadata.yaml", "relative_file_paths:\n- b_0.db3\n");
  EXPECT_EQ(
      ErrorOf([&] { FilesIn(folder); }),
      (folder / "metadata.yaml").string() + ": relative_file_paths: there is no file " + (folder / "b_0.db3").string());
}

}  // namespace
}  // namespace armcal::bags
