// plant - computes forces that act on a point of a link from outside: a hose, a wall, a push.
//
// Everything is in the base frame. A force is what the world does to the arm.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include <kdl/frames.hpp>

#include "codegen/src/io/toml_reader.hpp"

namespace armcal::plant {

class LinkForce {
 public:
  virtual ~LinkForce() = default;
  // At a place and speed of the point. since_s: from the effect's `from_s`; not called before.
  virtual KDL::Vector At(const KDL::Vector& place, const KDL::Vector& speed, double since_s) const = 0;
  // After each integration step, and while the effect is not there yet.
  virtual void Remember(const KDL::Vector&) {}
  virtual std::unique_ptr<LinkForce> Copy() const = 0;
  // The point in the axes of its link; at_flange(): the flange instead.
  KDL::Vector point;
  virtual bool at_flange() const { return true; }
};

// By kind, what makes a force of its keys.
using LinkForceReaders = std::map<std::string, std::function<std::unique_ptr<LinkForce>(const io::TomlReader&)>>;
const LinkForceReaders& AllLinkForces();

}  // namespace armcal::plant
