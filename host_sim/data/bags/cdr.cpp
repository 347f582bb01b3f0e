// bags - walks over the bytes of a CDR message along its definition.
#include "host_sim/data/bags/cdr.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>

namespace armcal::bags {

namespace {

constexpr std::size_t kEncapsulation_bytes = 4;

// Says by name what a message is that is not plain CDR. True: its numbers are big-endian.
bool IsBigEndian(Bytes message) {
  if (message.size() < kEncapsulation_bytes) throw EndOfBytes();
  const int kind = static_cast<unsigned char>(message[0]) << 8 | static_cast<unsigned char>(message[1]);
  if (kind == 0 || kind == 1) return kind == 0;
  const bool list = kind == 2 || kind == 3;
  const bool second = kind >= 6 && kind <= 11;
  throw io::InputError(fmt::format("a message is encoded as {} (0x{:04x}), expected plain CDR (XCDR1)",
                                   list     ? "a parameter list"
                                   : second ? "XCDR2"
                                            : "something unknown",
                                   kind));
}

class CdrWalk {
 public:
  CdrWalk(const Definition& definition, Bytes message, bool named, Flat& out)
      : types_(definition.types),
        swap_(IsBigEndian(message)),
        body_(message.substr(kEncapsulation_bytes)),
        at_(body_),
        named_(named),
        out_(out) {}

  void Walk() { Struct(types_[0], "", {}, false); }

 private:
  // A struct of a list of names and one array is a map from names to numbers.
  static bool IsMap(const Type& type) {
    return type.field.size() == 2 && type.field[0].kind == Kind::kText && IsListOfNames(type.field[0].name) &&
           SizeOf(type.field[1].kind) > 0 && type.field[1].form != Field::kOne;
  }

  void Struct(const Type& type, const std::string& path, const Scope& outer, bool hidden) {
    if (type.field.empty()) return (void)at_.Take(1);  // IDL has no empty struct, so ROS 2 puts a byte there
    Scope own;
    const Scope* scope = &outer;
    const bool map = IsMap(type);
    for (const Field& field : type.field) {
      if (field.kind == Kind::kText && field.form != Field::kOne && IsListOfNames(field.name) && !hidden) {
        own.names = TakeNames(field);
        own.path = path.size();
        scope = &own;
      } else if (field.kind == Kind::kText) {
        for (std::size_t k = Count(field); k > 0; --k) (void)TakeText();
      } else if (field.kind == Kind::kStruct) {
        Structs(field, path, *scope, hidden);
      } else {
        Numbers(field, path, *scope, map, hidden);
      }
    }
  }

  void Structs(const Field& field, const std::string& path, const Scope& scope, bool hidden) {
    const Type& type = types_[field.type];
    if (type.name == "std_msgs/Header") {  // its numbers are no channels
      const std::size_t begin = (Align(4), at_.at());
      Struct(type, path, {}, true);
      if (&field == &types_[0].field[0]) TakeStamp(begin);
      return;
    }
    const std::size_t count = Count(field);
    const bool listed = field.form != Field::kOne;
    const bool shown = !hidden && (!listed || count <= kLongestArray);
    for (std::size_t k = 0; k < count; ++k) {
      if (!shown || !named_) Struct(type, path, shown ? scope : Scope{}, !shown);
      else if (!listed) Struct(type, path + "/" + field.name, scope, false);
      else Struct(type, ElementPath(path, field.name, k, count, scope, IsMap(type)), {}, false);
    }
  }

  void Numbers(const Field& field, const std::string& path, const Scope& scope, bool map, bool hidden) {
    const std::size_t count = Count(field), size = SizeOf(field.kind);
    if (count == 0) return;
    Align(size);
    const Bytes bytes = at_.Take(std::uint64_t{count} * size);
    if (hidden || (field.form != Field::kOne && count > kLongestArray)) return;
    for (std::size_t k = 0; k < count; ++k) {
      out_.value.push_back(Number(field.kind, bytes.data() + k * size));
      if (!named_) continue;
      if (field.form == Field::kOne) out_.name.push_back(path + "/" + field.name);
      else out_.name.push_back(ElementPath(path, field.name, k, count, scope, map));
    }
  }

  void TakeStamp(std::size_t begin) {
    const Bytes bytes = body_.substr(begin, 8);
    out_.stamp_ns = static_cast<std::int64_t>(Number(Kind::kInt32, bytes.data())) * 1000000000 +
                    static_cast<std::int64_t>(Number(Kind::kUint32, bytes.data() + 4));
  }

  std::vector<std::string_view> TakeNames(const Field& field) {
    std::vector<std::string_view> names;
    for (std::size_t k = Count(field); k > 0; --k) {
      const Bytes name = TakeText();
      names.push_back(name);
      out_.AddToShape(name);
      if (names.size() > kLongestArray) throw io::InputError("a message has more than 256 names");
    }
    return names;
  }

  // How many elements a field has; those of a sequence stand in the message.
  std::size_t Count(const Field& field) {
    if (field.form != Field::kSequence) return field.count;
    const std::uint32_t count = TakeLength();
    (out_.shape += std::to_string(count)) += ' ';
    return count;
  }

  Bytes TakeText() {
    const std::uint32_t length = TakeLength();
    const Bytes text = at_.Take(length);
    return text.substr(0, text.find('\0'));
  }

  std::uint32_t TakeLength() {
    Align(4);
    const auto length = at_.Take<std::uint32_t>();
    return swap_ ? __builtin_bswap32(length) : length;
  }

  void Align(std::size_t size) {
    const std::size_t beyond = at_.at() % size;
    if (beyond != 0) (void)at_.Take(size - beyond);
  }

  template <class T, class Bits>
  double As(const char* bytes) const {
    Bits bits;
    std::memcpy(&bits, bytes, sizeof bits);
    if (swap_) {
      if constexpr (sizeof(Bits) == 2) bits = __builtin_bswap16(bits);
      if constexpr (sizeof(Bits) == 4) bits = __builtin_bswap32(bits);
      if constexpr (sizeof(Bits) == 8) bits = __builtin_bswap64(bits);
    }
    return static_cast<double>(std::bit_cast<T>(bits));
  }

  double Number(Kind kind, const char* bytes) const {
    switch (kind) {
      case Kind::kBool:
      case Kind::kUint8:
        return As<std::uint8_t, std::uint8_t>(bytes);
      case Kind::kInt8:
        return As<std::int8_t, std::uint8_t>(bytes);
      case Kind::kInt16:
        return As<std::int16_t, std::uint16_t>(bytes);
      case Kind::kUint16:
        return As<std::uint16_t, std::uint16_t>(bytes);
      case Kind::kInt32:
        return As<std::int32_t, std::uint32_t>(bytes);
      case Kind::kUint32:
        return As<std::uint32_t, std::uint32_t>(bytes);
      case Kind::kInt64:
        return As<std::int64_t, std::uint64_t>(bytes);
      case Kind::kUint64:
        return As<std::uint64_t, std::uint64_t>(bytes);
      case Kind::kFloat32:
        return As<float, std::uint32_t>(bytes);
      default:
        return As<double, std::uint64_t>(bytes);
    }
  }

  const std::vector<Type>& types_;
  bool swap_;
  Bytes body_;
  Cursor at_;
  bool named_;
  Flat& out_;
};

}  // namespace

void ReadCdr(const Definition& definition, Bytes message, bool named, Flat& out) {
  out.Clear();
  CdrWalk(definition, message, named, out).Walk();
}

}  // namespace armcal::bags
