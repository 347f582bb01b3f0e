// report tests - check that a page is complete, needs no other file, and is harmless whatever text comes in.
#include "host_sim/data/report/page.hpp"

#include <gtest/gtest.h>

#include <regex>

namespace armcal::report {
namespace {

Page Everything(const std::string& text) {
  Page page(text, text);
  page.Section(text);
  page.Subsection(text);
  page.Text(text);
  page.Box(Tone::kGood, text, text);
  page.List({text});
  page.Code(text);
  page.Facts({{text, text}});
  page.Add(Table{{text}, {{text}}, text});
  page.Add(Plot{{text, text, text}, {{text, {0, 1}, {0, 1}}}}, text);
  page.Add(Bars{{text, text, text}, {text}, {text}, {{1}}}, text);
  page.AddGrid({Plot{{text}, {}}}, text);
  page.Fold(text, Table{{text}, {{text}}, text});
  return page;
}

TEST(Page, EveryTextIsEscaped) {
  const std::string html = Everything("<script a='b' c=\"d\">&").Html();
  EXPECT_EQ(html.find("<script"), html.npos);
  EXPECT_NE(html.find("&lt;script a=&#39;b&#39; c=&quot;d&quot;&gt;&amp;"), html.npos);
}

TEST(Page, IsSelfContained) {
  const std::string html = Everything("text").Html();
  for (const char* outside : {"http:", "https:", "src=", "href=", "url(", "@import"}) {
    EXPECT_EQ(html.find(outside), html.npos) << outside;
  }
}

TEST(Page, ElementsAreClosedInOrder) {
  const std::string html = Everything("a < b").Html();
  std::vector<std::string> open;
  const std::regex tag("<(/?)([a-z0-9]+)[^>]*?(/?)>");
  for (std::sregex_iterator it(html.begin(), html.end(), tag), end; it != end; ++it) {
    const std::string name = (*it)[2];
    if ((*it)[3] == "/" || name == "meta") continue;
    if ((*it)[1] == "") {
      open.push_back(name);
      continue;
    }
    ASSERT_FALSE(open.empty());
    EXPECT_EQ(open.back(), name);
    open.pop_back();
  }
  EXPECT_TRUE(open.empty());
}

TEST(Page, SameCalls_GiveTheSameBytes) { EXPECT_EQ(Everything("x").Html(), Everything("x").Html()); }

}  // namespace
}  // namespace armcal::report
