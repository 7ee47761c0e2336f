/// Reconstructions with exact truth: beads under a curved surface, and the tractions on it, which are no mesh's
/// (tests/data/reference/tractions, made by an independent program).
#pragma once

#include <nlohmann/json.hpp>

#include "mbtfm/spatial/reconstruction.h"
#include "pipeline/files/csv.h"
#include "substrate/surface/formula.h"
#include "tests/support/test.h"

namespace mbtfm::test {

struct TractionScene {
  std::string name;
  Gel gel;
  double largest_um = 0;                        ///< displacement
  std::vector<Vec3> beads_um, exact_um, noise;  ///< noise: of one in each direction
  struct Outlier {
    std::size_t bead = 0;
    double rank = 0;
    Vec3 box;
  };
  std::vector<Outlier> outliers;
  std::vector<Vec2> lattice_um;
  std::vector<Vec3> traction_kPa;
  std::vector<double> areas_um2;  ///< of the curved surface around the lattice's points; 0 outside of the field
  struct Patch {
    Vec2 centre_um;
    double radius_um = 0;
    Vec3 force_nN;  ///< within a lateral distance of 1.5 radii
  };
  std::vector<Patch> patches;

  /// @param noise      sigma over the largest displacement; three times as much along z
  /// @param astray     share of the beads that lie somewhere within 10 um instead
  /// @param noise_level  below zero: the opposite noise
  std::vector<BeadInSpace> observed(double noise_level, double astray = 0) const {
    std::vector<BeadInSpace> seen;
    const double s = noise_level * largest_um;
    for (std::size_t b = 0; b < beads_um.size(); ++b) {
      const Vec3 e = noise[b];
      seen.push_back({beads_um[b], exact_um[b] + s * Vec3{e.x, e.y, 3 * e.z}, std::abs(s), 3 * std::abs(s), {}});
    }
    for (const Outlier& o : outliers)
      if (o.rank < astray) seen[o.bead].displacement_um = exact_um[o.bead] + 10 * o.box;
    return seen;
  }
  /// The patches as a segmentation would have them.
  std::vector<Adhesion> adhesions(double radii = 1) const {
    std::vector<Adhesion> made;
    for (const Patch& p : patches) {
      const double d = 2 * radii * p.radius_um;
      made.push_back({.adhesion_id = static_cast<int>(made.size()) + 1,
                      .position_um = p.centre_um,
                      .area_um2 = M_PI / 4 * d * d,
                      .major_axis_um = d,
                      .minor_axis_um = d});
    }
    return made;
  }
};

inline TractionScene traction_scene(const std::filesystem::path& folder) {
  TractionScene scene;
  scene.name = folder.filename().string();
  std::ifstream file(folder / "scene.json");
  const nlohmann::json json = nlohmann::json::parse(file);
  const std::string kind = json.at("surface").get<std::string>();
  std::string formula = kind + (kind == "flat" ? " z_um=0" : "");
  for (const char* key : {"amplitude_um", "period_um", "phase_um", "depth_um", "width_um", "wall_um"})
    if (json.contains(key)) formula += std::string(" ") + key + "=" + std::to_string(json.at(key).get<double>());
  scene.gel = {json.at("youngs_modulus_kPa").get<double>(), json.at("poisson_ratio").get<double>(),
               json.at("base_z_um").get<double>()};
  if (kind != "flat") {
    scene.gel.surface =
        std::make_shared<const HeightMap>(surface::sampled(surface::formula_of(formula), {-60, -60}, {60, 60}, 1));
  }
  scene.largest_um = json.at("u_max_um").get<double>();
  const auto vector = [](const files::CsvTable& t, int row, const char* x, const char* y, const char* z) {
    return Vec3{t.number(row, x), t.number(row, y), t.number(row, z)};
  };
  const files::CsvTable beads(folder / "beads.csv");
  for (int row = 0; row < beads.n_rows(); ++row) {
    scene.beads_um.push_back(vector(beads, row, "x_um", "y_um", "z_um"));
    scene.exact_um.push_back(vector(beads, row, "ux_um", "uy_um", "uz_um"));
    scene.noise.push_back(vector(beads, row, "ex", "ey", "ez"));
  }
  const files::CsvTable outliers(folder / "outliers.csv");
  for (int row = 0; row < outliers.n_rows(); ++row)
    scene.outliers.push_back({static_cast<std::size_t>(outliers.integer(row, "bead", 0)), outliers.number(row, "rank"),
                              vector(outliers, row, "bx", "by", "bz")});
  const files::CsvTable patches(folder / "patches.csv");
  for (int row = 0; row < patches.n_rows(); ++row)
    scene.patches.push_back({{patches.number(row, "x_um"), patches.number(row, "y_um")},
                             patches.number(row, "radius_um"),
                             vector(patches, row, "fx_nN", "fy_nN", "fz_nN")});
  const files::CsvTable truth(folder / "surface.csv");
  const spatial::Ground ground(scene.gel.surface.get());
  constexpr double kHalf = 45, kStep = 2.5;
  for (int row = 0; row < truth.n_rows(); ++row) {
    const Vec2 at{truth.number(row, "x_um"), truth.number(row, "y_um")};
    const auto share = [](double x) { return std::abs(x) > kHalf + 1e-9 ? 0 : std::abs(x) > kHalf - 1e-9 ? 0.5 : 1; };
    scene.lattice_um.push_back(at);
    scene.traction_kPa.push_back(vector(truth, row, "tx_kPa", "ty_kPa", "tz_kPa"));
    scene.areas_um2.push_back(share(at.x) * share(at.y) * kStep * kStep * ground.stretch(at));
  }
  return scene;
}

/// Bilinear tractions at a place; those of the rim beyond it.
inline Vec3 traction_at(const spatial::TractionMesh& mesh, const Eigen::VectorXd& traction_kPa, Vec2 at) {
  Vec2 low = mesh.quads.points_um.front(), high = low;
  for (const Vec2 p : mesh.quads.points_um) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  at = {std::clamp(at.x, low.x, high.x), std::clamp(at.y, low.y, high.y)};
  Vec3 sum;
  for (const auto& [vertex, share] : shares_at(mesh, at))
    sum += share * Vec3{traction_kPa[3 * vertex], traction_kPa[3 * vertex + 1], traction_kPa[3 * vertex + 2]};
  return sum;
}

/// The map's error over the truth's size, both in L2 over the curved surface.
inline double map_error(const TractionScene& scene, const spatial::TractionMesh& mesh,
                        const Eigen::VectorXd& traction_kPa) {
  double wrong = 0, size = 0;
  for (std::size_t k = 0; k < scene.lattice_um.size(); ++k) {
    if (scene.areas_um2[k] == 0) continue;
    const Vec3 off = traction_at(mesh, traction_kPa, scene.lattice_um[k]) - scene.traction_kPa[k];
    wrong += scene.areas_um2[k] * dot(off, off);
    size += scene.areas_um2[k] * dot(scene.traction_kPa[k], scene.traction_kPa[k]);
  }
  return std::sqrt(wrong / size);
}

/// Areas that make forces within 1.5 radii of the patches, seen from above, of tractions at the vertices.
inline Eigen::MatrixXd patch_areas_um2(const TractionScene& scene, const spatial::Problem& problem) {
  constexpr int kParts = 12;  // of a side: a rim is met to a twelfth of it
  Eigen::MatrixXd areas =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(scene.patches.size()), problem.mesh.n_vertices());
  over_faces(problem.mesh, problem.ground, kParts, spatial::Places::even,
             [&](Vec2 at, std::span<const spatial::VertexShare> shares, double area_um2) {
               for (std::size_t p = 0; p < scene.patches.size(); ++p) {
                 if (norm(at - scene.patches[p].centre_um) > 1.5 * scene.patches[p].radius_um) continue;
                 for (const auto& [vertex, share] : shares)
                   areas(static_cast<Eigen::Index>(p), vertex) += share * area_um2;
               }
             });
  return areas;
}

/// Of the forces within 1.5 radii of the patches: mean relative error, and error over stated error (root mean square of
/// the components).
struct ForceErrors {
  double mean = 0, over_stated = 0;
};
inline ForceErrors force_errors(const TractionScene& scene, const std::vector<spatial::PartForce>& forces) {
  ForceErrors errors;
  const auto n = static_cast<double>(scene.patches.size());
  for (std::size_t p = 0; p < scene.patches.size(); ++p) {
    const Vec3 off = forces[p].force_nN - scene.patches[p].force_nN, s = forces[p].sigma_nN;
    errors.mean += norm(off) / norm(scene.patches[p].force_nN) / n;
    const auto square = [](double error, double sigma) { return sigma > 0 ? error * error / (sigma * sigma) : 0; };
    errors.over_stated += (square(off.x, s.x) + square(off.y, s.y) + square(off.z, s.z)) / (3 * n);
  }
  errors.over_stated = std::sqrt(errors.over_stated);
  return errors;
}

}  // namespace mbtfm::test
