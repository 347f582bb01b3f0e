// client - selects a joint, reads its statistics, and makes sure that all of them are of one snapshot.
#include "host_sim/client/residual_reader.hpp"

#include <fmt/core.h>

#include <cmath>
#include <cstring>

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
    drive.WriteValue<reg::kResidualSelect>(static_cast<std::uint16_t>(joint));
    const auto header = drive.Read<reg::kResidualHeaderBlock>();
    const auto values = drive.Read<reg::kResidualValuesBlock>();
    const auto again = drive.Read<reg::kResidualHeaderBlock>();
    if (header.Get<reg::kResidualJoint>() != joint || std::memcmp(&header, &again, sizeof header) != 0) continue;
    JointResiduals r;
    r.joint = joint;
    r.generation = header.Get<reg::kResidualGeneration>();
    r.elapsed_s = header.Get<reg::kResidualElapsed>();
    r.sigma_Nm = header.Get<reg::kResidualSigma>();
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
