// tests - the kernels compiled with contraction, for the comparison of bits to find; CMake adds the option.
#include "tests/target/bits/kernels.cpp"  // NOLINT: the same program
