// report - writes text, tables and pictures as one HTML page that needs no other file and no network.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host_sim/data/report/live.hpp"
#include "host_sim/data/report/plot.hpp"
#include "host_sim/data/report/table.hpp"

namespace armcal::report {

// The colour of a box that a reader sees first.
enum class Tone { kNeutral, kGood, kWarning };

// The page is written from top to bottom. All text is escaped. Light and dark follow the reader's system; print is
// black on white. The same calls give the same bytes.
class Page {
 public:
  // The lead is one sentence below the title: what this page reports.
  explicit Page(std::string_view title, std::string_view lead = "");

  void Section(std::string_view title);
  void Subsection(std::string_view title);
  void Text(std::string_view paragraph);
  void Box(Tone tone, std::string_view headline, std::string_view text = "");
  void List(const std::vector<std::string>& items);
  void Box(Tone tone, std::string_view headline, const std::vector<std::string>& items);
  void Code(std::string_view text);
  void Facts(const std::vector<std::pair<std::string, std::string>>& facts);  // name and value, side by side
  void Add(const Table& table);
  void Add(const Plot& plot, std::string_view caption = "");
  void Add(const Bars& bars, std::string_view caption = "");
  // Pictures side by side, as many as fit: one per joint, for instance.
  void AddGrid(const std::vector<Plot>& plots, std::string_view caption = "");
  // Pictures that become charts to zoom and to read where the reader's browser runs JavaScript.
  void Add(const Live& live, std::string_view caption = "");
  // What `left` and `right` write, side by side where there is room.
  void Columns(const std::function<void(Page&)>& left, const std::function<void(Page&)>& right);
  // Folded away until the reader opens it.
  void Fold(std::string_view summary, const Table& table);
  void Fold(std::string_view summary, const std::function<void(Page&)>& content);

  std::string Html() const;
  void Write(const std::filesystem::path& path) const;  // atomic; io::InputError: cannot be written

 private:
  std::string title_;
  std::string body_;
  bool live_ = false;  // it holds charts
};

}  // namespace armcal::report
