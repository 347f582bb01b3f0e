// tool - what the definition of the command line gives beside parsing: what a misspelt word was meant to be, and the
// pages of the manual.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

namespace armcal::tool {

// "armcal 1.2.3" of 0x010203; and of this program.
std::string VersionText(std::uint32_t version);
std::string Version();

// The words behind the program's name. A former name of an option is replaced by its present name, and a line on stderr
// says so.
std::vector<std::string> WordsOf(int argc, const char* const* argv);

// One line about a command line that could not be read. The first word that is no verb or no option comes before all
// other mistakes, with the nearest one that there is.
std::string WrongUse(const CLI::App& app, const std::vector<std::string>& words, const CLI::ParseError& error);

// What a value must be, for CLI::Option::check. Their messages say what was expected.
CLI::Validator OneOf(const std::vector<std::string>& words);
CLI::Validator AboveZero();
template <class Number>
CLI::Validator Between(Number low, Number high) {
  const std::string expected =
      fmt::format("expected {} from {:.7g} to {:.7g}", std::is_integral_v<Number> ? "an integer" : "a number",
                  static_cast<double>(low), static_cast<double>(high));
  CLI::Validator check = CLI::Range(low, high);  // which takes nan, too
  check.operation([low, high, expected](std::string& text) {
    Number value{};
    const bool lies = CLI::detail::lexical_cast(text, value) && value >= low && value <= high;
    return lies ? std::string() : text + ": " + expected;
  });
  return check;
}

// The type of an option --out whose value is a folder.
inline constexpr const char* kFolder = "FOLDER";

// The files that this command line asks for can be written, and none of them is another file of it: some verbs work for
// minutes first. InputError: one cannot, or two options name one file.
void CheckOutputs(const CLI::App& app);

// armcal pages: manual pages and the words that bash completes, written from the definition of `app`.
void AddPages(CLI::App& app, std::function<int()>& action);

}  // namespace armcal::tool
