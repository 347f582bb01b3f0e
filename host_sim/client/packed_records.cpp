// client - continues positions of which a record holds 20 bits, and finds the whole run by the 12 others.
#include "host_sim/client/packed_records.hpp"

#include <fmt/core.h>

#include <optional>

#include "armcal/controller/trace_records.hpp"
#include "armcal/core/words.hpp"

namespace armcal::client {
namespace {

constexpr std::int64_t kTurn = 1 << 20;  // what a record holds of a position, in 1/16 count
constexpr int kMarked = 3;

// One joint's part of a record.
struct Part {
  std::int64_t low;  // of the position
  std::int32_t current_sixteenth;
  int state;
};

Part PartOf(const std::uint16_t* record, int n, int j) {
  const std::uint16_t pair = record[2 * n + j / 2];
  const unsigned byte = j % 2 == 0 ? pair >> 8 : pair & 0xFFu;
  const auto quarter = static_cast<std::int32_t>(((byte >> 2 & 3u) << 16) | record[n + j]);
  return {static_cast<std::int64_t>(byte >> 4) << 16 | record[j],
          4 * (quarter >= 1 << 17 ? quarter - (1 << 18) : quarter), static_cast<int>(byte & 3u)};
}

// The value with these lowest 20 bits that is next to `guess`.
std::int64_t Nearest(std::int64_t low, std::int64_t guess) {
  const std::int64_t off = ((low - guess) % kTurn + kTurn + kTurn / 2) % kTurn - kTurn / 2;
  return guess + off;
}

// What is known of a whole position at one record.
struct Anchor {
  std::size_t record;
  std::int64_t position;  // of 32 bits
};

// The positions of one joint in records first to last - 1, between which the drive has marked nothing. False: unknown.
bool Continue(const std::vector<Anchor>& anchors, std::int64_t* p, std::size_t first, std::size_t last) {
  for (std::size_t k = first + 1; k < last; ++k)
    p[k] = Nearest(p[k], k == first + 1 ? p[first] : 2 * p[k - 1] - p[k - 2]);
  if (anchors.size() < 2) return false;
  // The speed at the beginning is known but for whole turns from record to record.
  const auto wrap32 = [](std::int64_t x) { return static_cast<std::int64_t>(static_cast<std::int32_t>(x)); };
  const Anchor &a = anchors[0], &b = anchors[1];
  const auto steps = static_cast<std::int64_t>(b.record - a.record);
  const std::int64_t off = wrap32((b.position - a.position) - (p[b.record] - p[a.record]));
  if (off % (steps * kTurn) != 0) throw LinkError("packed records contradict each other; record again");
  const std::int64_t turns = off / steps;
  const std::int64_t start = a.position - p[a.record];
  for (std::size_t k = first; k < last; ++k)
    p[k] += start + (static_cast<std::int64_t>(k) - static_cast<std::int64_t>(a.record)) * turns;
  for (const Anchor& each : anchors)
    if (wrap32(p[each.record] - each.position) != 0)
      throw LinkError("packed records contradict each other; record again");
  return true;
}

}  // namespace

Unpacked Unpack(const TraceRecords& packed, int joints) {
  const int n = joints;
  if (packed.record_words != 2 * n + (n + 1) / 2 + 1)
    throw LinkError(fmt::format("packed records of {} registers, expected those of {} joints", packed.record_words, n));
  Unpacked out;
  out.records = packed;
  out.records.channels = controller::kRawMotion | controller::kRawFlags;
  out.records.record_words = static_cast<std::uint16_t>(5 * n);
  out.records.words.assign(packed.count() * out.records.record_words, 0);
  const auto record = [&](std::size_t k) { return &packed.words[k * packed.record_words]; };
  std::vector<std::int64_t> p(packed.count());
  for (int j = 0; j < n; ++j) {
    for (std::size_t k = 0; k < p.size(); ++k) p[k] = PartOf(record(k), n, j).low;
    for (std::size_t first = 0, last = 0; first < p.size(); first = last) {
      std::vector<Anchor> anchors;
      for (last = first; last < p.size(); ++last) {
        const bool gap = last > first && packed.ticks[last] - packed.ticks[last - 1] != packed.tick_step;
        if (last > first && (gap || PartOf(record(last), n, j).state == kMarked)) break;
        if (const std::uint16_t top = record(last)[packed.record_words - 1]; top >> 12 == j)
          anchors.push_back({last, static_cast<std::int64_t>(top & 0xFFFu) << 20 | p[last]});
      }
      const bool known = Continue(anchors, p.data(), first, last);
      if (!known) out.unknown += last - first;
      for (std::size_t k = first; k < last; ++k) {
        const Part part = PartOf(record(k), n, j);
        std::uint16_t* w = &out.records.words[k * out.records.record_words + 5 * static_cast<std::size_t>(j)];
        core::PutU32(w, static_cast<std::uint32_t>(p[k]));
        core::PutU32(w + 2, static_cast<std::uint32_t>(part.current_sixteenth));
        w[4] = part.state == 0   ? 0
               : part.state == 1 ? model::kEnabled
               : part.state == 2 ? model::kEnabled | model::kSaturated
                                 : model::kEnabled | model::kStale;
        if (!known) w[4] = static_cast<std::uint16_t>(w[4] | model::kStale);
      }
    }
  }
  return out;
}

}  // namespace armcal::client
