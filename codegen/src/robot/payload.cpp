// robot - reads a [payload] table and puts the payload on a link.
#include "codegen/src/robot/payload.hpp"

#include "codegen/src/io/toml_reader.hpp"
#include "codegen/src/robot/body.hpp"

namespace armcal::codegen {
Payload ReadPayload(const io::TomlReader& in) {
  in.AllowOnly({"mass_kg", "center_m", "inertia_kgm2"});
  Payload p;
  p.mass_kg = in.Positive("mass_kg");
  if (in.Has("center_m")) {
    const auto c = in.Numbers("center_m", 3);
    p.center_m = {c[0], c[1], c[2]};
  }
  if (in.Has("inertia_kgm2")) {
    if (!p.center_m) in.Report("center_m", "3 numbers, because the inertia is about the centre");
    const auto i = in.Numbers("inertia_kgm2", 6);
    p.inertia_kgm2 = {i[0], i[1], i[2], i[3], i[4], i[5]};
  }
  return p;
}

Payload ReadPayload(const std::filesystem::path& path) {
  const toml::table table = io::ParseToml(path);
  const io::TomlReader in(table, path.string());
  in.AllowOnly({"payload"});
  return ReadPayload(in.Table("payload"));
}

Link Carrying(const Link& link, const Eigen::Isometry3d& flange, const Payload& payload) {
  Body both = ToBody(link);
  Merge(both,
        Moved(flange, {payload.mass_kg, Eigen::Vector3d(payload.center_m->data()), Symmetric(*payload.inertia_kgm2)}));
  return ToLink(both);
}

}  // namespace armcal::codegen
