/// Sheets bonded to gels against an exact spectral solution (tests/data/reference/chapter4).
#include <gtest/gtest.h>

#include <chrono>
#include <numbers>

#include "continuum/sheet/forward.h"
#include "continuum/sheet/mesh_size.h"
#include "substrate/greens/models.h"
#include "tests/support/sheets.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::sheet;
using test::Deviation;

constexpr double kThick_um = 1e5;

struct DiscOnGel {
  double radius_um = 0;
  Scene scene;
  Gel gel;
};

DiscOnGel disc_of(const files::CsvTable& csv, int row, double finer = 1) {
  const auto value = [&](const char* column) {
    return csv.text(row, column) == "inf" ? std::numeric_limits<double>::infinity() : csv.number(row, column);
  };
  DiscOnGel disc{.radius_um = value("radius_um"), .scene = {}, .gel = {}};
  disc.gel = {value("gel_E_kPa"), value("gel_nu"), std::min(kThick_um, value("gel_thickness_um"))};
  disc.scene.region.rims.emplace_back(test::circle(disc.radius_um));
  disc.scene.material = {value("E_kPa"), value("nu"), value("h_um")};
  disc.scene.contraction.nN_per_um = value("s_nN_per_um");
  if (std::isfinite(value("adhesion_nN_per_um3"))) disc.scene.adhesion_nN_per_um3 = value("adhesion_nN_per_um3");
  disc.scene.size = size_on_gel(disc.scene.region, disc.scene.material, disc.gel, disc.scene.adhesion_nN_per_um3);
  disc.scene.size = with_edge(disc.scene.size, disc.scene.size.at_curves_um / finer);
  return disc;
}

Solution solved(const DiscOnGel& disc) {
  substrate::SubstrateParameters parameters;
  parameters.model = disc.gel.thickness_um < kThick_um ? substrate::ModelKind::layer : substrate::ModelKind::half_space;
  const auto model = greens::make_greens(disc.gel, parameters, 1);
  return solve_on_gel(disc.scene, *model, 1);
}

/// Of the bonded disc, whose traction is K / √(1 − r²/R²) near the rim; by trapezia between the points of the file
/// elsewhere no force can be had, so the reference is the tension: Σ force = 2π R times its fall over the band.
struct Errors {
  double u = 0, mean_tension = 0;
};
Errors errors_of(const files::CsvTable& csv, int first, const Solution& solution) {
  const Locator locator(*solution.elements);
  Deviation u;
  const int of_case = csv.integer(first, "case", 0);
  for (int row = first; row < csv.n_rows() && csv.integer(row, "case", 0) == of_case; ++row) {
    const double r = csv.number(row, "r_um"), c = std::cos(0.7), s = std::sin(0.7);
    const auto place = locator.find(r * Vec2{c, s}, 0.05);
    if (!place) continue;
    const Vec2 at = value_of(solution.u, solution.elements->nodes(place->triangle),
                             solution.elements->shape(place->triangle, place->r, place->s));
    u.add(c * at.x + s * at.y, csv.number(row, "sheet_ur_um"));
  }
  const double exact = csv.number(first, "mean_tension_nN_per_um");
  return {u.relative(), std::abs(balance_of(solution).mean_tension_nN_per_um - exact) / exact};
}

TEST(SheetOnGel, bonded_discs_are_the_spectral_solution) {
  const auto csv = test::chapter4("disc_on_gel");
  for (int row = 0; row < csv.n_rows(); row += 7) {
    DiscOnGel disc = disc_of(csv, row);
    if (const char* e = std::getenv("EDGE")) disc.scene.size.at_curves_um = disc.radius_um / std::atof(e);
    if (const char* e = std::getenv("GROW")) disc.scene.size.growth = std::atof(e);
    if (const char* e = std::getenv("LARGE")) disc.scene.size.largest_um = disc.radius_um / std::atof(e);
    const auto start = std::chrono::steady_clock::now();
    const Solution solution = solved(disc);
    const Errors errors = errors_of(csv, row, solution);
    const Balance balance = balance_of(solution);
    std::printf("%.2f s case %d: %d triangles, %d steps, u %.2e mean tension %.2e; net %.1e torque %.1e virial %.1e\n",
                std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
                csv.integer(row, "case", 0), solution.elements->n_triangles(), solution.report.iterations, errors.u,
                errors.mean_tension, norm(balance.net_force_nN) / balance.total_force_nN,
                std::abs(balance.net_torque_nN_um) / balance.largest_torque_nN_um,
                std::abs(balance.virial_tension_nN_per_um / balance.mean_tension_nN_per_um - 1));
    EXPECT_LE(errors.u, 0.01);
    EXPECT_LE(errors.mean_tension, 0.005);
    EXPECT_LE(norm(balance.net_force_nN), 1e-9 * balance.total_force_nN);
    EXPECT_LE(std::abs(balance.net_torque_nN_um), 1e-9 * balance.largest_torque_nN_um);
  }
}

}  // namespace
