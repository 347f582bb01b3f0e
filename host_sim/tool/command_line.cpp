// tool - finds misspelt words of a command line, and writes manual pages and completion from its definition.
#include "host_sim/tool/command_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <set>
#include <string_view>
#include <vector>

#include "armcal/core/version.hpp"
#include "codegen/src/io/atomic_write.hpp"
#include "codegen/src/io/faults.hpp"
#include "host_sim/data/files/files.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

namespace {

// As the definition has them: by place.
std::vector<const CLI::App*> Verbs(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* verb) { return !verb->get_name().empty(); });
}

std::vector<const CLI::Option*> Options(const CLI::App& verb) {
  std::vector<const CLI::Option*> out;
  for (const CLI::Option* option : verb.get_options())
    if (!option->get_group().empty()) out.push_back(option);
  return out;
}

std::vector<std::string> LongNames(const CLI::App& verb) {
  std::vector<std::string> out;
  for (const CLI::Option* option : Options(verb))
    for (const std::string& name : option->get_lnames()) out.push_back("--" + name);
  return out;
}

std::string Unknown(const std::string& what, const std::string& word, const std::vector<std::string>& known) {
  if (std::find(known.begin(), known.end(), word) != known.end()) return {};
  const std::string nearest = io::Nearest(word, known);
  return fmt::format("no {} {}; {}", what, word, nearest.empty() ? "--help lists them" : "the nearest is " + nearest);
}

// One line for the first word that is no verb or no option; empty: every word is known.
std::string Misspelt(const CLI::App& app, const CLI::App* verb, const std::vector<std::string>& words) {
  if (verb == nullptr) {
    std::vector<std::string> names;
    for (const CLI::App* known : Verbs(app)) names.push_back(known->get_name());
    const std::string& first = words[0];
    return first.starts_with("-") ? Unknown("option", first.substr(0, first.find('=')), LongNames(app))
                                  : Unknown("verb", first, names);
  }
  for (std::size_t k = 1; k < words.size(); ++k) {
    const std::string& word = words[k];
    if (word == "--") break;
    if (!word.starts_with("--")) continue;
    if (const std::string text = Unknown("option", word.substr(0, word.find('=')), LongNames(*verb)); !text.empty())
      return text;
  }
  return {};
}

enum class FileUse {
  kWrites,  // a file that the verb writes
  kOwn,     // a file or a folder that it writes and checks itself
  kOther,   // a file that it reads, or no file at all
};

struct GivenPath {
  std::string option;
  std::filesystem::path path;
  FileUse use;
};

// A name means the same in all verbs, but for `file`, which only armcal backup writes.
FileUse UseOf(const CLI::App& verb, const CLI::Option& option) {
  static const std::set<std::string> written{"--json",      "--report",  "--out",     "--samples",   "--model-out",
                                             "--table-out", "--records", "--ros-out", "--truth-log", "--payload-out"};
  const std::string name = option.get_name();
  if (name == "--db" || name == "--storage" || option.get_type_name() == kFolder) return FileUse::kOwn;
  const bool backup = verb.get_name() == "backup" && name == "file";
  return backup || written.contains(name) ? FileUse::kWrites : FileUse::kOther;
}

// The values of this command line, as paths. InputError: a file that has to be written has no name.
std::vector<GivenPath> GivenPaths(const CLI::App& verb) {
  std::vector<GivenPath> out;
  for (const CLI::Option* option : Options(verb))
    for (const std::string& value : option->results()) {
      const FileUse use = UseOf(verb, *option);
      if (!value.empty()) out.push_back({option->get_name(), value, use});
      else if (use == FileUse::kWrites && option->get_required())
        throw io::InputError(option->get_name() + ": expected a file");
    }
  return out;
}

// `one` is written. What is no output is a file only if it is there: it may be a name that looks like one.
bool SameFile(const GivenPath& one, const GivenPath& other) {
  namespace fs = std::filesystem;
  std::error_code none;
  const fs::file_status status = fs::status(other.path, none);
  if (fs::exists(status) ? !fs::is_regular_file(status) : other.use == FileUse::kOther) return false;
  const fs::path path = fs::weakly_canonical(fs::absolute(one.path), none);
  return !path.empty() && path == fs::weakly_canonical(fs::absolute(other.path), none);
}

// Troff reads a dot or a quote at the start of a line as a request, and a backslash anywhere.
std::string Troff(const std::string& text) {
  std::string out;
  bool at_start = true;
  for (const char c : text) {
    if (at_start && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\') out += "\\e";
    else if (c == '-') out += "\\-";
    else out += c;
    at_start = c == '\n';
  }
  return out;
}

// A description's lines; those of an example keep their shape.
std::string Paragraphs(const std::string& description) {
  std::string out;
  bool example = false;
  for (std::size_t from = 0; from < description.size();) {
    const std::size_t to = std::min(description.find('\n', from), description.size());
    const std::string line = description.substr(from, to - from);
    if (line.starts_with("example")) example = true;
    out += (example ? ".PP\n.nf\n" + Troff(line) + "\n.fi\n" : Troff(line) + "\n");
    from = to + 1;
  }
  return out;
}

std::string Head(const std::string& name) { return fmt::format(".TH \"{}\" 1 \"\" \"{}\"\n", Troff(name), Version()); }

std::string FirstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

std::string VerbPage(const CLI::App& verb) {
  const std::string name = "armcal-" + verb.get_name();
  std::string page = Head(name);
  page += ".SH NAME\n" + Troff(name + " - " + FirstLine(verb.get_description())) + "\n";
  page += ".SH SYNOPSIS\n.B armcal " + Troff(verb.get_name()) + "\n[OPTIONS]";
  for (const CLI::Option* option : Options(verb))
    if (option->get_positional()) page += Troff(" " + option->get_name(true));
  page += "\n.SH DESCRIPTION\n" + Paragraphs(verb.get_description()) + ".SH OPTIONS\n";
  for (const CLI::Option* option : Options(verb)) {
    page += ".TP\n\\fB" + Troff(option->get_name(false, true)) + "\\fR";
    if (const std::string type = option->get_type_name(); !type.empty()) page += " " + Troff(type);
    if (const std::string usual = option->get_default_str(); !usual.empty()) page += " (default " + Troff(usual) + ")";
    if (option->get_required()) page += " (required)";
    page += "\n" + Troff(option->get_description()) + "\n";
  }
  page +=
      ".SH EXIT STATUS\n0: done. 2: wrong use or bad input. 3: no link to the drive. 4: the drive refused. 5: no "
      "match (another table, other estimates). 6: incomplete. 130: Ctrl-C ended a recording. The description says "
      "where "
      "this verb uses a code otherwise.\n";
  return page + ".SH SEE ALSO\n.BR armcal (1)\n";
}

std::string TopPage(const CLI::App& app) {
  std::string page = Head("armcal") + ".SH NAME\n" +
                     Troff("armcal - " + app.get_description().substr(std::string("armcal: ").size())) +
                     "\n.SH SYNOPSIS\n.B armcal\nVERB [OPTIONS]\n.SH VERBS\n";
  for (const CLI::App* verb : Verbs(app))
    page +=
        ".TP\n.BR " + Troff("armcal-" + verb->get_name()) + " (1)\n" + Troff(FirstLine(verb->get_description())) + "\n";
  return page +
         ".SH ENVIRONMENT\n.TP\nARMCAL_HOME\nthe checkout or installation that robots and effects are read from\n";
}

std::string Completion(const CLI::App& app) {
  std::string verbs, cases;
  for (const CLI::App* verb : Verbs(app)) {
    verbs += (verbs.empty() ? "" : " ") + verb->get_name();
    std::string words;
    for (const std::string& name : LongNames(*verb)) words += (words.empty() ? "" : " ") + name;
    cases += fmt::format("    {}) words='{}' ;;\n", verb->get_name(), words);
  }
  return "# bash completion of armcal; files where no verb or option begins so\n_armcal() {\n"
         "  local word=${COMP_WORDS[COMP_CWORD]} words=\n"
         "  if ((COMP_CWORD == 1)); then\n"
         "    mapfile -t COMPREPLY < <(compgen -W '" +
         verbs +
         " --help --version' -- \"$word\")\n    return\n  fi\n"
         "  case ${COMP_WORDS[1]} in\n" +
         cases +
         "  esac\n"
         "  if [[ $word == -* ]]; then mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$word\"); fi\n"
         "}\ncomplete -o default -F _armcal armcal\n";
}

}  // namespace

std::string VersionText(std::uint32_t version) {
  return fmt::format("armcal {}.{}.{}", version >> 16, version >> 8 & 0xff, version & 0xff);
}
std::string Version() { return VersionText(ARMCAL_VERSION); }

std::vector<std::string> WordsOf(int argc, const char* const* argv) {
  struct Renamed {
    std::string_view verb, before, now;
  };
  static constexpr Renamed kRenamed[] = {
      {"excite", "--seconds", "--search-seconds"}, {"excite", "--from", "--found"}, {"export", "--urdf", "--into"}};
  std::vector<std::string> words(argv + 1, argv + argc);
  for (std::size_t k = 1; k < words.size(); ++k)
    for (const Renamed& one : kRenamed) {
      const std::size_t length = words[k].find('=');
      if (words[0] != one.verb || words[k].substr(0, length) != one.before) continue;
      fmt::print(stderr, "armcal {}: {} is called {}\n", one.verb, one.before, one.now);
      words[k].replace(0, one.before.size(), one.now);
    }
  return words;
}

std::string WrongUse(const CLI::App& app, const std::vector<std::string>& words, const CLI::ParseError& error) {
  if (words.empty()) return "armcal: expected a verb; armcal --help lists them";
  const CLI::App* verb = nullptr;
  for (const CLI::App* known : Verbs(app))
    if (known->get_name() == words[0]) verb = known;
  const std::string program = verb == nullptr ? "armcal" : "armcal " + verb->get_name();
  const std::string misspelt = Misspelt(app, verb, words);
  if (!misspelt.empty()) return program + ": " + misspelt;
  std::string what = error.what();
  constexpr std::string_view kConvert = "Could not convert: ";
  if (what.starts_with(kConvert))  // "Could not convert: --seed = abc"
    what = what.substr(kConvert.size()).replace(what.find(" = ") - kConvert.size(), 3, " ") + ": expected a number";
  else if (what.find("received") != what.npos)  // "--robot: At Most 1 required but received 2"
    what = what.substr(0, what.find(':')) + ": given more than once";
  else if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr)  // "--robot: 1 required TEXT missing"
    what = what.substr(0, what.find(':')) + ": expected a value behind it";
  else if (dynamic_cast<const CLI::ValidationError*>(&error) != nullptr)  // "--seconds: -3: expected a number from 0"
    what.replace(what.find(": "), 2, " ");
  return program + ": " + what + "; see " + program + " --help";
}

void CheckOutputs(const CLI::App& app) {
  for (const CLI::App* verb : app.get_subcommands()) {
    const std::vector<GivenPath> paths = GivenPaths(*verb);
    for (const GivenPath& one : paths) {
      if (one.use == FileUse::kWrites) io::CheckWritable(one.path);
      if (one.use == FileUse::kOther) continue;
      for (const GivenPath& other : paths)
        if (one.option != other.option && SameFile(one, other))
          throw io::InputError(
              fmt::format("{} and {} both name {}; choose another place", one.option, other.option, one.path.string()));
    }
  }
}

CLI::Validator OneOf(const std::vector<std::string>& words) {
  std::string expected;
  for (std::size_t k = 0; k < words.size(); ++k)
    expected += (k == 0 ? "" : k + 1 == words.size() ? " or " : ", ") + words[k];
  const auto check = [words, expected](const std::string& text) {
    return std::find(words.begin(), words.end(), text) != words.end() ? std::string() : text + ": expected " + expected;
  };
  return {check, fmt::format("{{{}}}", fmt::join(words, ","))};
}

CLI::Validator AboveZero() {
  constexpr double kLargest = std::numeric_limits<double>::max();
  CLI::Validator check = CLI::PositiveNumber;  // which takes nan, too
  check.operation([](std::string& text) {
    double value = 0;
    const bool good = CLI::detail::lexical_cast(text, value) && value > 0 && value <= kLargest;
    return good ? std::string() : text + ": expected a number above 0";
  });
  return check;
}

void AddPages(CLI::App& app, std::function<int()>& action) {
  auto* verb = app.add_subcommand("pages",
                                  "write manual pages and bash completion from the program's own definition\nexample: "
                                  "armcal pages --out build/pages && man build/pages/man1/armcal-excite.1");
  auto folder = std::make_shared<std::string>(), json = std::make_shared<std::string>();
  verb->add_option("--json", *json, "write the list of the files here");
  verb->add_option("--out", *folder, "folder to write: man1/armcal*.1, armcal (bash completion)")
      ->required()
      ->type_name(kFolder);
  verb->callback([&app, &action, folder, json] {
    action = [&app, folder, json] {
      const std::filesystem::path out = *folder;
      nlohmann::ordered_json written = nlohmann::ordered_json::array();
      const auto write = [&](const std::filesystem::path& path, const std::string& text) {
        files::WriteWholeFile(path, text);
        written.push_back(path.string());
      };
      io::MakeFolder(out / "man1");
      write(out / "man1" / "armcal.1", TopPage(app));
      for (const CLI::App* one : Verbs(app)) write(out / "man1" / ("armcal-" + one->get_name() + ".1"), VerbPage(*one));
      write(out / "armcal", Completion(app));
      WriteJson(*json, {{"files", written}});
      return static_cast<int>(kOk);
    };
  });
}

}  // namespace armcal::tool
