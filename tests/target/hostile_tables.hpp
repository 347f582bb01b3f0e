// tests - random tables of the example arm, half of them close to a bound, and the drive's judgement of a table. Both
// are the same on every machine.
#pragma once

#include <limits>

#include "armcal/estimator/adopted_table.hpp"
#include "armcal/model/ceilings.hpp"
#include "armcal/model/friction_grid.hpp"
#include "armcal/model/parameters.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "tests/target/numbers.hpp"

namespace armcal::target {

// What Controller does with a table at the command check; a test of the room controller compares the two.
template <class Model>
class Judge {
 public:
  core::Refusal operator()(const std::uint16_t* words) {
    core::Refusal r = model::CheckWords(model::View(Model::kCeilings), true, words);
    if (core::IsOk(r.status)) r.status = model::Decode(words, Model::kSchema, table_);
    if (core::IsOk(r.status)) r.status = estimator::BuildAdoptedTable(table_, 1, rigid_, adopted_);
    if (core::IsOk(r.status))
      r = model::CheckFriction(adopted_.committed, model::View(Model::kCeilings), memory_, rows_);
    return r;
  }
  const model::Committed<Model>& committed() const { return adopted_.committed; }

 private:
  estimator::Table<Model> table_;
  physical::RigidPrior<Model, float> rigid_;
  estimator::AdoptedTable<Model> adopted_;
  model::Memory<Model> memory_;
  model::Rows<Model> rows_;
};

class HostileTables {
 public:
  using Model = generated::Er20Like;
  static constexpr int n = Model::kJoints, kParameters = Model::kParameters;
  static constexpr int kWords = static_cast<int>(estimator::Table<Model>::kWords);

  // The first word of a number.
  static constexpr int JointWord(int joint, int part) { return model::kHeaderWords + 8 * joint + 2 * part; }
  static constexpr int ParameterWord(int k, int part) { return model::kHeaderWords + 8 * n + 8 * k + 2 * part; }

  HostileTables() { model::Encode(estimator::DefaultTable<Model>(), usual_); }

  // [kWords], valid until the next.
  const std::uint16_t* Next() {
    for (int k = 0; k < kWords; ++k) words_[k] = usual_[k];
    const bool near = numbers_.Below(2) == 0;
    const int changes = 1 + numbers_.Below(3);
    for (int k = 0; k < changes; ++k) near ? Near() : Far();
    if (numbers_.Below(2) == 0) {
      words_[5] = 1;
      core::PutU32(&words_[6], static_cast<std::uint32_t>(Around(500.0f)));
    }
    return words_;
  }

 private:
  // Within 1 % of the bound.
  float Around(float bound) { return bound * numbers_.Between(0.99f, 1.01f); }
  void Put(int word, float value) { core::PutF32(&words_[word], value); }

  void Near() {
    const model::Ceilings<n, kParameters>& c = Model::kCeilings;
    if (numbers_.Below(2) == 0) {
      const int j = numbers_.Below(n), part = numbers_.Below(4);
      const model::JointCeiling& joint = c.joint[j];
      const float low[] = {joint.sigma_low_Nm, joint.v_min_low_radps, joint.torque_Nm, joint.scale_low};
      const float high[] = {joint.sigma_high_Nm, joint.v_min_high_radps, joint.torque_Nm, joint.scale_high};
      return Put(JointWord(j, part), Around(numbers_.Below(2) == 0 ? low[part] : high[part]));
    }
    const int front = Model::kBodyParameters + numbers_.Below(Model::kFront);
    const int k = numbers_.Below(2) == 0 ? front : numbers_.Below(kParameters);
    const model::ParameterCeiling& p = c.parameter[k];
    const float bound[] = {numbers_.Below(2) == 0 ? p.low : p.high, p.sd, p.process_noise};
    const int part = numbers_.Below(3);
    Put(ParameterWord(k, part), Around(bound[part]));
    // Coulomb friction close to the least that brakes, with viscous friction of either sign.
    if (k < Model::kBodyParameters || numbers_.Below(2) == 0) return;
    const int j = numbers_.Below(n), Fc = Model::kBodyParameters + Model::kFrontBegin[j];
    const float push = Around(c.joint[j].feed_Nm), speed = c.joint[j].speed_radps;
    Put(ParameterWord(Fc, 0), numbers_.Below(2) == 0 ? -push : Around(c.joint[j].torque_Nm) * 0.5f);
    const float sign = numbers_.Below(2) == 0 ? -1.0f : 1.0f;
    Put(ParameterWord(Fc + 1, 0), sign * (Around(c.joint[j].torque_Nm) * 0.5f / speed));
  }

  void Far() {
    using Float = std::numeric_limits<float>;
    const float odd[] = {Float::infinity(), Float::quiet_NaN(), 1e30f, -1e30f, -1e6f, Float::denorm_min(), 0.0f};
    const int word = 5 + numbers_.Below(kWords - 5), first = word - word % 2;
    switch (numbers_.Below(4)) {
      case 0:
        words_[word] = static_cast<std::uint16_t>(numbers_.Bits() >> 16);
        return;
      case 1:
        return Put(first, odd[numbers_.Below(7)]);
      case 2: {  // of either sign, from 1e-4 to 1e8
        const auto exponent = static_cast<std::uint32_t>(114 + numbers_.Below(39));
        const std::uint32_t bits = numbers_.Bits();
        return Put(first, math::FloatOf((bits & 0x807FFFFFu) | exponent << 23));
      }
      default:
        return Put(first, core::GetF32(&words_[first]) * numbers_.Between(0.0f, 4.0f));
    }
  }

  Numbers numbers_{12345};
  std::uint16_t usual_[kWords], words_[kWords] = {};
};

}  // namespace armcal::target
