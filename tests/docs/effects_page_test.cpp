// tests - the pages on effects against the records and the table of quantities, word for word.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "codegen/src/generator/effect.hpp"

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

}  // namespace
}  // namespace armcal::tests
