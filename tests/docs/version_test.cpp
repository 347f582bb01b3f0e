// tests - files that other tools read cannot read the version from the header. They name the same one.
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <sstream>

namespace armcal::tests {
namespace {

// What the first match of `pattern` holds in its first group.
std::string Found(const char* path, const std::string& pattern) {
  std::ifstream in(path);
  EXPECT_TRUE(in) << path << ": run this in the top folder";
  const std::string text(std::istreambuf_iterator<char>(in), {});
  std::smatch match;
  EXPECT_TRUE(std::regex_search(text, match, std::regex(pattern))) << path << ": expected " << pattern;
  return match.size() > 1 ? match[1].str() : "";
}

TEST(Version, IsTheHeadersInEveryManifestAndPage) {
  std::istringstream digits(Found("lib/armcal/core/version.hpp", "#define ARMCAL_VERSION 0x([0-9A-F]{6})\n"));
  std::string version;
  for (char two[3] = {}; digits.read(two, 2);)
    version += (version.empty() ? "" : ".") + std::to_string(std::stoi(two, nullptr, 16));
  EXPECT_EQ(Found("library.json", "\"version\": \"([^\"]*)\""), version);
  EXPECT_EQ(Found("package.xml", "<version>([^<]*)</version>"), version);
  EXPECT_EQ(Found("host_sim/python/pyproject.toml", "\nversion = \"([^\"]*)\""), version);
  EXPECT_EQ(Found("CHANGELOG.md", "\n## ([0-9.]*)"), version);
  EXPECT_EQ(Found("docs/install.md", "armcal_([0-9.]*)_amd64"), version);
  EXPECT_EQ(Found("docs/install.md", "armcal/([0-9.]*)`"), version);
}

}  // namespace
}  // namespace armcal::tests
