// estimator - what is published, in the columns' own units; knows no filter's inside.
#pragma once

#include "armcal/estimator/image.hpp"
#include "armcal/estimator/live_model.hpp"

namespace armcal::estimator {

// What the estimator knows at one instant. Columns in filter coordinates [front, dense], own units.
template <class Model>
struct Estimates {
  std::uint32_t generation = 0;  // of the table that the filter started from
  std::uint32_t tick = 0;        // of the last sample inside
  std::uint32_t samples = 0;     // processed since adoption
  std::uint32_t stale = 0;       // samples of another generation, dropped
  std::uint32_t refused = 0;     // samples lost because the ring was full, since power-up
  float value[Model::kColumns] = {};
  float sd[Model::kColumns] = {};
  // Nonlinear parameters; the committed ones and zero unless the filter is extended.
  float eta[Model::kNonlinear > 0 ? Model::kNonlinear : 1] = {};
  float eta_sd[Model::kNonlinear > 0 ? Model::kNonlinear : 1] = {};
  std::uint32_t clamps = 0;  // how often an eta was cut to its bound
  std::uint32_t rows_used[Model::kJoints] = {};
  std::uint32_t rows_gated[Model::kJoints] = {};    // not valid, not moving, or outside the innovation gate
  std::uint32_t rows_refused[Model::kJoints] = {};  // not finite or beyond filter::kRowLimit
  float nis[Model::kJoints] = {};                   // see monitor::JointMonitor
  float residual_rms_Nm[Model::kJoints] = {};       // measured minus committed model, used rows
  bool inconsistent = false;                        // the deviations are too small: see monitor::Consistency
};

// Values and standard deviations from a filter's read-out in prior units: x, sd by column.
template <class Model, class ReadOut>
void FromPriorUnits(const Image<Model>& image, const ReadOut& out, Estimates<Model>& estimates) {
  for (int k = 0; k < Model::kColumns; ++k) {
    estimates.value[k] = image.committed.p[k] + image.scale[k] * out.x[k];
    estimates.sd[k] = image.scale[k] * out.sd[k];
  }
  constexpr bool kExtended = sizeof(out.x) > Model::kColumns * sizeof(float);
  for (int e = 0; e < Model::kNonlinear; ++e) {
    estimates.eta[e] = image.committed.eta[e];
    if constexpr (kExtended) {
      estimates.eta[e] = EtaAt(image, e, out.x[Model::kColumns + e]);
      estimates.eta_sd[e] = EtaSlope(image, e, estimates.eta[e]) * out.sd[Model::kColumns + e];
    }
  }
}

}  // namespace armcal::estimator
