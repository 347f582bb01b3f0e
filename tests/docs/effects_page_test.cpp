// tests - the pages on effects against the records and the table of quantities, word for word. The pictures of docs
// against what the records draw, byte for byte.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "codegen/src/generator/effect.hpp"
#include "tests/docs/pictures.hpp"

namespace armcal::tests {
namespace {

std::string Parameters(const codegen::EffectRecord& r) {
  std::string text;
  const auto add = [&](const std::string& name, const std::string& unit) {
    text += (text.empty() ? "" : ", ") + name + " [" + unit + "]";
  };
  for (const auto& p : r.linear)
    add(p.index.empty() ? p.name : p.name + p.index.front() + ".." + p.name + p.index.back(), p.unit);
  std::string linear;
  linear.swap(text);
  for (const auto& p : r.nonlinear) add(p.name, p.unit);
  return linear + (text.empty() ? "" : "; " + text);
}

std::string Line(const codegen::EffectRecord& r) {
  return "| `" + r.name + "` | " + codegen::Word(r.effect_class) + " | " + codegen::Word(r.scope) + " | " + r.title +
         (r.replaces.empty() ? "" : " (law)") + " | " + Parameters(r) + " |\n";
}

std::string FileText(const char* path) {
  std::ifstream in(path);
  EXPECT_TRUE(in) << "run this in the top folder";
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(AddAnEffectPage, HasOneLinePerQuantity_AsTheTableSays) {
  std::string expected, found;
  for (const codegen::QuantityInfo& q : codegen::QuantityTable())
    expected += std::string("| `") + q.word + "` | `" + q.declared + "` | " + q.unit + " | " + q.meaning + " |\n";
  std::istringstream page(FileText("docs/add_an_effect.md"));
  for (std::string line; std::getline(page, line);)
    if (line.rfind("| `", 0) == 0) found += line + "\n";
  EXPECT_EQ(found, expected) << "the table of docs/add_an_effect.md must be:\n" << expected;
}

TEST(EffectsPage, HasOneLinePerRecord_AsTheRecordSays) {
  std::istringstream in(FileText("docs/effects.md"));
  std::string expected, found;
  for (const auto& [name, record] : codegen::ReadCatalogue("codegen/effects")) expected += Line(record);
  for (std::string line; std::getline(in, line);)
    if (line.rfind("| `", 0) == 0) found += line + "\n";
  EXPECT_EQ(found, expected) << "the table of docs/effects.md must be:\n" << expected;
}

// The lines of a page that show a picture.
std::set<std::string> Shown(const char* page) {
  std::istringstream in(FileText(page));
  std::set<std::string> shown;
  for (std::string line; std::getline(in, line);)
    if (line.rfind("![", 0) == 0) shown.insert(line);
  return shown;
}

void ExpectFiles(const std::string& folder, const Pictures& pictures) {
  const std::string again = ": run build/host/tests/docs/draw_pictures docs";
  for (const auto& [name, text] : pictures)
    EXPECT_TRUE(std::filesystem::exists("docs/" + name) && FileText(("docs/" + name).c_str()) == text) << name << again;
  for (const auto& file : std::filesystem::directory_iterator("docs/" + folder))
    EXPECT_TRUE(pictures.contains(folder + "/" + file.path().filename().string())) << file.path() << " is left over";
}

TEST(EffectsPage, ShowsThePictureOfEachRecord_AndNoOther) {
  std::set<std::string> expected;
  for (const auto& [name, record] : codegen::ReadCatalogue("codegen/effects"))
    expected.insert("![" + record.title + "](effects/" + name + ".svg)");
  EXPECT_EQ(Shown("docs/effects.md"), expected);
}

TEST(EffectsPage, Pictures_AreWhatTheRecordsDraw) { ExpectFiles("effects", EffectPictures()); }

TEST(ConceptsPage, Pictures_AreShown_AndAreWhatTheProgramDraws) {
  const Pictures pictures = ConceptPictures();
  ExpectFiles("concepts", pictures);
  const std::set<std::string> shown = Shown("docs/concepts.md");
  EXPECT_EQ(shown.size(), pictures.size());
  for (const auto& [name, text] : pictures)
    EXPECT_TRUE(std::any_of(shown.begin(), shown.end(), [&](const auto& s) { return s.ends_with("](" + name + ")"); }))
        << name;
}

}  // namespace
}  // namespace armcal::tests
