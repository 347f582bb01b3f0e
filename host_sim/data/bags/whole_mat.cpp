// bags - walks the elements of a MATLAB file of version 5 (MathWorks, MAT-File Format, 2019). An element is a type, a
// number of bytes, and these bytes.
#include "host_sim/data/bags/whole_mat.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <string>

#include "host_sim/data/bags/unpack.hpp"

namespace armcal::bags {

namespace {

constexpr std::size_t kHeader_bytes = 128, kAlign_bytes = 8;
constexpr int kDeepestMatrix = 16;  // what lies deeper is not read
enum ElementType : std::uint32_t { kMatrix = 14, kCompressed = 15 };
enum ArrayClass : std::uint32_t { kCell = 1, kStruct = 2, kFirstNumeric = 6, kLastNumeric = 15 };
constexpr std::uint32_t kComplex = 0x0800;

struct Element {
  std::uint32_t type = 0;
  Bytes content;
};

std::size_t BytesOfNumber(std::uint32_t type) {
  constexpr std::size_t kBytes[] = {0, 1, 1, 2, 2, 4, 4, 4, 0, 8, 0, 0, 8, 8};
  if (type >= std::size(kBytes) || kBytes[type] == 0) throw io::InputError("is damaged");
  return kBytes[type];
}

std::string Inflated(Bytes packed) {
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) throw io::InputError("cannot be unpacked: not enough memory");
  const std::size_t most = MostBytes(packed.size());
  std::string out;
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  int state = Z_OK;
  while (state == Z_OK && out.size() < most) {
    const std::size_t known = out.size();
    out.resize(std::min(most, 2 * known + 4096));
    stream.next_out = reinterpret_cast<Bytef*>(out.data() + known);
    stream.avail_out = static_cast<uInt>(out.size() - known);
    state = inflate(&stream, Z_NO_FLUSH);
    out.resize(out.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  if (state != Z_STREAM_END) throw io::InputError("is damaged");
  return out;
}

class Walk {
 public:
  explicit Walk(bool swapped) : swapped_(swapped) {}

  void TopLevel(Bytes file) const {
    Cursor at(file);
    at.Take(kHeader_bytes);
    while (at.left() > 0) {
      const std::size_t begin = at.at();
      try {
        const Element element = Next(at, false);
        if (element.type == kCompressed) {
          const std::string inflated = Inflated(element.content);
          Cursor inner(inflated);
          Matrix(Next(inner, false), 0);
        } else {
          Matrix(element, 0);
        }
      } catch (const io::InputError&) {
        throw io::InputError(fmt::format("the variable at byte {} is damaged or cut short", begin));
      }
    }
  }

 private:
  std::uint32_t Word(Cursor& at) const {
    const auto word = at.Take<std::uint32_t>();
    return swapped_ ? __builtin_bswap32(word) : word;
  }

  // Up to four bytes may stand beside their own type. Within a matrix elements begin at multiples of eight bytes.
  Element Next(Cursor& at, bool aligned) const {
    const std::uint32_t tag = Word(at), small = tag >> 16;
    if (small > 0) return {tag & 0xFFFF, at.Take(4).substr(0, small)};
    const std::uint32_t size = Word(at);
    Element out{tag, at.Take(size)};
    if (aligned) at.Take(std::min<std::size_t>(at.left(), (kAlign_bytes - size % kAlign_bytes) % kAlign_bytes));
    return out;
  }

  void Matrix(const Element& element, int depth) const {
    if (element.type != kMatrix) throw io::InputError("is damaged");
    if (element.content.empty() || depth > kDeepestMatrix) return;
    Cursor at(element.content);
    const Element head = Next(at, true);
    Cursor flags(head.content);
    const std::uint32_t flag = Word(flags), kind = flag & 0xFF;
    if (kind != kCell && kind != kStruct && (kind < kFirstNumeric || kind > kLastNumeric)) return;  // not read
    Cursor sizes(Next(at, true).content);
    std::uint64_t count = 1;
    while (sizes.left() > 0)
      if (__builtin_mul_overflow(count, std::uint64_t{Word(sizes)}, &count)) throw io::InputError("is damaged");
    Next(at, true);  // the name
    if (kind >= kFirstNumeric) {
      for (int part = 0; part < (flag & kComplex ? 2 : 1); ++part) {
        const Element numbers = Next(at, true);
        if (numbers.content.size() != count * BytesOfNumber(numbers.type)) throw io::InputError("is damaged");
      }
      return;
    }
    std::uint64_t fields = 1;
    if (kind == kStruct) {
      Cursor length(Next(at, true).content);
      const std::uint32_t longest = Word(length);
      fields = Next(at, true).content.size() / std::max<std::uint32_t>(1, longest);
    }
    for (std::uint64_t k = 0; k < count * fields; ++k) Matrix(Next(at, true), depth + 1);
  }

  bool swapped_;
};

}  // namespace

void CheckWhole(Bytes mat) {
  if (mat.size() < kHeader_bytes) return;
  const Bytes version = mat.substr(124, 4);
  if (version == Bytes("\0\1IM", 4)) Walk(false).TopLevel(mat);
  else if (version == Bytes("\1\0MI", 4)) Walk(true).TopLevel(mat);
}

}  // namespace armcal::bags
