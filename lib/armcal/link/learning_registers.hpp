// link - learning on hold, and what was known of a joint dropped, over the wire; knows no estimator.
#pragma once

#include <cstdint>

#include "armcal/link/device.hpp"

namespace armcal::link {

// What the application does about it. Context: background; none may wait.
struct LearningApplication {
  void* context;
  core::Status (*hold)(void* context, bool hold);
  // block: a joint from 0, or the number of joints: what acts on several of them. Refused: without effect.
  core::Status (*reset)(void* context, int block);
};

// Writes need the unlocked session that a table needs (Status::kLocked). Context: background.
class LearningRegisters {
 public:
  // `device` outlives this.
  LearningRegisters(const LearningApplication& application, Device& device, std::uint16_t joints)
      : application_(application), device_(device), joints_(joints) {}
  LearningRegisters(const LearningRegisters&) = delete;

  // What RegisterMap::Add answers.
  core::Status Serve();

 private:
  static core::Status Read(void* self, std::uint16_t offset, std::uint16_t count, std::uint16_t* words);
  static core::Status WriteHold(void* self, std::uint16_t offset, std::uint16_t count, const std::uint16_t* words);
  static core::Status WriteReset(void* self, std::uint16_t offset, std::uint16_t count, const std::uint16_t* words);
  static core::Status ReadZero(void* self, std::uint16_t offset, std::uint16_t count, std::uint16_t* words);

  LearningApplication application_;
  Device& device_;
  std::uint16_t joints_;
  std::uint16_t held_ = 0;
};

}  // namespace armcal::link
