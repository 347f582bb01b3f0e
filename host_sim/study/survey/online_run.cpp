// survey - runs the estimators that are compiled for the robot and for the arm of (4).
#include "host_sim/study/survey/online_run.hpp"

#include <chrono>
#include <cmath>
#include <memory>
#include <stribeck_arm/model.hpp>

#include "armcal/estimator/physical_read_out.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "codegen/src/generator/emit.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/table_file.hpp"

namespace armcal::survey {

using Eigen::VectorXd;

std::string Name(OnlineFilter filter) {
  constexpr const char* kName[] = {"forgetting", "Kalman", "extended Kalman"};
  return kName[static_cast<int>(filter)];
}

bool Moves(double speed_radps, const codegen::Joint& joint) { return std::abs(speed_radps) > joint.v_min_radps; }

namespace {

// Wide standard deviations, relative to the mean, for what CAD gives badly. They belong to Fs / Fc uniform in 1.1
// .. 1.5 about 1.25, and to the logarithm of a speed that is log-uniform in 0.05 .. 0.2 rad/s.
constexpr double kToldBreakaway = 0.46, kToldSpeed = 0.4;

template <class Arm>
estimator::Table<Arm> TableOf(const codegen::Model& prior, const VectorXd& sigma_Nm) {
  calibration::TableFile file = calibration::DefaultTable(prior);
  for (int j = 0; j < Arm::kJoints; ++j) file.joint[j].sigma_Nm = sigma_Nm[j];
  for (calibration::TableRow& row : file.row) {
    if (row.name.starts_with("stribeck.dFs")) row.sd = kToldBreakaway * row.mean;
    if (row.name.starts_with("stribeck.vs")) row.sd = kToldSpeed * row.mean, row.state = "estimated";
  }
  estimator::Table<Arm> table;
  if (file.schema != Arm::kSchema ||
      !core::IsOk(model::Decode(calibration::EncodeTable(file).data(), Arm::kSchema, table)))
    throw io::InputError(prior.robot().path + ": not the arm for which the estimator is compiled");
  return table;
}

template <class Arm>
model::Sample<Arm::kJoints> SampleOf(const calibration::Dataset& log, const codegen::Robot& robot, int k) {
  model::Sample<Arm::kJoints> s;
  s.tick = static_cast<std::uint32_t>(k * Arm::kSampleTicks);
  for (int j = 0; j < Arm::kJoints; ++j) {
    s.q[j] = static_cast<float>(log.s.q(k, j));
    s.qd[j] = static_cast<float>(log.s.qd(k, j));
    s.qdd[j] = static_cast<float>(log.s.qdd(k, j));
    s.tau[j] = static_cast<float>(log.tau(k, j));
    s.flags[j] =
        log.used(k, j) && Moves(log.s.qd(k, j), robot.joint[j]) ? model::kValid | model::kMoving : model::kValid;
  }
  return s;
}

template <class Arm, class Filter>
OnlineResult Run(const codegen::Model& prior, const calibration::Dataset& log, const VectorXd& sigma_Nm) {
  struct Drive {
    physical::RigidPrior<Arm, float> rigid;
    estimator::AdoptedTable<Arm> adopted;
    estimator::Estimator<Arm, Filter> estimator;
    estimator::Estimates<Arm> estimates;
    physical::MapReadOut<Arm, double> read_out;
  };
  const auto began = std::chrono::steady_clock::now();
  const auto drive = std::make_unique<Drive>();
  const core::Status built =
      estimator::BuildAdoptedTable(TableOf<Arm>(prior, sigma_Nm), 1, drive->rigid, drive->adopted);
  if (!core::IsOk(built)) throw io::InputError(prior.robot().path + ": expected bodies that can exist");
  auto& arm = drive->estimator;
  arm.SetPublishEvery(1u << 30);
  arm.Adopt(drive->adopted, 0);
  const auto work = [&] {
    while (arm.Step()) {
    }
  };
  for (int k = 0; k < log.samples(); ++k) {
    (void)arm.PushSample(SampleOf<Arm>(log, prior.robot(), k));
    work();
  }
  arm.RequestReadOut();
  work();
  arm.Take(drive->estimates);

  OnlineResult out;
  out.inconsistent = drive->estimates.inconsistent;
  out.filter = Eigen::Map<const Eigen::VectorXf>(drive->estimates.value, Arm::kColumns).cast<double>();
  out.filter_sd = Eigen::Map<const Eigen::VectorXf>(drive->estimates.sd, Arm::kColumns).cast<double>();
  const core::Status begun = estimator::HandOverPhysical(drive->adopted, drive->rigid, arm, false, drive->read_out);
  while (core::IsOk(begun) && !drive->read_out.Step()) {
  }
  out.inconsistent |= estimator::PriorIsTooNarrow(drive->read_out);
  const auto& found = drive->read_out.result();
  calibration::Solution& s = out.solution;
  s.converged = core::IsOk(begun) && found.converged;
  s.bodies = Eigen::Map<const VectorXd>(found.body, Arm::kBodyParameters);
  // Nonlinear parameters come from the filter, since the read-out has linear ones only.
  VectorXd sd(Arm::kColumns + Arm::kNonlinear);
  s.z.resize(sd.size());
  s.z.head(Arm::kColumns) = Eigen::Map<const VectorXd>(found.column, Arm::kColumns);
  sd.head(Arm::kColumns) = Eigen::Map<const VectorXd>(found.column_sd, Arm::kColumns);
  for (int e = 0; e < Arm::kNonlinear; ++e) {
    s.z[Arm::kColumns + e] = static_cast<double>(drive->estimates.eta[e]);
    sd[Arm::kColumns + e] = static_cast<double>(drive->estimates.eta_sd[e]);
  }
  s.covariance = sd.cwiseAbs2().asDiagonal();
  s.iterations = found.steps;
  s.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  s.memory_bytes = sizeof(Drive);
  return out;
}

}  // namespace

bool CompiledFor(const codegen::Model& model, OnlineFilter filter) {
  const bool stribeck = filter == OnlineFilter::kExtended;
  return codegen::Schema(model) == (stribeck ? generated::StribeckArm::kSchema : generated::Er20Like::kSchema);
}

OnlineResult RunOnTarget(const codegen::Model& prior, const calibration::Dataset& log, const VectorXd& sigma_Nm,
                         OnlineFilter filter) {
  using generated::Er20Like;
  using generated::StribeckArm;
  switch (filter) {
    case OnlineFilter::kForgetting:
      return Run<Er20Like, filter::ForgettingFilter<Er20Like>>(prior, log, sigma_Nm);
    case OnlineFilter::kKalman:
      return Run<Er20Like, filter::KalmanFilter<Er20Like>>(prior, log, sigma_Nm);
    case OnlineFilter::kExtended:
      break;
  }
  return Run<StribeckArm, filter::ExtendedKalmanFilter<StribeckArm>>(prior, log, sigma_Nm);
}

}  // namespace armcal::survey
