// end-to-end tests - close the loop by a table alone, with a control run, and check the drive's estimate in double.
#include <algorithm>

#include "armcal/controller/trace_records.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "tests/e2e/demo_run.hpp"
#include "tests/unit/estimator/oracle.hpp"

namespace armcal::tests {
namespace {

using Model = generated::Er20Like;
using Sample = model::Sample<Model::kJoints>;

// The file of `armcal estimate --records`: the table in force, the drive's samples, and the drive's own estimate.
struct Records {
  estimator::Table<Model> table;
  std::vector<Sample> samples;
  std::vector<float> estimate, deviation;

  explicit Records(const fs::path& path) {
    const std::string bytes = ReadText(path);
    std::size_t at = 0;
    const auto take = [&](void* to, std::size_t size) {
      if (at + size > bytes.size()) throw std::runtime_error("records: too short");
      std::copy_n(bytes.data() + at, size, static_cast<char*>(to));
      at += size;
    };
    std::uint32_t head[3];  // samples, words of one, words of the table
    take(head, sizeof head);
    std::vector<std::uint16_t> table_words(head[2]), words(static_cast<std::size_t>(head[0]) * head[1]);
    std::vector<std::uint32_t> ticks(head[0]);
    take(table_words.data(), 2 * table_words.size());
    take(ticks.data(), 4 * ticks.size());
    take(words.data(), 2 * words.size());
    estimate.resize(Model::kColumns), deviation.resize(Model::kColumns);
    take(estimate.data(), 4 * estimate.size());
    take(deviation.data(), 4 * deviation.size());
    if (at != bytes.size()) throw std::runtime_error("records: too long");
    if (model::Decode(table_words.data(), Model::kSchema, table) != core::Status::kOk)
      throw std::runtime_error("records: a table that the firmware refuses");
    samples.resize(head[0]);
    float tau_model[Model::kJoints];
    for (std::size_t k = 0; k < samples.size(); ++k) {
      samples[k].tick = ticks[k];
      controller::ReadSampleRecord<Model::kJoints>(&words[k * head[1]], samples[k], tau_model);
    }
  }
};

// Worst distance of the drive's float32 estimate, in standard deviations, over what the data at least halved.
double WorstDistance(const Records& r, const std::vector<Sample>& samples) {
  auto host = std::make_unique<estimator::test::Host<Model, filter::ForgettingFilter<Model>>>();
  host->table = r.table;
  EXPECT_EQ(host->Adopt(), core::Status::kOk);
  const std::vector<double> lambda(host->adopted.prior.lambda, host->adopted.prior.lambda + Model::kColumns);
  const estimator::test::Oracle<Model> oracle(r.table, host->b0(), samples, lambda);
  const estimator::test::Matrix prior = estimator::test::PriorCovariance<Model>(r.table);
  double worst = 0;
  int determined = 0;
  for (const int k : oracle.active) {
    if (oracle.sd(k) >= 0.5 * std::sqrt(prior(k, k))) continue;
    ++determined;
    worst = std::max(worst, std::abs(static_cast<double>(r.estimate[k]) - oracle.x(k)) / oracle.sd(k));
    EXPECT_NEAR(r.deviation[k] / oracle.sd(k), 1, 0.05) << Model::kInfo[k].name << ", column " << k;
  }
  EXPECT_GT(determined, 20);
  std::printf("%d of %d parameters determined, worst distance %.4f standard deviations\n", determined,
              static_cast<int>(oracle.active.size()), worst);
  return worst;
}

TEST(TablePath, Asymmetry_IsFoundAndSwitchedOnByATable_AndTheDrivesEstimateIsTheDoubleBatch) {
  const fs::path folder = FreshFolder("asymmetry");
  const nlohmann::json result = RunDemo("asymmetry", folder);
  ASSERT_FALSE(result.is_null());
  ExpectSoundLoop(result, folder);
  ExpectFound(result, {"coulomb_asymmetry", "torque_offset"}, 4);
  EXPECT_TRUE(result.at("model").at("by_table").get<bool>());
  EXPECT_FALSE(fs::exists(folder / "generated"));  // nothing was rebuilt

  const Records records(folder / "estimate.bin");
  EXPECT_GT(records.samples.size(), 3000u);
  EXPECT_LT(WorstDistance(records, records.samples), 0.1);
  // the judge can see: one second withheld from it moves it away from the drive's estimate
  std::vector<Sample> fewer;
  for (std::size_t k = 0; k < records.samples.size(); ++k)
    if (k < 2000 || k >= 2125) fewer.push_back(records.samples[k]);
  auto host = std::make_unique<estimator::test::Host<Model, filter::ForgettingFilter<Model>>>();
  host->table = records.table;
  ASSERT_EQ(host->Adopt(), core::Status::kOk);
  const std::vector<double> lambda(host->adopted.prior.lambda, host->adopted.prior.lambda + Model::kColumns);
  EXPECT_GT(estimator::test::Oracle<Model>(records.table, host->b0(), fewer, lambda).Distance(records.estimate.data()),
            0.1);
}

TEST(TablePath, AnArmWithNothingUndeclared_GetsNoTerm) {
  const fs::path folder = FreshFolder("none");
  const nlohmann::json result = RunDemo("none", folder);
  ASSERT_FALSE(result.is_null());
  EXPECT_EQ(result.at("verdict"), "none");
  EXPECT_TRUE(result.at("terms").empty()) << result.at("terms");
  ExpectSoundLoop(result, folder);
  for (const double smallest : List(result, "smallest_detectable")) EXPECT_GT(smallest, 0);
}

}  // namespace
}  // namespace armcal::tests
