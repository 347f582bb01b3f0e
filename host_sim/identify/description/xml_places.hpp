// description - where elements stand in the text of an XML file, so that a few can be replaced and no other byte
// changes.
#pragma once

#include <string>
#include <vector>

namespace armcal::description {

struct XmlAttribute {
  std::string name;
  std::size_t begin = 0, end = 0;  // of its value, between the quotes
};

// An element of the file; positions are bytes of the text.
struct XmlElement {
  std::string name;
  std::string name_attribute;      // the value of its attribute "name"
  std::size_t begin = 0, end = 0;  // from '<' to behind the last '>'
  std::size_t inside = 0;          // behind its start tag
  std::size_t close = 0;           // where its end tag begins; equals `inside` for <a/>
  bool empty_tag = false;          // <a/>
  std::vector<XmlAttribute> attribute;
  std::vector<XmlElement> child;

  const XmlElement* Find(const std::string& element) const;      // the first child of this name, or none
  const XmlAttribute* Attribute(const std::string& name) const;  // or none
};

// The document's element. This is no parser: it finds places, and does not expand entities.
// file: for an error. Throws io::InputError: tags that do not match.
XmlElement PlacesOf(const std::string& file, const std::string& text);

}  // namespace armcal::description
