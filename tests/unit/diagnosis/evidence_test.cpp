// diagnosis tests - read signals, rows and aligned logs, and compare them with logs whose samples are known.
#include <gtest/gtest.h>

#include "host_sim/diagnose/diagnosis/work.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::diagnosis {
namespace {

using calibration::Dataset;

codegen::Robot ArmOfTwoLinks() { return codegen::ReadRobot("codegen/robots/two_link.toml"); }

TEST(OwnSignal, OfTheOtherJoint_IsReadThere_InTheRowsOfItsOwn) {
  const Candidate ripple(tests::Records().at("cross_ripple"), ArmOfTwoLinks(), {0, 1});
  Dataset data;
  data.s.q.resize(4, 2), data.s.qd.resize(4, 2);
  data.s.q << 10, 20, 11, 21, 12, 22, 13, 23;
  data.s.qd = -data.s.q;
  Evidence evidence;
  evidence.logs.resize(1), evidence.logs[0].data = &data;
  evidence.index.resize(2);
  for (const int sample : {0, 2, 3}) evidence.index[0].dataset.push_back(0), evidence.index[0].sample.push_back(sample);
  EXPECT_EQ(OwnSignal(ripple, evidence, "q"), Eigen::Vector3d(10, 12, 13));
  EXPECT_EQ(OwnSignal(ripple, evidence, "q[k]"), Eigen::Vector3d(20, 22, 23));
  EXPECT_EQ(OwnSignal(ripple, evidence, "qd[k]"), Eigen::Vector3d(-20, -22, -23));
  EXPECT_EQ(OwnSignal(ripple, evidence, "abs(qd[k])"), Eigen::Vector3d(20, 22, 23));
}

// Noise does not hang together over a gap, nor from one log to the next.
TEST(TrainingRows, BehindAGapAndInAnotherLog_FollowNoRow) {
  tests::SyntheticArm arm(ArmOfTwoLinks(), 4);
  Dataset first = arm.Run(4, 40), second = arm.Run(2, 41);  // 500 and 250 samples
  first.used.setOnes(), second.used.setOnes();
  first.used.block(40, 0, 3, 1).setZero();
  first.used(100, 1) = 0;
  const Diagnosis::Work work(arm.model(), {}, {&first, &second});
  const std::vector<int> begins[] = {{0, 40, 497}, {0, 100, 499}};
  for (int j = 0; j < 2; ++j) {
    const RowIndex& rows = work.evidence.index[j];
    ASSERT_EQ(rows.size(), j == 0 ? 747 : 749);
    std::vector<int> found;
    for (int k = 0; k < rows.size(); ++k)
      if (rows.segment_begin[k]) found.push_back(k);
    EXPECT_EQ(found, begins[j]) << j;
  }
}

// One sample is 8 ms. Torque that is one sample late belongs to the motion of the sample before.
TEST(TrainingLog, IsShiftedByTheConfirmedDelayAlone) {
  tests::SyntheticArm arm(ArmOfTwoLinks(), 4);
  const Dataset log = arm.Run(4, 40);
  const codegen::Catalogue records{{"time_delay", tests::Records().at("time_delay")}};
  Diagnosis::Work work(arm.model(), records, {&log});
  Chosen confirmed, refuted;
  confirmed.candidate = refuted.candidate = work.candidates.at(0).get();
  confirmed.eta = refuted.eta = {0};
  confirmed.delay_s = 0.008, refuted.delay_s = 0.016, refuted.confirmed = false;
  work.chosen = {confirmed, refuted};
  work.AlignLogs();
  const int rest = log.samples() - 1;
  EXPECT_LT((work.train[0]->s.q.bottomRows(rest) - log.s.q.topRows(rest)).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_GT((work.train[0]->s.q - log.s.q).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_EQ(work.train[0]->tau, log.tau);
  work.chosen[0].confirmed = false;
  work.AlignLogs();
  EXPECT_EQ(work.train[0]->s.q, log.s.q);
}

// A log so short that no row is left out: thinned columns are those of all rows, whatever was kept before.
TEST(KeptColumns, FollowTheRowsAndTheEstimate) {
  tests::SyntheticArm arm(ArmOfTwoLinks(), 4);
  Dataset log = arm.Run(4, 40);
  const codegen::Catalogue records{{"viscous_cubic", tests::Records().at("viscous_cubic")},
                                   {"load_friction", tests::Records().at("load_friction")}};
  Diagnosis::Work work(arm.model(), records, {&log});
  work.Solve({});
  std::vector<std::vector<Eigen::MatrixXd>> seen;
  const auto look = [&] {
    work.FollowEstimate(work.all_reads);
    const Thinned thinned(work.evidence, 2500, work.kept_columns);
    seen.emplace_back();
    for (const auto& c : work.candidates) {
      seen.back().push_back(thinned.Gather(*c, {}).block[0]);
      EXPECT_EQ(seen.back().back(), GatherColumns(*c, work.evidence, {}).block[0]) << c->name();
    }
  };
  look();
  work.estimate.x *= 1.1;
  look();
  log.used.topRows(100).setZero();
  work.MakeTrain();
  look();
  EXPECT_NE(seen[1], seen[0]);
  EXPECT_LT(seen[2][0].rows(), seen[1][0].rows());
}

TEST(KeptColumns, ThatNobodyAsksFor_AreForgotten) {
  const Candidate cubic(tests::Records().at("viscous_cubic"), ArmOfTwoLinks(), {0});
  Columns columns;
  columns.block.emplace_back(Eigen::MatrixXd::Ones(3, 1));
  KeptColumns kept;
  kept.Keep(cubic, {1}, columns), kept.Keep(cubic, {2}, columns);
  kept.ForgetUnused();  // both are new
  ASSERT_NE(kept.Find(cubic, {2}), nullptr);
  kept.ForgetUnused();
  EXPECT_EQ(kept.Find(cubic, {1}), nullptr);
  ASSERT_NE(kept.Find(cubic, {2}), nullptr);
  EXPECT_EQ(kept.Find(cubic, {2})->block[0], columns.block[0]);
}

}  // namespace
}  // namespace armcal::diagnosis
