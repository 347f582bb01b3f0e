// survey - the arm of section 6.1 in memory: a robot file with the friction law of one model, and its set parameters.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "codegen/src/generator/model.hpp"

namespace armcal::survey {

// Friction laws of section 2, by equation number.
enum class Law {
  kCoulombViscous,  // (3), (7)
  kStribeck,        // (4) with delta_s = 2
  kExponential,     // (5)
  kSechTanh,        // (6)
  kCubeRoot,        // (8)
  kLoad,            // (9) with the load of a payload declared at the flange
  kGradient,        // d f / d phi_f of (4) at the set values: the friction columns of (14)
};
std::string LawName(Law law);  // "(7)"

struct Payload {
  double mass_kg = 10;
  double center_m[3] = {0, 0, 0.1};  // in the last link's frame
};

// The set parameters of (4): breakaway and Stribeck speed, per joint.
struct Stribeck {
  Eigen::VectorXd fs_over_fc, qs_radps;
};
Stribeck SetStribeck(int joints);  // Fs = 1.2 Fc, qs = 0.1 rad/s

enum class Bodies { kStandard, kBase };

// The robot file with `law` on every joint, without rotor inertias, torque gains and undeclared effects. kStandard
// takes every body parameter that the torque depends on, as the survey does; kBase takes independent ones.
codegen::Robot Variant(const codegen::Robot& file, Law law, Bodies bodies, const Stribeck& stribeck);

// (4) with base parameters: the arm for which the firmware's extended filter is compiled here.
codegen::Robot StribeckArm(const codegen::Robot& file, const Stribeck& stribeck);

// The records that Variant uses: the given ones, but with delta_s of (4) fixed at 2 and the payload of (9) declared,
// and one more for kGradient.
codegen::Catalogue Records(codegen::Catalogue records, const Payload& payload = {});

// The table's means as z = [p, eta]. If the model's robot file holds the truth, this is the truth.
Eigen::VectorXd SetParameters(const codegen::Model& model);

// tau = K(s; eta) p of (14), [samples x joints].
Eigen::MatrixXd Torque(const codegen::Model& model, const codegen::Signals& s, const Eigen::VectorXd& z);

// The survey's phi_f: one row a joint, columns Fc, [Fs, qs,] beta. For (4): Fs = Fc + dFs.
Eigen::MatrixXd Friction(const codegen::Model& model, const Eigen::VectorXd& z);
// The place in z of a parameter with this table name ("Fc3", "stribeck.vs3"). -1: there is none.
int PlaceOf(const codegen::Model& model, const std::string& name);

}  // namespace armcal::survey
