// collision - reads the cell file.
#include "host_sim/identify/collision/cell.hpp"

#include <numbers>

#include "codegen/src/io/toml_reader.hpp"
#include "codegen/src/robot/frames.hpp"

namespace armcal::collision {

Cell ReadCell(const std::filesystem::path& path) {
  const toml::table table = io::ParseToml(path);
  io::Faults faults;
  const io::TomlReader in(table, path.string(), "", &faults);
  in.AllowOnly({"box", "plane"});
  const auto vector = [](const io::TomlReader& from, const char* key) {
    return Eigen::Vector3d(from.Numbers(key, 3).data());
  };
  Cell cell;
  for (const io::TomlReader& box : in.Tables("box")) {
    box.AllowOnly({"name", "center_m", "size_m", "rpy_deg"});
    CellBox b;
    b.name = box.Text("name");
    b.size = vector(box, "size_m");
    if ((b.size.array() <= 0).any()) box.Report("size_m", "3 numbers above zero");
    b.pose.translation() = vector(box, "center_m");
    if (box.Has("rpy_deg")) b.pose.linear() = codegen::RollPitchYaw(vector(box, "rpy_deg") * std::numbers::pi / 180);
    cell.box.push_back(b);
  }
  for (const io::TomlReader& plane : in.Tables("plane")) {
    plane.AllowOnly({"name", "point_m", "normal"});
    CellPlane p;
    p.name = plane.Text("name");
    p.normal = vector(plane, "normal");
    if (p.normal.norm() < 1e-6) plane.Report("normal", "a direction that is not zero");
    p.normal.normalize();
    p.offset = p.normal.dot(vector(plane, "point_m"));
    cell.plane.push_back(p);
  }
  if (cell.box.empty() && cell.plane.empty()) faults.Add(path.string() + ": expected [[box]] or [[plane]] tables");
  faults.ThrowIfAny();
  return cell;
}

}  // namespace armcal::collision
