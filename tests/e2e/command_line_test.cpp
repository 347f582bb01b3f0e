// end-to-end tests - complete the command line in bash, and read the manual pages.
#include <map>
#include <regex>
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

std::vector<std::string> VerbNames() {
  std::istringstream help(Tool({"--help"}).out);
  std::vector<std::string> out;
  bool verbs = false;
  for (std::string line; std::getline(help, line);) {
    if (verbs && line.starts_with("  ") && line[2] != ' ') out.push_back(line.substr(2, line.find(' ', 2) - 2));
    verbs = verbs || line.starts_with("Subcommands");
  }
  return out;
}

// Verb -> its options, from the completion that the program writes.
std::map<std::string, std::set<std::string>> OptionsOfVerbs() {
  const fs::path folder = FreshFolder("options");
  EXPECT_EQ(Tool({"pages", "--out", folder.string()}).code, 0);
  std::istringstream lines(ReadText(folder / "armcal"));
  const std::regex row("    (\\S+)\\) words='(.*)' ;;");
  std::map<std::string, std::set<std::string>> out;
  std::smatch found;
  for (std::string line; std::getline(lines, line);) {
    if (!std::regex_match(line, found, row)) continue;
    std::istringstream words(found[2].str());
    std::set<std::string>& options = out[found[1].str()];
    for (std::string word; words >> word;) options.insert(word);
  }
  return out;
}

// What a page shows as code: fenced blocks but those of outputs, with continued lines joined; indented lines; words in
// backticks.
std::vector<std::string> CodeOf(const fs::path& page) {
  std::istringstream lines(ReadText(page));
  std::vector<std::string> out;
  std::string fence, prose, open;
  bool inside = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("```")) inside = !inside, fence = line;
    else if (!inside && line.starts_with("    ") && line[4] != ' ') out.push_back(line);
    else if (!inside) prose += line + " ";
    else if (!fence.starts_with("```text")) {
      open += line;
      if (open.ends_with('\\')) open.back() = ' ';
      else out.push_back(open), open.clear();
    }
  }
  const std::regex ticks("`([^`]+)`");
  for (std::sregex_iterator it(prose.begin(), prose.end(), ticks), end; it != end; ++it) out.push_back((*it)[1]);
  return out;
}

TEST(CommandLine, EveryCommandInTheDocs_HasAVerbAndOptionsOfTheProgram) {
  const auto verbs = OptionsOfVerbs();
  std::vector<fs::path> pages{"README.md", "CONTRIBUTING.md", "SECURITY.md", "port/PORTING.md"};
  for (const auto& page : fs::directory_iterator("docs"))
    if (page.path().extension() == ".md") pages.push_back(page.path());
  const std::regex command("(?:^|[\\s/$(])armcal +([a-z]+)([^|;&>#]*)"), option("\\s(--[a-z][a-z-]*)");
  int commands = 0;
  for (const fs::path& page : pages)
    for (const std::string& line : CodeOf(page)) {
      const std::string code = line.substr(0, line.find('#'));
      for (std::sregex_iterator it(code.begin(), code.end(), command), end; it != end; ++it) {
        ++commands;
        const std::string verb = (*it)[1], rest = (*it)[2];
        const auto known = verbs.find(verb);
        EXPECT_NE(known, verbs.end()) << page << ": no verb " << verb << ": " << code;
        if (known == verbs.end()) continue;
        for (std::sregex_iterator word(rest.begin(), rest.end(), option); word != end; ++word)
          EXPECT_TRUE(known->second.contains((*word)[1])) << page << ": no option " << (*word)[1] << ": " << code;
      }
    }
  EXPECT_GT(commands, 150);
}

TEST(CommandLine, EveryVerb_HasJson_Version_AndAnExample) {
  const std::string version = Tool({"--version"}).out;
  const std::string page = ReadText("docs/commands.md");
  const auto verbs = VerbNames();
  EXPECT_GT(verbs.size(), 20u);
  for (const std::string& verb : verbs) {
    const std::string help = Tool({verb, "--help"}).out;
    EXPECT_NE(help.find("example: armcal " + verb), std::string::npos) << verb;
    EXPECT_NE(help.find("Usage: armcal " + verb), std::string::npos) << verb;
    EXPECT_NE(help.find("--json"), std::string::npos) << verb;
    EXPECT_NE(page.find("`" + verb + "`"), std::string::npos) << verb << " is not in docs/commands.md";
    EXPECT_EQ(Tool({verb, "--version"}).out, version) << verb;
  }
}

TEST(CommandLine, AnOptionsFormerName_StillWorks_AndSaysThePresentOne) {
  const fs::path folder = FreshFolder("former_names");
  const std::string motion = (folder / "motion.csv").string();
  for (const std::vector<std::string>& seconds : {std::vector<std::string>{"--seconds", "60"}, {"--seconds=60"}}) {
    std::vector<std::string> words{"excite", "--robot", "two_link", "--starts", "1", "--no-slow", "--out", motion};
    words.insert(words.end(), seconds.begin(), seconds.end());
    const Outcome o = Tool(words);
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(o.err, "armcal excite: --seconds is called --search-seconds\n");
  }
  EXPECT_EQ(Tool({"excite", "--help"}).out.find("--seconds"), std::string::npos);
  EXPECT_EQ(Tool({"record", "--seconds", "0"}).err.find("is called"), std::string::npos) << "another verb's option";
}

}  // namespace
}  // namespace armcal::tests
