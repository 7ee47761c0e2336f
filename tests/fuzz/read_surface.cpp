/// The gel's surface: triangle meshes of other programs until they are heights, and surface.vtp.
#include "pipeline/files/triangle_mesh.h"
#include "pipeline/files/vtk_files.h"
#include "substrate/surface/height.h"
#include "substrate/surface/mesh.h"
#include "substrate/surface/missing.h"
#include "tests/fuzz/target.h"
#include "tests/support/mesh_files.h"

namespace mbtfm::fuzz::surface_readers {
namespace {

constexpr std::array kExtensions = {".stl", ".ply", ".obj", ".vtp"};
constexpr int kSide = 5;  ///< vertices

Vec3 at(int i, int j) { return {1.5 * i, 2.0 * j, std::sin(i) + 0.3 * j}; }

TriangleMesh height_field() {
  TriangleMesh mesh;
  for (int k = 0; k < kSide * kSide; ++k) mesh.points_um.push_back(at(k % kSide, k / kSide));
  for (int k = 0; k < kSide * (kSide - 1); ++k) {
    if (k % kSide == kSide - 1) continue;
    mesh.triangles.push_back({k, k + 1, k + kSide + 1});
    mesh.triangles.push_back({k, k + kSide + 1, k + kSide});
  }
  return mesh;
}

std::string surface_vtp() {
  HeightMap map{.origin_um = {-3, 4}, .spacing_um = {1.5, 2}, .n_x = kSide, .n_y = kSide};
  for (int k = 0; k < kSide * kSide; ++k) map.z_um.push_back(at(k % kSide, k / kSide).z);
  map.sigma_um.assign(map.z_um.size(), 0.25);
  put("whole.vtp", "");
  files::write_surface(folder() / "whole.vtp", map);
  return bytes_of(folder() / "whole.vtp");
}

std::vector<std::string> samples() {
  const TriangleMesh mesh = height_field();
  return {test::stl_text(mesh),
          test::stl_binary(mesh),
          test::ply_text(mesh),
          test::ply_binary(mesh, test::Order::little_endian),
          test::ply_binary(mesh, test::Order::big_endian),
          test::obj_text(mesh),
          test::vtp_text(mesh),
          surface_vtp()};
}

void read(std::string_view bytes) {
  const std::string_view input = bytes;
  for (const char* const extension : kExtensions) {
    const auto file = fuzz::put(std::string("input") + extension, input);
    fuzz::answer([&] {
      const TriangleMesh mesh = files::read_triangle_mesh(file, 1);
      try {
        const HeightMap map = surface::sample_mesh(mesh, surface::suggested_spacing_um(mesh)).map;
        surface::filled(surface::binned(map, 1 + std::max(map.n_x, map.n_y) / 500), 5);  // as the program does
      } catch (const InvalidData&) {  // the program makes it an error of the file
      }
    });
  }
  fuzz::answer([&] {
    const HeightMap map = files::read_surface(fuzz::folder() / "input.vtp");
    const surface::Height height(map);
    height(map.origin_um);
  });
}

const bool is_added = add({"surface", 8000, samples, read});

}  // namespace
}  // namespace mbtfm::fuzz::surface_readers
