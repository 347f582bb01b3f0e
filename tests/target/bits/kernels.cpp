// tests - triangular kernels and body coordinates on random numbers.
#include "armcal/math/columns.hpp"
#include "armcal/math/symmetric.hpp"
#include "armcal/physical/body.hpp"
#include "port/runner/line.hpp"
#include "tests/target/numbers.hpp"

using namespace armcal;          // NOLINT: all of it is under test
using namespace armcal::target;  // NOLINT: the bench of these programs
using armcal::port::runner::Line;

namespace {

constexpr int n = 36, m = 40;
float w[n * m], ud[math::UdSize(n)], h[n], f[n];

void Fill(Numbers& numbers, float* x, int count) {
  for (int k = 0; k < count; ++k) x[k] = numbers.Signed();
}
void Print(const char* name, int round, const float* x, int count) {
  Digest digest;
  digest.Add(x, count);
  Line(name).Decimal(round).Hex(digest.value()).End();
}

// A covariance from its square root, then through every kernel that changes or reads it.
void Ud(Numbers& numbers, int round) {
  Fill(numbers, w, n * m);
  math::UdFromSquareRoot<n, m>(w, ud);
  Print("from_square_root", round, ud, math::UdSize(n));
  for (int k = 0; k < 5; ++k) {
    Fill(numbers, h, n);
    math::UdAdd<n>(ud, numbers.Between(0.0f, 0.1f), h);
    Print("add", round, ud, math::UdSize(n));
  }
  for (int k = 0; k < n; ++k) f[k] = 1.0f / (h[k] = numbers.Between(0.1f, 4.0f));
  math::UdScale<n>(ud, h, f);
  math::UdDiagonal<n>(ud, f);
  Print("scaled_diagonal", round, f, n);
  Fill(numbers, h, n);
  math::UdSolveUpper<n>(ud, h);
  Print("solve_upper", round, h, n);
}

// Three rows at a time into the first two stored rows of a triangle, element by element as they stand in a block.
void Givens(Numbers& numbers, int round) {
  constexpr int kRows = 3, kAfter = 33;
  const std::uint8_t begin[kRows] = {0, 0, 1};
  float d[2] = {1e-6f, 1e-6f}, stored[2 * kAfter + 1] = {}, block[(kAfter + 2) * kRows], rotation[4 * kRows];
  float weight[kRows];
  for (int k = 0; k < 50; ++k) {
    Fill(numbers, block, (kAfter + 2) * kRows);
    for (float& v : weight) v = 1.0f;
    math::GivensCorner<2, kRows>(d, stored, block, kAfter, begin, 0, kRows, weight, rotation);
    math::FoldBlock<kRows, 2, kRows>(block, stored, rotation, kAfter);
  }
  Print("givens_stored", round, stored, 2 * kAfter + 1);
  Print("givens_rest", round, block + 2 * kRows, kAfter * kRows);
  Print("givens_weights", round, weight, kRows);
  Print("givens_diagonal", round, d, 2);
}

void Bodies(Numbers& numbers, int round) {
  float central[10], body[10], jacobian[100];
  Fill(numbers, central, 10);
  physical::FromCentral(central, body);
  Print("body", round, body, 10);
  physical::ToCentral(body, central);
  Print("central", round, central, 10);
  physical::BodyJacobian(central[0], central + 1, jacobian);
  Print("body_jacobian", round, jacobian, 100);
  for (int k = 0; k < 10; ++k) central[k] = numbers.Between(k == 0 || k == 4 || k == 7 || k == 9 ? 0.2f : -0.1f, 0.3f);
  Line("physical").Decimal(physical::IsPhysical(central) ? 1 : 0).End();
}

}  // namespace

int Program() {
  Numbers numbers(17);
  for (int round = 0; round < 20; ++round) {
    Ud(numbers, round);
    Givens(numbers, round);
    Bodies(numbers, round);
  }
  return 0;
}
