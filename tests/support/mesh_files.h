/// Triangle meshes as other programs write them.
#pragma once

#include "pipeline/contract/numbers.h"
#include "pipeline/contract/surface.h"
#include "tests/support/test.h"

namespace mbtfm::test {

template <class T>
void put(std::string& bytes, T value) {
  char own[sizeof(T)];
  std::memcpy(own, &value, sizeof(T));
  bytes.append(own, sizeof(T));
}
template <class T>
void put_swapped(std::string& bytes, T value) {
  std::string own;
  put(own, value);
  bytes.append(own.rbegin(), own.rend());
}

inline std::string text_of(Vec3 p) { return shortest(p.x) + " " + shortest(p.y) + " " + shortest(p.z); }

inline std::string stl_text(const TriangleMesh& mesh) {
  std::string text = "solid gel\n";
  for (const auto& t : mesh.triangles) {
    text += "  facet normal 0 0 1\n    outer loop\n";
    for (const int c : t) text += "      vertex " + text_of(mesh.points_um[c]) + "\n";
    text += "    endloop\n  endfacet\n";
  }
  return text + "endsolid gel\n";
}

inline std::string stl_binary(const TriangleMesh& mesh) {
  std::string bytes = "solid, says the header, though this is binary";
  bytes.resize(80);
  put(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) put(bytes, 0.0F);
    for (const int c : t) {
      const Vec3 p = mesh.points_um[c];
      for (const double x : {p.x, p.y, p.z}) put(bytes, static_cast<float>(x));
    }
    put(bytes, std::uint16_t{0});
  }
  return bytes;
}

inline std::string ply_head(const std::string& format, std::size_t n_points, std::size_t n_faces) {
  return "ply\nformat " + format + " 1.0\ncomment a gel\nelement vertex " + std::to_string(n_points) +
         "\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\nelement face " +
         std::to_string(n_faces) + "\nproperty list uchar int vertex_indices\nend_header\n";
}

inline std::string ply_text(const TriangleMesh& mesh) {
  std::string text = ply_head("ascii", mesh.points_um.size(), mesh.triangles.size());
  for (const Vec3 p : mesh.points_um) text += text_of(p) + " 255\n";
  for (const auto& [a, b, c] : mesh.triangles)
    text += "3 " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(c) + "\n";
  return text;
}

enum class Order { little_endian, big_endian };

inline std::string ply_binary(const TriangleMesh& mesh, Order order) {
  const bool is_big = order == Order::big_endian;
  std::string bytes =
      ply_head(is_big ? "binary_big_endian" : "binary_little_endian", mesh.points_um.size(), mesh.triangles.size());
  const auto add = [&](auto value) { is_big ? put_swapped(bytes, value) : put(bytes, value); };
  for (const Vec3 p : mesh.points_um) {
    for (const double x : {p.x, p.y, p.z}) add(x);
    add(std::uint8_t{255});
  }
  for (const auto& t : mesh.triangles) {
    add(std::uint8_t{3});
    for (const std::int32_t c : t) add(c);
  }
  return bytes;
}

/// Every other corner counted back from the last point.
inline std::string obj_text(const TriangleMesh& mesh) {
  std::string text = "# a gel\nmtllib none.mtl\no gel\n";
  for (const Vec3 p : mesh.points_um) text += "v " + text_of(p) + "\n";
  text += "vn 0 0 1\n";
  for (const auto& [a, b, c] : mesh.triangles) {
    const int back = b - static_cast<int>(mesh.points_um.size());
    text += "f " + std::to_string(a + 1) + "//1 " + std::to_string(back) + "//1 " + std::to_string(c + 1) + "//1\n";
  }
  return text;
}

inline std::string vtp_text(const TriangleMesh& mesh) {
  std::string points, corners, ends;
  for (const Vec3 p : mesh.points_um) points += text_of(p) + "\n";
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
    for (const int c : mesh.triangles[k]) corners += std::to_string(c) + " ";
    ends += std::to_string(3 * (k + 1)) + " ";
  }
  return "<VTKFile type=\"PolyData\" version=\"0.1\"><PolyData><Piece NumberOfPoints=\"" +
         std::to_string(mesh.points_um.size()) + "\" NumberOfPolys=\"" + std::to_string(mesh.triangles.size()) +
         "\"><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">" + points +
         "</DataArray></Points><Polys><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">" + corners +
         "</DataArray><DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">" + ends +
         "</DataArray></Polys></Piece></PolyData></VTKFile>\n";
}

}  // namespace mbtfm::test
