// link - a drive as its client sees it: every block of the register map but the traces, and the lock of a session.
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

// One joint's residual statistics at one instant; the values as SPEC.md lists them.
struct ResidualPage {
  std::uint32_t generation = 0;
  std::uint32_t elapsed_s = 0;
  float sigma_Nm = 0.0f;
  float values[reg::kResidualValues] = {};
};

// What the application does when a client asks for it. Context: background; none may wait.
struct ClientRequests {
  void* context;
  // Learning is put on hold (true) or goes on.
  core::Status (*hold)(void* context, bool hold);
  // Forgets a block: a joint from 0, or the number of joints for what acts on several of them. Refused: without effect.
  core::Status (*reset)(void* context, int block);
  // Fills all of `page`; joint from 0.
  void (*take_residuals)(void* context, int joint, ResidualPage& page);
};

// Context of every call: background.
class Device {
 public:
  static constexpr std::uint32_t kUnlock_ms = 60000;  // the lock falls shut so long after the last write that needs it

  // `live` and `transaction` outlive the device.
  Device(const Identity& identity, const LiveStatus& live, TableTransaction& transaction,
         const ClientRequests& requests);
  Device(const Device&) = delete;

  // Serves a list of float32: as many of its elements as `list` has. `values` are read at each request.
  // kFull: no room for another list; else what RegisterMap::Add answers.
  core::Status Serve(const Span& list, const float* values);

  // What else the device can do (reg::kHasRawTrace ...). Before the first request.
  void Declare(std::uint32_t capabilities) { identity_.capabilities |= capabilities; }

  // Time goes on for the transaction and the lock. Call it in every turn of the background loop.
  void Step(std::uint32_t now_ms);

  RegisterMap& map() { return map_; }  // for further blocks: traces, the vendor range
  PduEngine& engine() { return engine_; }
  bool unlocked() const { return unlocked_; }

 private:
  static constexpr int kMaxLists = 8;

  // Memory that a client may write and read, and nothing else happens.
  template <int kWords>
  struct Scratch {
    core::Status Read(std::uint16_t offset, std::uint16_t count, std::uint16_t* words) {
      return CopyWords(word, offset, count, words);
    }
    core::Status Write(std::uint16_t offset, std::uint16_t count, const std::uint16_t* words) {
      std::memcpy(word + offset, words, 2u * count);
      return core::Status::kOk;
    }
    std::uint16_t word[kWords] = {};
  };

  core::Status ServeOwn();
  core::Status NeedsUnlock();

  void FillIdentity(Words<reg::kIdentityBlock>& w);
  void FillStatus(Words<reg::kStatusBlock>& w);
  void FillUnlock(Words<reg::kUnlock>& w);
  core::Status TakeUnlock(const Words<reg::kUnlock>& w);
  void FillCommand(Words<reg::kCommandBlock>& w);
  core::Status TakeCommand(const Words<reg::kCommandBlock>& w);
  core::Status ReadStaged(std::uint16_t offset, std::uint16_t count, std::uint16_t* words);
  core::Status WriteStaged(std::uint16_t offset, std::uint16_t count, const std::uint16_t* words);
  core::Status ReadActive(std::uint16_t offset, std::uint16_t count, std::uint16_t* words);
  void FillHold(Words<reg::kLearningHold>& w);
  core::Status TakeHold(const Words<reg::kLearningHold>& w);
  void FillReset(Words<reg::kLearningReset>& w);
  core::Status TakeReset(const Words<reg::kLearningReset>& w);
  void FillSelect(Words<reg::kResidualSelect>& w);
  core::Status TakeSelect(const Words<reg::kResidualSelect>& w);
  void FillResidualHeader(Words<reg::kResidualHeaderBlock>& w);

  Identity identity_;
  const LiveStatus& live_;
  TableTransaction& transaction_;
  ClientRequests requests_;
  RegisterMap map_;
  PduEngine engine_;
  FloatList lists_[kMaxLists] = {};
  int list_count_ = 0;
  Scratch<reg::kScratchWords> scratch_;
  Scratch<2 * reg::kScratchValues> scratch_float_, scratch_u32_;
  bool unlocked_ = false;
  std::uint32_t now_ms_ = 0;
  std::uint32_t touched_ms_ = 0;
  std::uint16_t held_ = 0;
  // A page is larger than one request. So selecting a joint copies its statistics, and the copy stays until the next
  // selection. Two clients that select in turn see that by the snapshot's number.
  ResidualPage residuals_;
  FloatList residual_values_{residuals_.values};
  std::uint16_t residual_joint_ = 0, snapshot_ = 0;
};

}  // namespace armcal::link
