// drive - serves the trajectory player as registers of the vendor range.
#pragma once

#include <vector>

#include "armcal/link/register_map.hpp"
#include "host_sim/machine/drive/firmware.hpp"

namespace armcal::drive {

// Context: background, all of it.
class VendorBlock {
 public:
  VendorBlock(PlayedMotion& player, int joints) : player_(player), joints_(joints) {}

  // kFull, kBadAddress: the map's answer.
  core::Status Serve(link::RegisterMap& map);

 private:
  static core::Status ReadStatus(void* self, std::uint16_t offset, std::uint16_t count, std::uint16_t* words);
  static core::Status ReadControl(void* self, std::uint16_t offset, std::uint16_t count, std::uint16_t* words);
  static core::Status WriteControl(void* self, std::uint16_t offset, std::uint16_t count, const std::uint16_t* words);
  static core::Status ReadNothing(void* self, std::uint16_t offset, std::uint16_t count, std::uint16_t* words);
  static core::Status WriteSetup(void* self, std::uint16_t offset, std::uint16_t count, const std::uint16_t* words);
  static core::Status WritePoints(void* self, std::uint16_t offset, std::uint16_t count, const std::uint16_t* words);
  core::Status Obey(client::PlayerCommand command);

  PlayedMotion& player_;
  int joints_;
  std::uint32_t points_ = 0, step_us_ = 0;
  std::uint16_t speed_percent_ = 100;
  std::vector<float> position_;
  std::vector<char> loaded_;
};

}  // namespace armcal::drive
