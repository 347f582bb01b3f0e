// link - page header, page data, arm and acknowledge of a trace; knows no transport.
#include "armcal/link/trace_registers.hpp"

#include "armcal/core/words.hpp"

namespace armcal::link {

namespace {

using core::PutU32;
using core::Status;

// `context` is the Trace in all of them. Reading the header forms a page if there is none.
Status ReadPageHeader(void* context, std::uint16_t offset, std::uint16_t count, std::uint16_t* words) {
  auto& trace = *static_cast<Trace*>(context);
  const TraceState state = trace.state();  // before the page: "done" with an empty page means that nothing follows
  const TracePage& page = trace.Page();
  const std::uint32_t waiting = trace.waiting();
  std::uint16_t h[reg::kPageHeaderCount];
  PutU32(h, page.first_record);
  PutU32(h + 2, page.first_tick);
  PutU32(h + 4, trace.record_ticks());
  h[6] = page.count;
  h[7] = trace.requested().record_words;
  PutU32(h + 8, trace.lost());
  h[10] = trace.requested().number;
  h[11] = page.generation;
  h[12] = static_cast<std::uint16_t>(state);
  h[13] = static_cast<std::uint16_t>(waiting > 0xFFFFu ? 0xFFFFu : waiting);
  PutU32(h + 14, trace.requested().channels);
  return CopyWords(h, offset, count, words);
}

Status ReadPageData(void* context, std::uint16_t offset, std::uint16_t count, std::uint16_t* words) {
  return static_cast<Trace*>(context)->ReadPage(offset, count, words);
}

Status ReadArm(void* context, std::uint16_t offset, std::uint16_t count, std::uint16_t* words) {
  const TraceArm& arm = static_cast<Trace*>(context)->requested();
  std::uint16_t w[reg::kTraceArmCount] = {arm.number, static_cast<std::uint16_t>(arm.mode), arm.decimation};
  PutU32(w + 4, arm.start_tick);
  PutU32(w + 6, arm.limit);
  PutU32(w + 8, arm.channels);
  return CopyWords(w, offset, count, words);
}

Status WriteArm(void* context, std::uint16_t, std::uint16_t, const std::uint16_t* w) {
  auto& trace = *static_cast<Trace*>(context);
  if (w[3] != 0) return Status::kOutOfRange;
  std::uint16_t present[reg::kTraceArmCount];
  const Status read = ReadArm(context, 0, reg::kTraceArmCount, present);
  if (core::IsOk(read) && w[0] != 0 && std::memcmp(present, w, sizeof present) == 0) return Status::kOk;  // a retry
  TraceArm arm;
  arm.number = w[0];
  arm.mode = static_cast<TraceMode>(w[1]);
  arm.decimation = w[2];
  arm.start_tick = core::GetU32(w + 4);
  arm.limit = core::GetU32(w + 6);
  arm.channels = core::GetU32(w + 8);
  return trace.Arm(arm);
}

Status ReadAcknowledge(void* context, std::uint16_t offset, std::uint16_t count, std::uint16_t* words) {
  std::uint16_t w[2];
  PutU32(w, static_cast<Trace*>(context)->acknowledged());
  return CopyWords(w, offset, count, words);
}

Status WriteAcknowledge(void* context, std::uint16_t, std::uint16_t, const std::uint16_t* words) {
  return static_cast<Trace*>(context)->Acknowledge(core::GetU32(words));
}

}  // namespace

Status ServeTrace(RegisterMap& map, int number, Trace& trace) {
  if (number < 0 || number >= reg::kTraces) return Status::kOutOfRange;
  const std::uint16_t page = reg::kTracePage[number];
  const std::uint16_t arm = reg::kTraceArm[number];
  const auto data = static_cast<std::uint16_t>(page + reg::kPageData);
  const auto acknowledge = static_cast<std::uint16_t>(arm + reg::kTraceAcknowledge);
  const Block blocks[] = {
      {RegisterKind::kInput, page, reg::kPageHeaderCount, &trace, ReadPageHeader, nullptr, WriteRule::kWords},
      {RegisterKind::kInput, data, reg::kPageDataCount, &trace, ReadPageData, nullptr, WriteRule::kWords},
      {RegisterKind::kHolding, arm, reg::kTraceArmCount, &trace, ReadArm, WriteArm, WriteRule::kWhole},
      {RegisterKind::kHolding, acknowledge, 2, &trace, ReadAcknowledge, WriteAcknowledge, WriteRule::kWhole},
  };
  for (const Block& block : blocks) {
    const Status added = map.Add(block);
    if (!core::IsOk(added)) return added;
  }
  return Status::kOk;
}

}  // namespace armcal::link
