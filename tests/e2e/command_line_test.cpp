// end-to-end tests - complete the command line in bash, and read the manual pages.
#include <set>
#include <sstream>

#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

// What bash offers behind these words; the last one is not finished.
std::set<std::string> Completed(const fs::path& completion, const std::string& words) {
  const Outcome o = RunProgram({"bash", "-c",
                                "source '" + completion.string() + "' && COMP_WORDS=(armcal " + words +
                                    ") && COMP_CWORD=$((${#COMP_WORDS[@]} - 1)) && _armcal && printf '%s\\n' "
                                    "\"${COMPREPLY[@]}\""});
  EXPECT_EQ(o.err, "") << words;
  std::istringstream lines(o.out);
  std::set<std::string> out;
  for (std::string line; std::getline(lines, line);) out.insert(line);
  return out;
}

TEST(CommandLine, Pages_HoldEveryVerbAndOptionOfTheHelp) {
  const fs::path folder = FreshFolder("pages");
  ASSERT_EQ(Tool({"pages", "--out", folder.string()}).code, 0);
  const fs::path completion = folder / "armcal";
  EXPECT_EQ(Completed(completion, "exc"), std::set<std::string>{"excite"});
  EXPECT_EQ(Completed(completion, "i"), (std::set<std::string>{"identify", "import", "info"}));
  EXPECT_EQ(Completed(completion, "diagnose --tr"), std::set<std::string>{"--train"});
  EXPECT_EQ(Completed(completion, "excite --x"), std::set<std::string>{""});
  int verbs = 0;
  for (const auto& page : fs::directory_iterator(folder / "man1")) {
    const std::string name = page.path().stem(), text = ReadText(page.path());
    if (name == "armcal") continue;
    ++verbs;
    const std::string help = Tool({name.substr(std::string("armcal-").size()), "--help"}).out;
    ASSERT_NE(help.find("Options:"), std::string::npos) << name;
    std::istringstream words(help.substr(help.find("Options:")));
    for (std::string word; words >> word;) {
      if (!word.starts_with("--") || word.size() < 3 || !std::isalpha(static_cast<unsigned char>(word[2]))) continue;
      word = word.substr(0, word.find_first_of(",;.)="));
      std::string troff;
      for (const char c : word) troff += c == '-' ? std::string("\\-") : std::string(1, c);
      EXPECT_NE(text.find(troff), std::string::npos) << name << ": " << word;
    }
  }
  EXPECT_GT(verbs, 20);
}

}  // namespace
}  // namespace armcal::tests
