// plant - holds elastic cells that slip: each is a spring to an anchor, and drags the anchor along beyond its length.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

namespace armcal::plant {

// The anchors are the memory: one position a cell.
class SlippingCells {
 public:
  // share: of the friction while all cells slip; length: at which this cell slips.
  void Add(double share, double length) {
    share_.push_back(share);
    length_.push_back(length);
  }
  std::size_t count() const { return share_.size(); }
  // The friction at a position, between -1 and 1 if the shares sum up to 1.
  double At(double position, std::span<const double> anchors) const {
    double sum = 0;
    for (std::size_t i = 0; i < share_.size(); ++i)
      sum += share_[i] * std::clamp((position - anchors[i]) / length_[i], -1.0, 1.0);
    return sum;
  }
  void Drag(double position, std::span<double> anchors) const {
    for (std::size_t i = 0; i < share_.size(); ++i)
      anchors[i] = std::clamp(anchors[i], position - length_[i], position + length_[i]);
  }

 private:
  std::vector<double> share_, length_;
};

}  // namespace armcal::plant
