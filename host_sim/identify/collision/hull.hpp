// collision - the convex hull of points.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace armcal::collision {

struct Hull {
  std::vector<Eigen::Vector3d> corner;
  std::vector<std::array<int, 3>> face;  // counter-clockwise, seen from outside
};

// Quickhull. Points nearer to a face than a millionth of the size count as inside. No faces: the points have no volume.
Hull ConvexHull(const std::vector<Eigen::Vector3d>& points);

}  // namespace armcal::collision
