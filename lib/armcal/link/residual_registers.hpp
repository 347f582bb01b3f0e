// link - serves a joint's residual statistics as a snapshot; knows how many values there are, not what they mean.
#pragma once

#include <cstdint>

#include "armcal/link/register_map.hpp"

namespace armcal::link {

// One joint's statistics at one instant; the values as SPEC.md lists them.
struct ResidualPage {
  std::uint32_t generation = 0;
  std::uint32_t elapsed_s = 0;
  float sigma_Nm = 0.0f;
  float values[reg::kResidualValueCount] = {};
};

// A page is larger than one request, so selecting a joint copies it, and the copy stays until the next selection.
// Two clients that take turns see it by the snapshot's number. Context: background.
class ResidualPages {
 public:
  // Fills all of `page`; joint from 0.
  using Take = void (*)(void* context, int joint, ResidualPage& page);

  ResidualPages(Take take, void* context, std::uint16_t joints) : take_(take), context_(context), joints_(joints) {}
  ResidualPages(const ResidualPages&) = delete;

  // What RegisterMap::Add answers.
  core::Status Serve(RegisterMap& map);

 private:
  static core::Status ReadPage(void* self, std::uint16_t offset, std::uint16_t count, std::uint16_t* words);
  static core::Status ReadSelect(void* self, std::uint16_t offset, std::uint16_t count, std::uint16_t* words);
  static core::Status WriteSelect(void* self, std::uint16_t offset, std::uint16_t count, const std::uint16_t* words);

  Take take_;
  void* context_;
  std::uint16_t joints_;
  std::uint16_t joint_ = 0, snapshot_ = 0;
  ResidualPage page_;
};

}  // namespace armcal::link
