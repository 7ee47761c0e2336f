/// Hard cases of gels that are not flat and not linear: their surfaces, as users have them, and their mechanics.
#include "pipeline/contract/errors.h"
#include "substrate/choice/factory.h"
#include "substrate/choice/large_strain.h"
#include "substrate/loads.h"
#include "substrate/response.h"
#include "substrate/surface/beads.h"
#include "substrate/surface/formula.h"
#include "tests/support/beads_below.h"
#include "tests/support/hard_case.h"

namespace mbtfm {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;
using substrate::Ellipse;
using test::came_out;
using test::two_digits;

/// What a call refuses; empty where it does not.
template <class Call>
std::string refusal_of(const Call& call) {
  try {
    call();
  } catch (const InvalidData& refused) {
    return refused.what();
  } catch (const NotSolved& refused) {
    return refused.what();
  }
  return {};
}

double off(const VectorXd& a, const VectorXd& b) { return (a - b).norm() / b.norm(); }

/// Two adhesions that pull at each other across a surface, and points of it.
struct Pair {
  Gel gel{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 40};
  std::vector<Ellipse> ellipses = {{{-8, 1}, 2, 1.5, 0.3}, {{8, -1}, 2, 1.5, -0.3}};
  std::vector<Vec2> points;

  explicit Pair(const std::string& formula) {
    gel.surface =
        std::make_shared<const HeightMap>(surface::sampled(surface::formula_of(formula), {-40, -40}, {40, 40}, 0.2));
    for (double y = -12; y <= 12; y += 4)
      for (double x = -14; x <= 14; x += 3.5) points.push_back({x, y});
  }
  VectorXd displaced(double elements_across) const {
    substrate::SubstrateParameters p;
    p.model = substrate::ModelKind::curved;
    p.displacement_tolerance = 0;
    p.elements_across_adhesion = elements_across;
    const auto model = choice::make_substrate(gel, p, 2);
    return model->response({ellipses}, {points})->displace(Eigen::Vector4d(3, 1, -3, -1));
  }
};

TEST(CurvedGel, bears_a_slope_of_sixty_degrees) {
  const Pair steep("wave amplitude_um=8.27 period_um=30 phase_um=7.5");  // 2 pi A / L = tan 60
  const double difference = off(steep.displaced(2), steep.displaced(4));
  came_out("differ by " + two_digits(100 * difference) + " %");
  EXPECT_LE(difference, 0.05);
}

TEST(CurvedGel, bears_a_wall_of_eighty_degrees_or_refuses_it_by_place) {
  std::string measured;
  // depth / (2 wall) is the tangent
  for (const auto& [degrees, wall_um] : {std::pair{"70", "0.91"}, std::pair{"80", "0.44"}, std::pair{"89", "0.044"}}) {
    const std::string refused = refusal_of([&, wall = wall_um] {
      const Pair groove(std::string("groove depth_um=5 width_um=6 wall_um=") + wall);
      const double difference = off(groove.displaced(1), groove.displaced(2));
      EXPECT_LE(difference, 0.1);
      measured += two_digits(100 * difference) + " %; ";
    });
    if (refused.empty()) continue;
    EXPECT_TRUE(has_words(refused, "surface at ("));
    measured += std::string(degrees) + " refused; ";
  }
  came_out(measured.substr(0, measured.size() - 2));
}

TEST(CurvedGel, hardly_cares_how_incompressible_it_is) {
  Pair wave("wave amplitude_um=4 period_um=30");
  wave.gel.poisson_ratio = 0.499;
  const VectorXd before = wave.displaced(2);
  wave.gel.poisson_ratio = 0.4999;
  const double change = off(wave.displaced(2), before);
  came_out("changed by " + two_digits(100 * change) + " %");
  EXPECT_LE(change, 0.02);
}

TEST(CurvedGel, says_where_a_load_turns_it_inside_out) {
  Gel gel{.youngs_modulus_kPa = 3, .poisson_ratio = 0.49, .thickness_um = 40};
  const std::vector<Ellipse> ellipses = {{{-8, 0}, 2, 1.5, 0}, {{8, 0}, 2, 1.5, 0}};
  const Eigen::Vector4d forces = 190 * Eigen::Vector4d(1, 0, -1, 0);
  const std::string refused = refusal_of([&] {
    choice::LargeStrain(gel, ellipses, {{0, 0}}, forces, 2).about(forces);
  });
  came_out(refused.substr(0, refused.find(':')));
  EXPECT_TRUE(has_words(refused, "% of this load"));
}

double wave(Vec2 p) { return -12 * std::cos(2 * pi * (p.x - 35) / 70); }

surface::SurfaceFit fitted(const std::vector<Vec3>& beads) {
  return surface::fit_beads(beads, std::vector<double>(beads.size(), test::kBeadSigma_um));
}

TEST(SurfaceOfBeads, of_a_few_beads_has_honest_errors_or_is_refused) {
  std::string measured;
  for (const double density : {1e-3, 2.5e-5}) {
    const std::vector<Vec3> beads = test::beads_below(wave, density, 4);
    double worst = 0;
    const std::string refused = refusal_of([&] {
      const surface::SurfaceFit fit = fitted(beads);
      for (const Vec2 at : {Vec2{0, 0}, {20, 10}, {-35, -20}, {30, 40}})
        worst = std::max(worst, std::abs(fit.height_um(at) - wave(at)) / fit.sigma_um(at));
    });
    EXPECT_LE(worst, 4) << density;
    measured += (measured.empty() ? "" : "; ") + std::to_string(beads.size()) +
                " beads: " + (refused.empty() ? two_digits(worst) + " standard errors" : "refused");
  }
  came_out(measured);
}

}  // namespace
}  // namespace mbtfm
