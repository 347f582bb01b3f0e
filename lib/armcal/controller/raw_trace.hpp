// controller - the ring of the raw trace: what the tick measured and was told; knows no register.
#pragma once

#include "armcal/estimator/trace_records.hpp"
#include "armcal/link/trace.hpp"

namespace armcal::controller {

// kWords: of 16 bits. A record of six joints takes 33 (motion and flags) to 69.
template <class Model, std::uint32_t kWords = link::kDefaultTraceWords>
class RawTrace : public link::TraceRing<kWords> {
 public:
  RawTrace() : link::TraceRing<kWords>(1, RecordWords, nullptr) {}

 private:
  static std::uint16_t RecordWords(void*, std::uint32_t channels) {
    return estimator::RawRecordWords<Model::kJoints>(channels);
  }
};

}  // namespace armcal::controller
