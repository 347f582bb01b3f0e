// calibration - sums the products of columns over packs of samples.
//
// One object sums one row of the regressor. The row's columns lie side by side in a panel of samples. The products of
// each pair of columns are added lane by lane into accumulators; kTileRows x kTileColumns of them are in registers at a
// time. Memory depends on the number of columns alone. The lanes are added at the end, so the bits do not depend on the
// machine's vector width. The file stands alone, because armcal bench compiles it with flags of its own.
#pragma once

#include <cstddef>
#include <vector>

#include "armcal/math/pack.hpp"

namespace armcal::calibration {

// P: a Pack of doubles. kPanel: samples per panel. kTileRows divides kTileColumns or the other way round.
template <class P, int kTileRows, int kTileColumns, int kPanel>
class GramSum {
 public:
  static constexpr int kLanes = P::kLanes, kPacks = kPanel / kLanes;
  static_assert(kPanel % kLanes == 0 && kTileColumns % kTileRows == 0);

  explicit GramSum(int columns)
      : columns_(columns),
        padded_((columns + kTileColumns - 1) / kTileColumns * kTileColumns),
        panel_(static_cast<std::size_t>(padded_) * kPacks, P(0)) {
    int tiles = 0;
    for (int r = 0; r < padded_; r += kTileRows) tiles += r / kTileColumns + 1;
    sum_.assign(static_cast<std::size_t>(tiles) * kTileRows * kTileColumns, P(0));
  }

  int columns() const { return columns_; }
  // kPacks packs, that is kPanel samples, of column k; filled by the caller.
  P* column(int k) { return panel_.data() + static_cast<std::size_t>(k) * kPacks; }

  // Adds the panel's first `packs` packs; entries of samples that do not count must be zero.
  void AddPanel(int packs = kPacks) {
    P* sum = sum_.data();
    for (int r = 0; r < padded_; r += kTileRows)
      for (int c = 0; c <= r; c += kTileColumns, sum += kTileRows * kTileColumns)
        AddTile(column(r), column(c), packs, sum);
  }

  // gram: [columns x columns], column-major, both triangles; added to what is there.
  void AddTo(double* gram) const {
    const P* sum = sum_.data();
    for (int r = 0; r < padded_; r += kTileRows)
      for (int c = 0; c <= r; c += kTileColumns)
        for (int i = r; i < r + kTileRows; ++i)
          for (int k = c; k < c + kTileColumns; ++k, ++sum) {
            if (i >= columns_ || k > i) continue;
            double total = 0;
            for (int lane = 0; lane < kLanes; ++lane) total += (*sum)[lane];
            gram[i + static_cast<std::size_t>(k) * columns_] += total;
            if (i != k) gram[k + static_cast<std::size_t>(i) * columns_] += total;
          }
  }

 private:
  static void AddTile(const P* a, const P* b, int packs, P* sum) {
    P tile[kTileRows][kTileColumns];
    for (int i = 0; i < kTileRows; ++i)
      for (int k = 0; k < kTileColumns; ++k) tile[i][k] = sum[i * kTileColumns + k];
    for (int p = 0; p < packs; ++p)
      for (int i = 0; i < kTileRows; ++i)
        for (int k = 0; k < kTileColumns; ++k) tile[i][k] += a[i * kPacks + p] * b[k * kPacks + p];
    for (int i = 0; i < kTileRows; ++i)
      for (int k = 0; k < kTileColumns; ++k) sum[i * kTileColumns + k] = tile[i][k];
  }

  int columns_, padded_;
  std::vector<P> panel_, sum_;
};

}  // namespace armcal::calibration
