// filter - the bank: what it may not change, and which member it believes.
#include "armcal/filter/model_bank.hpp"

#include <gtest/gtest.h>

#include "tests/unit/filter/rows.hpp"

namespace armcal::filter {
namespace {
using namespace test;  // NOLINT: the bench of these tests

using SmallBank = ModelBank<Small>;

struct Bank : Bench {
  SmallBank filter;
  Bank() {
    size = 3;
    for (const int k : {1, 4}) prior.noise[k] = 1e-5f;  // columns of joint 0 and joint 2 that may change
    filter.Restart(prior);
  }
  void Sample(std::uint32_t moving = kAll) {
    int all = kNoSlices;
    for (int j = 0; j < Small::kJoints; ++j) {
      const Row row = Next(j);
      filter.BeginRow(j, row.front, row.dense, row.y, (moving >> j) & 1u);
      (void)filter.StepRow(all);
    }
    (void)filter.StepRows(all);
    filter.EndSample(moving);
  }
  std::vector<std::vector<unsigned char>> Kept() const {
    std::vector<std::vector<unsigned char>> all;
    for (int m = 0; m < SmallBank::kMembers; ++m) all.push_back(EstimateBytes(filter.estimate(m)));
    return all;
  }
};

TEST(ModelBank, WithoutChange_TheSlowestMemberWeighsMost_AndTheTruthLiesInside) {
  Bank bank;
  for (int s = 0; s < 1500; ++s) bank.Sample();
  const auto out = Read(bank.filter);
  double square = 0;
  for (int k = 0; k < Small::kColumns; ++k) square += std::pow((out.x[k] - bank.truth(k)) / out.sd[k], 2);
  EXPECT_LT(square / Small::kColumns, 2.2);  // 12 normal squares: mean 1, deviation 0.4, three of it
  for (const int joint : {0, 2}) EXPECT_GT(bank.filter.weight(joint, 0), bank.filter.weight(joint, 2));
}

TEST(ModelBank, AfterAStep_TheFastMemberTakesOver_OnThatJointAlone) {
  Bank bank;
  for (int s = 0; s < 1000; ++s) bank.Sample();
  bank.truth(4) += 1;  // a prior standard deviation at once
  double fast = 0, other = 0;
  for (int s = 0; s < 30; ++s) {
    bank.Sample();
    fast = std::max<double>(fast, bank.filter.weight(2, 2));
    other = std::max<double>(other, bank.filter.weight(0, 2));
  }
  EXPECT_GT(fast, 0.9);
  EXPECT_LT(other, 0.5);
  EXPECT_NEAR(bank.filter.x(4), bank.truth(4), 0.3);
}

TEST(ModelBank, Report_IsTheMixturesInnovation_OfUnitSpread) {
  Bank bank;
  double square = 0;
  for (int s = 0; s < 1000; ++s) {
    bank.Sample();
    for (int j = 0; j < Small::kJoints && s >= 100; ++j) {
      const UpdateReport& r = bank.filter.report(j);
      square += r.innovation * r.innovation / r.variance / (900 * Small::kJoints);
    }
  }
  EXPECT_NEAR(square, 1, 0.1);  // 2700 normal squares: deviation 0.027
}

TEST(ModelBank, RestOrRefusedRows_LeaveEveryBit) {
  Bank bank;
  for (int s = 0; s < 200; ++s) bank.Sample();
  const auto before = bank.Kept();
  const float weight = bank.filter.weight(0, 1);
  for (int s = 0; s < 1000; ++s) bank.Sample(0);
  Row row = bank.Next(2);
  row.dense[5] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(bank.filter.Update(2, row.front, row.dense, row.y, true).status, core::Status::kNotFinite);
  EXPECT_EQ(bank.Kept(), before);
  EXPECT_EQ(bank.filter.weight(0, 1), weight);
}

TEST(ModelBank, AnySlices_GiveTheSameBits) {
  Bank whole, sliced;
  for (int s = 0; s < 100; ++s) {
    whole.Sample();
    Row rows[Small::kJoints];
    for (int j = 0; j < Small::kJoints; ++j) rows[j] = sliced.Next(j);
    (void)TakeRows(sliced.filter, rows, 23);
    sliced.filter.BeginEnd(kAll);
    for (int credit = 0; (credit += 23, !sliced.filter.StepEnd(credit));) {
    }
  }
  EXPECT_EQ(whole.Kept(), sliced.Kept());
}

TEST(ModelBank, SaysWhatItCannotHold) {
  Bank bank;
  EXPECT_TRUE(SmallBank::Suits(bank.prior));
  bank.prior.noise[Small::kFront] = 1e-6f;
  EXPECT_FALSE(SmallBank::Suits(bank.prior));
}

}  // namespace
}  // namespace armcal::filter
