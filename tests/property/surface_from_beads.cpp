/// A gel's surface from the beads below it, against surfaces that are known.
#include "pipeline/contract/errors.h"
#include "substrate/surface/beads.h"
#include "tests/support/beads_below.h"

namespace mbtfm::surface {
namespace {

using test::beads_below;
using test::Misfit;
using Height = test::HeightOf;
constexpr double kHalf = test::kBeadField_um, kSigma = test::kBeadSigma_um;

double wave(Vec2 p) { return -12 * std::cos(2 * std::numbers::pi * (p.x - 35) / 70); }
double turned_wave(Vec2 p) { return -10 * std::cos(2 * std::numbers::pi * (0.8 * p.x + 0.6 * p.y - 30) / 60); }
double groove(Vec2 p) { return 10 * (std::tanh((p.x + 20) / 9) - std::tanh((p.x - 20) / 9)); }

SurfaceFit fitted(const std::vector<Vec3>& beads) {
  return fit_beads(beads, std::vector<double>(beads.size(), kSigma));
}

Misfit misfit_of(const SurfaceFit& fit, const Height& height) {
  return test::misfit_of([&](Vec2 at) { return fit.height_um(at); }, height);
}

TEST(SurfaceFromBeads, lies_within_a_third_of_the_beads_distance_and_has_no_bias) {
  const std::vector<std::pair<std::string, Height>> surfaces = {
      {"flat", [](Vec2) { return 0.0; }}, {"wave", wave}, {"groove", groove}};
  for (const double density : {0.003, 0.0062, 0.02}) {
    const double apart = 1 / std::cbrt(density);
    const int n_seeds = density < 0.01 ? 5 : 2;
    for (const auto& [name, height] : surfaces) {
      Misfit mean;
      for (int seed = 1; seed <= n_seeds; ++seed) {
        const SurfaceFit fit = fitted(beads_below(height, density, seed));
        EXPECT_NEAR(fit.density_per_um3, density, 0.15 * density);
        const Misfit misfit = misfit_of(fit, height);
        mean.mean_um += misfit.mean_um / n_seeds;
        mean.rms_um += misfit.rms_um / n_seeds;
      }
      EXPECT_LE(mean.rms_um, 0.35 * apart) << name << " " << density;
      EXPECT_LE(std::abs(mean.mean_um), 0.2 * apart) << name << " " << density;
    }
  }
}

TEST(SurfaceFromBeads, finds_the_direction_of_crests) {
  const SurfaceFit fit = fitted(beads_below(turned_wave, 0.0062, 1));
  EXPECT_GT(fit.smoothing.ratio, 1);
  const double across = std::atan2(0.6, 0.8);
  EXPECT_LE(std::abs(std::cos(fit.smoothing.crest_rad - across)), 0.1);
  EXPECT_LE(misfit_of(fit, turned_wave).rms_um, 0.35 / std::cbrt(0.0062));
}

TEST(SurfaceFromBeads, is_not_lifted_by_stray_beads_and_names_them) {
  std::vector<Vec3> beads = beads_below(wave, 0.0062, 2);
  const Misfit without = misfit_of(fitted(beads), wave);
  const int n = static_cast<int>(beads.size());
  for (int k = 0; k < 8; ++k) {
    const Vec2 at = {-40.0 + 10 * k, 35.0 - 9 * k};
    beads.push_back({at.x, at.y, wave(at) - 8 - k});
  }
  const SurfaceFit fit = fitted(beads);
  for (int k = n; k < n + 8; ++k)
    EXPECT_TRUE(std::find(fit.above_surface.begin(), fit.above_surface.end(), k) != fit.above_surface.end()) << k - n;
  EXPECT_LE(fit.above_surface.size(), 10u);
  EXPECT_LE(misfit_of(fit, wave).rms_um, 1.3 * without.rms_um);
}

TEST(SurfaceFromBeads, refuses_by_place_what_no_bead_holds_and_sheets_of_beads) {
  const auto reason = [](const std::vector<Vec3>& beads) -> std::string {
    const auto e = test::caught<InvalidData>([&] { fitted(beads); });
    return e ? e->what() : "";
  };
  std::vector<Vec3> beads = beads_below(wave, 0.0062, 1);
  std::vector<Vec3> with_hole = beads;
  std::erase_if(with_hole, [](const Vec3& p) { return std::hypot(p.x - 30, p.y - 30) < 25; });
  EXPECT_TRUE(has_words(reason(with_hole), "none near x, y = "));
  std::vector<Vec3> sheets;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> across(-kHalf, kHalf), thick(0, 1);
  for (int k = 0; k < 6000; ++k) sheets.push_back({across(random), across(random), thick(random) + 30 * (k % 2)});
  EXPECT_TRUE(has_words(reason(sheets), "sheets"));
  beads.push_back({5000, 0, 10});
  EXPECT_TRUE(has_words(reason(beads), "none near x, y = "));
}

TEST(SurfaceFromBeads, knows_no_unit_and_bears_a_bead_far_above) {
  std::vector<Vec3> beads = beads_below(wave, 0.0062, 1);
  const Misfit alone = misfit_of(fitted(beads), wave);
  std::vector<Vec3> in_nm = beads;
  for (Vec3& p : in_nm) p = {1000 * p.x, 1000 * p.y, 1000 * p.z};
  const SurfaceFit nm = fit_beads(in_nm, std::vector<double>(in_nm.size(), 1000 * kSigma));
  const SurfaceFit um = fitted(beads);
  for (const Vec2 at : {Vec2{0, 0}, {20, -30}, {-41, 7}})
    EXPECT_NEAR(nm.height_um(1000 * at) / 1000, um.height_um(at), 0.1);
  beads.push_back({0, 0, -900});
  const SurfaceFit with = fitted(beads);
  EXPECT_EQ(with.above_surface, (std::vector<int>{static_cast<int>(beads.size()) - 1}));
  EXPECT_LE(misfit_of(with, wave).rms_um, 1.3 * alone.rms_um);
}

TEST(SurfaceFromBeads, refuses_what_shows_no_surface) {
  EXPECT_THROW(fitted({{0, 0, 1}, {1, 1, 2}}), InvalidData);
  std::vector<Vec3> beads = beads_below(wave, 0.003, 1);
  beads[7].z = std::nan("");
  EXPECT_THROW(fitted(beads), InvalidData);
  for (Vec3& bead : beads) bead.z = 4;
  EXPECT_THROW(fitted(beads), InvalidData);
}

}  // namespace
}  // namespace mbtfm::surface
