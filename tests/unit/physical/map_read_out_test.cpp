// physical - the read-out against dense algebra, the linear read-out and its stated objective.
#include "armcal/physical/map_read_out.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "codegen/generated/er20_like/model.hpp"
#include "tests/unit/estimator/two_link_model.hpp"
#include "tests/unit/physical/read_out_case.hpp"

namespace armcal::physical {
namespace {
using namespace test;  // NOLINT: the bench of these tests
using Six = generated::Er20Like;
using Two = armcal::test::TwoLink;

TEST(MapReadOut, WithoutData_IsThePriorCountedOnce) {
  const auto c = Draw<Six>(1, 0, 0);
  auto read_out = std::make_unique<ReadOut<Six>>();
  const auto& got = Solve(*read_out, *c);
  std::vector<double> mean(c->rigid->mean, c->rigid->mean + 66);
  EXPECT_LT(Distance(*c, got.body, mean.data()), 0.02);  // the barrier's pull: eps / 2 of order 1
  EXPECT_NEAR(got.learned, 0, 0.01);
  EXPECT_NEAR(got.moved, 0, 0.01);
  // Counted twice, the deviations would be smaller by sqrt(2).
  for (int k = 0; k < 66; ++k) EXPECT_NEAR(got.body_sd[k], c->rigid->sd[k], 1e-3 * c->rigid->sd[k]) << k;
  for (int k = 0; k < Six::kColumns; ++k)
    EXPECT_NEAR(got.column_sd[k], c->adopted->scale[k], 1e-2 * c->adopted->scale[k]) << k;
}

TEST(MapReadOut, NearAPriorThatIsNarrow_IsTheLinearReadOut) {
  Case<Six> c;
  for (int k = 0; k < 66; ++k) c.table.parameter[k].sd *= 1e-3f;  // so that nothing bends and no border is near
  ASSERT_EQ(c.Build(), core::Status::kOk);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  Matrix h = Matrix::Zero(100, Six::kColumns);
  for (int k = 0; k < Six::kColumns; ++k)
    for (int r = 0; r < h.rows(); ++r) h(r, k) = c.adopted->prior.active[k] ? normal(random) : 0;
  c.Take(h, Vector::NullaryExpr(h.rows(), [&] { return 10 * normal(random); }));
  auto read_out = std::make_unique<ReadOut<Six>>();
  const auto& got = Solve(*read_out, c);

  auto linear = std::make_unique<physical::RigidPrior<Six, double>>();
  std::copy(c.rigid->mean, c.rigid->mean + 66, linear->mean);
  std::copy(c.rigid->sd, c.rigid->sd + 66, linear->sd);
  physical::SpreadPrior(*linear);
  physical::FactorPrior(*linear);
  std::vector<double> base(Six::kRigid), expected(66);
  physical::MapBodies<Six>(linear->mean, base.data());
  for (int r = 0; r < Six::kRigid; ++r)
    base[r] += static_cast<double>(c.adopted->scale[Six::kFront + r]) * c.x[Six::kFront + r];
  physical::ReadBodies(*linear, base.data(), expected.data());
  EXPECT_LT(Distance(c, got.body, expected.data()), 0.01);
  // Columns, friction too, are then the filter's own.
  const Matrix p = Covariance(c.ud.data(), Six::kColumns);
  for (int k = 0; k < Six::kColumns; ++k) {
    const double scale = c.adopted->scale[k], sd = scale * std::sqrt(p(k, k));
    EXPECT_NEAR(got.column[k], c.adopted->committed.p[k] + scale * c.x[k], 0.01 * scale) << k;
    EXPECT_NEAR(got.column_sd[k], sd, 1e-2 * sd) << k;
  }
}

TEST(MapReadOut, OfATableWithABodyAtTheBorder_IsPhysical) {
  // Link 3 loses what keeps its largest moment below the sum of the others, as far as a table may.
  Case<Six> c;
  double central[10], body[10];
  for (int k = 0; k < 10; ++k) body[k] = c.table.parameter[22 + k].mean;
  ToCentral(body, central);
  const auto put = [&](double product) {
    central[5] = product;
    FromCentral(central, body);
    for (int k = 0; k < 10; ++k) body[k] = c.table.parameter[22 + k].mean = static_cast<float>(body[k]);
    return c.Build() == core::Status::kOk && IsPhysical(body);  // by the table's rounding, and without
  };
  double inside = central[5], outside = 0.5;
  ASSERT_TRUE(put(inside));
  ASSERT_FALSE(put(outside));
  for (int k = 0; k < 60; ++k) (put((inside + outside) / 2) ? inside : outside) = (inside + outside) / 2;
  ASSERT_TRUE(put(inside));
  TakeNoise(c, 3);
  auto read_out = std::make_unique<ReadOut<Six>>();
  const auto& got = Solve(*read_out, c);
  EXPECT_TRUE(PhysicalInATable<Six>(got.body));
  EXPECT_TRUE(got.converged);
}

TEST(MapReadOut, StartedWarm_EndsWhereAColdStartDoes) {
  const auto c = Draw<Six>(5, 0.2, 0.7), later = Draw<Six>(5, 0.3, 0.7);
  auto warm = std::make_unique<ReadOut<Six>>(), cold = std::make_unique<ReadOut<Six>>();
  Solve(*warm, *c);
  const auto& from_there = Solve(*warm, *later, true);
  const auto& from_the_prior = Solve(*cold, *later);
  EXPECT_LT(Distance(*c, from_there.body, from_the_prior.body), 1e-4);
  EXPECT_LT(from_there.steps, from_the_prior.steps);
}

TEST(MapReadOut, WithAnotherBetweenItsSlicesAndAFilterThatGoesOn_GivesTheSameBits) {
  const auto c = Draw<Six>(6, 0.2, 0.5), other = Draw<Six>(7, 0.2, 0.5);
  auto alone = std::make_unique<ReadOut<Six>>(), first = std::make_unique<ReadOut<Six>>(),
       second = std::make_unique<ReadOut<Six>>();
  const auto& expected = Solve(*alone, *c);
  ASSERT_EQ(c->HandOver(*first), core::Status::kOk);
  ASSERT_EQ(other->HandOver(*second), core::Status::kOk);
  std::fill(c->x.begin(), c->x.end(), 1e9f);
  std::fill(c->ud.begin(), c->ud.end(), 1e9f);
  bool done = false;
  while (!done) {
    done = first->Step();
    second->Step();
  }
  for (int k = 0; k < 66; ++k) EXPECT_EQ(first->result().body[k], expected.body[k]) << k;
  for (int k = 0; k < Six::kColumns; ++k) EXPECT_EQ(first->result().column_sd[k], expected.column_sd[k]) << k;
}

TEST(MapReadOut, FromAnotherFactorOfTheSameCovariance_IsTheSame) {
  const auto c = Draw<Six>(8, 0.2, 0.5);
  auto one = std::make_unique<ReadOut<Six>>(), two = std::make_unique<ReadOut<Six>>();
  const auto& expected = Solve(*one, *c);
  // Eigenvectors: columns in no order at all.
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(Covariance(c->ud.data(), Six::kColumns));
  ASSERT_EQ(two->Begin(c->prior(), c->x.data()), core::Status::kOk);
  for (int k = 0; k < Six::kColumns; ++k) {
    const Eigen::VectorXf column = eigen.eigenvectors().col(k).cast<float>();
    const double d = std::max(0.0, eigen.eigenvalues()(k));
    ASSERT_EQ(two->AddSpread(static_cast<float>(d), column.data()), core::Status::kOk);
  }
  while (!two->Step()) {
  }
  // Eigenvectors rounded to float: 1e-7 of the largest variance, in the smallest one's inverse.
  EXPECT_LT(Distance(*c, two->result().body, expected.body), 0.02);
  for (int k = 0; k < Six::kColumns; ++k)
    EXPECT_NEAR(two->result().column_sd[k], expected.column_sd[k], 0.01 * expected.column_sd[k]) << k;
}

// The objective as the header states it, in dense double algebra: all links' central coordinates, then the effects.
double Objective(const Case<Two>& c, const Vector& t) {
  constexpr int kDense = Two::kDense;
  Vector body(22), w(kDense), rigid(7);
  double cost = 0;
  for (int at = 0; at < 22; at += 11) {
    FromCentral(t.data() + at, body.data() + at);
    body(at + 10) = t(at + 10);
    const double* b = body.data() + at;
    Eigen::Matrix4d j;
    const double half = (b[4] + b[7] + b[9]) / 2;
    j << half - b[4], -b[5], -b[6], b[1], -b[5], half - b[7], -b[8], b[2], -b[6], -b[8], half - b[9], b[3], b[1], b[2],
        b[3], b[0];
    cost -= 0.005 * (std::log(j.determinant()) + std::log(t(at + 10)));
    double mean[11], central[11];
    std::copy(c.rigid->mean + at, c.rigid->mean + at + 11, mean);
    ToCentral(mean, central);
    central[10] = mean[10];
    for (int k = 0; k < 11; ++k) cost += 0.5 * std::pow((t(at + k) - central[k]) / c.rigid->sd[at + k], 2);
  }
  const Vector shift = body - Eigen::Map<const Eigen::VectorXf>(c.rigid->mean, 22).cast<double>();
  physical::MapBodies<Two>(shift.data(), rigid.data());
  for (int r = 0; r < 7; ++r) w(r) = rigid(r) / c.adopted->scale[Two::kFront + r];
  w(7) = t(22);
  const Matrix p = Covariance(c.ud.data(), Two::kColumns).bottomRightCorner(kDense, kDense);
  const Matrix p0 = Covariance(c.adopted->prior.dense_ud, 7);
  const Vector d = w - Eigen::Map<const Eigen::VectorXf>(c.x.data() + Two::kFront, kDense).cast<double>();
  return cost + 0.5 * d.dot(p.ldlt().solve(d)) - 0.5 * w.head(7).dot(p0.ldlt().solve(w.head(7)));
}

TEST(MapReadOut, WithAnEffectOfTheWholeArm_StandsWhereTheStatedObjectiveIsLeast) {
  auto c = std::make_unique<Case<Two>>();
  c->table.parameter[29].state = model::ParameterState::kEstimated;  // coupling friction
  ASSERT_EQ(c->Build(), core::Status::kOk);
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  Matrix h = Matrix::Zero(60, Two::kColumns);
  for (int k = 0; k < Two::kColumns; ++k)
    for (int r = 0; r < h.rows(); ++r) h(r, k) = c->adopted->prior.active[k] ? 0.5 * normal(random) : 0;
  c->Take(h, Vector::NullaryExpr(h.rows(), [&] { return 2 * normal(random); }));
  ReadOut<Two> read_out;
  const auto& got = Solve(read_out, *c);
  ASSERT_TRUE(got.converged);

  Vector t(23), size(23);
  for (int at = 0; at < 22; at += 11) {
    ToCentral(got.body + at, t.data() + at);
    t(at + 10) = got.body[at + 10];
    for (int k = 0; k < 11; ++k) size(at + k) = c->rigid->sd[at + k];
  }
  const int effect = Two::kFront + 7;
  t(22) = (got.column[effect] - c->adopted->committed.p[effect]) / c->adopted->scale[effect];
  size(22) = 1;
  for (int k = 0; k < 23; ++k) {
    const Vector step = 1e-3 * size(k) * Vector::Unit(23, k);
    const double slope = (Objective(*c, t + step) - Objective(*c, t - step)) / 2e-3;
    EXPECT_NEAR(slope, 0, 1e-3) << k;  // in chi^2 a prior standard deviation
  }
}

TEST(MapReadOut, HeldParameters_KeepTheTablesValues) {
  Case<Six> c;
  for (const int k : {0, 12, 26, 40, 54, 65}) c.table.parameter[k].state = model::ParameterState::kFixed;
  ASSERT_EQ(c.Build(), core::Status::kOk);
  TakeNoise(c, 9);
  auto read_out = std::make_unique<ReadOut<Six>>();
  const auto& got = Solve(*read_out, c);
  for (const int k : {0, 12, 26, 40, 54, 65}) {
    double mean[11], body[11];
    const int at = k / 11 * 11;
    std::copy(c.rigid->mean + at, c.rigid->mean + at + 11, mean);
    double expected[11], found[11];
    ToCentral(mean, expected), expected[10] = mean[10];
    std::copy(got.body + at, got.body + at + 11, body);
    ToCentral(body, found), found[10] = body[10];
    EXPECT_NEAR(found[k - at], expected[k - at], 1e-12 * std::abs(expected[k - at])) << k;
    EXPECT_EQ(got.body_sd[k], 0) << k;
  }
}

TEST(MapReadOut, RefusedInput_LeavesTheLastResult) {
  const auto c = Draw<Six>(2, 0.2, 0.5);
  auto read_out = std::make_unique<ReadOut<Six>>();
  const std::vector<double> before(Solve(*read_out, *c).body, read_out->result().body + 66);
  c->x[20] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(c->HandOver(*read_out), core::Status::kNotFinite);
  c->x[20] = 0;
  c->ud[math::UdIndex(30, 30)] = -1e-9f;
  EXPECT_EQ(c->HandOver(*read_out), core::Status::kNotFinite);
  c->ud[math::UdIndex(30, 30)] = 0.5f;
  const float rotor = c->rigid->mean[10];
  c->rigid->mean[10] = 0;  // and uncertain
  EXPECT_EQ(c->HandOver(*read_out), core::Status::kUnphysical);
  c->rigid->mean[10] = rotor;
  c->rigid->mean[0] = -1;
  EXPECT_EQ(c->HandOver(*read_out), core::Status::kUnphysical);
  EXPECT_TRUE(read_out->Step());
  EXPECT_TRUE(std::equal(before.begin(), before.end(), read_out->result().body));
}

}  // namespace
}  // namespace armcal::physical
