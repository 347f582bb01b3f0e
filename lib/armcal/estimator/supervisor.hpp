// estimator - keeps the last estimates that can be believed. No program of the project uses it yet.
#pragma once

#include "armcal/estimator/estimates.hpp"

namespace armcal::estimator {

// Stands between an estimator and whoever acts on its numbers. While somebody works on an arm, its estimates may be far
// off, or may belong to no arm that can exist; then the last good ones stay. Context: one, any.
template <class Model>
class Supervisor {
 public:
  // Takes what an estimator has published. bodies [kBodyParameters] are the arm that belongs to it: from the read-out
  // of BeginPhysical, or from ReadBodies if that takes too long. kOk: these are the good ones now. With every other
  // answer the old ones stay: kNotFinite; kUnphysical (a body, or a negative rotor inertia); kHeld
  // (Estimates::inconsistent: the innovations are larger than the filter believes, because the arm has changed or does
  // what the model lacks).
  core::Status Accept(const Estimates<Model>& estimates, const float* bodies) {
    const core::Status status = Judge(estimates, bodies);
    ++(core::IsOk(status) ? accepted_ : kept_);
    if (!core::IsOk(status)) return status;
    good_ = estimates;
    for (int k = 0; k < Model::kBodyParameters; ++k) bodies_[k] = bodies[k];
    return status;
  }

  bool any() const { return accepted_ != 0u; }
  const Estimates<Model>& good() const { return good_; }
  const float* bodies() const { return bodies_; }  // [kBodyParameters] of the good ones
  std::uint32_t accepted() const { return accepted_; }
  std::uint32_t kept() const { return kept_; }  // how often the good ones stayed

 private:
  static core::Status Judge(const Estimates<Model>& e, const float* bodies) {
    bool finite = true, physical = true;
    for (int k = 0; k < Model::kColumns; ++k) finite &= math::IsFinite(e.value[k]) && math::IsFinite(e.sd[k]);
    for (int k = 0; k < Model::kBodyParameters; ++k) finite &= math::IsFinite(bodies[k]);
    if (!finite) return core::Status::kNotFinite;
    for (int link = 0; link < Model::kJoints; ++link) physical &= physical::CanExist(bodies + link * model::kBodyBlock);
    if (!physical) return core::Status::kUnphysical;
    return e.inconsistent ? core::Status::kHeld : core::Status::kOk;
  }

  Estimates<Model> good_;
  float bodies_[Model::kBodyParameters] = {};
  std::uint32_t accepted_ = 0, kept_ = 0;
};

}  // namespace armcal::estimator
