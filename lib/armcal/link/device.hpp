// link - the whole register map of a drive, put together; knows where every value is served, not how it comes about.
#pragma once

#include <cstdint>

#include "armcal/link/pdu_engine.hpp"
#include "armcal/link/register_map.hpp"
#include "armcal/link/table_transaction.hpp"

namespace armcal::link {

struct Identity {
  std::uint32_t schema = 0;
  std::uint32_t firmware_version = 0;
  std::uint32_t serial_number = 0;
  std::uint16_t axes = 0;
  std::uint16_t parameters = 0;
  std::uint16_t columns = 0;
  std::uint32_t capabilities = 0;
  std::uint32_t tick_rate_Hz = 0;
  std::uint16_t sample_ticks = 0;
  DeviceIdentification texts = {"armcal", "", "1"};
};

// Values that the application keeps current. It writes them in the context that polls the link.
struct LiveStatus {
  std::uint16_t feedforward_state = 0;  // 0 off: no valid table, 1 on, 2 cross-fading
  std::uint32_t generation = 0;
  std::uint32_t tick = 0;
  std::uint32_t enabled_axes = 0;
  std::uint32_t clamp_count = 0;
  std::uint32_t sample_gaps = 0;
  std::uint16_t health = 0;         // bit k: filter k's deviations are smaller than its innovations
  std::uint32_t rows_used[2] = {};  // filter A, B
  std::uint32_t rows_gated[2] = {};
};

// Serves what registers.hpp lists, traces apart (trace_registers.hpp). Context of every call: background.
class Device {
 public:
  static constexpr std::uint32_t kUnlock_ms = 60000;  // the lock falls shut so long after the last table access

  // `live` and `transaction` outlive the device.
  Device(const Identity& identity, const LiveStatus& live, TableTransaction& transaction);
  Device(const Device&) = delete;

  // Serves `count` float32 from an input register on (reg::kEstimateA ...); `values` are read at each request.
  // kFull: no room for another list; else what RegisterMap::Add answers.
  core::Status AddFloats(std::uint16_t first, const float* values, std::uint16_t count);

  // What else the device can do (reg::kHasRawTrace ...). Before the first request.
  void Declare(std::uint32_t capabilities) { identity_.capabilities |= capabilities; }

  // Time goes on for the transaction and the lock. Call it in every turn of the background loop.
  void Step(std::uint32_t now_ms);

  RegisterMap& map() { return map_; }  // for further blocks: traces, the vendor range
  PduEngine& engine() { return engine_; }
  bool unlocked() const { return unlocked_; }
  // kLocked; or kOk, and the lock stays open for another while. For whoever serves a write that needs it.
  core::Status Unlocked();

 private:
  static constexpr int kMaxFloatLists = 8;
  using Words = std::uint16_t;

  template <core::Status (Device::*kMethod)(Words, Words, Words*)>
  static core::Status Read(void* device, Words offset, Words count, Words* words) {
    return (static_cast<Device*>(device)->*kMethod)(offset, count, words);
  }
  template <core::Status (Device::*kMethod)(Words, Words, const Words*)>
  static core::Status Write(void* device, Words offset, Words count, const Words* words) {
    return (static_cast<Device*>(device)->*kMethod)(offset, count, words);
  }

  core::Status ReadIdentity(Words offset, Words count, Words* words);
  core::Status ReadStatus(Words offset, Words count, Words* words);
  core::Status ReadCommand(Words offset, Words count, Words* words);
  core::Status WriteCommand(Words offset, Words count, const Words* words);
  core::Status ReadUnlock(Words offset, Words count, Words* words);
  core::Status WriteUnlock(Words offset, Words count, const Words* words);
  core::Status ReadStaged(Words offset, Words count, Words* words);
  core::Status WriteStaged(Words offset, Words count, const Words* words);
  core::Status ReadActive(Words offset, Words count, Words* words);

  Identity identity_;
  const LiveStatus& live_;
  TableTransaction& transaction_;
  RegisterMap map_;
  PduEngine engine_;
  const float* floats_[kMaxFloatLists] = {};
  int float_lists_ = 0;
  Words scratch_[reg::kScratchCount] = {};
  Words scratch_float_[2 * reg::kScratchPairs] = {};
  Words scratch_u32_[2 * reg::kScratchPairs] = {};
  bool unlocked_ = false;
  std::uint32_t now_ms_ = 0;
  std::uint32_t touched_ms_ = 0;
};

}  // namespace armcal::link
