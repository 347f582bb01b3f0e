// link - serves the registers of a drive (without the traces), and allows one connection at a time to write.
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
  std::uint32_t rows_outside[2] = {};
  std::uint32_t implausible_ticks = 0;
};

// The residual statistics of one joint at one instant. SPEC.md lists the values.
struct ResidualPage {
  std::uint32_t generation = 0;
  std::uint32_t elapsed_s = 0;
  float sigma_Nm = 0.0f;
  float values[reg::kResidualValues] = {};
};

// What the application does when a client asks for it. None of these may wait. The client gets the Status; if it is a
// refusal, nothing may have changed. Context: background.
struct ClientRequests {
  void* context;
  // Puts learning on hold (true) or lets it go on (false). kOk, or a refusal of the application's choice.
  core::Status (*hold)(void* context, bool hold);
  // Forgets what was learnt of one part: a joint from 0, or the number of joints for what acts on several of them. kOk;
  // kOutOfRange: no filter can reset this part.
  core::Status (*reset)(void* context, int block);
  // Fills all of `page`. joint: from 0.
  void (*take_residuals)(void* context, int joint, ResidualPage& page);
  // Whether clients may write now, for example by the position of a key switch. It is asked at every unlock, table
  // command, write to the stage and command to the estimators. nullptr: they may.
  bool (*may_write)(void* context) = nullptr;
};

// Only one session at a time may load tables and command learning: the one that has the seat. A session takes the seat
// with `unlock`. It loses the seat when it writes 0 to `unlock`, when its connection ends, kUnlock_ms after its last
// write that needs the seat, or when another session unlocks and this one has sent no request for
// Sessions::kPatience_ms. The words that it has staged are then dropped; a save that has begun goes on. Context of
// every call: background.
class Device {
 public:
  // The session loses the seat when this time has passed since its last write that needs the seat, or since its last
  // unlock.
  static constexpr std::uint32_t kUnlock_ms = 60000;

  // `live` and `transaction` outlive the device.
  Device(const Identity& identity, const LiveStatus& live, TableTransaction& transaction,
         const ClientRequests& requests);
  Device(const Device&) = delete;

  // Serves a list of float32. Each request reads `values` anew. kFull: no room for another list; else what
  // RegisterMap::Add answers.
  core::Status Serve(const Span& list, const float* values);

  // Adds to what the device says it can do (reg::kHasRawTrace ...). Call it before the first request.
  void Declare(std::uint32_t capabilities) { identity_.capabilities |= capabilities; }

  // Gives the time to the sessions, the seat and the transaction. Call it in every turn of the background loop.
  void Step(std::uint32_t now_ms);

  RegisterMap& map() { return map_; }  // for further blocks: traces, and the integrator's own
  PduEngine& engine() { return engine_; }

 private:
  static constexpr int kMaxLists = 8;

  // Memory that a client may write and read. Nothing else happens.
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
  bool Seated();
  void LeaveSeat();
  bool MayWrite() const { return requests_.may_write == nullptr || requests_.may_write(requests_.context); }
  core::Status NeedsUnlock();
  core::Status MayCommandLearning();

  void FillIdentity(Words<reg::kIdentityBlock>& w);
  void FillVersion(Words<reg::kLibraryVersion>& w);
  void FillWriting(Words<reg::kWritingBlock>& w);
  void FillStatus(Words<reg::kStatusBlock>& w);
  void FillTable(Words<reg::kTableBlock>& w);
  void FillDoubt(Words<reg::kDoubtBlock>& w);
  void FillUnlock(Words<reg::kUnlock>& w);
  core::Status TakeUnlock(const Words<reg::kUnlock>& w);
  void FillCommand(Words<reg::kCommandBlock>& w);
  core::Status TakeCommand(const Words<reg::kCommandBlock>& w);
  core::Status ReadOverview(std::uint16_t offset, std::uint16_t count, std::uint16_t* words);
  core::Status ReadStaged(std::uint16_t offset, std::uint16_t count, std::uint16_t* words);
  core::Status WriteStaged(std::uint16_t offset, std::uint16_t count, const std::uint16_t* words);
  core::Status ReadActive(std::uint16_t offset, std::uint16_t count, std::uint16_t* words);
  void FillHold(Words<reg::kLearningHold>& w);
  core::Status TakeHold(const Words<reg::kLearningHold>& w);
  void FillReset(Words<reg::kLearningReset>& w);
  core::Status TakeReset(const Words<reg::kLearningReset>& w);
  void FillSelect(Words<reg::kResidualSelect>& w);
  core::Status TakeSelect(const Words<reg::kResidualSelect>& w);
  void FillTrialLimit(Words<reg::kTrialLimit>& w);
  core::Status TakeTrialLimit(const Words<reg::kTrialLimit>& w);
  void FillLog(Words<reg::kLogBlock>& w);
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
  std::uint32_t now_ms_ = 0;
  std::uint32_t touched_ms_ = 0;
  std::uint16_t held_ = 0;
  // A page is larger than one request. So the selection of a joint copies its statistics, and the copy stays until the
  // next selection. Two clients that select in turn notice it, because the number of the snapshot changes.
  ResidualPage residuals_;
  FloatList residual_values_{residuals_.values};
  std::uint16_t residual_joint_ = 0, snapshot_ = 0;
};

}  // namespace armcal::link
