// consumer - a user's program with a generated model of the user's own robot file: the arm held out level, by hand.
// It also calls code of the library's sources, and uses a model that armcal brings.
#ifdef WITH_EIGEN
#include <armcal/eigen.hpp>
#endif

#include <armcal/armcal.hpp>
#include <armcal/core/version.hpp>
#include <er20_like/model.hpp>
#include <users_arm/model.hpp>

#if ARMCAL_VERSION < 0x000100
#error "expected a version of armcal"
#endif

using Arm = armcal::generated::UsersArm;

int main() {
  float base[Arm::kRigid] = {};
  for (int b = 0; b < Arm::kRigid; ++b)
    for (int k = Arm::kMapBegin[b]; k < Arm::kMapBegin[b + 1]; ++k)
      base[b] += Arm::kMapValue[k] * Arm::kInfo[Arm::kMapColumn[k]].mean;
  armcal::model::ModelInput<float, Arm::kJoints> x = {};
  float front[Arm::kFront] = {}, dense[Arm::kJoints * Arm::kDense] = {}, torque_Nm[Arm::kJoints] = {};
  Arm::Regressor<float>(x, nullptr, nullptr, nullptr, nullptr, front, dense);
  for (int i = 0; i < Arm::kJoints; ++i)
    for (int b = 0; b < Arm::kRigid; ++b) torque_Nm[i] += dense[i * Arm::kDense + b] * base[b];
  // 3 kg at 0.2 m and 2 kg at 0.5 + 0.2 m; the second joint carries 2 kg at 0.2 m.
  const float expected_Nm[] = {9.81f * (3 * 0.2f + 2 * 0.7f), 9.81f * 2 * 0.2f};
  bool right = true;
  for (int i = 0; i < Arm::kJoints; ++i)
    right = right && armcal::math::Abs(torque_Nm[i] - expected_Nm[i]) < 1e-4f;  // a few roundings of 20 N m in float
  // "read holding register 0 of device 1"; 84 0A is the known checksum of this request.
  const unsigned char request[] = {0x01, 0x03, 0x00, 0x00, 0x00, 0x01, 0x84, 0x0A};
  armcal::link::RtuFramer framer(1, 2);
  std::size_t used = 0;
  right = right && framer.OnBytes(request, sizeof request, 0, used) == armcal::link::RtuFramer::Result::kRequest;
  right = right && used == sizeof request && armcal::generated::Er20Like::kJoints == 6;
#ifdef WITH_EIGEN
  right = right && Eigen::Vector2f(expected_Nm).norm() > 0;
#endif
  return right ? 0 : 1;
}
