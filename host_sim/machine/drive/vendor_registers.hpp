// drive - lists the registers of the trajectory player. They lie outside lib's register map.
#pragma once

#include <cstdint>

namespace armcal::drive {

// Holding registers.
inline constexpr std::uint16_t kPlayerCommand = 0x8000;  // u16: PlayerCommand; written alone
inline constexpr std::uint16_t kPlayerSpeed = 0x8001;    // u16: percent of the trajectory's own speed, 1..100
inline constexpr std::uint16_t kPlayerSetup =
    0x8010;  // u32 points, u32 step in microseconds: makes room, drops what was loaded
inline constexpr std::uint16_t kPlayerPoints =
    0x8020;  // u32 first point, then f32 positions, joint by joint, whole points
inline constexpr std::uint16_t kPlayerPointsCount = 120;

// Input registers.
inline constexpr std::uint16_t kPlayerStatus =
    0x8000;  // u16 state, u16 reason, u32 points, u32 first tick, u32 last tick
inline constexpr std::uint16_t kPlayerStatusCount = 8;

enum class PlayerCommand : std::uint16_t { kNone = 0, kEnable = 1, kDisable = 2, kStart = 3, kStop = 4 };

enum class PlayerState : std::uint16_t {
  kDisabled = 0,
  kHolding = 1,   // enabled, standing still
  kBlending = 2,  // on the way to the first point
  kPlaying = 3,
  kFinished = 4,  // enabled, standing at the last point
  kStopped = 5,   // enabled, stopped: see the reason
};

enum class StopReason : std::uint16_t { kNone = 0, kCommand = 1, kTrackingError = 2, kNoTrajectory = 3 };

}  // namespace armcal::drive
