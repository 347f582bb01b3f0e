// description - changes of a few values in the text of an XML file. No other byte changes.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "host_sim/identify/description/xml_places.hpp"

namespace armcal::description {

// What stands in an element without children: its name and its attributes.
struct XmlContent {
  std::string element;
  std::vector<std::pair<std::string, std::string>> attribute;

  std::string Text() const;
};

class XmlEdits {
 public:
  // text: stays where it is for as long as this does. file: for an error.
  XmlEdits(const std::string& file, const std::string& text) : text_(text), root_(PlacesOf(file, text)) {}

  const XmlElement& root() const { return root_; }
  // These attributes get these values. All else of the element stays.
  void SetAttributes(const XmlElement& e, const XmlContent& content);
  // What stands between the tags becomes `with`.
  void SetText(const XmlElement& e, const std::string& with);
  // Becomes the first that stands in the element.
  void Insert(const XmlElement& parent, const std::string& text);
  // The child becomes `with`, or is added as the first one; empty: it is taken out.
  void SetChild(const XmlElement& parent, const std::string& child, const std::string& with);
  // These elements within the child get these contents. The child and they are added where they are missing.
  void SetChildren(const XmlElement& parent, const std::string& child,
                   const std::vector<std::pair<std::string, std::string>>& content);
  // The text with all changes.
  std::string Apply();

 private:
  struct Edit {
    std::size_t begin, end;
    std::string with;
  };
  const std::string& text_;
  XmlElement root_;
  std::vector<Edit> edit_;
};

}  // namespace armcal::description
