// client - selects, reads, and makes sure that it was one snapshot.
#include "host_sim/client/residual_reader.hpp"

#include <fmt/core.h>

#include <cmath>

#include "armcal/core/words.hpp"

namespace armcal::client {

namespace reg = link::reg;

namespace {

constexpr int kSnapshots = 5;

ResidualBins TakeBins(const std::uint16_t*& w) {
  ResidualBins bins;
  for (auto& signal : bins.bin)
    for (auto& direction : signal)
      for (ResidualBin& b : direction)
        for (double* sum :
             {&b.count, &b.residual, &b.square, &b.speed, &b.position, &b.load, &b.load_size, &b.temperature}) {
          *sum = core::GetF32(w);
          w += 2;
        }
  return bins;
}

}  // namespace

JointResiduals ReadResiduals(DriveClient& drive, int joint) {
  if ((drive.ReadIdentity().capabilities & reg::kHasResiduals) == 0)
    throw RefusedError(drive.name() + ": keeps no residual statistics", 0, core::Status::kBadAddress);
  for (int attempt = 0; attempt < kSnapshots; ++attempt) {
    drive.WriteSingle(reg::kResidualSelect, static_cast<std::uint16_t>(joint));
    const std::vector<std::uint16_t> header = drive.ReadInput(reg::kResidualPage, reg::kResidualHeaderCount);
    const std::vector<std::uint16_t> values = drive.ReadInput(reg::kResidualValues, 2 * reg::kResidualValueCount);
    if (header[0] != joint || drive.ReadInput(reg::kResidualPage, reg::kResidualHeaderCount) != header) continue;
    JointResiduals r;
    r.joint = joint;
    r.generation = core::GetU32(&header[2]);
    r.elapsed_s = core::GetU32(&header[4]);
    r.sigma_Nm = core::GetF32(&header[6]);
    const std::uint16_t* w = values.data();
    r.reference = TakeBins(w);
    r.recent = TakeBins(w);
    for (int i = 0; i < reg::kResidualSlices; ++i, w += 6)
      if (const float start_s = core::GetF32(w); !std::isnan(start_s))
        r.slices.push_back({start_s, core::GetF32(w + 2), core::GetF32(w + 4)});
    return r;
  }
  throw LinkError(fmt::format("{}: another client selects joints while the statistics are read", drive.name()));
}

}  // namespace armcal::client
