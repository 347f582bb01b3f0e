// robot - reads [payload] and adds two bodies by Steiner's rule; knows no other table.
#include "codegen/src/robot/payload.hpp"

#include "codegen/src/robot/frames.hpp"
#include "codegen/src/robot/toml_reader.hpp"

namespace armcal::codegen {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d Symmetric(const std::array<double, 6>& i) {
  Matrix3d I;
  I << i[0], i[1], i[2], i[1], i[3], i[4], i[2], i[4], i[5];
  return I;
}

// What a mass adds to the moments about a point that is `d` away from it.
Matrix3d Steiner(double mass, const Vector3d& d) {
  return mass * (d.squaredNorm() * Matrix3d::Identity() - d * d.transpose());
}

}  // namespace

Payload ReadPayload(const TomlReader& in) {
  in.AllowOnly({"mass_kg", "center_m", "inertia_kgm2"});
  Payload p;
  p.mass_kg = in.Positive("mass_kg");
  if (in.Has("center_m")) {
    const auto c = in.Numbers("center_m", 3);
    p.center_m = {c[0], c[1], c[2]};
  }
  if (in.Has("inertia_kgm2")) {
    if (!p.center_m) in.Fail("center_m", "3 numbers, because the inertia is about the centre");
    const auto i = in.Numbers("inertia_kgm2", 6);
    p.inertia_kgm2 = {i[0], i[1], i[2], i[3], i[4], i[5]};
  }
  return p;
}

Payload ReadPayload(const std::filesystem::path& path) {
  const toml::table table = ParseToml(path);
  const TomlReader in(table, path.string());
  in.AllowOnly({"payload"});
  return ReadPayload(in.Table("payload"));
}

Link Carrying(const Link& link, const Eigen::Isometry3d& flange, const Payload& payload) {
  const Matrix3d R = flange.linear();
  const Vector3d a(link.center_m.data()), b = flange * Vector3d(payload.center_m->data());
  const double mass = link.mass_kg + payload.mass_kg;
  const Vector3d centre = (link.mass_kg * a + payload.mass_kg * b) / mass;
  const Matrix3d I = Symmetric(link.inertia_kgm2) + Steiner(link.mass_kg, a - centre) +
                     R * Symmetric(*payload.inertia_kgm2) * R.transpose() + Steiner(payload.mass_kg, b - centre);
  return {mass, Components(centre), {I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2)}};
}

}  // namespace armcal::codegen
