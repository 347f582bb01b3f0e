// collision tests - hulls are closed, convex and as large as their points; meshes are read from every kind of file.
#include "host_sim/identify/collision/hull.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <set>

#include <Eigen/Geometry>

#include "host_sim/identify/collision/distance.hpp"
#include "host_sim/identify/collision/mesh.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::collision {
namespace {

using Eigen::Vector3d;
using files::test::ErrorOf;
using files::test::TemporaryFolder;

std::vector<Vector3d> Cloud(const std::string& kind) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  std::vector<Vector3d> points;
  for (int k = 0; k < 400; ++k) {
    const Vector3d p(normal(random), normal(random), normal(random));
    if (kind == "ball") points.push_back(p.normalized());
    else if (kind == "cloud") points.push_back(p);
    else if (kind == "cube") points.push_back(p.array().round().max(-1).min(1));  // many points in each plane
    else points.emplace_back(std::cos(0.1 * k), std::sin(0.1 * k), k % 2);        // a turned part: two rings
  }
  return points;
}

TEST(ConvexHull, IsClosedAndConvexAndHoldsAllPoints) {
  for (const char* kind : {"ball", "cloud", "cube", "rings"}) {
    const std::vector<Vector3d> points = Cloud(kind);
    const Hull hull = ConvexHull(points);
    ASSERT_FALSE(hull.face.empty()) << kind;
    std::set<std::pair<int, int>> edges;
    for (const auto& face : hull.face)
      for (int k = 0; k < 3; ++k)
        EXPECT_TRUE(edges.emplace(face[k], face[(k + 1) % 3]).second) << kind << ": an edge has two faces on one side";
    for (const auto& [from, to] : edges) EXPECT_TRUE(edges.contains({to, from})) << kind << ": a hole";
    EXPECT_EQ(hull.corner.size() + hull.face.size(), edges.size() / 2 + 2) << kind << ": Euler";
    std::mt19937_64 random(2);
    std::normal_distribution<double> normal;
    for (int k = 0; k < 500; ++k) {
      const Vector3d direction = Vector3d(normal(random), normal(random), normal(random)).normalized();
      double of_points = -1e9, of_hull = -1e9;
      for (const Vector3d& p : points) of_points = std::max(of_points, direction.dot(p));
      for (const Vector3d& p : hull.corner) of_hull = std::max(of_hull, direction.dot(p));
      EXPECT_NEAR(of_hull, of_points, 1e-5) << kind;
    }
  }
  EXPECT_LT(ConvexHull(Cloud("cube")).corner.size(), 30U);  // eight, and such as lie on edges
}

TEST(ConvexHull, OfPointsWithoutVolume_HasNoFaces) {
  std::vector<Vector3d> flat = Cloud("cloud");
  for (Vector3d& p : flat) p.z() = 2 * p.x() - p.y();
  EXPECT_TRUE(ConvexHull(flat).face.empty());
  EXPECT_TRUE(ConvexHull({Vector3d::Ones()}).face.empty());
  EXPECT_TRUE(ConvexHull({}).face.empty());
}

// Bytes of a binary STL with one triangle a face.
std::string BinaryStl(const std::vector<std::array<Vector3d, 3>>& triangles) {
  std::string bytes = "solid, as some programs begin their binary files, too";
  bytes.resize(80, ' ');
  const auto add = [&bytes](const void* data, std::size_t size) { bytes.append(static_cast<const char*>(data), size); };
  const auto count = static_cast<std::uint32_t>(triangles.size());
  add(&count, 4);
  for (const auto& triangle : triangles) {
    const float normal[3] = {9, 9, 9};
    add(normal, sizeof normal);
    for (const Vector3d& p : triangle) {
      const Eigen::Vector3f corner = p.cast<float>();
      add(corner.data(), 12);
    }
    add("\0", 2);
  }
  return bytes;
}

// The corners of the other files in millimetres, in a node that is turned and moved, and back in the node around it.
std::string Collada(const std::string& up_axis) {
  return R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
 <asset><unit name="millimeter" meter="0.001"/><up_axis>)" +
         up_axis + R"(</up_axis></asset>
 <library_geometries><geometry id="g"><mesh>
  <source id="p"><float_array id="a" count="12">0 0 0 500 0 0 0 250 0 0 0 -2000</float_array>
   <technique_common><accessor source="#a" count="4" stride="3"><param name="X" type="float"/>
    <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <triangles count="2"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2 0 1 3</p></triangles>
 </mesh></geometry></library_geometries>
 <library_visual_scenes><visual_scene id="s">
  <node id="outer"><translate>0 0 -70</translate>
   <node id="inner"><translate>0 0 70</translate><instance_geometry url="#g"/></node></node>
 </visual_scene></library_visual_scenes>
 <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
)";
}

TEST(ReadMesh, EveryKindOfFile_HasTheSameCorners) {
  if (!CanMeasure()) GTEST_SKIP() << "built without Assimp";
  const TemporaryFolder folder;
  const Vector3d a(0, 0, 0), b(0.5, 0, 0), c(0, 0.25, 0), d(0, 0, -2);
  const std::string vertex = "  vertex 0 0 0\n  vertex 0.5 0 0\n  vertex 0 0.25 0\n",
                    head = " facet normal 0 0 1\n outer loop\n";
  const std::string text = "solid s\n" + head + vertex + " endloop\n endfacet\n" + head +
                           "  vertex 0 0 0\n  vertex 0.5 0 0\n  vertex 0 0 -2e0\n endloop\n endfacet\nendsolid\n";
  const std::vector<std::vector<Vector3d>> read = {
      ReadMesh(folder.Write("m.STL", BinaryStl({{a, b, c}, {a, b, d}}))), ReadMesh(folder.Write("t.stl", text)),
      ReadMesh(
          folder.Write("m.obj", "# w\nv 0 0 0\nv 0.5 0 0\nvn 9 9 9\nv 0 0.25 0\nv 0 0 -2 1.0\nf 1 2 3\nf 1 2 4\n")),
      ReadMesh(folder.Write("m.dae", Collada("Z_UP"))), ReadMesh(folder.Write("y.dae", Collada("Y_UP")))};
  const std::vector<Vector3d> expected{d, a, c, b};
  for (const auto& corners : read) {
    ASSERT_EQ(corners.size(), expected.size());
    for (std::size_t k = 0; k < corners.size(); ++k) EXPECT_LT((corners[k] - expected[k]).norm(), 1e-7);
  }
}

TEST(ReadMesh, FaultyFiles_AreRefusedInOneLine) {
  if (!CanMeasure()) GTEST_SKIP() << "built without Assimp";
  const TemporaryFolder folder;
  const std::pair<std::filesystem::path, const char*> cases[] = {
      {folder / "none.stl", "no such file"},
      {folder.Write("m.dae", "<COLLADA/>"), "empty"},
      {folder.Write("cut.dae", Collada("Z_UP").substr(0, 700)), "malformed"},
      {folder.Write("m.step", "ISO-10303-21;"), "STL, OBJ or COLLADA"},
      {folder.Write("cut.stl", BinaryStl({{Vector3d::Zero(), Vector3d::Ones(), Vector3d::UnitX()}}).substr(0, 100)),
       "expected a mesh"},
      {folder.Write("word.stl", "solid s\nfacet normal 0 0 1\nouter loop\nvertex 1 two 3\nendloop\nendfacet\n"), "two"},
      {folder.Write("empty.obj", ""), "expected a mesh"},
      {folder.Write("short.obj", "v 1 2\nv 0 0 1\nv 0 1 0\nf 1 2 3\n"), "expected a mesh"}};
  for (const auto& [path, expected] : cases) {
    const std::string error = ErrorOf([&] { ReadMesh(path); });
    EXPECT_NE(error.find(path.string()), std::string::npos) << error;
    EXPECT_NE(error.find(expected), std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
}

}  // namespace
}  // namespace armcal::collision
