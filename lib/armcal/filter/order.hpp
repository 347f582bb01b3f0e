// filter - in which order a factor holds the columns of a model, and at which row each column of it begins.
//
// A column's place in this order is its position. The front columns of a joint stand just before the first dense column
// of the joint's row. Two things follow:
//   Row i of the regressor is zero before position first[i]. So it does not touch the factor's columns before that.
//   Front columns of two joints never meet in a row. So U between them stays zero, as long as process noise and
//   considered columns do not couple them. The block form does not store those zeros: there a front column begins at
//   the first front column of its joint, and a dense column begins at the top.
#pragma once

#include <cstdint>

namespace armcal::filter {

enum class Form : std::uint8_t {
  kDense,  // any column may have process noise or be considered
  kBlock   // process noise on front columns only, none considered; a third fewer instructions, a quarter less memory
};

// Which columns a filter has beside the layout's [front, dense]. They are numbered from Layout::kColumns on.
enum class Beside : std::uint8_t {
  kNothing,
  kEta,    // the nonlinear parameters, after all others: kNonlinear columns
  kSlopes  // one for each joint, after its front columns: the rate of change of one of them
};

// The front columns that a row touches in the block form: those of its joint. {0, 0}: none, or the dense form.
struct Front {
  std::uint8_t begin, end;  // positions
};

// The look-up tables of an order, without the type of its layout. With these, one copy of the code that works on a
// factor serves all filters of a form.
// size: number of positions. fronts, denses: number of front and of dense columns. states: number of columns that have
// a prior (front, dense and eta, but no slopes).
struct AnyShape {
  std::uint8_t size, fronts, denses, states;
  const std::uint8_t* position;  // by column: its position
  const std::uint8_t* column;    // by position: its column
};
template <Form form>
struct Shape;
template <>
struct Shape<Form::kDense> : AnyShape {
  static constexpr int kColumnCost = 6;  // of a column besides its elements (slices.hpp), as measured
  // Element (i, p) is number Origin(p) + i of a Factor. A column has elements from row Begin(p) on. (p, p) holds D.
  constexpr int Origin(int p) const { return 3 * size + p * (p + 1) / 2; }
  constexpr int Begin(int) const { return 0; }
  constexpr int Begin(int, Front) const { return 0; }
  // Above: the next position after p that a row touches; `size`: none. Below: the next one before p; -1: none.
  constexpr int Above(int p, Front) const { return p + 1; }
  constexpr int Below(int p, Front) const { return p - 1; }
};
template <>
struct Shape<Form::kBlock> : AnyShape {
  const std::uint16_t* origin;
  const std::uint8_t* begin;
  const std::uint8_t* above;  // by position: the next dense position after it; size: none
  const std::int8_t* below;   // before it; -1: none

  static constexpr int kColumnCost = 8;
  constexpr int Origin(int p) const { return origin[p]; }
  constexpr int Begin(int p) const { return begin[p]; }
  constexpr int Begin(int p, Front front) const { return p < front.end ? front.begin : 0; }  // if the row touches p
  constexpr int Above(int p, Front front) const { return p + 1 < front.end ? p + 1 : above[p]; }
  constexpr int Below(int p, Front front) const {
    const int own = (p < front.end ? p : front.end) - 1;
    return own > below[p] ? own : below[p];
  }
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

  // What every order has, and below what the block form needs besides.
  struct Tables {
    std::uint8_t position[kSize] = {};
    std::uint8_t column[kSize] = {};
    std::uint8_t first[kJoints] = {};  // position of a joint's first front column, and of its row's first element
    std::uint8_t front_end[kJoints] = {};

    constexpr Tables() {
      int at = 0;
      for (int d = 0; d <= Layout::kDense; ++d) {
        for (int i = 0; i < kJoints; ++i)
          if (Layout::kRowBegin[i] == d) at = PlaceFront(i, at);
        if (d < Layout::kDense) at = Place(Layout::kFront + d, at);
      }
      if (beside == Beside::kEta)
        for (int e = 0; e < kMore; ++e) at = Place(Layout::kColumns + e, at);
    }

   private:
    constexpr int PlaceFront(int i, int at) {
      first[i] = static_cast<std::uint8_t>(at);
      for (int k = Layout::kFrontBegin[i]; k < Layout::kFrontBegin[i + 1]; ++k) at = Place(k, at);
      if (beside == Beside::kSlopes) at = Place(Layout::kColumns + i, at);
      front_end[i] = static_cast<std::uint8_t>(at);
      return at;
    }
    constexpr int Place(int k, int at) {
      column[at] = static_cast<std::uint8_t>(k);
      position[k] = static_cast<std::uint8_t>(at);
      return at + 1;
    }
  };
  struct BlockTables {
    std::uint16_t origin[kSize] = {};
    std::uint8_t begin[kSize] = {};
    std::uint8_t above[kSize] = {};
    std::int8_t below[kSize] = {};

    constexpr BlockTables() {
      for (int p = 0, elements = 3 * kSize, last = -1; p < kSize; ++p) {
        for (int i = 0; i < kJoints; ++i)
          if (p >= kAt.first[i] && p < kAt.front_end[i]) begin[p] = kAt.first[i];
        origin[p] = static_cast<std::uint16_t>(elements - begin[p]);
        elements += p - begin[p] + 1;
        below[p] = static_cast<std::int8_t>(last);
        if (!IsFront(p)) last = p;
      }
      for (int p = kSize - 1, next = kSize; p >= 0; --p) {
        above[p] = static_cast<std::uint8_t>(next);
        if (!IsFront(p)) next = p;
      }
    }
  };
  static_assert(kSize < 128, "positions are stored in a byte");
  static constexpr Tables kAt{};

  static constexpr bool IsFront(int p) {
    return (kAt.column[p] < Layout::kFront) | (beside == Beside::kSlopes && kAt.column[p] >= Layout::kColumns);
  }
  static constexpr Front FrontOf(int joint) {  // kJoints: none
    if (form == Form::kDense || joint == kJoints) return {0, 0};
    return {kAt.first[joint], kAt.front_end[joint]};
  }
  static constexpr BlockTables kBlockAt{};

  static constexpr auto MakeShape() {
    constexpr int states = Layout::kColumns + (beside == Beside::kEta ? Layout::kNonlinear : 0);
    constexpr AnyShape any = {kSize, Layout::kFront, Layout::kDense, states, kAt.position, kAt.column};
    if constexpr (form == Form::kDense) return Shape<form>{any};
    else return Shape<form>{any, kBlockAt.origin, kBlockAt.begin, kBlockAt.above, kBlockAt.below};
  }
  static constexpr Shape<form> kShape = MakeShape();
  static constexpr int kElements = kShape.Origin(kSize - 1) - 2 * kSize;
};

}  // namespace armcal::filter
