// survey tests - logs of the plant show the friction that the robot file states.
#include "host_sim/study/survey/plant_run.hpp"

#include <gtest/gtest.h>

#include "host_sim/identify/choice/fit_model.hpp"
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

}  // namespace
}  // namespace armcal::survey
