// link - the two registers of learning; knows no transport.
#include "armcal/link/learning_registers.hpp"

namespace armcal::link {

using core::Status;

Status LearningRegisters::Read(void* self, std::uint16_t, std::uint16_t, std::uint16_t* words) {
  words[0] = static_cast<const LearningRegisters*>(self)->held_;
  return Status::kOk;
}

Status LearningRegisters::WriteHold(void* self, std::uint16_t, std::uint16_t, const std::uint16_t* words) {
  auto& l = *static_cast<LearningRegisters*>(self);
  if (words[0] > 1) return Status::kOutOfRange;
  const Status unlocked = l.device_.Unlocked();
  if (!core::IsOk(unlocked)) return unlocked;
  const Status done = l.application_.hold(l.application_.context, words[0] == 1);
  if (core::IsOk(done)) l.held_ = words[0];
  return done;
}

// A command: nothing stays in it.
Status LearningRegisters::ReadZero(void*, std::uint16_t, std::uint16_t, std::uint16_t* words) {
  words[0] = 0;
  return Status::kOk;
}

Status LearningRegisters::WriteReset(void* self, std::uint16_t, std::uint16_t, const std::uint16_t* words) {
  auto& l = *static_cast<LearningRegisters*>(self);
  if (words[0] < 1 || words[0] > l.joints_ + 1) return Status::kOutOfRange;
  const Status unlocked = l.device_.Unlocked();
  return core::IsOk(unlocked) ? l.application_.reset(l.application_.context, words[0] - 1) : unlocked;
}

Status LearningRegisters::Serve() {
  const Status hold =
      device_.map().Add({RegisterKind::kHolding, reg::kLearningHold, 1, this, Read, WriteHold, WriteRule::kWords});
  if (!core::IsOk(hold)) return hold;
  return device_.map().Add(
      {RegisterKind::kHolding, reg::kLearningReset, 1, this, ReadZero, WriteReset, WriteRule::kWords});
}

}  // namespace armcal::link
