// end-to-end tests - misspell the command line, complete it in bash, and read the manual pages.
#include <set>
#include <sstream>

#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

TEST(CommandLine, AMisspeltWord_IsAnsweredWithTheNearest) {
  struct Case {
    std::vector<std::string> words;
    std::string line;
  };
  for (const Case& c : std::vector<Case>{
           {{"exite"}, "armcal: no verb exite; the nearest is excite\n"},
           {{"identity", "--robot", "er20_like"}, "armcal: no verb identity; the nearest is identify\n"},
           {{"diagnos"}, "armcal: no verb diagnos; the nearest is diagnose\n"},
           {{"zzzzzzzz"}, "armcal: no verb zzzzzzzz\n"},
           {{"--verson"}, "armcal: no option --verson; the nearest is --version\n"},
           {{"identify", "--robt", "er20_like", "--train", "a.csv"},
            "armcal identify: no option --robt; the nearest is --robot\n"},
           {{"excite", "--robot", "er20_like", "--out", "x.csv", "--sed=3"},
            "armcal excite: no option --sed; the nearest is --seed\n"},
           {{"flash", "--conect", "127.0.0.1:502"}, "armcal flash: no option --conect; the nearest is --connect\n"}}) {
    const Outcome o = Tool(c.words);
    EXPECT_EQ(o.code, 2) << c.line;
    EXPECT_EQ(o.err, c.line);
    EXPECT_EQ(o.out, "");
  }
  EXPECT_NE(Tool({"identify", "--train", "a.csv"}).err.find("--robot is required"), std::string::npos);
}

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
