/// tractions_in_space STUDY FOLDER SCENE...: how exact tractions in space are, on scenes whose truth is exact.
///   methods   maps, forces and sums by noise. The bars beside the numbers are those of an
///             independent dense inversion (docs/developers/tractions_in_space.md).
///   losses    the same by loss, with beads astray
///   patches   forces on patches that are known: with a background, without, and as sums of maps that know of none
///   beside    the same patches alone: how far what they leave looks like tractions beside them
///   thesis    the minimiser of the thesis: how near to the minimum, and at what price
///   meshes    three meshes of the gel by three of the tractions: how far the answers differ, over what noise does
///   refine    faces split by each rule, beside even lattices
///   surface   with the surface that the beads themselves show, in place of the true one
///   fttc      beside the usual method, of the beads just below the surface (level scenes)
#include <chrono>
#include <cstdio>
#include <iostream>
#include <map>
#include <numbers>
#include <string>

#include "mbtfm/spatial/basis.h"
#include "mbtfm/spatial/reconstruction.h"
#include "mbtfm/spatial/repeated.h"
#include "mbtfm/tractions/traction.h"
#include "substrate/choice/factory.h"
#include "substrate/surface/beads.h"
#include "tests/support/traction_scene.h"

namespace {

using namespace mbtfm;
using spatial::BeadLoss;
using test::ForceErrors;
using test::TractionScene;

struct Known {
  const TractionScene& scene;
  spatial::Problem problem;
  Eigen::MatrixXd areas_um2;

  void observe(double noise, double astray, const spatial::SpatialParameters& parameters) {
    std::vector<BeadInSpace> beads = scene.observed(noise, astray);
    problem.observed = spatial::observe(beads, scene.gel, problem.ground, parameters);
  }
  ForceErrors forces(const spatial::SpatialReconstruction& r) const {
    return test::force_errors(scene, forces_on(problem, r, areas_um2));
  }
};

/// The map with the lambda that an oracle would take, and the forces with it.
double best_map_error(const Known& known) {
  const spatial::Problem& p = known.problem;
  const auto basis =
      spatial::orthonormal_basis(norm_of(p.mesh, p.ground, [&](Vec2 at) { return p.expected.amplitude(at); }));
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(p.observed.displacement_um.size());
  const auto spectrum =
      spectrum_of(p, basis.response(p.response_um_per_kPa, 2), ones, static_cast<double>(ones.size()), 2);
  double best = 1;
  const double largest = std::sqrt(spectrum.values().maxCoeff());
  for (double lambda = 0.3 * largest; lambda > 1e-4 * largest; lambda *= 0.89)
    best = std::min(best, test::map_error(known.scene, p.mesh, basis.tractions(spectrum.solve(lambda))));
  return best;
}

void tell(const Known& known, const char* what, double noise, double astray, const spatial::SpatialReconstruction& r,
          double best) {
  const double error = test::map_error(known.scene, known.problem.mesh, r.traction_kPa);
  const ForceErrors forces = known.forces(r);
  const spatial::Balance balance = balance_of(known.problem, r);
  std::printf(
      "%-12s %-11s noise %.2f astray %.1f  map %.3f (%.2f x best)  forces %.3f  error/stated %.2f  total %.0f nN  net "
      "%.0f +- %.0f nN  energy %.0f fJ  degrees %.0f  scale %.2f  lambda %.3g (%s; risk %.3g evidence %.3g gcv %.3g; "
      "sums %.3g)\n",
      known.scene.name.c_str(), what, noise, astray, error, best > 0 ? error / best : 0.0, forces.mean,
      forces.over_stated, balance.total_force_nN, norm(balance.force_nN), norm(balance.force_sigma_nN),
      balance.strain_energy_fJ, r.degrees, r.weighing.scale, r.lambda.value_or(0),
      r.lambda_by ? name_of(*r.lambda_by) : "-", r.scan ? r.scan->by_risk : 0.0, r.scan ? r.scan->by_evidence : 0.0,
      r.scan ? r.scan->by_gcv : 0.0, r.summands ? r.summands->lambda.value_or(0) : 0.0);
  std::fflush(stdout);
}

using Method = spatial::SpatialReconstruction (*)(const spatial::Problem&, const tractions::TractionParameters&,
                                                  const spatial::SpatialParameters&, int);
constexpr std::pair<const char*, Method> kMethods[] = {{"tikhonov", spatial::reconstruct_tikhonov},
                                                       {"group-l1", spatial::reconstruct_group_l1}};

/// Its problem, with 2 % of noise and no bead astray.
Known known_of(const TractionScene& scene) {
  const spatial::SpatialInputs inputs{scene.observed(0.02), scene.gel, {}, {}};
  Known known{scene, make_problem(inputs, {}, {}, {}, 2), {}};
  known.areas_um2 = patch_areas_um2(scene, known.problem);
  std::printf("%s: %ld unknowns, spacing %.2f um, beads %.2f um apart, model error %.4f\n", scene.name.c_str(),
              static_cast<long>(known.problem.n_unknowns()), known.problem.mesh.spacing_um.x,
              known.problem.observed.distance_um, known.problem.model_error);
  return known;
}

void methods(const TractionScene& scene) {
  Known known = known_of(scene);
  for (const double noise : {0.0, 0.02, 0.05, 0.1, 0.2}) {
    known.observe(noise, 0, {});
    const double best = best_map_error(known);
    for (const auto& [name, method] : kMethods) tell(known, name, noise, 0, method(known.problem, {}, {}, 2), best);
  }
}

void losses(const TractionScene& scene) {
  Known known = known_of(scene);
  spatial::SpatialParameters parameters;
  constexpr double kNoise = 0.1;
  for (const BeadLoss loss : {BeadLoss::mixture, BeadLoss::l2, BeadLoss::huber, BeadLoss::biweight, BeadLoss::l1,
                              BeadLoss::l1_by_component}) {
    parameters.loss = loss;
    for (const double astray : {0.0, 0.1, 0.3}) {
      known.observe(kNoise, astray, parameters);
      for (const auto& [name, method] : kMethods) {
        const std::string what = std::string(name_of(loss)) + " " + name;
        tell(known, what.c_str(), kNoise, astray, method(known.problem, {}, parameters, 2), 0);
      }
    }
  }
}

// --- patches that are known

/// The same scene with another draw of its noise: each bead has that of another.
TractionScene with_draw(TractionScene scene, int draw) {
  constexpr int kApart = 397;
  std::rotate(scene.noise.begin(), scene.noise.begin() + draw * kApart, scene.noise.end());
  return scene;
}

/// Of patches as wide as the bumps are, and of such whose second moment is that of the bumps.
enum class Ways { all, patches_alone };
void patches_by(const TractionScene& scene, Ways ways) {
  using enum tractions::TractionMethod;
  constexpr int kDraws = 2;
  const double weak = spatial::SpatialParameters{}.background;
  for (const double radii : {std::numbers::sqrt2 / 2, 1.0}) {
    const spatial::SpatialInputs inputs{scene.observed(0.02), scene.gel, scene.adhesions(radii), {}};
    spatial::Problem problem = make_problem(inputs, {}, {.spacing_um = {}, .has_patches = true}, {}, 2);
    const auto areas_um2 = patch_areas_um2(scene, problem);
    const auto measure = [&](double noise, int draw, const char* what, tractions::TractionMethod method,
                             double background) {
      tractions::TractionParameters traction;
      traction.method = method;
      spatial::SpatialParameters parameters;
      parameters.background = background;
      const auto r = reconstruct(problem, inputs, traction, parameters, 2);
      const ForceErrors sums = force_errors(scene, forces_on(problem, r, areas_um2)),
                        as_told = force_errors(scene, r.forces);
      std::printf("%-12s radii %.2f noise %.2f draw %d %-19s map %.3f  sums %.3f (%.2f)  as told %.3f (%.2f) ",
                  scene.name.c_str(), radii, noise, draw, what, test::map_error(scene, problem.mesh, r.traction_kPa),
                  sums.mean, sums.over_stated, as_told.mean, as_told.over_stated);
      for (const auto& [name, value] : r.figures) {
        if (name == "misfit_of_patches_alone") std::printf(" patches alone leave %.2f", std::get<double>(value));
        if (name == "tractions_beside_patches") std::printf(" deviate %.1f", std::get<double>(value));
      }
      for (const auto& f : r.findings) std::printf(f ? " [%s]" : "", f ? f->id.c_str() : "");
      std::printf("\n");
      std::fflush(stdout);
    };
    for (const double noise : {0.02, 0.05, 0.1}) {
      for (int draw = 0; draw < kDraws; ++draw) {
        problem.observed = spatial::observe(with_draw(scene, draw).observed(noise), scene.gel, problem.ground, {});
        measure(noise, draw, "patches alone", tractions::TractionMethod::patches, 0);
        if (ways == Ways::patches_alone) continue;
        measure(noise, draw, "patches, background", tractions::TractionMethod::patches, weak);
        if (radii < 1) continue;
        measure(noise, draw, "tikhonov", tikhonov, weak);
        measure(noise, draw, "group-l1", group_l1, weak);
      }
    }
  }
}

void patches(const TractionScene& scene) { patches_by(scene, Ways::all); }
void beside(const TractionScene& scene) { patches_by(scene, Ways::patches_alone); }

// --- the thesis' minimiser

/// Processor time of what is done, all threads together.
double seconds_of(const std::function<void()>& work) {
  const std::clock_t begin = std::clock();
  work();
  return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
}

void thesis(const TractionScene& scene) {
  const spatial::SpatialInputs inputs{scene.observed(0.05), scene.gel, {}, {}};
  std::optional<spatial::Problem> problem;
  spatial::SpatialReconstruction ours, theirs;
  const double whole_s = seconds_of([&]() {
    problem = make_problem(inputs, {}, {}, {}, 2);
    ours = reconstruct_tikhonov(*problem, {}, {}, 2);
  });
  theirs = reconstruct_thesis_cg(*problem, {}, {}, 2);
  substrate::SubstrateParameters curved;
  curved.model = substrate::ModelKind::curved;
  const auto model = choice::make_substrate(scene.gel, curved, 2);
  const auto response = response_of_vertices(*model, *problem);
  response->displace(ours.traction_kPa);  // makes mesh and factor
  constexpr int kSolves = 10;
  const double solve_s = seconds_of([&]() {
                           for (int k = 0; k < kSolves; ++k) response->displace(ours.traction_kPa);
                         }) /
                         kSolves;
  std::int64_t steps = 0, solves = 0;
  for (const auto& [name, value] : theirs.figures) {
    if (name == "thesis_steps") steps = std::get<std::int64_t>(value);
    if (name == "thesis_direct_solves") solves = std::get<std::int64_t>(value);
  }
  std::printf(
      "%-12s %ld unknowns  apart %.1e  %ld steps, %ld solves of %.3f s: %.3g s for %.1f s of ours (with mesh, factor, "
      "lambda and errors), %.0f times\n",
      scene.name.c_str(), static_cast<long>(problem->n_unknowns()),
      (theirs.traction_kPa - ours.traction_kPa).norm() / ours.traction_kPa.norm(), static_cast<long>(steps),
      static_cast<long>(solves), solve_s, static_cast<double>(solves) * solve_s, whole_s,
      static_cast<double>(solves) * solve_s / whole_s);
  std::fflush(stdout);
}

// --- meshes

/// At the places of the scene's truth, three a place, each times the root of its area: distances are those of L2.
Eigen::VectorXd map_of(const TractionScene& scene, const spatial::TractionMesh& mesh, const Eigen::VectorXd& t_kPa) {
  Eigen::VectorXd map(3 * static_cast<Eigen::Index>(scene.lattice_um.size()));
  for (std::size_t k = 0; k < scene.lattice_um.size(); ++k) {
    const Vec3 t = std::sqrt(scene.areas_um2[k]) * test::traction_at(mesh, t_kPa, scene.lattice_um[k]);
    map.segment<3>(3 * static_cast<Eigen::Index>(k)) << t.x, t.y, t.z;
  }
  return map;
}

/// Of one pair of meshes, with the noise of the scene, and with the same noise of the other sign.
struct OnMeshes {
  double tolerance = 0, spacing_um = 0;
  Eigen::VectorXd map, mirrored;
  double error = 0, forces = 0;
};

void meshes(const TractionScene& scene) {
  constexpr double kNoise = 0.05;
  constexpr double kTolerances[] = {0.05, 0.02, 0.005}, kSpacings[] = {1.2, 1, 0.75};
  const spatial::SpatialParameters parameters;
  std::map<std::string, std::vector<OnMeshes>> found;
  for (const double tolerance : kTolerances) {
    for (const double share : kSpacings) {
      spatial::SpatialInputs inputs{scene.observed(kNoise), scene.gel, {}, {}};
      substrate::SubstrateParameters gel;
      gel.displacement_tolerance = tolerance;
      const double beads_um =
          observe(inputs.beads, scene.gel, spatial::Ground(scene.gel.surface.get()), parameters).distance_um;
      Known known{scene,
                  make_problem(inputs, parameters, {.spacing_um = share * parameters.spacing_beads * beads_um}, gel, 2),
                  {}};
      known.areas_um2 = patch_areas_um2(scene, known.problem);
      for (const auto& [name, method] : kMethods) {
        OnMeshes on{tolerance, known.problem.mesh.spacing_um.x, {}, {}, 0, 0};
        for (const double sign : {-1.0, 1.0}) {
          known.observe(sign * kNoise, 0, parameters);
          const auto r = method(known.problem, {}, parameters, 2);
          (sign < 0 ? on.mirrored : on.map) = map_of(scene, known.problem.mesh, r.traction_kPa);
          on.error = test::map_error(scene, known.problem.mesh, r.traction_kPa);
          on.forces = known.forces(r).mean;
        }
        std::printf("%-12s %-9s tolerance %.3f (states %.4f) spacing %.2f um (%d vertices)  map %.3f  forces %.3f\n",
                    scene.name.c_str(), name, tolerance, known.problem.model_error, on.spacing_um,
                    known.problem.mesh.n_vertices(), on.error, on.forces);
        std::fflush(stdout);
        found[name].push_back(on);
      }
    }
  }
  for (const auto& [name, all] : found) {
    const OnMeshes& usual = all[4];
    const double noise = (usual.map - usual.mirrored).norm() / 2;
    for (const OnMeshes& on : all) {
      std::printf("%-12s %-9s tolerance %.3f spacing %.2f um: differs by %.3f of what noise does\n", scene.name.c_str(),
                  name.c_str(), on.tolerance, on.spacing_um, (on.map - usual.map).norm() / noise);
    }
  }
}

// --- faces that are split

/// The problem with other faces, which lie on the lattice of `fine`: the same tractions displace the beads alike.
spatial::Problem on_faces(const spatial::Problem& fine, const spatial::TractionMesh& mesh) {
  Eigen::MatrixXd by_component = Eigen::MatrixXd::Zero(fine.n_unknowns(), 3 * mesh.n_vertices());
  for (Eigen::Index v = 0; v < fine.mesh.n_vertices(); ++v) {
    for (const auto& [vertex, share] : shares_at(mesh, fine.mesh.quads.points_um[v]))
      for (Eigen::Index c = 0; c < 3; ++c) by_component(3 * v + c, 3 * vertex + c) += share;
  }
  spatial::Problem other = fine;
  other.mesh = mesh;
  other.response_um_per_kPa = fine.response_um_per_kPa * by_component;
  other.surface_um_per_kPa.resize(0, 0);
  return other;
}

void refine(const TractionScene& scene) {
  const spatial::SpatialParameters parameters;
  const std::vector<BeadInSpace> beads = scene.observed(0.02);
  const auto problem_with = [&](spatial::Meshing meshing) {
    return make_problem({beads, scene.gel, {}, {}}, parameters, meshing, {}, 2);
  };
  const spatial::Ground ground(scene.gel.surface.get());
  const spatial::Observed observed = observe(beads, scene.gel, ground, parameters);
  const double d = observed.distance_um;
  const auto compare = [&](Known& known, const char* what, double noise) {
    for (const auto& [name, method] : kMethods) {
      known.areas_um2 = patch_areas_um2(scene, known.problem);
      known.observe(noise, 0, parameters);
      const auto begin = std::chrono::steady_clock::now();
      const auto r = method(known.problem, {}, parameters, 2);
      const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
      std::printf("%-12s %-10s %-9s noise %.2f  %d vertices, %.2f um  map %.3f  forces %.3f (%.2f)  %.1f s\n",
                  scene.name.c_str(), what, name, noise, known.problem.mesh.n_vertices(),
                  std::ldexp(known.problem.mesh.spacing_um.x, -known.problem.mesh.finest_level()),
                  test::map_error(scene, known.problem.mesh, r.traction_kPa), known.forces(r).mean,
                  known.forces(r).over_stated, seconds.count());
      std::fflush(stdout);
    }
  };
  constexpr double kNoises[] = {0.0, 0.02, 0.05, 0.1, 0.2};
  constexpr double kEven = 1.06, kLargest = 1.66;  // of the distance of the beads; even: about as many as `resolved`
  Known even{scene, problem_with({.spacing_um = kEven * d}), {}};
  for (const double noise : kNoises) compare(even, "even", noise);
  const spatial::Rectangle over = expected_tractions({beads, scene.gel, {}, {}}, observed, ground, parameters, 0).over;
  const spatial::TractionMesh large = make_traction_mesh(ground, over, kLargest * d, [](Vec2) { return true; });
  const spatial::Meshing all_split{.spacing_um = {},
                                   .mesh = with_split(large, ground, std::vector<bool>(large.leaves.size(), true))};
  const Known fine{scene, problem_with(all_split), {}};
  for (const double noise : kNoises) {
    Known unsplit{scene, on_faces(fine.problem, large), {}};
    compare(unsplit, "large", noise);
    Known all{scene, fine.problem, {}};
    compare(all, "all split", noise);
    const auto first = spatial::reconstruct_tikhonov(unsplit.problem, {}, parameters, 2);
    for (const spatial::Refine rule : {spatial::Refine::resolved, spatial::Refine::threshold}) {
      Known split{
          scene,
          on_faces(fine.problem, with_split(large, fine.problem.ground, faces_to_split(unsplit.problem, first, rule))),
          {}};
      compare(split, name_of(rule), noise);
    }
  }
}

// --- the surface of the beads themselves

/// As the beads show it, their places known as well as their displacements.
TractionScene with_surface_of_beads(TractionScene scene, double noise) {
  std::vector<Vec3> places = scene.beads_um;
  const double sigma_um = 3 * noise * scene.largest_um / std::numbers::sqrt2;  // a displacement has two places' errors
  for (std::size_t b = 0; b < places.size(); ++b) places[b].z += sigma_um * scene.noise[places.size() - 1 - b].z;
  const surface::SurfaceFit fit = surface::fit_beads(places, std::vector<double>(places.size(), sigma_um));
  const surface::Height truth(*scene.gel.surface);
  double squares = 0;
  for (const Vec2 at : scene.lattice_um) squares += std::pow(fit.height_um(at) - truth(at), 2);
  std::printf("%-12s surface of %zu beads: rms %.2f um\n", scene.name.c_str(), places.size(),
              std::sqrt(squares / static_cast<double>(scene.lattice_um.size())));
  const surface::Lattice& l = fit.lattice;  // as mbtfm-surface has it: where beads are
  scene.gel.surface = std::make_shared<const HeightMap>(surface::sampled(
      [&](Vec2 at) { return fit.height_um(at); }, l.corner_um, at_place(l, {1.0 * l.n_x, 1.0 * l.n_y}), 1));
  return scene;
}

void with_estimated_surface(const TractionScene& scene) {
  if (!scene.gel.surface) return;
  const spatial::SpatialParameters parameters;
  for (const double noise : {0.02, 0.05, 0.1}) {
    const TractionScene estimated = with_surface_of_beads(scene, noise);
    for (const TractionScene* used : {&scene, &estimated}) {
      Known known{*used, make_problem({used->observed(noise), used->gel, {}, {}}, parameters, {}, {}, 2), {}};
      known.areas_um2 = patch_areas_um2(*used, known.problem);
      for (const auto& [name, method] : kMethods)
        tell(known, name, noise, 0, method(known.problem, {}, parameters, 2), 0);
    }
  }
}

// --- beside FTTC

/// Of the parts along the surface.
double error_along(const TractionScene& scene, const std::function<Vec2(Vec2)>& found_kPa) {
  double wrong = 0, size = 0;
  for (std::size_t k = 0; k < scene.lattice_um.size(); ++k) {
    const Vec2 truth{scene.traction_kPa[k].x, scene.traction_kPa[k].y};
    wrong += scene.areas_um2[k] * dot(found_kPa(scene.lattice_um[k]) - truth, found_kPa(scene.lattice_um[k]) - truth);
    size += scene.areas_um2[k] * dot(truth, truth);
  }
  return std::sqrt(wrong / size);
}

/// The traction of the nearest patch.
Vec2 nearest_kPa(const std::vector<GroundPatch>& patches, Vec2 at) {
  const auto nearer = [&](const auto& a, const auto& b) { return norm(a.position_um - at) < norm(b.position_um - at); };
  return std::min_element(patches.begin(), patches.end(), nearer)->traction_kPa;
}

DisplacementField upper_beads(const TractionScene& scene, double noise, double deepest_um) {
  DisplacementField field;
  for (const BeadInSpace& b : scene.observed(noise)) {
    if (b.position_um.z > deepest_um) continue;
    field.push_back({.position_um = {b.position_um.x, b.position_um.y},
                     .displacement_um = {b.displacement_um.x, b.displacement_um.y},
                     .sigma_um = b.sigma_um,
                     .flag = {}});
  }
  return field;
}

void beside_fttc(const TractionScene& scene) {
  const spatial::SpatialParameters parameters;
  for (const double noise : {0.0, 0.02, 0.05, 0.1}) {
    for (const double deepest_um : {2.0, 4.0, 8.0}) {
      const DisplacementField field = upper_beads(scene, std::max(noise, 1e-4), deepest_um);
      const auto fttc = tractions::reconstruct_fttc({field, scene.gel, {}, {}}, {}, 2);
      std::printf("%-12s fttc      noise %.2f  %zu beads above %.0f um  along the surface %.3f\n", scene.name.c_str(),
                  noise, field.size(), deepest_um,
                  error_along(scene, [&](Vec2 at) { return nearest_kPa(fttc.patches, at); }));
    }
    Known known{scene, make_problem({scene.observed(noise), scene.gel, {}, {}}, parameters, {}, {}, 2), {}};
    for (const auto& [name, method] : kMethods) {
      const auto r = method(known.problem, {}, parameters, 2);
      std::printf("%-12s %-9s noise %.2f  all beads  along the surface %.3f\n", scene.name.c_str(), name, noise,
                  error_along(scene, [&](Vec2 at) {
                    const Vec3 t = test::traction_at(known.problem.mesh, r.traction_kPa, at);
                    return Vec2{t.x, t.y};
                  }));
    }
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::map<std::string, void (*)(const TractionScene&)> studies = {
      {"methods", methods}, {"losses", losses}, {"patches", patches}, {"beside", beside},
      {"thesis", thesis},   {"meshes", meshes}, {"refine", refine},   {"surface", with_estimated_surface},
      {"fttc", beside_fttc}};
  if (argc < 4 || !studies.contains(argv[1])) {
    std::cerr << "usage: tractions_in_space methods|losses|patches|beside|thesis|meshes|refine|surface|fttc FOLDER "
                 "SCENE...\n";
    return 2;
  }
  for (int k = 3; k < argc; ++k) studies.at(argv[1])(test::traction_scene(std::filesystem::path(argv[2]) / argv[k]));
}
