// drive - serves the player's registers. It refuses a command until setup and all points are loaded.
#include "host_sim/machine/drive/vendor_block.hpp"

#include <algorithm>
#include <cmath>

#include "armcal/model/parameters.hpp"

namespace armcal::drive {

using core::Status;

namespace {
constexpr std::uint32_t kMaxPoints = 200000, kMinStep_us = 500, kMaxStep_us = 50000;
}

Status VendorBlock::Serve(link::RegisterMap& map) {
  using link::RegisterKind;
  using link::WriteRule;
  const link::Block blocks[] = {
      {RegisterKind::kInput, client::kPlayerStatus, client::kPlayerStatusCount, this, &ReadStatus, nullptr,
       WriteRule::kWords},
      {RegisterKind::kHolding, client::kPlayerCommand, 2, this, &ReadControl, &WriteControl, WriteRule::kWords},
      {RegisterKind::kHolding, client::kPlayerSetup, 4, this, &ReadNothing, &WriteSetup, WriteRule::kWhole},
      {RegisterKind::kHolding, client::kPlayerPoints, client::kPlayerPointsCount, this, &ReadNothing, &WritePoints,
       WriteRule::kPairs}};
  for (const link::Block& b : blocks)
    if (const Status s = map.Add(b); !core::IsOk(s)) return s;
  return Status::kOk;
}

Status VendorBlock::ReadStatus(void* self, std::uint16_t offset, std::uint16_t count, std::uint16_t* out) {
  const auto& b = *static_cast<VendorBlock*>(self);
  std::uint16_t w[client::kPlayerStatusCount] = {static_cast<std::uint16_t>(b.player_.state()),
                                                 static_cast<std::uint16_t>(b.player_.reason())};
  core::PutU32(w + 2, static_cast<std::uint32_t>(std::count(b.loaded_.begin(), b.loaded_.end(), 1)));
  core::PutU32(w + 4, b.player_.first_tick());
  core::PutU32(w + 6, b.player_.last_tick());
  std::copy_n(w + offset, count, out);
  return Status::kOk;
}

Status VendorBlock::ReadControl(void* self, std::uint16_t offset, std::uint16_t count, std::uint16_t* out) {
  const auto& b = *static_cast<VendorBlock*>(self);
  const std::uint16_t w[] = {0, b.speed_percent_};
  std::copy_n(w + offset, count, out);
  return Status::kOk;
}

Status VendorBlock::ReadNothing(void*, std::uint16_t, std::uint16_t count, std::uint16_t* out) {
  std::fill_n(out, count, std::uint16_t{0});
  return Status::kOk;
}

Status VendorBlock::WriteControl(void* self, std::uint16_t offset, std::uint16_t count, const std::uint16_t* w) {
  auto& b = *static_cast<VendorBlock*>(self);
  const bool with_speed = offset + count > 1, with_command = offset == 0;
  const std::uint16_t percent = with_speed ? w[1 - offset] : b.speed_percent_;
  if (percent < 1 || percent > 100) return Status::kOutOfRange;
  if (with_command && w[0] > static_cast<std::uint16_t>(client::PlayerCommand::kStop)) return Status::kOutOfRange;
  if (with_speed) {
    b.speed_percent_ = percent;
    b.player_.SetSpeed(percent / 100.0);
  }
  return with_command ? b.Obey(static_cast<client::PlayerCommand>(w[0])) : Status::kOk;
}

Status VendorBlock::Obey(client::PlayerCommand command) {
  if (command == client::PlayerCommand::kStart) {
    const bool complete = points_ > 0 && std::count(loaded_.begin(), loaded_.end(), 1) == static_cast<long>(points_);
    if (!complete || !player_.enabled() || player_.moving()) return Status::kWrongOrder;
    if (!player_.Load(step_us_ * 1e-6, points_, position_.data())) return Status::kBusy;
  }
  player_.Command(command);
  return Status::kOk;
}

Status VendorBlock::WriteSetup(void* self, std::uint16_t, std::uint16_t, const std::uint16_t* w) {
  auto& b = *static_cast<VendorBlock*>(self);
  const std::uint32_t points = core::GetU32(w), step = core::GetU32(w + 2);
  if (points < 10 || points > kMaxPoints || step < kMinStep_us || step > kMaxStep_us) return Status::kOutOfRange;
  b.points_ = points;
  b.step_us_ = step;
  b.position_.assign(static_cast<std::size_t>(points) * b.joints_, 0.0f);
  b.loaded_.assign(points, 0);
  return Status::kOk;
}

Status VendorBlock::WritePoints(void* self, std::uint16_t offset, std::uint16_t count, const std::uint16_t* w) {
  auto& b = *static_cast<VendorBlock*>(self);
  if (offset != 0 || count < 2 || (count - 2) % (2 * b.joints_) != 0) return Status::kWrongSize;
  const std::uint32_t first = core::GetU32(w), points = static_cast<std::uint32_t>((count - 2) / (2 * b.joints_));
  if (points > b.points_ || first > b.points_ - points) return Status::kOutOfRange;  // first + points may wrap
  for (int k = 2; k < count; k += 2)
    if (!std::isfinite(core::GetF32(w + k))) return Status::kNotFinite;
  for (std::uint32_t k = 0; k < points * b.joints_; ++k)
    b.position_[first * b.joints_ + k] = core::GetF32(w + 2 + 2 * k);
  std::fill_n(b.loaded_.begin() + first, points, 1);
  return Status::kOk;
}

}  // namespace armcal::drive
