// client - unpacks trace records; knows no connection and no plant.
#include "host_sim/client/trace_log.hpp"

#include <Eigen/LU>
#include <numbers>

#include "armcal/controller/trace_records.hpp"

namespace armcal::client {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Joint quantities from averaged motor counts and current, by the robot file's nominal constants.
struct AxisScale {
  MatrixXd to_joint, torque_to_joint;
  VectorXd counts_to_rad, lsb_to_Nm, zero;
  explicit AxisScale(const codegen::Robot& r) : counts_to_rad(r.joints()), lsb_to_Nm(r.joints()), zero(r.joints()) {
    const int n = r.joints();
    MatrixXd C = MatrixXd::Identity(n, n);
    for (std::size_t k = 0; k < r.coupling.size(); ++k)
      C(static_cast<int>(k) / n, static_cast<int>(k) % n) = r.coupling[k];
    to_joint = C.inverse();
    torque_to_joint = C.transpose();
    for (int j = 0; j < n; ++j) {
      const auto& m = r.joint[j].motor;
      counts_to_rad[j] = 2 * std::numbers::pi / (m.counts_per_turn * m.gear_ratio);
      lsb_to_Nm[j] = m.current_A_per_lsb * m.torque_constant_NmpA * m.gear_ratio;
      zero[j] = m.zero_counts;
    }
  }
};

// A window of `ticks` ticks from `first` on lies whole in the played part; ticks wrap.
bool Inside(std::uint32_t first, std::uint32_t ticks, const PlayedTicks& played) {
  return first - played.first < 0x80000000u && played.last - (first + ticks - 1) < 0x80000000u;
}

}  // namespace

logs::Log RawLog(const TraceRecords& r, const codegen::Robot& robot, const PlayedTicks& played,
                 std::uint32_t& first_tick) {
  const int n = robot.joints();
  const AxisScale scale(robot);
  std::vector<std::size_t> inside;
  for (std::size_t k = 0; k < r.count(); ++k)
    if (Inside(r.ticks[k], r.tick_step, played)) inside.push_back(k);
  if (inside.size() < logs::kMinSamples)
    throw LinkError("trace: " + std::to_string(inside.size()) + " records of the trajectory, expected at least " +
                    std::to_string(logs::kMinSamples));
  first_tick = r.ticks[inside[0]];
  logs::Log log;
  const auto N = static_cast<Eigen::Index>(inside.size());
  log.joints = n;
  log.source = "trace";
  log.t.resize(N);
  const bool warm = r.channels & controller::kRawTemperature, told = r.channels & controller::kRawSetPoint;
  for (MatrixXd* m : {&log.q, &log.tau}) m->resize(N, n);
  if (warm) log.temp.resize(N, n);
  if (told) log.qref.resize(N, n), log.tauff.resize(N, n);
  log.flags.resize(N, n);
  VectorXd motor(n), current(n);
  for (Eigen::Index i = 0; i < N; ++i) {
    const std::uint16_t* w = &r.words[inside[i] * r.record_words];
    log.t[i] = static_cast<double>(r.ticks[inside[i]] - first_tick) / robot.tick_rate_Hz;
    for (int j = 0; j < n; ++j) {
      // 1/16 counts wrap at 2^32: signed, they reach +- 2^27 counts about zero, far beyond any joint's range
      motor[j] = scale.counts_to_rad[j] * (static_cast<std::int32_t>(core::GetU32(w)) / 16.0 - scale.zero[j]);
      current[j] = scale.lsb_to_Nm[j] * static_cast<std::int32_t>(core::GetU32(w + 2)) / 16.0;
      w += 4;
      if (warm) log.temp(i, j) = core::GetF32(w), w += 2;
      log.flags(i, j) = *w++;
      if (told) log.qref(i, j) = core::GetF32(w), log.tauff(i, j) = core::GetF32(w + 2), w += 4;
    }
    log.q.row(i) = scale.to_joint * motor;
    log.tau.row(i) = scale.torque_to_joint * current;
  }
  return log;
}

logs::Log SampleLog(const TraceRecords& r, const codegen::Robot& robot, const PlayedTicks& played, bool all) {
  const int n = robot.joints();
  logs::Log log;
  log.joints = n;
  std::vector<std::size_t> inside;
  for (std::size_t k = 0; k < r.count(); ++k)
    if (all || Inside(r.ticks[k], robot.sample_ticks, played)) inside.push_back(k);
  const auto N = static_cast<Eigen::Index>(inside.size());
  log.t.resize(N);
  for (MatrixXd* m : {&log.q, &log.qd, &log.qdd, &log.tau, &log.temp, &log.tauff}) m->resize(N, n);
  log.flags.resize(N, n);
  for (Eigen::Index i = 0; i < N; ++i) {
    log.t[i] = static_cast<double>(r.ticks[inside[i]]) / robot.tick_rate_Hz;
    const std::uint16_t* w = &r.words[inside[i] * r.record_words];
    for (int j = 0; j < n; ++j, w += controller::kSampleWordsPerJoint) {
      log.q(i, j) = core::GetF32(w), log.qd(i, j) = core::GetF32(w + 2), log.qdd(i, j) = core::GetF32(w + 4);
      log.tau(i, j) = core::GetF32(w + 6), log.temp(i, j) = core::GetF32(w + 8);
      log.flags(i, j) = w[10];
      log.tauff(i, j) = core::GetF32(w + 11);
    }
  }
  return log;
}

}  // namespace armcal::client
