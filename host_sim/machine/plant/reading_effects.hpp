// plant - computes what lies between a motor's torque and the drive's reading of it: amplifier, filter, wire.
#pragma once

#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>

#include "codegen/src/io/toml_reader.hpp"

namespace armcal::plant {

// Of one axis. Torque on the joint's side by nominal constants.
class ReadingEffect {
 public:
  virtual ~ReadingEffect() = default;
  // Once a tick. since_s: from the effect's `from_s`; the effect is not asked before.
  virtual double Pass(double torque_Nm, double tick_s, double since_s, double motor_angle_rad) = 0;
  // Where the converter ends.
  virtual double limit_Nm() const { return std::numeric_limits<double>::infinity(); }
  virtual std::unique_ptr<ReadingEffect> Copy() const = 0;
};

// By kind, what makes an effect of its keys.
using ReadingEffectReaders =
    std::map<std::string, std::function<std::unique_ptr<ReadingEffect>(const io::TomlReader&)>>;
const ReadingEffectReaders& AllReadingEffects();

}  // namespace armcal::plant
