// description - collects changes as places of the original text, and applies them from the end.
#include "host_sim/identify/description/xml_edits.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace armcal::description {

std::string XmlContent::Text() const {
  std::string text = "<" + element;
  for (const auto& [name, value] : attribute) text += fmt::format(" {}=\"{}\"", name, value);
  return text + "/>";
}

void XmlEdits::SetAttributes(const XmlElement& e, const XmlContent& content) {
  std::string added;
  for (const auto& [name, value] : content.attribute)
    if (const XmlAttribute* known = e.Attribute(name)) edit_.push_back({known->begin, known->end, value});
    else added += fmt::format(" {}=\"{}\"", name, value);
  const std::size_t behind_name = e.begin + 1 + e.name.size();
  if (!added.empty()) edit_.push_back({behind_name, behind_name, added});
}

void XmlEdits::SetText(const XmlElement& e, const std::string& with) {
  if (!e.empty_tag) edit_.push_back({e.inside, e.close, with});
  else edit_.push_back({e.begin, e.end, text_.substr(e.begin, e.end - e.begin - 2) + ">" + with + "</" + e.name + ">"});
}

void XmlEdits::SetChild(const XmlElement& parent, const std::string& child, const std::string& with) {
  if (const XmlElement* found = parent.Find(child)) {
    std::size_t begin = found->begin;
    if (with.empty())  // with the space before it
      while (begin > 0 && (text_[begin - 1] == ' ' || text_[begin - 1] == '\t')) --begin;
    if (with.empty() && begin > 0 && text_[begin - 1] == '\n') --begin;
    edit_.push_back({begin, found->end, with});
  } else if (!with.empty()) {
    Insert(parent, "\n    " + with);
  }
}

void XmlEdits::SetChildren(const XmlElement& parent, const std::string& child,
                           const std::vector<std::pair<std::string, std::string>>& content) {
  const XmlElement* const found = parent.Find(child);
  std::string added;
  for (const auto& [name, text] : content) {
    const XmlElement* const known = found ? found->Find(name) : nullptr;
    if (known) SetText(*known, text);
    else added += fmt::format("\n      <{0}>{1}</{0}>", name, text);
  }
  if (added.empty()) return;
  if (found) Insert(*found, added);
  else Insert(parent, fmt::format("\n    <{0}>{1}\n    </{0}>", child, added));
}

void XmlEdits::Insert(const XmlElement& parent, const std::string& text) {
  if (parent.empty_tag) SetText(parent, text + "\n  ");
  else edit_.push_back({parent.inside, parent.inside, text});
}

std::string XmlEdits::Apply() {
  std::stable_sort(edit_.begin(), edit_.end(), [](const Edit& a, const Edit& b) { return a.begin > b.begin; });
  std::string out = text_;
  for (const Edit& e : edit_) out.replace(e.begin, e.end - e.begin, e.with);
  return out;
}

}  // namespace armcal::description
