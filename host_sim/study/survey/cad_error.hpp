// survey - CAD values that are off in ways an estimate is not told, and how an error is measured that was added.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "codegen/src/robot/robot.hpp"

namespace armcal::survey {

struct CadError {
  enum class Kind {
    kWorst,    // each entry times 1 + width or 1 - width
    kUniform,  // times a number between these
    kAdded,    // each coordinate of a centre +- 10 mm, each product of inertia +- 5 % of the trace; uniform
    kOneLink,  // one link times 1.5 or 0.5, the others uniform within the width
    kMixed     // kUniform and kAdded
  } kind = Kind::kUniform;
  double width = 0.2;

  bool has_absolute() const { return kind == Kind::kAdded || kind == Kind::kMixed; }
};
std::string CadErrorName(const CadError& error);

// The robot with such CAD values: links and rotor inertias; [prior] stays as the file has it. A body that cannot exist
// is drawn again. Throws io::InputError where none is found.
codegen::Robot DrawCad(const codegen::Robot& truth, const CadError& error, std::uint64_t seed);

// Bodies about link origins, [11 n]; rotors: 0.
Eigen::VectorXd BodiesOf(const codegen::Robot& robot);

// Mean over all entries of |estimate - truth|, a mass over the link's mass, a coordinate of a centre over the link's
// length, an inertia over the trace. The length is the distance to the next joint or, if longer, the radius of
// gyration. bodies: about link origins, [11 n].
double ScaledBodyError(const codegen::Robot& truth, const Eigen::VectorXd& bodies);

}  // namespace armcal::survey
