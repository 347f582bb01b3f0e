// bags - reads MCAP files, record after record (mcap.dev/spec). The index at the end is not used: a file that was cut
// has none.
#include <fmt/format.h>
#include <zlib.h>

#include <map>

#include "host_sim/data/bags/container.hpp"
#include "host_sim/data/bags/unpack.hpp"

namespace armcal::bags {

namespace {

constexpr Bytes kMagic("\x89MCAP0\r\n", 8);
enum Opcode : std::uint8_t { kSchema = 3, kChannel = 4, kMessage = 5, kChunk = 6, kDataEnd = 15 };

std::uint32_t Checksum(Bytes bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

class McapReader {
 public:
  McapReader(Bytes file, const Taker& taker) : file_(file), taker_(taker) {}

  void Read() {
    Cursor at(file_.substr(kMagic.size()));
    const bool closed = file_.size() >= 2 * kMagic.size() && file_.ends_with(kMagic);
    bool ended = false;
    while (!ended && at.left() > 0) {
      const std::size_t begin = at.at() + kMagic.size();
      try {
        const auto opcode = at.Take<std::uint8_t>();
        const Bytes content = at.Take(at.Take<std::uint64_t>());
        ended = opcode == kDataEnd;
        Record(opcode, content, begin);
      } catch (const EndOfBytes&) {
        if (closed) throw io::InputError(fmt::format("the record at byte {} is damaged", begin));
        return Cut(begin);
      }
    }
    if (!closed) Cut(file_.size());
  }

 private:
  struct Schema {
    std::string name, encoding, data;
  };
  struct Channel {
    Topic topic;
    bool wanted = false;
  };

  void Cut(std::size_t at) const {
    if (messages_ == 0) throw io::InputError("is cut short, before its first message; copy or record it again");
    taker_.note(fmt::format("the end of the file is missing; {} messages are read, up to byte {} of {}", messages_, at,
                            file_.size()));
  }

  // A record that is whole has no reason to end early.
  void Record(std::uint8_t opcode, Bytes content, std::size_t begin) {
    try {
      if (opcode == kChunk) return ReadChunk(content);
      InChunk(opcode, content);
    } catch (const EndOfBytes&) {
      throw io::InputError(fmt::format("the record at byte {} is damaged", begin));
    } catch (const io::InputError& error) {
      throw io::InputError(fmt::format("the record at byte {}: {}", begin, error.what()));
    }
  }

  void InChunk(std::uint8_t opcode, Bytes content) {
    Cursor at(content);
    if (opcode == kSchema) {
      const auto id = at.Take<std::uint16_t>();
      const Bytes name = at.TakeText(), encoding = at.TakeText(), data = at.TakeText();
      schema_[id] = {std::string(name), std::string(encoding), std::string(data)};
    } else if (opcode == kChannel) {
      AddChannel(at);
    } else if (opcode == kMessage) {
      const auto found = channel_.find(at.Take<std::uint16_t>());
      if (found == channel_.end()) throw io::InputError("a message has no channel");
      (void)at.Take<std::uint32_t>();  // its number
      const auto recorded_ns = at.Take<std::uint64_t>();
      (void)at.Take<std::uint64_t>();  // when it was published
      ++messages_;
      if (found->second.wanted)
        taker_.take(found->second.topic, {static_cast<std::int64_t>(recorded_ns), at.Take(at.left())});
    }
  }

  void AddChannel(Cursor& at) {
    const auto id = at.Take<std::uint16_t>();
    if (channel_.contains(id)) return;  // repeated, so that each chunk can be read alone
    const auto schema = at.Take<std::uint16_t>();
    const Bytes name = at.TakeText(), encoding = at.TakeText();
    if (schema != 0 && !schema_.contains(schema)) throw io::InputError("a channel has no schema");
    Channel channel{{std::string(name), std::string(encoding), {}, {}, {}}};
    if (schema != 0) {
      const Schema& of = schema_[schema];
      channel.topic.type = of.name, channel.topic.schema = of.encoding, channel.topic.definition = of.data;
    }
    channel.wanted = taker_.wants(channel.topic);
    channel_.emplace(id, std::move(channel));
  }

  void ReadChunk(Bytes content) {
    Cursor at(content);
    (void)at.Take<std::uint64_t>(), (void)at.Take<std::uint64_t>();  // first and last time
    const auto size = at.Take<std::uint64_t>();
    const auto checksum = at.Take<std::uint32_t>();
    const Bytes compression = at.TakeText();
    const Bytes records = Unpack(compression, at.Take(at.Take<std::uint64_t>()), size);
    if (checksum != 0 && checksum != Checksum(records)) throw io::InputError("the checksum of a chunk is wrong");
    Cursor in(records);
    while (in.left() > 0) {
      const auto opcode = in.Take<std::uint8_t>();
      InChunk(opcode, in.Take(in.Take<std::uint64_t>()));
    }
  }

  Bytes Unpack(Bytes compression, Bytes packed, std::uint64_t size) {
    if (compression.empty()) return packed;
    if (compression != "lz4" && compression != "zstd")
      throw io::InputError(fmt::format("a chunk is compressed by '{}', expected lz4 or zstd", compression));
    if (size > MostBytes(packed.size()))
      throw io::InputError(fmt::format("a chunk of {} bytes claims to hold {}", packed.size(), size));
    if (compression == "lz4") UnpackLz4(packed, static_cast<std::size_t>(size), unpacked_);
    else UnpackZstd(packed, static_cast<std::size_t>(size), unpacked_);
    return unpacked_;
  }

  Bytes file_;
  const Taker& taker_;
  std::map<std::uint16_t, Schema> schema_;
  std::map<std::uint16_t, Channel> channel_;
  std::string unpacked_;
  std::size_t messages_ = 0;
};

}  // namespace

bool IsMcap(Bytes file) { return file.starts_with(kMagic); }

void ReadMcap(Bytes file, const Taker& taker) { McapReader(file, taker).Read(); }

}  // namespace armcal::bags
