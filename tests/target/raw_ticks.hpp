// tests - control ticks as an arm's hardware gives them, in integers.
#pragma once

#include "armcal/model/sample.hpp"
#include "tests/target/numbers.hpp"

namespace armcal::target {

// Ticks of axes that speed up and slow down at random.
template <int n>
class RawTicks {
 public:
  const model::RawSample<n>& Next() {
    const int event = numbers_.Below(4000);
    raw_.tick += event == 0 ? 3u : 1u;
    for (int i = 0; i < n; ++i) {
      speed_[i] += numbers_.Below(41) - 20;
      const auto counts = static_cast<std::uint32_t>(raw_.counts[i]) + static_cast<std::uint32_t>(speed_[i] / 4);
      raw_.counts[i] = static_cast<std::int32_t>(counts);
      raw_.current[i] = static_cast<std::int16_t>(numbers_.Below(20001) - 10000);
      raw_.flags[i] = model::kEnabled;
      raw_.temperature_degC[i] = numbers_.Between(20.0f, 60.0f);
    }
    if (event == 1) raw_.flags[2] |= model::kSaturated;
    if (event == 2) raw_.flags[4] = 0;
    if (event == 3) raw_.flags[0] |= model::kStale;
    return raw_;
  }
  RawTicks() {
    for (int i = 0; i < n; ++i) raw_.counts[i] = 2147480000 - 50000 * i;  // wraps soon
  }

 private:
  Numbers numbers_{3};
  model::RawSample<n> raw_;
  std::int32_t speed_[n] = {};
};

}  // namespace armcal::target
