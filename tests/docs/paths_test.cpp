// tests - every path that a page of docs, README or DESIGN puts between backticks is there, and so is every linked
// page. The pages that tests follow at the same time start their drives on different ports.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>

namespace armcal::tests {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> Pages() {
  std::vector<fs::path> pages{"README.md", "DESIGN.md", "CONTRIBUTING.md", "port/PORTING.md"};
  for (const auto& entry : fs::directory_iterator("docs"))
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  return pages;
}

TEST(Docs, EveryPathThatAPageNames_Exists) {
  // a file of the tree: starts with a top folder and ends in a suffix; wildcards, <placeholders> and examples made by a
  // page itself (build/, robots of a tutorial) are no such paths
  const std::regex named("`((?:lib|port|codegen|host_sim|tests|toolchains|docs)/[A-Za-z0-9_/.-]+\\.[a-z]+)`");
  int seen = 0;
  for (const fs::path& page : Pages()) {
    std::ifstream in(page);
    ASSERT_TRUE(in) << page << ": run this in the top folder";
    const std::string text(std::istreambuf_iterator<char>(in), {});
    for (std::sregex_iterator it(text.begin(), text.end(), named), end; it != end; ++it, ++seen)
      EXPECT_TRUE(fs::exists((*it)[1].str())) << page << " names " << (*it)[1];
  }
  EXPECT_GT(seen, 20);
}

TEST(Docs, EveryLinkedPage_Exists) {
  const std::regex link("\\]\\(([A-Za-z0-9_/.-]+\\.(?:md|png))\\)");
  for (const fs::path& page : Pages()) {
    std::ifstream in(page);
    const std::string text(std::istreambuf_iterator<char>(in), {});
    for (std::sregex_iterator it(text.begin(), text.end(), link), end; it != end; ++it)
      EXPECT_TRUE(fs::exists(page.parent_path() / (*it)[1].str())) << page << " links to " << (*it)[1];
  }
}

// Two drives on one port: the second ends at once, and the page waits for it in vain. 1502 is what a page shows without
// being followed; the test of README's session takes another port.
TEST(Docs, NoTwoPages_StartADriveOnTheSamePort) {
  const std::regex started("simulate [^\n]*--port ([0-9]+)");
  std::map<std::string, fs::path> page_of;
  for (const fs::path& page : Pages()) {
    std::ifstream in(page);
    const std::string text(std::istreambuf_iterator<char>(in), {});
    for (std::sregex_iterator it(text.begin(), text.end(), started), end; it != end; ++it)
      if (const std::string port = (*it)[1]; port != "1502") {
        EXPECT_EQ(page_of.try_emplace(port, page).first->second, page) << "port " << port;
      }
  }
  EXPECT_GE(page_of.size(), 4u);
}

}  // namespace
}  // namespace armcal::tests
