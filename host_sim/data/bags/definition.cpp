// bags - reads ROS 2 definitions.
#include "host_sim/data/bags/definition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/bags/known_types.hpp"

namespace armcal::bags {

namespace {

constexpr int kDeepest = 16;  // structs within structs
constexpr std::size_t kMostTypes = 1000;

std::string_view Stripped(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const auto first = text.find_first_not_of(kBlank);
  return first == text.npos ? std::string_view{} : text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

template <class Each>
void ForEachLine(std::string_view text, Each each) {
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    each(Stripped(text.substr(0, end)));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

std::optional<Kind> KindOf(std::string_view word) {
  constexpr std::pair<std::string_view, Kind> kWords[] = {
      {"bool", Kind::kBool},       {"byte", Kind::kUint8},  {"char", Kind::kUint8},    {"int8", Kind::kInt8},
      {"uint8", Kind::kUint8},     {"int16", Kind::kInt16}, {"uint16", Kind::kUint16}, {"int32", Kind::kInt32},
      {"uint32", Kind::kUint32},   {"int64", Kind::kInt64}, {"uint64", Kind::kUint64}, {"float32", Kind::kFloat32},
      {"float64", Kind::kFloat64}, {"string", Kind::kText}};
  for (const auto& [name, kind] : kWords)
    if (word == name) return kind;
  return std::nullopt;
}

bool IsName(std::string_view word) {
  return !word.empty() && std::all_of(word.begin(), word.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
}

// Reads what stands behind a type: "", "[]", "[<=8]", "[6]".
void ReadForm(std::string_view form, Field& field) {
  if (form.empty()) return;
  form.remove_prefix(1), form.remove_suffix(1);
  field.form = Field::kSequence;
  if (form.empty() || form.starts_with("<=")) return;
  field.form = Field::kArray;
  const auto [end, error] = std::from_chars(form.data(), form.data() + form.size(), field.count);
  if (error != std::errc() || end != form.data() + form.size()) throw io::InputError("expected a number in []");
}

}  // namespace

std::string ShortName(std::string_view type) {
  std::string name(type);
  if (const auto at = name.find("/msg/"); at != name.npos) name.erase(at, 4);
  return name;
}

Definitions::Definitions() {
  for (const KnownType& known : kKnownTypes) texts_.push_back({known.name, known.text});
}

void Definitions::Add(const std::string& name, std::string_view text) {
  std::string at = ShortName(name), body;
  const auto finish = [&] {
    std::erase_if(texts_, [&at](const Text& known) { return known.name == at; });
    texts_.push_back({at, std::move(body)});
    body.clear();
  };
  ForEachLine(text, [&](std::string_view line) {
    if (line.starts_with("MSG:")) {
      finish();
      at = ShortName(Stripped(line.substr(4)));
    } else if (!line.starts_with("====")) {
      (body += line) += '\n';
    }
  });
  finish();
}

const Definitions::Text* Definitions::Look(const std::string& name) const {
  const std::string wanted = ShortName(name);
  for (auto at = texts_.rbegin(); at != texts_.rend(); ++at)
    if (at->name == wanted || (at->name.find('/') == std::string::npos && wanted.ends_with("/" + at->name)))
      return &*at;
  return nullptr;
}

bool Definitions::Knows(const std::string& name) const { return Look(name) != nullptr; }

Definition Definitions::Find(const std::string& name) const {
  Definition out;
  (void)Make(name, 0, out);
  return out;
}

std::size_t Definitions::Make(const std::string& name, int depth, Definition& out) const {
  const Text* const text = Look(name);
  if (text == nullptr) throw io::InputError(fmt::format("no definition of {}; give its file with --msg", name));
  if (depth > kDeepest) throw io::InputError(fmt::format("{} contains itself", name));
  const std::size_t place = out.types.size();
  if (place >= kMostTypes) throw io::InputError(fmt::format("{} is made of too many types", name));
  out.types.push_back({ShortName(name), {}});
  const std::string package = ShortName(name).substr(0, ShortName(name).find('/'));
  int number = 0;
  ForEachLine(text->text, [&](std::string_view line) {
    ++number;
    line = Stripped(line.substr(0, line.find('#')));
    if (line.empty()) return;
    const auto blank = std::min(line.find_first_of(" \t"), line.size());
    std::string_view type = line.substr(0, blank), rest = Stripped(line.substr(blank));
    const std::string_view word = rest.substr(0, rest.find_first_of(" \t="));
    const std::string_view behind = Stripped(rest.substr(word.size()));
    if (behind.starts_with('=')) return;  // a constant
    Field field;
    field.name = word;
    const auto bracket = std::min(type.find('['), type.size());
    const std::string_view form = type.substr(bracket);
    std::string_view element = type.substr(0, bracket);
    element = element.substr(0, element.find('<'));  // string<=10
    const auto bad = [&](const char* why) {
      throw io::InputError(fmt::format("definition of {}, line {}: '{}': {}", name, number, line, why));
    };
    if (!IsName(word) || (!form.empty() && !form.ends_with(']'))) bad("expected TYPE NAME");
    if (element == "wstring") bad("armcal does not read wstring");
    if (const auto kind = KindOf(element)) field.kind = *kind;
    else field.kind = Kind::kStruct;
    try {
      ReadForm(form, field);
    } catch (const io::InputError& error) {
      bad(error.what());
    }
    if (field.kind == Kind::kStruct) {
      std::string whole(element);
      if (whole.find('/') == whole.npos) whole = whole == "Header" ? "std_msgs/Header" : package + "/" + whole;
      field.type = Make(whole, depth + 1, out);
    }
    out.types[place].field.push_back(std::move(field));
  });
  return place;
}

}  // namespace armcal::bags
