// health - lists the simple causes of a residual, and finds which of them explain a set of bins.
#pragma once

#include <array>
#include <vector>

namespace armcal::health {

enum ShapeIndex : int {
  kOffset,
  kCoulomb,
  kViscous,
  kGain,
  kLoadFriction,
  kPosition,
  kTempCoulomb,
  kTempViscous,
  kShapes
};

// One cause: torque = value x a function of speed, position, load and temperature that is linear in a bin's means.
struct Shape {
  const char* name;       // for people
  const char* kind;       // the record in codegen/effects that has it
  const char* parameter;  // of that record, or of a linear stand-in for it
  const char* unit;       // of a turning joint; a sliding one: N for N*m, m for rad
  double most;            // a larger value is something else; 0: any
};
const Shape& ShapeOf(int index);

// What a unit of each shape gives in a bin: its mean over the bin's rows.
using ShapeMeans = std::array<double, kShapes>;

// One bin, or the change of one between two times.
struct Evidence {
  double torque_Nm = 0;  // mean residual, to be explained
  double variance = 0;   // of that mean
  double rows = 0;
  ShapeMeans shape{};  // all zero for a shape that the data cannot show
};

struct Term {
  int shape = 0;
  double value = 0, sd = 0;  // in the shape's unit
  double rms_Nm = 0;         // over the rows
  std::vector<int> also;     // shapes that do as well in its place, up to five standard deviations or a twentieth
};

struct Explanation {
  std::vector<Term> terms;  // strongest first
  double share = 0;         // of the weighted squared torque that the terms explain
};

// Forward selection by weighted least squares: a term enters if its chi^2 gain is that of five standard deviations,
// the noise being raised to what the best fit of all shapes leaves, if its size is `smallest_Nm` or more, and if it
// explains a tenth of the whole. At most three.
Explanation Explain(const std::vector<Evidence>& evidence, double smallest_Nm);

}  // namespace armcal::health
