// description - finds elements by scanning tags; comments, CDATA and quoted text are passed by.
#include "host_sim/identify/description/xml_places.hpp"

#include "codegen/src/io/input_error.hpp"

namespace armcal::description {

namespace {

class Scan {
 public:
  Scan(const std::string& file, const std::string& text) : file_(file), text_(text) {}

  XmlElement Document() {
    std::vector<XmlElement> open(1);
    while ((at_ = text_.find('<', at_)) != text_.npos) {
      if (PassedBy("<!--", "-->") || PassedBy("<![CDATA[", "]]>") || PassedBy("<?", "?>") || PassedBy("<!", ">"))
        continue;
      const std::size_t begin = at_, end = EndOfTag();
      if (text_[begin + 1] == '/') {
        if (open.size() < 2) throw io::InputError(file_ + ": XML: an end tag without its start");
        XmlElement done = std::move(open.back());
        if (text_.compare(begin + 2, done.name.size(), done.name) != 0 ||
            std::string_view(" \t\r\n>").find(text_[begin + 2 + done.name.size()]) == std::string_view::npos)
          throw io::InputError(file_ + ": XML: <" + done.name + "> without its end tag");
        open.pop_back();
        done.close = begin, done.end = end;
        open.back().child.push_back(std::move(done));
        continue;
      }
      XmlElement e;
      e.begin = begin, e.inside = e.close = e.end = end;
      e.empty_tag = text_[end - 2] == '/';
      const std::size_t name = text_.find_first_of(" \t\r\n/>", begin + 1);
      e.name = text_.substr(begin + 1, name - begin - 1);
      e.attribute = Attributes(name, end);
      for (const XmlAttribute& a : e.attribute)
        if (a.name == "name") e.name_attribute = text_.substr(a.begin, a.end - a.begin);
      if (e.empty_tag) open.back().child.push_back(std::move(e));
      else open.push_back(std::move(e));
    }
    if (open.size() != 1 || open[0].child.empty())
      throw io::InputError(file_ + ": XML: an element without its end tag");
    return open[0].child.front();
  }

 private:
  bool PassedBy(const std::string& begin, const std::string& end) {
    if (text_.compare(at_, begin.size(), begin) != 0) return false;
    const std::size_t close = text_.find(end, at_ + begin.size());
    at_ = close == text_.npos ? text_.size() : close + end.size();
    return true;
  }
  std::size_t EndOfTag() {
    char quote = 0;
    for (; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (quote) {
        if (c == quote) quote = 0;
      } else if (c == '"' || c == '\'') {
        quote = c;
      } else if (c == '>') {
        return ++at_;
      }
    }
    throw io::InputError(file_ + ": XML: a tag without its end");
  }
  std::vector<XmlAttribute> Attributes(std::size_t from, std::size_t to) const {
    std::vector<XmlAttribute> out;
    for (std::size_t at = from;;) {
      const std::size_t start = text_.find_first_not_of(" \t\r\n", at);
      const std::size_t equals = text_.find('=', at);
      if (start >= to || equals >= to) return out;
      const std::size_t open = text_.find_first_of("\"'", equals);
      if (open >= to) return out;
      const std::size_t close = text_.find(text_[open], open + 1);
      out.push_back({text_.substr(start, text_.find_first_of(" \t\r\n=", start) - start), open + 1, close});
      at = close + 1;
    }
  }

  std::string file_;
  const std::string& text_;
  std::size_t at_ = 0;
};

}  // namespace

const XmlElement* XmlElement::Find(const std::string& element) const {
  for (const XmlElement& e : child)
    if (e.name == element) return &e;
  return nullptr;
}

const XmlAttribute* XmlElement::Attribute(const std::string& of) const {
  for (const XmlAttribute& a : attribute)
    if (a.name == of) return &a;
  return nullptr;
}

XmlElement PlacesOf(const std::string& file, const std::string& text) { return Scan(file, text).Document(); }

}  // namespace armcal::description
