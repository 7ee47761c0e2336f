/// What chapter 4.2 of the thesis claims, computed: the traction at the tips of spikes over that at the edge of a disc,
/// on springs and on a gel, and the edge of the thesis' own colonies. Prints the tables of docs/developers/sheets.md.
#include <chrono>
#include <cstdio>
#include <numbers>

#include "continuum/sheet/forward.h"
#include "continuum/sheet/mesh_size.h"
#include "continuum/sheet/tables.h"
#include "pipeline/files/csv.h"
#include "substrate/greens/models.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::sheet;

Region outline(double radius_um, double spike_um, double w) {
  Polygon points;
  const int n = 2880;
  for (int i = 0; i < n; ++i) {
    const double t = 2 * std::numbers::pi * i / n;
    const double r = radius_um + (spike_um > 0 ? spike_um * std::exp((std::cos(4 * t) - 1) / w) : 0);
    points.push_back(r * Vec2{std::cos(t), std::sin(t)});
  }
  return {{Curve(points)}, {}};
}

/// Discs of any penetration length, against their closed form.
void print_discs() {
  const files::CsvTable csv(std::filesystem::path(MBTFM_SOURCE_DIR "/tests/data/reference/chapter4/sheet_disc.csv"));
  std::puts("disc | nodes | u | S_rr | S_tt (of the largest)");
  for (int row = 0; row < csv.n_rows();) {
    const int of_case = csv.integer(row, "case", 0);
    const auto value = [&](const char* column) { return csv.number(row, column); };
    Scene scene;
    scene.region = outline(value("radius_um"), 0, 1);
    scene.material = {value("E_kPa"), value("nu"), value("h_um")};
    scene.contraction.nN_per_um = value("s_nN_per_um");
    scene.adhesion_nN_per_um3 = value("kappa_nN_per_um3");
    scene.line_tension_nN = value("line_nN");
    scene.size = size_on_springs(scene.region, value("penetration_um"));
    const Solution solution = solve_on_springs(scene, 1);
    std::array<double, 3> off{}, largest{};
    for (; row < csv.n_rows() && csv.integer(row, "case", 0) == of_case; ++row) {
      const double c = std::cos(0.7), s = std::sin(0.7);
      const SheetPoint at = at_points_of(solution, {value("r_um") * Vec2{c, s}}).front();
      const double xx = at.sxx_nN_per_um.value(), yy = at.syy_nN_per_um.value(), xy = at.sxy_nN_per_um.value();
      const std::array<double, 3> ours = {c * at.ux_um.value() + s * at.uy_um.value(),
                                          c * c * xx + s * s * yy + 2 * c * s * xy,
                                          s * s * xx + c * c * yy - 2 * c * s * xy};
      const std::array<double, 3> exact = {value("ur_um"), value("Srr_nN_per_um"), value("Stt_nN_per_um")};
      for (std::size_t k = 0; k < 3; ++k) {
        off[k] = std::max(off[k], std::abs(ours[k] - exact[k]));
        largest[k] = std::max(largest[k], std::abs(exact[k]));
      }
    }
    std::printf("%d | %d | %.1e | %.1e | %.1e\n", of_case, solution.elements->n_nodes(), off[0] / largest[0],
                off[1] / largest[1], off[2] / largest[2]);
  }
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Vec2 displacement_at(const Solution& solution, Vec2 p) {
  const auto place = Locator(*solution.elements).find(p, 0.05);
  if (!place) return {};
  return value_of(solution.u, solution.elements->nodes(place->triangle),
                  solution.elements->shape(place->triangle, place->r, place->s));
}

Scene on_springs(double radius_um, double spike_um, double w, double nu, double l_um) {
  const Material material{100, nu, 2};
  Scene scene;
  scene.region = outline(radius_um, spike_um, w);
  scene.material = material;
  scene.contraction.nN_per_um = 1;
  scene.adhesion_nN_per_um3 = material.stiffness_nN_per_um() / (l_um * l_um);
  scene.size = size_on_springs(scene.region, l_um);
  return scene;
}

void print_spike_ratios() {
  const files::CsvTable csv(std::filesystem::path(MBTFM_SOURCE_DIR "/tests/data/reference/chapter4/spike_ratio.csv"));
  std::puts("spike um | l um | tip over edge | reference | triangles | s");
  for (int row = 0; row < csv.n_rows(); ++row) {
    const auto value = [&](const char* column) { return csv.number(row, column); };
    const double R = value("radius_um"), a = value("spike_height_um");
    const auto start = std::chrono::steady_clock::now();
    const Solution spikes = solve_on_springs(on_springs(R, a, value("w"), value("nu"), value("penetration_um")), 1);
    const double seconds = seconds_since(start);
    const Solution disc = solve_on_springs(on_springs(R, 0, value("w"), value("nu"), value("penetration_um")), 1);
    const double ratio = norm(displacement_at(spikes, {R + a, 0})) / norm(displacement_at(disc, {R, 0}));
    std::printf("%g | %g | %.3f | %.3f ± %.1f %% | %d | %.2f\n", a, value("penetration_um"), ratio,
                value("tip_over_disc_edge"), 100 * value("relative_error"), spikes.elements->n_triangles(), seconds);
  }
}

void print_thesis_edges() {
  std::puts("E kPa | s nN/um | R um | edge u um | edge T Pa");
  for (const auto& [E, s, R] : {std::array{0.4, 0.0038, 100.0}, {400.0, 3.8, 100.0}, {400.0, 3.8, 200.0}}) {
    Scene scene;
    scene.region = outline(R, 0, 1);
    scene.material = {E, 0.5, 2};
    scene.contraction.nN_per_um = s;
    scene.adhesion_nN_per_um3 = 0.12;
    scene.size = size_on_springs(scene.region, std::sqrt(scene.material.stiffness_nN_per_um() / 0.12));
    const double u = norm(displacement_at(solve_on_springs(scene, 1), {R, 0}));
    std::printf("%g | %g | %g | %.4g | %.4g\n", E, s, R, u, 1000 * 0.12 * u);
  }
}

/// Mean traction within a Gaussian's reach of the edge, as a reconstruction of that resolution has it at its largest.
double blurred_kPa(const Solution& solution, Vec2 at, double sd_um) {
  Vec2 sum;
  for (const GroundPatch& patch : solution.patches) {
    const Vec2 d = patch.position_um - at;
    sum += patch.area_um2 * std::exp(-0.5 * dot(d, d) / (sd_um * sd_um)) / (2 * std::numbers::pi * sd_um * sd_um) *
           patch.traction_kPa;
  }
  return norm(sum);
}

/// The largest within a spike's half width and three resolutions of a tip at (tip_um, 0).
double largest_near(const Solution& solution, double tip_um, double sd_um) {
  constexpr double kHalfWidth_um = 8.3;
  double largest = 0;
  for (double x = tip_um + 0.5 * sd_um; x > tip_um - 3 * sd_um; x -= 0.5 * sd_um)
    for (double y = 0; y <= kHalfWidth_um; y += 0.25 * kHalfWidth_um)
      largest = std::max(largest, blurred_kPa(solution, {x, y}, sd_um));
  return largest;
}

void print_spikes_on_gel() {
  const Gel gel{8.4, 0.49, 60};
  substrate::SubstrateParameters parameters;
  parameters.model = substrate::ModelKind::layer;
  const auto model = greens::make_greens(gel, parameters, 2);
  std::puts("E kPa x h um | resolution um | tip over edge | disc Pa | triangles | s");
  for (const auto& [E, h] : {std::array{1.0, 4.0}, {10.0, 4.0}, {100.0, 4.0}, {400.0, 2.0}}) {
    const auto scene_of = [&, E = E, h = h](double spike_um) {
      Scene scene;
      scene.region = outline(100, spike_um, 0.05);
      scene.material = {E, 0.49, h};
      scene.contraction.nN_per_um = 1;
      scene.size = size_on_gel(scene.region, scene.material, gel, std::nullopt);
      return scene;
    };
    const auto start = std::chrono::steady_clock::now();
    const Solution spikes = solve_on_gel(scene_of(50), *model, 2);
    const double seconds = seconds_since(start);
    const Solution disc = solve_on_gel(scene_of(0), *model, 2);
    for (const double sd : {4.0, 6.0, 12.0})
      std::printf("%g x %g | %g | %.2f | %.3g | %d | %.2f\n", E, h, sd,
                  largest_near(spikes, 150, sd) / largest_near(disc, 100, sd), 1000 * largest_near(disc, 100, sd),
                  spikes.elements->n_triangles(), seconds);
  }
}

}  // namespace

int main() {
  print_discs();
  print_thesis_edges();
  print_spike_ratios();
  print_spikes_on_gel();
}
