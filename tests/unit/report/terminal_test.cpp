// report tests - check aligned tables, and progress that leaves no marks in a file.
#include <gtest/gtest.h>

#include <cstdio>

#include "host_sim/data/report/progress.hpp"
#include "host_sim/data/report/table.hpp"

namespace armcal::report {
namespace {

TEST(Table, NumbersFlushRight_TextFlushLeft_Utf8CountsLetters) {
  const Table table{{"joint", "RMS", "unit"}, {{"µ", "1.5", "N·m"}, {"axis 2", "-12.25", "N"}, {"x", "-"}}, ""};
  EXPECT_EQ(Text(table),
            "joint      RMS  unit\n"
            "------  ------  ----\n"
            "µ          1.5  N·m\n"
            "axis 2  -12.25  N\n"
            "x            -\n");
}

TEST(Table, WordsInAColumn_MakeItText) {
  EXPECT_TRUE(IsNumeric({{"a"}, {{"1"}, {"2.5 %"}, {""}}, ""}, 0));
  EXPECT_FALSE(IsNumeric({{"a"}, {{"1"}, {"two"}}, ""}, 0));
  EXPECT_FALSE(IsNumeric({{"a"}, {{""}}, ""}, 0));
}

TEST(Progress, IntoAFile_WritesNothing) {
  std::FILE* file = std::tmpfile();
  ASSERT_NE(file, nullptr);
  {
    Progress progress("identify", file);
    for (int k = 0; k <= 1000; ++k) progress.Set(k / 1000.0);
  }
  std::rewind(file);
  std::string text(4096, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), file));
  std::fclose(file);
  EXPECT_EQ(text, "");
}

}  // namespace
}  // namespace armcal::report
