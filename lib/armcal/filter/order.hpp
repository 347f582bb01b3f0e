// filter - in which order a factor holds the columns of a model, and at which row each column of it begins.
//
// A column's place in this order is its position. The front columns of a joint stand before the first dense column of
// the joint's row. Two things follow:
//   Row i of the regressor is zero before position first[i]. So it does not touch the factor's columns before that.
//   Front columns of two joints never meet in a row. So U between them stays zero, as long as process noise and
//   considered columns do not couple them. The block form does not store those zeros: there a front column begins at
//   the first front column of its joint, and a dense column begins at the top.
// In the block form, the front columns of a joint stand before the whole block of dense columns (kBlockColumns) that
// the joint's row begins in. So the columns of a block always stand side by side, for a few stored zeros.
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
// So many shared columns are processed together. Blocks are counted from the last of `count` columns; the columns
// before the first whole block are processed one by one. BlockBegin: the first column of the block that column j is in.
inline constexpr int kBlockColumns = 4;
constexpr int BlockBegin(int count, int j) {
  const int before = (kBlockColumns - (count - j) % kBlockColumns) % kBlockColumns;
  return j < before ? j : j - before;
}
// Which columns a row touches: front, and the shared columns from number `shared` on. In the dense form all columns are
// shared; in the block form those that are not front columns. `shared` begins a block, and the row may be zero at the
// first columns of it. first: the position of the row's first element.
struct RowPlace {
  std::uint8_t first, shared;
  Front front;
};
inline constexpr RowPlace kNoRow = {255, 255, {0, 0}};

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
  // The shared columns: how many there are, and their positions. They begin at the top.
  constexpr int Shared() const { return size; }
  constexpr int At(int shared) const { return shared; }
};
template <>
struct Shape<Form::kBlock> : AnyShape {
  const std::uint16_t* origin;
  const std::uint8_t* begin;

  static constexpr int kColumnCost = 8;
  constexpr int Origin(int p) const { return origin[p]; }
  constexpr int Begin(int p) const { return begin[p]; }
  constexpr int Shared() const { return states - fronts; }
  constexpr int At(int shared) const { return position[fronts + shared]; }
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
  static constexpr int kStates = Layout::kColumns + (beside == Beside::kEta ? Layout::kNonlinear : 0);
  static constexpr int kShared = form == Form::kDense ? kSize : kStates - Layout::kFront;

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
          if (FrontBefore(i) == d) at = PlaceFront(i, at);
        if (d < Layout::kDense) at = Place(Layout::kFront + d, at);
      }
      if (beside == Beside::kEta)
        for (int e = 0; e < kMore; ++e) at = Place(Layout::kColumns + e, at);
    }

   private:
    static constexpr int FrontBefore(int i) {  // number of the dense column
      return form == Form::kDense ? Layout::kRowBegin[i] : BlockBegin(kShared, Layout::kRowBegin[i]);
    }
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

    constexpr BlockTables() {
      for (int p = 0, elements = 3 * kSize; p < kSize; ++p) {
        for (int i = 0; i < kJoints; ++i)
          if (p >= kAt.first[i] && p < kAt.front_end[i]) begin[p] = kAt.first[i];
        origin[p] = static_cast<std::uint16_t>(elements - begin[p]);
        elements += p - begin[p] + 1;
      }
    }
  };
  static_assert(kSize < 128, "positions are stored in a byte");
  static constexpr Tables kAt{};

  static constexpr bool IsFront(int p) {
    return (kAt.column[p] < Layout::kFront) | (beside == Beside::kSlopes && kAt.column[p] >= Layout::kColumns);
  }
  static constexpr RowPlace PlaceOf(int joint) {  // of a joint's row
    const bool dense = form == Form::kDense;
    const std::uint8_t first = kAt.first[joint];
    const int shared = BlockBegin(kShared, dense ? first : Layout::kRowBegin[joint]);
    return {first, static_cast<std::uint8_t>(shared), dense ? Front{0, 0} : Front{first, kAt.front_end[joint]}};
  }
  static constexpr BlockTables kBlockAt{};

  static constexpr auto MakeShape() {
    constexpr AnyShape any = {kSize, Layout::kFront, Layout::kDense, kStates, kAt.position, kAt.column};
    if constexpr (form == Form::kDense) return Shape<form>{any};
    else return Shape<form>{any, kBlockAt.origin, kBlockAt.begin};
  }
  static constexpr Shape<form> kShape = MakeShape();
  static constexpr int kElements = kShape.Origin(kSize - 1) - 2 * kSize;
};

}  // namespace armcal::filter
