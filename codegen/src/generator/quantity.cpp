// generator - the table of quantities.
#include "codegen/src/generator/quantity.hpp"

#include <algorithm>

namespace armcal::codegen {
namespace {

constexpr QuantityInfo kTable[] = {
    {Quantity::kPosition, "q", "q", Indexing::kJoint, false, false, "rad or m", "position of a joint"},
    {Quantity::kSpeed, "qd", "qd", Indexing::kJoint, false, false, "rad/s or m/s", "speed of a joint"},
    {Quantity::kAcceleration, "qdd", "qdd", Indexing::kJoint, false, false, "rad/s^2 or m/s^2",
     "acceleration of a joint"},
    {Quantity::kTemperature, "temp", "temp", Indexing::kJoint, false, false, "deg C", "temperature of a joint"},
    {Quantity::kTime, "t", "t", Indexing::kNone, false, false, "s", "time since the table was adopted, or of the log"},
    {Quantity::kTimeStep, "dt", "dt", Indexing::kNone, false, false, "s", "time since the sample before"},
    {Quantity::kRigidTorque, "tau_rigid", "tau_rigid", Indexing::kJoint, true, false, "N*m or N",
     "torque of the links, without the rotors: what the gear carries"},
    {Quantity::kGravityTorque, "tau_gravity", "tau_gravity", Indexing::kJoint, true, false, "N*m or N",
     "gravity's part of it"},
    {Quantity::kBodyColumn, "Y", "Y", Indexing::kBody, false, false, "per unit of the parameter",
     "torque of the row per unit of a body's parameter, about the robot file's frame"},
    {Quantity::kMassMatrix, "M", "M[:,j]", Indexing::kRowJoint, true, false, "kg*m^2 or kg",
     "entry of the mass matrix of the links, without the rotors"},
    {Quantity::kGravitySlope, "dtau_dg", "dY/dgravity", Indexing::kRowAxis, true, false, "N*m per m/s^2",
     "torque of the row per unit of gravity along x, y or z of the base"},
    {Quantity::kGravityStiffness, "dgravity_dq", "dgravity_dq", Indexing::kRowJoint, true, false, "N*m/rad",
     "gravity's torque of the row per unit of a joint's position"},
    {Quantity::kTorqueSlope, "dtau_dq", "dtau_dq", Indexing::kRowJoint, true, false, "N*m/rad",
     "torque of the links in the row per unit of a joint's position"},
    {Quantity::kTorqueSpeedSlope, "dtau_dqd", "dtau_dqd", Indexing::kRowJoint, true, false, "N*m*s/rad",
     "torque of the links in the row per unit of a joint's speed"},
    {Quantity::kFlangePosition, "flange", "flange", Indexing::kAxis, false, false, "m",
     "where the last link's frame stands, along x, y or z of the base"},
    {Quantity::kFlangeJacobian, "J", "J", Indexing::kRowAxis, false, false, "m/rad",
     "its slope over the position of the row's joint"},
    {Quantity::kApproach, "approach", "approach", Indexing::kAxis, false, false, "1",
     "direction of the last link's z axis, along x, y or z of the base"},
    {Quantity::kApproachSlope, "dapproach_dq", "dapproach_dq", Indexing::kRowAxis, false, false, "1/rad",
     "its slope over the position of the row's joint"},
    {Quantity::kModelTorque, "tau_model", "tau_model", Indexing::kJoint, true, true, "N*m or N",
     "torque of the whole model"},
    {Quantity::kDelayedTorque, "tau_delayed", "tau_delayed", Indexing::kJoint, true, true, "N*m or N",
     "the same, earlier by the record's delay"},
};

template <class Matches>
const QuantityInfo* Find(Matches matches) {
  const auto it = std::find_if(std::begin(kTable), std::end(kTable), matches);
  return it == std::end(kTable) ? nullptr : it;
}

}  // namespace

std::span<const QuantityInfo> QuantityTable() { return kTable; }
const QuantityInfo* FindWord(std::string_view word) {
  return Find([&](const QuantityInfo& i) { return i.word == word; });
}
const QuantityInfo* FindDeclared(std::string_view word) {
  return Find([&](const QuantityInfo& i) { return i.declared == word; });
}
const QuantityInfo* FindQuantity(Quantity quantity) {
  return Find([&](const QuantityInfo& i) { return i.quantity == quantity; });
}

std::string NameOf(const InputId& input) {
  const QuantityInfo* info = FindQuantity(input.quantity);
  const auto number = [](int index) { return std::to_string(index + 1); };
  if (info == nullptr) {
    if (input.quantity == Quantity::kSymbol) return input.symbol;
    return (input.quantity == Quantity::kBaseParameter ? "base" : "p") + std::to_string(input.parameter);
  }
  switch (info->indexing) {
    case Indexing::kNone:
      return info->word;
    case Indexing::kJoint:
      return info->word + number(input.row);
    case Indexing::kBody:
      return std::string(info->word) + "[" + number(input.row) + ", " + number(input.body) + ", " +
             std::to_string(input.parameter) + "]";
    case Indexing::kRowJoint:
      return std::string(info->word) + "[" + number(input.row) + ", " + number(input.body) + "]";
    case Indexing::kRowAxis:
      return std::string(info->word) + "[" + number(input.row) + ", " + "xyz"[input.parameter] + "]";
    case Indexing::kAxis:
      return std::string(info->word) + "[" + "xyz"[input.parameter] + "]";
  }
  return info->word;
}

}  // namespace armcal::codegen
