// report - writes an HTML page.
#include "host_sim/data/report/page.hpp"

#include <fmt/format.h>

#include <cctype>

#include "host_sim/data/files/files.hpp"
#include "host_sim/data/report/assets.hpp"
#include "host_sim/data/report/style.hpp"

namespace armcal::report {
namespace {

std::string Cell(std::string_view tag, const std::string& text, bool number) {
  return fmt::format("<{0}{1}>{2}</{0}>", tag, number ? " class='n'" : "", Escape(text));
}

// A path as a link has it: all but letters, digits and "-._~/" as %XX.
std::string InUrl(std::string_view path) {
  std::string out;
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte < 128 && std::isalnum(byte)) || std::string_view("-._~/").find(c) != std::string_view::npos) out += c;
    else out += fmt::format("%{:02X}", byte);
  }
  return out;
}

std::string HtmlTable(const Table& table) {
  std::string html;
  if (!table.caption.empty()) html += "<p class='caption'>" + Escape(table.caption) + "</p>";
  html += "<div class='wide'><table>";
  if (!table.header.empty()) {
    html += "<thead><tr>";
    for (std::size_t c = 0; c < table.header.size(); ++c) html += Cell("th", table.header[c], IsNumeric(table, c));
    html += "</tr></thead>";
  }
  html += "<tbody>";
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    const auto& row = table.rows[r];
    html += "<tr>";
    for (std::size_t c = 0; c < row.size(); ++c)
      html += c == 0 && r < table.link.size() && !table.link[r].empty()
                  ? "<td><a href='" + InUrl(table.link[r]) + "'>" + Escape(row[c]) + "</a></td>"
                  : Cell("td", row[c], IsNumeric(table, c));
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

void Page::Box(Tone tone, std::string_view headline, const std::vector<std::string>& items) {
  Box(tone, headline, "");
  body_.erase(body_.rfind("</div>"));
  List(items);
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

void Page::Add(const Live& live, std::string_view caption) {
  body_ += Figure(report::Html(live), caption);
  live_ = true;
}

void Page::Columns(const std::function<void(Page&)>& left, const std::function<void(Page&)>& right) {
  body_ += "<div class='columns'><div>";
  left(*this);
  body_ += "</div><div>";
  right(*this);
  body_ += "</div></div>\n";
}

void Page::Fold(std::string_view summary, const Table& table) {
  Fold(summary, [&](Page& page) { page.Add(table); });
}

void Page::Fold(std::string_view summary, const std::function<void(Page&)>& content) {
  body_ += "<details><summary>" + Escape(summary) + "</summary>";
  content(*this);
  body_ += "</details>\n";
}

std::string Page::Html() const {
  std::string html =
      "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'>"
      "<meta name='viewport' content='width=device-width,initial-scale=1'>"
      "<meta name='color-scheme' content='light dark'><title>" +
      Escape(title_) + "</title><style>";
  html += fmt::format("\n:root{{{}}}\n{}{}", kLight, assets::kPageStyle, PictureStyle());
  html += "</style></head><body><main>\n" + body_ + "</main>\n";
  if (live_) html += LiveScripts();
  return html + "</body></html>\n";
}

void Page::Write(const std::filesystem::path& path) const { files::WriteWholeFile(path, Html()); }

}  // namespace armcal::report
