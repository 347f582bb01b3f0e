// generator - what an effect's expression can read, in one table, and what an input of a graph stands for.
//
// The parser, the generator, the diagnosis and docs/add_an_effect.md all follow this table.
#pragma once

#include <compare>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace armcal::codegen {

enum class Quantity : std::uint8_t {
  // of the sample
  kPosition,
  kSpeed,
  kAcceleration,
  kTemperature,
  kTime,
  kTimeStep,
  // of the committed model
  kRigidTorque,
  kGravityTorque,
  kBodyColumn,
  kMassMatrix,
  kGravitySlope,
  kGravityStiffness,
  kTorqueSlope,
  kTorqueSpeedSlope,
  // of the kinematics
  kFlangePosition,
  kFlangeJacobian,
  kApproach,
  kApproachSlope,
  // what a sensor record acts on
  kModelTorque,
  kDelayedTorque,
  // no words of an expression: what a model's own graph holds
  kBaseParameter,  // parameter: number of the committed base parameter
  kCoordinate,     // parameter: number of the filter coordinate
  kSymbol,         // symbol: the name of a nonlinear parameter or of a state
};

// One input of a graph. Indices count from 0; those that the quantity does not have are 0.
struct InputId {
  Quantity quantity;
  int row = 0;   // the joint, or the row of a matrix
  int body = 0;  // kBodyColumn: the body; kMassMatrix, kGravityStiffness, kTorqueSlope, kTorqueSpeedSlope: the column
  int parameter = 0;  // kBodyColumn: of the body's ten; kGravitySlope and the flange's: axis 0 to 2
  std::string symbol = {};

  friend auto operator<=>(const InputId&, const InputId&) = default;
};

inline InputId SymbolId(const std::string& name) { return {.quantity = Quantity::kSymbol, .symbol = name}; }

// How a word of an expression is indexed.
enum class Indexing : std::uint8_t {
  kNone,      // t
  kJoint,     // q, q[k], q[3]
  kBody,      // Y[flange, mx], Y[3, m], Y[3, i]
  kRowJoint,  // M[r, j]
  kRowAxis,   // dtau_dg[r, x]
  kAxis,      // flange[x]
};

struct QuantityInfo {
  Quantity quantity;
  const char* word;      // in an expression
  const char* declared;  // in a record's list of inputs
  Indexing indexing;
  bool of_estimate;  // follows the committed model: the record says depends_on_estimate
  bool sensor_only;
  const char* unit;
  const char* meaning;
};

// Every quantity that has a word.
std::span<const QuantityInfo> QuantityTable();
const QuantityInfo* FindWord(std::string_view word);      // null: no such word
const QuantityInfo* FindDeclared(std::string_view word);  // by the word of a record's list of inputs
const QuantityInfo* FindQuantity(Quantity quantity);      // null: it has no word

// A short name of an input for messages: "q3", "Y[2, 3, 0]". Nothing reads it back.
std::string NameOf(const InputId& input);

}  // namespace armcal::codegen
