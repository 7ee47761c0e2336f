#include "samples/gels/scene.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/stage/parameters.h"
#include "samples/drawing/random.h"

namespace mbtfm::gels {
namespace {

using drawing::Random;
using drawing::Stream;
using std::numbers::pi;

Eigen::Vector3d as_eigen(Vec3 v) { return {v.x, v.y, v.z}; }
Vec3 as_vec(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

// --- surfaces; x and y from the middle of the field

double groove(double x, double depth, double width) {
  constexpr double kWall = 10;  // um: a wall of 56 degrees at a depth of 30 um
  return depth / 2 * (std::tanh((x + width / 2) / kWall) - std::tanh((x - width / 2) / kWall));
}

std::function<double(Vec2)> height_about_the_middle(SpaceScene scene) {
  switch (scene) {
    case SpaceScene::none:
    case SpaceScene::patches_on_ring:
      return [](Vec2) { return 0.0; };
    case SpaceScene::wave:  // its valley in the middle
      return [](Vec2 p) { return 10 * std::cos(2 * pi * p.x / 60); };
    case SpaceScene::groove_edge:
      return [](Vec2 p) { return groove(p.x - 35, 30, 70); };
    case SpaceScene::between_grooves: {
      constexpr double kRidge = 50;  // um: the cell's size; the thesis does not say
      return [](Vec2 p) { return groove(p.x - kRidge / 2 - 60, 25, 120) + groove(p.x + kRidge / 2 + 60, 25, 120); };
    }
    case SpaceScene::between_waves:
      return [](Vec2 p) { return 15 * std::cos(2 * pi * p.x / 60); };
  }
  throw InternalError("a scene without a surface");
}

struct Surface {
  std::function<double(Vec2)> height;
  Vec3 at(Vec2 p) const { return {p.x, p.y, height(p)}; }
  Vec2 slope(Vec2 p) const {
    constexpr double kStep = 1e-4;
    return {(height(p + Vec2{kStep, 0}) - height(p - Vec2{kStep, 0})) / (2 * kStep),
            (height(p + Vec2{0, kStep}) - height(p - Vec2{0, kStep})) / (2 * kStep)};
  }
  /// Out of the gel, not of length 1: that is the area of the surface over one of the plane.
  Vec3 area_normal(Vec2 p) const {
    const Vec2 s = slope(p);
    return {s.x, s.y, -1};
  }
  Vec3 normal(Vec2 p) const {
    const Vec3 n = area_normal(p);
    return (1 / norm(n)) * n;
  }
  Vec3 tangent(Vec2 p, Vec3 along) const {
    const Vec3 n = normal(p), t = along - dot(along, n) * n;
    return norm(t) > 1e-9 ? (1 / norm(t)) * t : Vec3{};
  }
};

// --- patches

/// A bump of traction: its value in the middle.
struct Bump {
  Patch patch;
  Vec3 traction_kPa;
};

double share_at(const Bump& bump, Vec3 place) {
  const double r = norm(place - bump.patch.centre_um) / bump.patch.radius_um;
  return r < 1 ? (1 - r * r) * (1 - r * r) : 0;
}

/// The integral of (1 - r²/a²)² over a disc.
double bump_area(double radius) { return pi * radius * radius / 3; }

Bump bump_of(const Surface& surface, Vec2 centre, double radius, Vec3 traction) {
  return {
      {.centre_um = surface.at(centre), .radius_um = radius, .aimed_nN = bump_area(radius) * traction, .force_nN = {}},
      traction};
}

/// Three patches in a ring at the edge of a round cell: tangential tractions inwards, and normal ones at random; a
/// nucleus in the middle takes up what is left (thesis 2.4).
std::vector<Bump> on_a_ring(const Surface& surface, Vec2 middle, double traction_kPa, Random& random) {
  constexpr double kCell = 25, kRing = 8, kNucleus = 10;  // um
  std::vector<Bump> bumps;
  const double turn = random.uniform(0, 2 * pi);
  Vec3 sum;
  for (int k = 0; k < 3; ++k) {
    const double angle = turn + 2 * pi / 3 * k + random.uniform(-0.4, 0.4),
                 from_middle = kCell - random.uniform(0, kRing);
    const Vec2 out{std::cos(angle), std::sin(angle)};
    const Vec3 pull{-traction_kPa * out.x, -traction_kPa * out.y, random.uniform(-0.4, 0.4) * traction_kPa};
    bumps.push_back(bump_of(surface, middle + from_middle * out, random.uniform(5, 8), pull));
    sum += bumps.back().patch.aimed_nN;
  }
  bumps.push_back(bump_of(surface, middle, kNucleus, (-1 / bump_area(kNucleus)) * sum));
  return bumps;
}

/// The place to which forces of these sizes point from these places without a sum: where the sum of the distances,
/// weighed by them, is least (Weiszfeld 1937).
Vec3 balanced_target(const std::vector<Vec3>& places, const std::vector<double>& sizes) {
  Vec3 target;
  for (const Vec3& p : places) target += (1 / static_cast<double>(places.size())) * p;
  for (int round = 0; round < 2000; ++round) {
    Vec3 sum;
    double weight = 0;
    for (std::size_t k = 0; k < places.size(); ++k) {
      const double w = sizes[k] / std::max(1e-6, norm(target - places[k]));
      sum += w * places[k], weight += w;
    }
    target = (1 / weight) * sum;
  }
  return target;
}

/// Patches on both sides of the middle, all pulling towards one point that balances them (thesis 2.5).
std::vector<Bump> about_a_point(const Surface& surface, Vec2 middle, double reach, double traction_kPa,
                                Random& random) {
  std::vector<Vec2> places;
  std::vector<Vec3> in_space;
  std::vector<double> radii, sizes;
  for (int k = 0; k < 6; ++k) {
    const double side = k % 2 == 0 ? -1 : 1;
    const Vec2 at = middle + Vec2{side * reach * random.uniform(0.7, 1), 24.0 * (k / 2 - 1) + random.uniform(-4, 4)};
    places.push_back(at);
    in_space.push_back(surface.at(at));
    radii.push_back(random.uniform(6, 8.5));
    sizes.push_back(traction_kPa * bump_area(radii.back()));
  }
  const Vec3 target = balanced_target(in_space, sizes);
  std::vector<Bump> bumps;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Vec3 to = target - in_space[k];
    bumps.push_back(bump_of(surface, places[k], radii[k], (traction_kPa / std::max(1e-6, norm(to))) * to));
  }
  return bumps;
}

std::vector<Bump> bumps_of(SpaceScene scene, const Surface& surface, Vec2 middle, double traction_kPa, Random& random) {
  switch (scene) {
    case SpaceScene::patches_on_ring:
      return on_a_ring(surface, middle, traction_kPa, random);
    case SpaceScene::groove_edge:
      return about_a_point(surface, middle, 18, traction_kPa, random);
    case SpaceScene::between_grooves:
      return about_a_point(surface, middle, 24, traction_kPa, random);
    default:
      return about_a_point(surface, middle, 22, traction_kPa, random);
  }
}

// --- the forces that make them

/// Places over the patches, as far out of the gel as they are apart.
std::vector<Eigen::Vector3d> places_outside(const Surface& surface, const std::vector<Bump>& bumps) {
  constexpr double kApart = 3;  // um: half of what a bump is wide
  std::vector<Eigen::Vector3d> places;
  std::vector<Vec3> taken;
  for (const Bump& bump : bumps) {
    const double reach = bump.patch.radius_um + kApart;
    const Vec3 c = bump.patch.centre_um;
    const int n = static_cast<int>(reach / (0.8 * kApart)) + 1;
    for (int j = -n; j <= n; ++j) {
      for (int i = -n; i <= n; ++i) {
        const Vec2 at{c.x + kApart * (i + 0.5 * (j & 1)), c.y + 0.866 * kApart * j};  // triangles
        const Vec3 on = surface.at(at);
        if (norm(on - c) > reach) continue;
        const Vec3 place = on + kApart * surface.normal(at);
        // patches that touch share their places; a hollow brings places over its sides together
        const bool is_taken = std::ranges::any_of(taken, [&](Vec3 t) { return norm(t - place) < 0.6 * kApart; });
        // over a hollow the normals meet: a place must lie outside of the gel on all sides
        const bool is_outside = surface.height({place.x, place.y}) - place.z > 0.5 * kApart;
        if (is_taken || !is_outside) continue;
        taken.push_back(place);
        places.push_back(as_eigen(place));
      }
    }
  }
  return places;
}

Eigen::Vector3d traction(const FieldUnderASurface& field, const Surface& surface, Vec2 at) {
  return field.stress_kPa(as_eigen(surface.at(at))) * as_eigen(surface.normal(at));
}

struct Row {
  Vec2 at;
  double area = 0;  ///< of the surface that it represents
};
/// Fine near the patches, coarse elsewhere.
std::vector<Row> rows_of(const Surface& surface, const std::vector<Bump>& bumps, double field_um) {
  constexpr double kCoarse = 4.5, kNear = 1.4;
  constexpr int kFiner = 3;
  std::vector<Row> rows;
  const int n = static_cast<int>(field_um / kCoarse);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const Vec2 corner{i * kCoarse, j * kCoarse}, middle = corner + Vec2{kCoarse / 2, kCoarse / 2};
      const bool is_near = std::ranges::any_of(bumps, [&](const Bump& b) {
        const Vec3 d = surface.at(middle) - b.patch.centre_um;
        return norm(d) < kNear * b.patch.radius_um + kCoarse;
      });
      const int finer = is_near ? kFiner : 1;
      const double step = kCoarse / finer;
      for (int l = 0; l < finer; ++l) {
        for (int k = 0; k < finer; ++k) {
          const Vec2 at = corner + Vec2{(k + 0.5) * step, (l + 0.5) * step};
          rows.push_back({at, step * step * norm(surface.area_normal(at))});
        }
      }
    }
  }
  return rows;
}

Vec3 aimed_traction(const std::vector<Bump>& bumps, Vec3 place) {
  Vec3 sum;
  for (const Bump& bump : bumps) sum += share_at(bump, place) * bump.traction_kPa;
  return sum;
}

/// Places of the surface within a lateral distance of 1.5 radii of a patch.
std::vector<Row> rows_within(const Surface& surface, const Patch& patch, double step_um) {
  constexpr double kReach = 1.5;  // radii
  std::vector<Row> rows;
  const int n = static_cast<int>(kReach * patch.radius_um / step_um) + 1;
  for (int j = -n; j <= n; ++j) {
    for (int i = -n; i <= n; ++i) {
      const Vec2 away{i * step_um, j * step_um}, at = Vec2{patch.centre_um.x, patch.centre_um.y} + away;
      if (norm(away) <= kReach * patch.radius_um)
        rows.push_back({at, step_um * step_um * norm(surface.area_normal(at))});
    }
  }
  return rows;
}

Eigen::Vector3d force_through(const FieldUnderASurface& field, const Surface& surface, const std::vector<Row>& rows) {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (const Row& row : rows) force += row.area * traction(field, surface, row.at);
  return force;
}

/// Least squares of the traction over the surface. The sum of forces and that of moments are held at zero, and the
/// force through each patch at the one it is aimed at.
std::vector<FieldUnderASurface::Source> fitted_sources(const Surface& surface, const std::vector<Bump>& bumps,
                                                       const SceneSize& size, int threads) {
  const std::vector<Eigen::Vector3d> places = places_outside(surface, bumps);
  const std::vector<Row> rows = rows_of(surface, bumps, size.field_um);
  const auto n_rows = static_cast<Eigen::Index>(rows.size()), n = static_cast<Eigen::Index>(3 * places.size());
  constexpr double kStep = 1;  // um: of the forces through patches, which are smooth over 6 um
  std::vector<std::vector<Row>> within;
  for (const Bump& bump : bumps) within.push_back(rows_within(surface, bump.patch, kStep));
  const auto n_patches = std::ssize(bumps);
  Eigen::MatrixXd a(3 * n_rows, n), through(3 * n_patches, n);
  Eigen::VectorXd b(3 * n_rows);
  numerics::parallel_for(static_cast<int>(places.size()), threads, [&](int s) {
    for (int c = 0; c < 3; ++c) {
      const FieldUnderASurface unit({{places[s], Eigen::Vector3d::Unit(c)}}, size.gel.youngs_modulus_kPa,
                                    size.gel.poisson_ratio, size.gel.thickness_um);
      for (Eigen::Index r = 0; r < n_rows; ++r) {
        const Row& row = rows[r];
        a.col(3 * s + c).segment<3>(3 * r) = std::sqrt(row.area) * traction(unit, surface, row.at);
      }
      for (Eigen::Index p = 0; p < n_patches; ++p)
        through.col(3 * s + c).segment<3>(3 * p) = force_through(unit, surface, within[p]);
    }
  });
  for (Eigen::Index r = 0; r < n_rows; ++r) {
    const Row& row = rows[r];
    b.segment<3>(3 * r) = std::sqrt(row.area) * as_eigen(aimed_traction(bumps, surface.at(row.at)));
  }
  const Eigen::Index n_all = n + 6 + 3 * n_patches;
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n_all, n_all);
  system.topLeftCorner(n, n) = a.transpose() * a;
  constexpr double kRidge = 1e-5;  // of the mean diagonal: forces of opposite sign side by side do not grow
  system.diagonal().head(n).array() += kRidge * system.diagonal().head(n).mean();
  const Eigen::Vector3d middle(size.field_um / 2, size.field_um / 2, 0);
  const double scale = system.diagonal().head(n).mean();
  for (std::size_t s = 0; s < places.size(); ++s) {
    const Eigen::Vector3d arm = (places[s] - middle) / size.field_um;
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector3d moment = arm.cross(Eigen::Vector3d::Unit(c));
      const auto at = static_cast<Eigen::Index>(3 * s) + c;
      system(at, n + c) = system(n + c, at) = scale;
      for (int m = 0; m < 3; ++m) system(at, n + 3 + m) = system(n + 3 + m, at) = scale * moment[m];
    }
  }
  system.bottomLeftCorner(3 * n_patches, n) = scale * through;
  system.topRightCorner(n, 3 * n_patches) = scale * through.transpose();
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n_all);
  right.head(n) = a.transpose() * b;
  for (Eigen::Index p = 0; p < n_patches; ++p)
    right.segment<3>(n + 6 + 3 * p) = scale * as_eigen(bumps[p].patch.aimed_nN);
  const Eigen::VectorXd f = system.partialPivLu().solve(right).head(n);
  std::vector<FieldUnderASurface::Source> sources;
  for (std::size_t s = 0; s < places.size(); ++s)
    sources.push_back({places[s], f.segment<3>(static_cast<Eigen::Index>(3 * s))});
  return sources;
}

// --- what is measured

void sample_surface(GelScene& scene, const Surface& surface, const std::vector<Bump>& bumps, int threads) {
  constexpr double kStep = 2.5;
  const FieldUnderASurface field = scene.exact();
  const int n = static_cast<int>(scene.field_um / kStep);
  scene.surface.resize(static_cast<std::size_t>(n) * n);
  std::vector<double> off(scene.surface.size()), all(scene.surface.size());
  numerics::parallel_for(n * n, threads, [&](int k) {
    const Vec2 at{(k % n + 0.5) * kStep, (k / n + 0.5) * kStep};
    const Vec3 t = as_vec(traction(field, surface, at));
    const auto place = static_cast<std::size_t>(k);
    scene.surface[place] = {surface.at(at), surface.normal(at), t};
    const Vec3 d = t - aimed_traction(bumps, surface.at(at));
    const double area = norm(surface.area_normal(at));
    off[place] = area * dot(d, d), all[place] = area * dot(t, t);
  });
  double sum_off = 0, sum = 0;
  for (std::size_t k = 0; k < all.size(); ++k) sum_off += off[k], sum += all[k];
  scene.share_beside_patches = sum > 0 ? sum_off / sum : 0;
}

void measure_patches(GelScene& scene, const Surface& surface, const std::vector<Bump>& bumps, int threads) {
  const FieldUnderASurface field = scene.exact();
  scene.patches.resize(bumps.size());
  numerics::parallel_for(static_cast<int>(bumps.size()), threads, [&](int p) {
    constexpr double kStep = 0.5;  // um
    Patch patch = bumps[p].patch;
    patch.force_nN = as_vec(force_through(field, surface, rows_within(surface, patch, kStep)));
    scene.patches[p] = patch;
  });
}

void place_beads(GelScene& scene, const Surface& surface, const SpaceParameters& p, const SceneSize& size,
                 int threads) {
  Random random(size.seed, Stream::beads);
  const FieldUnderASurface field = scene.exact();
  std::vector<Vec3> places;
  for (int k = 0; k < size.n_beads; ++k) {
    const Vec2 at{random.uniform(0, size.field_um), random.uniform(0, size.field_um)};
    const double top = surface.height(at);
    places.push_back({at.x, at.y, random.uniform(top, std::min(top + p.bead_depth_um, size.gel.thickness_um))});
  }
  scene.truth.resize(places.size());
  numerics::parallel_for(static_cast<int>(places.size()), threads, [&](int k) {
    const Vec3 place = places[k];
    scene.truth[k] = {
        .position_um = place, .displacement_um = as_vec(field.displacement_um(as_eigen(place))), .flag = {}};
  });
  for (const BeadInSpace& bead : scene.truth)
    scene.largest_displacement_um = std::max(scene.largest_displacement_um, norm(bead.displacement_um));
  for (int k = 0; k < p.surface_beads; ++k)
    scene.surface_beads_um.push_back(surface.at({random.uniform(0, size.field_um), random.uniform(0, size.field_um)}));
}

void add_noise(GelScene& scene, const SpaceParameters& p, const SceneSize& size) {
  Random random(size.seed, Stream::noise);
  scene.noise_um = size.noise * scene.largest_displacement_um;
  scene.measured = scene.truth;
  for (BeadInSpace& bead : scene.measured) {
    const Vec3 noise{random.normal(), random.normal(), p.axial_noise * random.normal()};
    const double fate = random.uniform();
    const Vec3 stray{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5)};
    // a stray bead has the box in place of its displacement (thesis, fig. 2.7)
    bead.displacement_um += fate < p.outlier_fraction ? p.outlier_box_um * stray : scene.noise_um * noise;
    bead.sigma_um = scene.noise_um, bead.sigma_z_um = p.axial_noise * scene.noise_um;
  }
}

void require_room(const SpaceParameters& p, const SceneSize& size, const Surface& surface) {
  constexpr double kLeast = 70;  // um: the cell and ten to either side
  if (size.field_um < kLeast) {
    throw UsageError("expected a field of " + brief(kLeast) +
                     " um or more (image_size_px x pixel_size_um) with --scene, found " + brief(size.field_um));
  }
  double deepest = 0;
  for (int k = 0; k < 500; ++k)
    deepest = std::max(deepest, surface.height({k * size.field_um / 500, size.field_um / 2}));
  constexpr double kGel = 10;  // um of gel under the deepest place
  if (size.gel.thickness_um < deepest + kGel) {
    throw UsageError("expected gel.thickness_um of at least " + brief(deepest + kGel) + " with --scene " +
                     name_of(p.scene) + ", whose surface goes down to " + brief(deepest) + " um");
  }
  if (size.gel.poisson_ratio > 0.4999)
    throw UsageError("expected gel.poisson_ratio up to 0.4999 with --scene: the exact field has no limit beyond");
}

}  // namespace

void declare(stage::ParameterList& list, SpaceParameters& p) {
  list.table("space");
  list.add("scene", p.scene);
  list.add("traction_kPa", p.traction_kPa, Range::modulus_kPa());
  list.add("bead_depth_um", p.bead_depth_um, Range::size_um());
  list.add("axial_noise", p.axial_noise, Range::factor());
  list.add("outlier_fraction", p.outlier_fraction, Range::between(0, 1));
  list.add("outlier_box_um", p.outlier_box_um, Range::size_um());
  list.add("surface_beads", p.surface_beads, Range::between(0, 1000000));
  list.add("z_step_um", p.z_step_um, Range::mesh_um());
  list.add("numerical_aperture", p.numerical_aperture, Range::between(0.2, 1.25));
  list.add("gel_index", p.gel_index, Range::between(1.3, 1.6));
  list.add("immersion_index", p.immersion_index, Range::between(1.3, 1.6));
  list.add("peak_photons", p.peak_photons, Range::between(1, 1e6));
  list.add("bleached", p.bleached, Range::between(0, 0.9));
  list.add("slice_drift_um", p.slice_drift_um, Range::between(0, 10));
}

HeightMap map_of(const GelScene& scene) {
  constexpr int kLines = 93;
  const double step = scene.field_um / (kLines - 1);
  HeightMap map{.origin_um = {}, .spacing_um = {step, step}, .n_x = kLines, .n_y = kLines, .z_um = {}, .sigma_um = {}};
  for (int k = 0; k < kLines * kLines; ++k)
    map.z_um.push_back(scene.height_um(map.vertex_um(static_cast<std::size_t>(k))));
  return map;
}

GelScene simulate(const SpaceParameters& p, const SceneSize& size, int threads, const Progress& progress) {
  MBTFM_ASSERT(p.scene != SpaceScene::none);
  const auto tell = [&](double fraction, const char* what) {
    if (progress) progress(fraction, what);
  };
  const Vec2 middle{size.field_um / 2, size.field_um / 2};
  GelScene scene{
      .height_um = [about = height_about_the_middle(p.scene), middle](Vec2 at) { return about(at - middle); },
      .field_um = size.field_um,
      .gel = size.gel,
      .sources = {},
      .patches = {},
      .surface = {},
      .truth = {},
      .measured = {},
      .surface_beads_um = {}};
  const Surface surface{scene.height_um};
  require_room(p, size, surface);
  Random random(size.seed, Stream::adhesions);
  const std::vector<Bump> bumps = bumps_of(p.scene, surface, middle, p.traction_kPa, random);
  tell(0, "fitting forces over the surface");
  scene.sources = fitted_sources(surface, bumps, size, threads);
  tell(0.3, "moving beads");
  place_beads(scene, surface, p, size, threads);
  add_noise(scene, p, size);
  sample_surface(scene, surface, bumps, threads);
  measure_patches(scene, surface, bumps, threads);
  return scene;
}

}  // namespace mbtfm::gels
