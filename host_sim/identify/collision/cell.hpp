// collision - what stands around the arm.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

namespace armcal::collision {

struct CellBox {
  std::string name;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  // of its middle, seen from the base frame
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
};

// All points p with normal . p <= offset are solid.
struct CellPlane {
  std::string name;
  Eigen::Vector3d normal;  // unit
  double offset = 0;
};

struct Cell {
  std::vector<CellBox> box;
  std::vector<CellPlane> plane;
};

// A cell file, in the base frame: [[box]] with name, center_m, size_m and perhaps rpy_deg; [[plane]] with name, point_m
// and normal, which points to where the arm is. Throws io::InputError with all faults.
Cell ReadCell(const std::filesystem::path& path);

}  // namespace armcal::collision
