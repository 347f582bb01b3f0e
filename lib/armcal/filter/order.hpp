// filter - in which order a UD factor holds the columns, and where each column of it begins; knows no number.
//
// A joint's front columns stand just before the first dense column of its row. Two things follow:
//   row i of the regressor is zero before first[i], so that the factor's columns before it are not touched by it;
//   front columns of two joints never meet in a row, so that U between them stays zero as long as process noise and
//   considered columns do not couple them. The block form does not store those zeros: a front column begins at its
//   joint's first one, a dense column at the top.
#pragma once

#include <cstdint>

namespace armcal::filter {

enum class Form : std::uint8_t {
  kDense,  // any column may have process noise or be considered
  kBlock   // process noise on front columns only, none considered; half the instructions, a quarter less memory
};

// Columns of a filter beside the layout's own [front, dense], numbered from Layout::kColumns on.
enum class Beside : std::uint8_t {
  kNothing,
  kEta,    // the nonlinear parameters, after all others: kNonlinear columns
  kSlopes  // one a joint, after its front columns: d/dt of one of them
};

template <class Layout, Form form, Beside beside>
struct Order {
  static constexpr Form kForm = form;
  static constexpr Beside kBeside = beside;
  static constexpr int kJoints = Layout::kJoints;
  static constexpr int kMore = beside == Beside::kEta      ? Layout::kNonlinear
                               : beside == Beside::kSlopes ? Layout::kJoints
                                                           : 0;
  static constexpr int kSize = Layout::kColumns + kMore;

  struct Tables {
    std::uint8_t column[kSize] = {};      // at a position of the factor
    std::uint8_t position[kSize] = {};    // of a column
    std::uint8_t joint[kSize] = {};       // of the front column at a position; kJoints: a dense one
    std::uint8_t begin[kSize] = {};       // first stored row of the column at a position
    std::uint16_t start[kSize + 1] = {};  // where its elements [begin, position] are stored, D last
    std::uint8_t first[kJoints] = {};     // position of a joint's first front column, and of its row's first element
    std::uint8_t front_end[kJoints] = {};

    constexpr Tables() {
      int at = 0;
      for (int d = 0; d <= Layout::kDense; ++d) {
        for (int i = 0; i < kJoints; ++i)
          if (Layout::kRowBegin[i] == d) at = PlaceFront(i, at);
        if (d < Layout::kDense) at = Place(Layout::kFront + d, kJoints, at, 0);
      }
      if (beside == Beside::kEta)
        for (int e = 0; e < kMore; ++e) at = Place(Layout::kColumns + e, kJoints, at, 0);
      for (int p = 0; p < kSize; ++p) start[p + 1] = static_cast<std::uint16_t>(start[p] + p - begin[p] + 1);
    }

   private:
    constexpr int PlaceFront(int i, int at) {
      const int top = form == Form::kBlock ? at : 0;
      first[i] = static_cast<std::uint8_t>(at);
      for (int k = Layout::kFrontBegin[i]; k < Layout::kFrontBegin[i + 1]; ++k) at = Place(k, i, at, top);
      if (beside == Beside::kSlopes) at = Place(Layout::kColumns + i, i, at, top);
      front_end[i] = static_cast<std::uint8_t>(at);
      return at;
    }
    constexpr int Place(int k, int i, int at, int top) {
      column[at] = static_cast<std::uint8_t>(k);
      position[k] = static_cast<std::uint8_t>(at);
      joint[at] = static_cast<std::uint8_t>(i);
      begin[at] = static_cast<std::uint8_t>(top);
      return at + 1;
    }
  };
  static_assert(kSize < 128, "positions are stored in a byte");
  static constexpr Tables kAt{};
  static constexpr int kElements = kAt.start[kSize];

  // Where the rows of a column's elements are counted from: element (i, p) is at kOrigin + i.
  static constexpr int Origin(int p) { return kAt.start[p] - kAt.begin[p]; }
  static constexpr bool IsFront(int p) { return kAt.joint[p] != kJoints; }
  // In the block form the front column at p has nothing in the row of another joint.
  static constexpr bool Skips(int p, int row_joint) {
    return form == Form::kBlock && IsFront(p) && kAt.joint[p] != row_joint;
  }
};

}  // namespace armcal::filter
