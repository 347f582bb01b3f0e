// collision - quickhull: each face keeps the points outside of it, and the farthest of them becomes a corner.
#include "host_sim/identify/collision/hull.hpp"

#include <Eigen/Geometry>
#include <map>
#include <utility>

namespace armcal::collision {
namespace {

using Eigen::Vector3d;

constexpr double kSlack = 1e-6;  // of the size

struct Face {
  std::array<int, 3> corner;
  Vector3d normal;
  double offset = 0;
  std::vector<int> outside;
  bool alive = true;
};

class Quickhull {
 public:
  explicit Quickhull(const std::vector<Vector3d>& points) : point_(points) {
    Vector3d low = points.front(), high = low;
    for (const Vector3d& p : points) low = low.cwiseMin(p), high = high.cwiseMax(p);
    slack_ = kSlack * (high - low).norm();
    if (!Begin()) return;
    for (std::size_t f = 0; f < face_.size(); ++f)  // faces are added meanwhile
      while (face_[f].alive && !face_[f].outside.empty()) Grow(static_cast<int>(f));
  }

  const std::vector<Face>& face() const { return face_; }

 private:
  double Height(const Face& f, int p) const { return f.normal.dot(point_[static_cast<std::size_t>(p)]) - f.offset; }

  template <class Distance>
  int Farthest(Distance distance) const {
    int best = 0;
    for (std::size_t p = 1; p < point_.size(); ++p)
      if (distance(point_[p]) > distance(point_[static_cast<std::size_t>(best)])) best = static_cast<int>(p);
    return best;
  }

  int Add(int a, int b, int c) {
    const auto at = [&](int p) { return point_[static_cast<std::size_t>(p)]; };
    Face f{{a, b, c}, (at(b) - at(a)).cross(at(c) - at(a)).normalized(), 0, {}};
    f.offset = f.normal.dot((at(a) + at(b) + at(c)) / 3);
    face_.push_back(f);
    const int number = static_cast<int>(face_.size()) - 1;
    for (int k = 0; k < 3; ++k) edge_[{f.corner[k], f.corner[(k + 1) % 3]}] = number;
    return number;
  }

  // Gives each point to the first of these faces that it is outside of.
  void Share(const std::vector<int>& points, const std::vector<int>& faces) {
    for (const int p : points)
      for (const int f : faces)
        if (Height(face_[static_cast<std::size_t>(f)], p) > slack_) {
          face_[static_cast<std::size_t>(f)].outside.push_back(p);
          break;
        }
  }

  // A tetrahedron. False: the points have no volume.
  bool Begin() {
    const auto at = [&](int p) { return point_[static_cast<std::size_t>(p)]; };
    const int a = Farthest([&](const Vector3d& p) { return p.x(); });
    const int b = Farthest([&](const Vector3d& p) { return (p - at(a)).norm(); });
    if ((at(b) - at(a)).norm() <= slack_) return false;
    const Vector3d along = (at(b) - at(a)).normalized();
    const int c = Farthest([&](const Vector3d& p) { return (p - at(a)).cross(along).norm(); });
    if ((at(c) - at(a)).cross(along).norm() <= slack_) return false;
    const Vector3d up = along.cross(at(c) - at(a)).normalized();
    const int d = Farthest([&](const Vector3d& p) { return std::abs((p - at(a)).dot(up)); });
    const double height = (at(d) - at(a)).dot(up);
    if (std::abs(height) <= slack_) return false;
    const int p = height > 0 ? c : b, q = height > 0 ? b : c;  // a, p, q: seen from outside
    std::vector<int> all(point_.size());
    for (std::size_t k = 0; k < all.size(); ++k) all[k] = static_cast<int>(k);
    Share(all, {Add(a, p, q), Add(a, d, p), Add(p, d, q), Add(q, d, a)});
    return true;
  }

  // Replaces all faces that see the farthest point outside of this one. They hang together: the search goes from face
  // to face, so that their border is one line even where rounding blurs what is outside.
  void Grow(int start) {
    const std::vector<int>& outside = face_[static_cast<std::size_t>(start)].outside;
    int top = outside.front();
    for (const int p : outside)
      if (Height(face_[static_cast<std::size_t>(start)], p) > Height(face_[static_cast<std::size_t>(start)], top))
        top = p;
    std::vector<int> seen{start}, orphans;
    std::vector<std::pair<int, int>> border;
    face_[static_cast<std::size_t>(start)].alive = false;
    for (std::size_t k = 0; k < seen.size(); ++k) {
      const std::array<int, 3> corner = face_[static_cast<std::size_t>(seen[k])].corner;
      for (int e = 0; e < 3; ++e) {
        Face& beyond = face_[static_cast<std::size_t>(edge_.at({corner[(e + 1) % 3], corner[e]}))];
        if (!beyond.alive || Height(beyond, top) <= slack_) continue;
        beyond.alive = false;
        seen.push_back(static_cast<int>(&beyond - face_.data()));
      }
    }
    for (const int f : seen) {
      Face& face = face_[static_cast<std::size_t>(f)];
      orphans.insert(orphans.end(), face.outside.begin(), face.outside.end());
      face.outside.clear();
      for (int e = 0; e < 3; ++e) {
        const int from = face.corner[e], to = face.corner[(e + 1) % 3];
        if (face_[static_cast<std::size_t>(edge_.at({to, from}))].alive) border.emplace_back(from, to);
      }
    }
    std::vector<int> fresh;
    for (const auto& [from, to] : border) fresh.push_back(Add(from, to, top));
    Share(orphans, fresh);
  }

  const std::vector<Vector3d>& point_;
  double slack_ = 0;
  std::vector<Face> face_;
  std::map<std::pair<int, int>, int> edge_;  // directed: the face on its left
};

}  // namespace

Hull ConvexHull(const std::vector<Vector3d>& points) {
  Hull hull;
  if (points.empty()) return hull;
  std::map<int, int> number;
  const Quickhull quick(points);
  for (const Face& f : quick.face()) {
    if (!f.alive) continue;
    std::array<int, 3> corner{};
    for (int k = 0; k < 3; ++k) {
      const auto [at, is_new] = number.try_emplace(f.corner[k], static_cast<int>(hull.corner.size()));
      if (is_new) hull.corner.push_back(points[static_cast<std::size_t>(f.corner[k])]);
      corner[k] = at->second;
    }
    hull.face.push_back(corner);
  }
  return hull;
}

}  // namespace armcal::collision
