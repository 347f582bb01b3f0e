// report - writes an HTML page.
#include "host_sim/data/report/page.hpp"

#include <fmt/format.h>

#include "host_sim/data/files/files.hpp"
#include "host_sim/data/report/style.hpp"

namespace armcal::report {
namespace {

// Colours lightened for dark ground.
constexpr std::string_view kStyle = R"css(
@media(prefers-color-scheme:dark){:root{--ink:#e4e8ec;--soft:#9aa5b1;--rule:#3a424b;--faint:#22272d;--ground:#15191e;
--plate:#15191edd;--c0:#58b4e8;--c1:#ff8c42;--c2:#3ecf9e;--c3:#e59cc4;--c4:#f0c24b;--c5:#8fd0ff;--c6:#b5bec7;
--good:#3ecf9e;--warn:#ff8c42}}
@media print{:root{--ink:#000;--soft:#333;--rule:#bbb;--faint:#f3f3f3;--ground:#fff;--plate:#fff;--c0:#0072b2;
--c1:#d55e00;--c2:#009e73;--c3:#cc79a7;--c4:#b88600;--c5:#3a9bdc;--c6:#555}
main{max-width:none!important;padding:0!important}figure,tr,.box,.facts{break-inside:avoid}h2,h3{break-after:avoid}}
*{box-sizing:border-box}
body{margin:0;background:var(--ground);color:var(--ink);font:15px/1.5 system-ui,"Segoe UI","DejaVu Sans",sans-serif}
main{max-width:62rem;margin:0 auto;padding:2.2rem 1.4rem 4rem}
h1{font-size:1.75rem;line-height:1.2;margin:0}.lead{color:var(--soft);font-size:1.05rem;margin:.35rem 0 1.4rem}
h2{font-size:1.25rem;margin:2.2rem 0 .6rem;padding-bottom:.25rem;border-bottom:1px solid var(--rule)}
h3{font-size:1.02rem;margin:1.5rem 0 .4rem}p{margin:.5rem 0;max-width:48rem}ul{margin:.4rem 0;padding-left:1.3rem}
.box{border-left:4px solid var(--c0);background:var(--faint);padding:.7rem 1rem;margin:.9rem 0;border-radius:0 4px 4px 0}
.box.good{border-color:var(--good)}.box.warn{border-color:var(--warn)}.box b{font-size:1.05rem}.box p{margin:.2rem 0 0}
.facts{display:grid;grid-template-columns:max-content 1fr;gap:.15rem 1.2rem;margin:.8rem 0}
.facts dt{color:var(--soft)}.facts dd{margin:0;overflow-wrap:anywhere}
.wide{overflow-x:auto}table{border-collapse:collapse;margin:.7rem 0;font-size:.93rem}
caption{text-align:left;min-width:min(30rem,85vw);color:var(--soft);padding-bottom:.3rem}
th,td{padding:.28rem 1.1rem .28rem 0;text-align:left;border-bottom:1px solid var(--rule);vertical-align:top}
th{font-weight:600;border-bottom:1.5px solid var(--soft)}
.n{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}
pre{background:var(--faint);padding:.7rem 1rem;overflow-x:auto;border-radius:4px;font-size:.88rem}
details{margin:.7rem 0}summary{cursor:pointer;color:var(--soft)}
figure{margin:1rem 0}figcaption{color:var(--soft);font-size:.9rem;margin-top:.2rem;max-width:48rem}
.grid2{display:grid;grid-template-columns:repeat(auto-fit,minmax(20rem,1fr));gap:.8rem}
svg{display:block;width:100%;height:auto;font:12px system-ui,"DejaVu Sans",sans-serif}
)css";

std::string Cell(std::string_view tag, const std::string& text, bool number) {
  return fmt::format("<{0}{1}>{2}</{0}>", tag, number ? " class='n'" : "", Escape(text));
}

std::string HtmlTable(const Table& table) {
  std::string html = "<div class='wide'><table>";
  if (!table.caption.empty()) html += "<caption>" + Escape(table.caption) + "</caption>";
  if (!table.header.empty()) {
    html += "<thead><tr>";
    for (std::size_t c = 0; c < table.header.size(); ++c) html += Cell("th", table.header[c], IsNumeric(table, c));
    html += "</tr></thead>";
  }
  html += "<tbody>";
  for (const auto& row : table.rows) {
    html += "<tr>";
    for (std::size_t c = 0; c < row.size(); ++c) html += Cell("td", row[c], IsNumeric(table, c));
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

std::string Figure(const std::string& content, std::string_view caption) {
  std::string html = "<figure>" + content;
  if (!caption.empty()) html += "<figcaption>" + Escape(caption) + "</figcaption>";
  return html + "</figure>\n";
}

}  // namespace

Page::Page(std::string_view title, std::string_view lead) : title_(title) {
  body_ = "<h1>" + Escape(title) + "</h1>\n";
  if (!lead.empty()) body_ += "<p class='lead'>" + Escape(lead) + "</p>\n";
}

void Page::Section(std::string_view title) { body_ += "<h2>" + Escape(title) + "</h2>\n"; }
void Page::Subsection(std::string_view title) { body_ += "<h3>" + Escape(title) + "</h3>\n"; }
void Page::Text(std::string_view paragraph) { body_ += "<p>" + Escape(paragraph) + "</p>\n"; }
void Page::Code(std::string_view text) { body_ += "<pre>" + Escape(text) + "</pre>\n"; }

void Page::Box(Tone tone, std::string_view headline, std::string_view text) {
  const char* style = tone == Tone::kGood ? " good" : tone == Tone::kWarning ? " warn" : "";
  body_ += fmt::format("<div class='box{}'><b>{}</b>", style, Escape(headline));
  if (!text.empty()) body_ += "<p>" + Escape(text) + "</p>";
  body_ += "</div>\n";
}

void Page::List(const std::vector<std::string>& items) {
  body_ += "<ul>";
  for (const std::string& item : items) body_ += "<li>" + Escape(item) + "</li>";
  body_ += "</ul>\n";
}

void Page::Facts(const std::vector<std::pair<std::string, std::string>>& facts) {
  body_ += "<dl class='facts'>";
  for (const auto& [name, value] : facts) body_ += "<dt>" + Escape(name) + "</dt><dd>" + Escape(value) + "</dd>";
  body_ += "</dl>\n";
}

void Page::Add(const Table& table) { body_ += HtmlTable(table); }
void Page::Add(const Plot& plot, std::string_view caption) { body_ += Figure(Svg(plot), caption); }
void Page::Add(const Bars& bars, std::string_view caption) { body_ += Figure(Svg(bars), caption); }

void Page::AddGrid(const std::vector<Plot>& plots, std::string_view caption) {
  std::string grid = "<div class='grid2'>";
  for (const Plot& plot : plots) grid += Svg(plot);
  body_ += Figure(grid + "</div>", caption);
}

void Page::Fold(std::string_view summary, const Table& table) {
  body_ += "<details><summary>" + Escape(summary) + "</summary>" + HtmlTable(table) + "</details>\n";
}

std::string Page::Html() const {
  std::string html =
      "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'>"
      "<meta name='viewport' content='width=device-width,initial-scale=1'>"
      "<meta name='color-scheme' content='light dark'><title>" +
      Escape(title_) + "</title><style>";
  html += fmt::format("\n:root{{{}}}", kLight);
  html += kStyle;
  return html + PictureStyle() + "</style></head><body><main>\n" + body_ + "</main></body></html>\n";
}

void Page::Write(const std::filesystem::path& path) const { files::WriteWholeFile(path, Html()); }

}  // namespace armcal::report
