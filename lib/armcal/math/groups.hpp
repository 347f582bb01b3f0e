// math - moves floats that lie side by side between memory and registers.
//
// A Cortex-M4F moves several of them with one instruction (VLDM, VSTM). Compilers use single loads and stores for the
// elements of arrays, so the instruction stands here. Its registers must have consecutive numbers. So a group has a
// place: the number of its first register. Groups that are in use at the same time should have places that do not
// overlap, or the compiler has to copy. Everything between a load and a store is the compiler's work.
// A Cortex-M7 executes a single load together with an FPU instruction, so it is faster without groups. Context: any.
#pragma once

#include <type_traits>
#include <utility>

// Inlined even at -Os, which would otherwise call a loop's body four times.
#define ARMCAL_INLINE __attribute__((always_inline))

// An FPU of version 4 with single precision only. Version 5 has instructions for the smaller and the larger number.
#if defined(__GNUC__) && !defined(__clang__) && defined(__ARM_FP) && !defined(__ARM_FEATURE_NUMERIC_MAXMIN)
#define ARMCAL_MOVES_GROUPS (__ARM_FP == 4)
#else
#define ARMCAL_MOVES_GROUPS 0
#endif

namespace armcal::math {

inline constexpr bool kMovesGroups = ARMCAL_MOVES_GROUPS;

namespace internal {

// Calls f for 0 .. count - 1, each a constant. Unrolled by hand: at -O2 a compiler keeps such loops and their arrays.
template <class F, int... k>
ARMCAL_INLINE inline void EachOf([[maybe_unused]] F f, std::integer_sequence<int, k...>) {
  (f(std::integral_constant<int, k>{}), ...);
}
template <int count, class F>
ARMCAL_INLINE inline void Each(F f) {
  EachOf(f, std::make_integer_sequence<int, count>{});
}

// A group of `count` numbers. Store returns the address after the last one. Where no instruction moves the group: one
// number after the other, and the place means nothing.
template <int count, int place>
struct Group {
  template <class T>
  ARMCAL_INLINE static void Load(const T* from, T* to) {
    Each<count>([&](auto k) ARMCAL_INLINE { to[k] = from[k]; });
  }
  template <class T>
  ARMCAL_INLINE static T* Store(const T* from, T* to) {
    Each<count>([&](auto k) ARMCAL_INLINE { to[k] = from[k]; });
    return to + count;
  }
};

#if ARMCAL_MOVES_GROUPS
// What the instruction reads or writes, so that the compiler keeps the order of accesses.
template <int count, class T>
ARMCAL_INLINE inline T (&Memory(T* at))[count] {
  return *reinterpret_cast<T(*)[count]>(at);
}
// clang-format off
#define ARMCAL_GROUP_1(a)                                                                                      \
  template <> struct Group<1, a> {                                                                             \
    ARMCAL_INLINE static void Load(const float* from, float* to) { to[0] = from[0]; }                          \
    ARMCAL_INLINE static float* Store(const float* from, float* to) {                                          \
      register float r0 __asm("s" #a) = from[0];                                                               \
      __asm("vstmia %1!, {s" #a "}" : "=m"(*to), "+r"(to) : "t"(r0));                                          \
      return to;                                                                                               \
    }                                                                                                          \
  }
#define ARMCAL_GROUP_2(a, b)                                                                                   \
  template <> struct Group<2, a> {                                                                             \
    ARMCAL_INLINE static void Load(const float* from, float* to) {                                             \
      register float r0 __asm("s" #a), r1 __asm("s" #b);                                                       \
      __asm("vldmia %2, {s" #a "-s" #b "}" : "=t"(r0), "=t"(r1) : "r"(from), "m"(Memory<2>(from)));            \
      to[0] = r0, to[1] = r1;                                                                                  \
    }                                                                                                          \
    ARMCAL_INLINE static float* Store(const float* from, float* to) {                                          \
      register float r0 __asm("s" #a) = from[0], r1 __asm("s" #b) = from[1];                                   \
      __asm("vstmia %1!, {s" #a "-s" #b "}" : "=m"(Memory<2>(to)), "+r"(to) : "t"(r0), "t"(r1));               \
      return to;                                                                                               \
    }                                                                                                          \
  }
#define ARMCAL_GROUP_3(a, b, c)                                                                                \
  template <> struct Group<3, a> {                                                                             \
    ARMCAL_INLINE static void Load(const float* from, float* to) {                                             \
      register float r0 __asm("s" #a), r1 __asm("s" #b), r2 __asm("s" #c);                                     \
      __asm("vldmia %3, {s" #a "-s" #c "}"                                                                     \
            : "=t"(r0), "=t"(r1), "=t"(r2) : "r"(from), "m"(Memory<3>(from)));                                 \
      to[0] = r0, to[1] = r1, to[2] = r2;                                                                      \
    }                                                                                                          \
    ARMCAL_INLINE static float* Store(const float* from, float* to) {                                          \
      register float r0 __asm("s" #a) = from[0], r1 __asm("s" #b) = from[1], r2 __asm("s" #c) = from[2];       \
      __asm("vstmia %1!, {s" #a "-s" #c "}" : "=m"(Memory<3>(to)), "+r"(to) : "t"(r0), "t"(r1), "t"(r2));      \
      return to;                                                                                               \
    }                                                                                                          \
  }
#define ARMCAL_GROUP_4(a, b, c, d)                                                                             \
  template <> struct Group<4, a> {                                                                             \
    ARMCAL_INLINE static void Load(const float* from, float* to) {                                             \
      register float r0 __asm("s" #a), r1 __asm("s" #b), r2 __asm("s" #c), r3 __asm("s" #d);                   \
      __asm("vldmia %4, {s" #a "-s" #d "}"                                                                     \
            : "=t"(r0), "=t"(r1), "=t"(r2), "=t"(r3) : "r"(from), "m"(Memory<4>(from)));                       \
      to[0] = r0, to[1] = r1, to[2] = r2, to[3] = r3;                                                          \
    }                                                                                                          \
    ARMCAL_INLINE static float* Store(const float* from, float* to) {                                          \
      register float r0 __asm("s" #a) = from[0], r1 __asm("s" #b) = from[1];                                   \
      register float r2 __asm("s" #c) = from[2], r3 __asm("s" #d) = from[3];                                   \
      __asm("vstmia %1!, {s" #a "-s" #d "}"                                                                    \
            : "=m"(Memory<4>(to)), "+r"(to) : "t"(r0), "t"(r1), "t"(r2), "t"(r3));                             \
      return to;                                                                                               \
    }                                                                                                          \
  }
ARMCAL_GROUP_1(24); ARMCAL_GROUP_1(25); ARMCAL_GROUP_1(26); ARMCAL_GROUP_1(27);
ARMCAL_GROUP_2(16, 17); ARMCAL_GROUP_2(18, 19); ARMCAL_GROUP_2(20, 21);
ARMCAL_GROUP_2(24, 25); ARMCAL_GROUP_2(26, 27); ARMCAL_GROUP_2(28, 29); ARMCAL_GROUP_2(30, 31);
ARMCAL_GROUP_3(16, 17, 18); ARMCAL_GROUP_3(19, 20, 21);
ARMCAL_GROUP_4(0, 1, 2, 3); ARMCAL_GROUP_4(4, 5, 6, 7); ARMCAL_GROUP_4(8, 9, 10, 11); ARMCAL_GROUP_4(12, 13, 14, 15);
ARMCAL_GROUP_4(16, 17, 18, 19); ARMCAL_GROUP_4(20, 21, 22, 23); ARMCAL_GROUP_4(24, 25, 26, 27); ARMCAL_GROUP_4(28, 29, 30, 31);
// clang-format on
#undef ARMCAL_GROUP_1
#undef ARMCAL_GROUP_2
#undef ARMCAL_GROUP_3
#undef ARMCAL_GROUP_4
#endif

// Any number of floats, as groups of four and one of what remains.
template <int count, int place, class T>
ARMCAL_INLINE inline void Load(const T* from, T* to) {
  if constexpr (count > 4) {
    Group<4, place>::Load(from, to);
    Load<count - 4, place + 4>(from + 4, to + 4);
  } else {
    Group<count, place>::Load(from, to);
  }
}
template <int count, int place, class T>
ARMCAL_INLINE inline T* Store(const T* from, T* to) {
  if constexpr (count > 4) return Store<count - 4, place + 4>(from + 4, Group<4, place>::Store(from, to));
  else return Group<count, place>::Store(from, to);
}

}  // namespace internal
}  // namespace armcal::math
