// files tests - read and write whole files, and compare their hashes.
#include "host_sim/data/files/files.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "codegen/src/io/atomic_write.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::files {
namespace {

using test::ErrorOf;
using test::TemporaryFolder;

TEST(Files, Sha256_MatchesPublishedVectors) {  // FIPS 180-4 examples
  EXPECT_EQ(Sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(Sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(Sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(Sha256(std::string(1000000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Files, AtomicWrite_PlainAndGzip_ReadBackTheSame) {
  const TemporaryFolder folder;
  std::string text;
  for (long k = 0; k < 300000; ++k) text += std::to_string(k * 7919 % 1000003) + ",";
  for (const char* name : {"a.txt", "b.gz", "new/folder/c.csv.gz"}) {
    WriteWholeFile(folder / name, text);
    EXPECT_EQ(ReadWholeFile(folder / name), text) << name;
  }
  EXPECT_LT(std::filesystem::file_size(folder / "b.gz"), text.size() / 2);
}

// 64 MB of zeros in a file of 64 KB. Text of numbers of the same size is read.
TEST(Files, AFileMadeToFillTheMemory_IsRefused_AndALongLogIsNot) {
  const TemporaryFolder folder;
  WriteWholeFile(folder / "bomb.gz", std::string(std::size_t{64} << 20, '0'));
  EXPECT_NE(ErrorOf([&] { (void)ReadWholeFile(folder / "bomb.gz"); }).find("bomb.gz: grows to more than 60 times"),
            std::string::npos);
  std::string rows;
  for (long k = 0; rows.size() < (std::size_t{24} << 20); ++k)
    rows += std::to_string(k * 7919 % 1000003) + ",0.0,0.0\n";
  WriteWholeFile(folder / "log.gz", rows);
  EXPECT_EQ(ReadWholeFile(folder / "log.gz").size(), rows.size());
}

TEST(Files, AtomicWrite_GzipTwice_GivesTheSameBytes) {
  const TemporaryFolder folder;
  WriteWholeFile(folder / "a.gz", "same text");
  WriteWholeFile(folder / "b.gz", "same text");
  EXPECT_EQ(FileHash(folder / "a.gz"), FileHash(folder / "b.gz"));
}

TEST(Files, AtomicWrite_WhereItCannot_LeavesNoPartAndKeepsTheOld) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "target/inside");  // a folder that is not empty cannot be replaced
  EXPECT_EQ(ErrorOf([&] { WriteWholeFile(folder / "target", "text"); }),
            (folder / "target").string() + ": cannot be written: Is a directory; choose another place");
  EXPECT_TRUE(std::filesystem::is_directory(folder / "target/inside"));
  int entries = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder / ".")) ++entries;
  EXPECT_EQ(entries, 1);
  WriteWholeFile(folder / "file", "text");
  EXPECT_EQ(ErrorOf([&] { WriteWholeFile(folder / "file/below.csv", "text"); }),
            (folder / "file/below.csv").string() + ": cannot be written: Not a directory; choose another place");
}

TEST(Files, CheckWritable_SaysBeforeWhatAWriteSaysAfter_AndMakesNothing) {
  const TemporaryFolder folder;
  WriteWholeFile(folder / "file", "text");
  std::filesystem::create_directories(folder / "target/inside");
  for (const char* bad : {"target", "file/below.csv", "file/far/below.csv"}) {
    const std::string before = ErrorOf([&] { io::CheckWritable(folder / bad); });
    EXPECT_NE(before, "") << bad;
    EXPECT_EQ(before, ErrorOf([&] { io::AtomicWrite(folder / bad, "text"); }));
  }
  for (const char* good : {"file", "new.csv", "new/folder/new.csv"})
    EXPECT_EQ(ErrorOf([&] { io::CheckWritable(folder / good); }), "") << good;
  EXPECT_FALSE(std::filesystem::exists(folder / "new"));
  EXPECT_FALSE(std::filesystem::exists(folder / "new.csv"));
}

TEST(Files, AtomicWrite_ToALink_ReplacesTheFileThatItNames) {
  const TemporaryFolder folder;
  namespace fs = std::filesystem;
  fs::create_directories(folder / "far");
  folder.Write("far/old.csv", "old");
  fs::create_symlink("far/old.csv", folder / "link");
  fs::create_symlink("link", folder / "link of a link");
  fs::create_symlink(folder / "far/new.csv", folder / "link to nothing");
  for (const auto& [link, file] : {std::pair{"link", "far/old.csv"}, std::pair{"link of a link", "far/old.csv"},
                                   std::pair{"link to nothing", "far/new.csv"}}) {
    EXPECT_EQ(ErrorOf([&] { io::CheckWritable(folder / link); }), "") << link;
    io::AtomicWrite(folder / link, link);
    EXPECT_TRUE(fs::is_symlink(folder / link)) << link;
    EXPECT_FALSE(fs::is_symlink(folder / file)) << link;
    EXPECT_EQ(test::ReadBytes(folder / file), link);
  }
  fs::create_symlink("far", folder / "link to a folder");
  fs::create_symlink("loop", folder / "loop");
  for (const auto& [link, why] :
       {std::pair{"link to a folder", "Is a directory"}, std::pair{"loop", "Too many levels"}})
    for (const auto write : {+[](const fs::path& path) { io::CheckWritable(path); },
                             +[](const fs::path& path) { io::AtomicWrite(path, "text"); }})
      EXPECT_NE(ErrorOf([&] { write(folder / link); }).find(why), std::string::npos) << link;
}

TEST(Files, AtomicWrite_ToAPipeOrADevice_WritesToItAndLeavesIt) {
  const TemporaryFolder folder;
  const std::filesystem::path pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(ErrorOf([&] { io::CheckWritable(pipe); }), "");
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK);  // the writer need not wait for it
  io::AtomicWrite(pipe, "through the pipe");
  char bytes[64];
  const ssize_t count = read(reader, bytes, sizeof bytes);
  close(reader);
  ASSERT_GT(count, 0);
  EXPECT_EQ(std::string(bytes, static_cast<std::size_t>(count)), "through the pipe");
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
  std::filesystem::create_symlink("/dev/null", folder / "nowhere");
  io::AtomicWrite(folder / "nowhere", "text");
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "nowhere"));
  EXPECT_NE(ErrorOf([&] { io::AtomicWrite("/dev/full", "text"); }).find("No space left"), std::string::npos);
}

// As `--json /dev/stdout` does, with the standard output in a file: both writers go on where the other one ended.
TEST(Files, AtomicWrite_ToADescriptorOfThisProgram_AppendsToWhatItHolds) {
  const TemporaryFolder folder;
  const int file = open((folder / "out").c_str(), O_CREAT | O_RDWR, 0600);
  const std::filesystem::path link = "/dev/fd/" + std::to_string(file);
  std::filesystem::create_symlink(link, folder / "as stdout");
  ASSERT_EQ(write(file, "before ", 7), 7);
  for (const std::filesystem::path& path : {link, folder / "as stdout"}) {
    EXPECT_EQ(ErrorOf([&] { io::CheckWritable(path); }), "");
    io::AtomicWrite(path, "text ");
  }
  ASSERT_EQ(write(file, "after", 5), 5);
  close(file);
  EXPECT_EQ(test::ReadBytes(folder / "out"), "before text text after");
}

TEST(Files, ReadWholeFile_GzipCutShort_IsRefused) {
  const TemporaryFolder folder;
  std::string text;
  for (long k = 0; k < 100000; ++k) text += std::to_string(k * k % 7919) + "\n";
  WriteWholeFile(folder / "whole.gz", text);
  std::ifstream in(folder / "whole.gz", std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(in), {});
  for (const std::size_t size : {bytes.size() / 2, bytes.size() - 4}) {
    const auto cut = folder.Write("cut.gz", bytes.substr(0, size));
    EXPECT_EQ(ErrorOf([&] { ReadWholeFile(cut); }),
              cut.string() + ": gzip data is damaged or cut short; copy or record it again");
  }
}

TEST(Files, ReadWholeFile_MissingOrFolder_SaysSo) {
  const TemporaryFolder folder;
  EXPECT_EQ(ErrorOf([&] { ReadWholeFile(folder / "none"); }),
            (folder / "none").string() + ": no such file; check the path");
  std::filesystem::create_directories(folder / "sub");
  EXPECT_EQ(ErrorOf([&] { ReadWholeFile(folder / "sub"); }),
            (folder / "sub").string() + ": is a folder, expected a file");
}

TEST(Files, HashOfAFolder_IsThatOfTheNamesAndHashesOfItsFiles) {
  const TemporaryFolder folder;
  folder.Write("b", "two"), folder.Write("a", "one");
  // printf 'a %s\nb %s\n' $(printf one | sha256sum | cut -c-64) $(printf two | sha256sum | cut -c-64) | sha256sum
  EXPECT_EQ(FileHash(folder / ""), "a10d1fa05764ffc27440aa18ea4f3eea5c16e3c37f7458422dfb3d7dce4b1682");
}

}  // namespace
}  // namespace armcal::files
