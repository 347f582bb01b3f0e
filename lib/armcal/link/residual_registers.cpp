// link - header, values and selection of the residual statistics' page; knows no transport.
#include "armcal/link/residual_registers.hpp"

#include "armcal/core/words.hpp"

namespace armcal::link {

using core::Status;

Status ResidualPages::ReadPage(void* self, std::uint16_t offset, std::uint16_t count, std::uint16_t* words) {
  const auto& p = *static_cast<const ResidualPages*>(self);
  std::uint16_t header[reg::kResidualHeaderCount] = {p.joint_, p.snapshot_};
  core::PutU32(header + 2, p.page_.generation);
  core::PutU32(header + 4, p.page_.elapsed_s);
  core::PutF32(header + 6, p.page_.sigma_Nm);
  for (unsigned i = 0; i < count; ++i) {
    const unsigned at = offset + i;
    if (at < reg::kResidualHeaderCount) {
      words[i] = header[at];
    } else {
      const unsigned value = at - reg::kResidualHeaderCount;
      std::uint16_t pair[2];
      core::PutF32(pair, p.page_.values[value / 2]);
      words[i] = pair[value % 2];
    }
  }
  return Status::kOk;
}

Status ResidualPages::ReadSelect(void* self, std::uint16_t, std::uint16_t, std::uint16_t* words) {
  words[0] = static_cast<const ResidualPages*>(self)->joint_;
  return Status::kOk;
}

Status ResidualPages::WriteSelect(void* self, std::uint16_t, std::uint16_t, const std::uint16_t* words) {
  auto& p = *static_cast<ResidualPages*>(self);
  if (words[0] < 1 || words[0] > p.joints_) return Status::kOutOfRange;
  p.joint_ = words[0];
  ++p.snapshot_;
  p.take_(p.context_, p.joint_ - 1, p.page_);
  return Status::kOk;
}

Status ResidualPages::Serve(RegisterMap& map) {
  constexpr std::uint16_t kWords = reg::kResidualHeaderCount + 2 * reg::kResidualValueCount;
  const Status page =
      map.Add({RegisterKind::kInput, reg::kResidualPage, kWords, this, ReadPage, nullptr, WriteRule::kWords});
  if (!core::IsOk(page)) return page;
  return map.Add({RegisterKind::kHolding, reg::kResidualSelect, 1, this, ReadSelect, WriteSelect, WriteRule::kWords});
}

}  // namespace armcal::link
