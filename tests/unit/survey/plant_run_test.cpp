// survey tests - logs of the plant show what the robot file states.
#include "host_sim/study/survey/plant_run.hpp"

#include <gtest/gtest.h>

#include "host_sim/identify/choice/fit_model.hpp"
#include "host_sim/study/survey/platform.hpp"
#include "tests/unit/survey/survey_arm.hpp"

namespace armcal::survey {
namespace {

// Truth: the robot file, which the plant reads by itself. A quarter of a standard deviation is what a bias may take
// from the coverage of an interval: 95 % become 94.3 %.
TEST(PlantRun, WithoutNoise_AFitMissesTheFilesFrictionByLessThanAQuarterOfADeviation) {
  PlantSettings settings;
  settings.friction = settings.torque_constant = settings.noise = 0;
  settings.seconds = 20;
  const logs::Log log = RunPlant(test::File(), test::StudyNonlinear(), settings);
  const codegen::Model model(test::File(), test::AllRecords());
  const calibration::Dataset data = calibration::Prepare(model, log, {50});
  calibration::Problem problem = calibration::MakeProblem(model, {&data});
  problem.covariance.resize(0, 0);
  // Of a sample, the mean of eight readings with noise.
  for (int j = 0; j < 6; ++j) problem.sigma_Nm[j] = test::File().joint[j].torque_noise_Nm / std::sqrt(8.0);
  const calibration::Solution found = choice::SolveInRounds(problem);
  for (int j = 0; j < 6; ++j)
    for (const char* name : {"Fc", "Fv"}) {
      const int place = PlaceOf(model, name + std::to_string(j + 1));
      EXPECT_NEAR(found.z[place], test::File().joint[j].nominal.at(name),
                  0.25 * std::sqrt(found.covariance(place, place)))
          << name << j + 1;
    }
}

// The loss is made with KDL, and compared with the body columns of armcal's own regressor.
TEST(PlantRun, WithALossByLoad_HasThePayloadsTorqueTimesF1Added) {
  const codegen::Model model(test::File(), test::AllRecords());
  PlantSettings settings;
  settings.friction = settings.torque_constant = settings.noise = 0;
  settings.seconds = 4;
  settings.payload = plant::Body{8, {0.03, -0.02, 0.1}, {0.02, 0, 0, 0.02, 0, 0.02}};
  const calibration::Dataset without =
      calibration::Prepare(model, RunPlant(test::File(), test::StudyNonlinear(), settings), {50});
  settings.load_loss = Eigen::VectorXd::LinSpaced(6, 0.05, 0.1);
  const calibration::Dataset with =
      calibration::Prepare(model, RunPlant(test::File(), test::StudyNonlinear(), settings), {50});
  std::vector<Eigen::MatrixXd> column;
  model.BodyColumns(without.s, 5, column);
  Eigen::VectorXd body(10);
  body << 8, 0.03, -0.02, 0.1, 0.02, 0, 0, 0.02, 0, 0.02;
  const Eigen::VectorXd declared = calibration::ToOrigin(body);
  for (int j = 0; j < 6; ++j)
    for (int k = 0; k < with.samples(); ++k) {
      // A joint that turns jolts the others, and the filtered acceleration does not show a jolt.
      if (with.used.row(k).minCoeff() == 0) continue;
      const double load = column[static_cast<std::size_t>(j)].row(k).dot(declared);
      EXPECT_NEAR(with.tau(k, j) - without.tau(k, j), settings.load_loss[j] * load, 0.05) << j << " " << k;
    }
}

Settings SurveyOfTheFile() {
  Settings settings;
  settings.robot = test::File();
  settings.records = test::AllRecords();
  return settings;
}

Motions StudyMotions() {
  Motions motions;
  motions.linear.series = test::StudyLinear();
  motions.nonlinear.series = test::StudyNonlinear();
  motions.other = Validation(test::File(), test::AllRecords(), 5);
  return motions;
}

// Two programs that do not know each other: the plant moves by KDL's forward dynamics, the model's torque comes from
// armcal's regressor. Both take bodies and friction from the robot file.
TEST(SurveyTruth, OfThePlant_IsTheTorqueThatTheModelHasForTheSetParameters) {
  for (const Law law : {Law::kCoulombViscous, Law::kStribeck}) {
    const Stribeck set = DrawStribeck(6, 3);
    const auto truth = MakeTruth(SurveyOfTheFile(), StudyMotions(), law, set);
    const Eigen::MatrixXd exact = truth->tau_other - Torque(truth->model, truth->other, truth->z);
    EXPECT_GT(exact.rows(), 500);
    EXPECT_LT(exact.cwiseAbs().maxCoeff(), 1e-6) << LawName(law);
    // Through sensors and derivatives: far below the noise that is added later.
    const Eigen::MatrixXd read = truth->Judged(truth->train.tau - Torque(truth->model, truth->train.s, truth->z));
    EXPECT_GT(read.rows(), 500);
    EXPECT_LT(BaseError(read, truth->sigma_Nm), 0.1) << LawName(law);
  }
}

TEST(SurveyTruth, OfThePlant_LeavesOutRowsAtRest) {
  const auto truth = MakeTruth(SurveyOfTheFile(), StudyMotions(), Law::kCoulombViscous, SetStribeck(6));
  for (int j = 0; j < 6; ++j) {
    EXPECT_GT(truth->other.qd.col(j).cwiseAbs().minCoeff(), test::File().joint[j].v_min_radps);
    for (int k = 0; k < truth->train.samples(); ++k)
      if (truth->train.used(k, j)) {
        EXPECT_GT(std::abs(truth->train.s.qd(k, j)), test::File().joint[j].v_min_radps);
      }
  }
}

}  // namespace
}  // namespace armcal::survey
