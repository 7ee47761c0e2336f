/// Registered cells and their mean.
#include "mbtfm/mean/cells.h"
#include "mbtfm/mean/images.h"
#include "mbtfm/mean/registration.h"
#include "pipeline/contract/errors.h"
#include "substrate/greens/half_space.h"
#include "tests/support/test.h"

namespace mbtfm::mean {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A disc with spikes, one of them longer: it lies on itself in one way alone.
Polygon spiked(double radius_um, double spike_um, double longer_um, int n_points, double from = 0) {
  Polygon outline;
  for (int k = 0; k < n_points; ++k) {
    const double t = 2 * std::numbers::pi * (k + from) / n_points;
    const double spikes = std::exp((std::cos(4 * t) - 1) / 0.2);
    const double r = radius_um + (spike_um + longer_um * std::exp((std::cos(t) - 1) / 0.1)) * spikes;
    outline.push_back({r * std::cos(t), r * std::sin(t)});
  }
  return outline;
}

Polygon with_noise(Polygon outline, double sigma_um, std::uint64_t seed) {
  test::Normal normal(seed, sigma_um);
  for (Vec2& p : outline) p += {normal(), normal()};
  return outline;
}

/// Inverse of a motion, about the same places.
Motion back(const Motion& motion) {
  const double angle = motion.is_mirrored ? motion.angle_rad : -motion.angle_rad;
  return {motion.to_um, motion.from_um, angle, motion.is_mirrored};
}

/// Sheared, so that it is no longer its own mirror image.
Polygon leaning(Polygon outline) {
  for (Vec2& p : outline) p = {p.x + 0.004 * p.y * p.y, p.y + 0.3 * p.x};
  return outline;
}

TEST(Mean, registration_finds_a_known_shift_turn_and_mirror) {
  const Polygon reference = leaning(spiked(40, 15, 6, 360));
  for (const bool is_mirrored : {false, true})
    for (const double angle : {0.3, 100.0, -170.0}) {
      const Motion truth{{80, 70}, centroid_um(reference), angle * kDegree, is_mirrored};
      // another sampling, and outlines of pixels of 0.2 um
      const Polygon cell = with_noise(moved(leaning(spiked(40, 15, 6, 311, 0.4)), back(truth)), 0.1, 3);
      const Way way = ways_onto(cell, reference, is_mirrored ? Mirrors::tried : Mirrors::not_tried).front();
      EXPECT_EQ(way.motion.is_mirrored, is_mirrored);
      // where a point of the cell comes to lie: a tenth of a pixel of 0.2 um at the centre, 0.1 degrees at 55 um
      for (const Vec2 at : {Vec2{80, 70}, Vec2{120, 70}, Vec2{80, 110}}) {
        const double arm = norm(at - truth.from_um);
        EXPECT_LT(norm(way.motion.place_um(at) - truth.place_um(at)), 0.02 + 0.1 * kDegree * arm) << angle;
      }
    }
}

TEST(Mean, a_shape_that_is_its_own_mirror_image_is_not_mirrored) {
  EXPECT_EQ(mirrors_for(Switch::automatic, spiked(40, 15, 6, 360)), Mirrors::not_tried);
  EXPECT_EQ(mirrors_for(Switch::automatic, leaning(spiked(40, 15, 6, 360))), Mirrors::tried);
}

/// Smooth blobs of light in places of their own, seen in the frame of a motion's cell.
Brightness blobs(const Motion& motion, double noise, std::uint64_t seed) {
  Brightness image{.width = 260, .height = 240, .pixel_size_um = 0.5};
  std::mt19937_64 places(4), random(seed);
  std::uniform_real_distribution<double> across(25, 95), height(0.4, 1);
  std::normal_distribution<double> normal(0, noise);
  struct Blob {
    Vec2 at;
    double height;
  };
  std::vector<Blob> all;
  for (int k = 0; k < 30; ++k) {
    const double x = across(places), y = across(places);
    all.push_back({{x, y}, height(places)});
  }
  for (int j = 0; j < image.height; ++j)
    for (int i = 0; i < image.width; ++i) {
      const Vec2 at = motion.place_um({0.5 * (i + 0.5), 0.5 * (j + 0.5)});
      double value = 5 + normal(random);
      for (const Blob& blob : all) value += blob.height * std::exp(-dot(at - blob.at, at - blob.at) / 18);
      image.values.push_back(static_cast<float>(value));
    }
  return image;
}

TEST(Mean, images_show_a_known_shift_and_turn) {
  const Brightness reference = blobs({}, 0.05, 1);
  for (const double angle : {12.3, -140.0}) {
    const Motion truth{{62, 60}, {64.3, 58.1}, angle * kDegree, false};
    const auto ways = ways_by_images(blobs(truth, 0.05, 2), reference, Mirrors::tried);
    const Motion& found = ways.front().motion;
    EXPECT_FALSE(found.is_mirrored);
    EXPECT_NEAR(std::remainder(found.angle_rad - truth.angle_rad, 2 * std::numbers::pi), 0, 0.1 * kDegree);
    EXPECT_LT(norm(found.place_um({62, 60}) - truth.place_um({62, 60})), 0.1 * 0.5);  // a tenth of a pixel
    EXPECT_FALSE(correlate_equally(ways[0], ways[1]));
    EXPECT_LT(ways.front().shift_error_um, 0.05);
  }
}

Cell cell_of(const Polygon& outline) { return {.name = "cell", .outline_um = outline}; }

TEST(Mean, a_symmetric_shape_is_ambiguous_unless_its_symmetry_is_said) {
  const Polygon reference = spiked(40, 15, 0, 360);
  const std::vector<Cell> cells = {cell_of(with_noise(spiked(40, 15, 0, 333), 0.3, 1))};
  for (const char* group : {"C1", "C2", "C4v"}) {
    const Alignment alignment{.reference_um = reference, .motions = motions_of(symmetry_of(group), reference)};
    const CellRow row = aligned(cells, alignment, 1).front();
    EXPECT_EQ(row.is_ambiguous, std::string(group) != "C4v") << group;
    EXPECT_TRUE(row.is_kept);
  }
  const Alignment uneven{.reference_um = spiked(40, 15, 6, 360),
                         .motions = motions_of(symmetry_of("C1"), spiked(40, 15, 6, 360))};
  EXPECT_FALSE(aligned({cell_of(spiked(40, 15, 6, 300))}, uneven, 1).front().is_ambiguous);
}

TEST(Mean, symmetry_that_a_shape_does_not_have_is_refused) {
  const Polygon reference = spiked(40, 15, 0, 360);
  const auto aligned_to = [&](const char* group) {
    return Alignment{.reference_um = reference, .motions = motions_of(symmetry_of(group), reference)};
  };
  EXPECT_NO_THROW(expect_symmetric(aligned_to("C4v"), "C4v"));
  EXPECT_THROW(expect_symmetric(aligned_to("C3"), "C3"), UsageError);
  EXPECT_THROW(symmetry_of("D4"), UsageError);
  EXPECT_THROW(symmetry_of("C0"), UsageError);
}

TEST(Mean, a_disc_is_no_spiked_cell) {
  const Alignment alignment{.reference_um = spiked(40, 25, 0, 360), .motions = {Motion{}}};
  const CellRow row = aligned({cell_of(spiked(45, 0, 0, 360))}, alignment, 1).front();
  EXPECT_FALSE(row.is_kept);
  EXPECT_TRUE(has_words(row.reason, "from the reference"));
}

const Gel kGel{.youngs_modulus_kPa = 8};

/// Four patches that pull towards the middle, and beads on all sides of them.
struct Pulling {
  std::vector<substrate::Ellipse> patches;
  std::vector<Vec2> forces_nN;
  DisplacementField beads;
};
/// @param camera  from the frame of the patches to that of the beads, whose field is a square of 100 um there
Pulling pulling(int n_beads, double sigma_um, std::uint64_t seed, const Motion& camera = {}) {
  Pulling p;
  for (int k = 0; k < 4; ++k) {
    const double t = 0.5 * std::numbers::pi * k + 0.3;
    p.patches.push_back({20.0 * Vec2{std::cos(t), std::sin(t)}, 6, 4, t});
    p.forces_nN.push_back(-30.0 * Vec2{std::cos(t), std::sin(t)});
  }
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> across(-50, 50);
  std::normal_distribution<double> noise(0, sigma_um);
  for (int k = 0; k < n_beads; ++k) {
    Bead bead{.position_um = {across(random), across(random)}, .sigma_um = 0.01};
    for (std::size_t j = 0; j < 4; ++j) {
      const Vec2 force = p.forces_nN[j];
      const Vec2 there = camera.back_um(bead.position_um);
      const auto g = greens::HalfSpaceEllipse(kGel, p.patches[j]).compliance_um_per_nN(there);
      bead.displacement_um += camera.vector({g.xx * force.x + g.xy * force.y, g.xy * force.x + g.yy * force.y});
    }
    if (sigma_um > 0) bead.displacement_um += {noise(random), noise(random)};
    p.beads.push_back(bead);
  }
  return p;
}

Registered registered(const DisplacementField& beads, const Motion& motion) { return {beads, kGel, motion}; }

tractions::TractionParameters fttc() {
  tractions::TractionParameters parameters;
  parameters.gel_model = GelModel::half_space;
  parameters.spacing_um = 0.7;
  return parameters;
}

/// A length lambda E of 2.4 um. Tractions of 0.7 um, the nodes' distance, are then left out; with less FTTC follows
/// what lies between its nodes, which do not turn with the cell.
constexpr double kLambda_um_per_kPa = 0.3;

double relative_difference(const CellField& a, const CellField& b) {
  double difference = 0, size = 0;
  for (double y = -30; y <= 30; y += 2)
    for (double x = -30; x <= 30; x += 2) {
      const Vec2 of_a = a.at({x, y})->traction_kPa, of_b = b.at({x, y})->traction_kPa;
      difference += dot(of_a - of_b, of_a - of_b);
      size += dot(of_a, of_a);
    }
  return std::sqrt(difference / size);
}

TEST(Mean, a_cell_that_lies_turned_in_its_image_has_the_same_tractions) {
  const CellField still = field_of(registered(pulling(4000, 0, 5).beads, {}), fttc(), kLambda_um_per_kPa);
  for (const double angle : {37.0, 90.0}) {
    const Motion camera{{0, 0}, {1.5, -1}, angle * kDegree, angle < 90};
    const auto turned_beads = pulling(4000, 0, 8, camera).beads;
    const CellField turned = field_of(registered(turned_beads, back(camera)), fttc(), kLambda_um_per_kPa);
    // other beads on another lattice, and a square field that ends elsewhere: as two images of one cell differ
    const CellField again = field_of(registered(pulling(4000, 0, 9).beads, {}), fttc(), kLambda_um_per_kPa);
    EXPECT_LT(relative_difference(still, turned), 1.5 * relative_difference(still, again));
  }
}

TEST(Mean, the_same_beads_moved_are_the_same_tractions_moved) {
  const Pulling p = pulling(2000, 0, 5);
  const CellField still = field_of(registered(p.beads, {}), fttc(), kLambda_um_per_kPa);
  const Motion motion{{0, 0}, {7, -3}, 37 * kDegree, true};
  const CellField moved_cell = field_of(registered(p.beads, motion), fttc(), kLambda_um_per_kPa);
  for (const Vec2 place : {Vec2{20, 5}, Vec2{-3, 11}, Vec2{0, 0}}) {
    const Vec2 here = motion.vector(still.at(place)->traction_kPa),
               there = moved_cell.at(motion.place_um(place))->traction_kPa;
    EXPECT_LT(norm(here - there), 1e-9 * norm(here) + 1e-12);
  }
}

TEST(Mean, a_model_is_blurred_the_same_however_the_cell_lies_in_its_image) {
  const Pulling p = pulling(2000, 0, 6);
  const auto model = [](Vec2 at) { return std::exp(-dot(at - Vec2{8, 0}, at - Vec2{8, 0}) / 50) * Vec2{-1, 0.5}; };
  const Motion camera{{0, 0}, {0, 0}, 90 * kDegree, false};  // its lattice has the same nodes
  DisplacementField turned = p.beads;
  for (Bead& bead : turned) {
    bead.position_um = camera.place_um(bead.position_um);
    bead.displacement_um = camera.vector(bead.displacement_um);
  }
  const CellField here = blurred(model, registered(p.beads, {}), fttc(), kLambda_um_per_kPa),
                  there = blurred(model, registered(turned, back(camera)), fttc(), kLambda_um_per_kPa);
  // the solver stops at a hundredth of the tractions in energy
  EXPECT_LT(relative_difference(here, there), 0.01);
}

TEST(Mean, a_model_is_blurred_as_beads_blur_the_truth) {
  const Pulling p = pulling(4000, 0, 6);
  const Registered cell = registered(p.beads, {});
  const auto truth = [&](Vec2 at) {
    Vec2 traction;
    for (std::size_t j = 0; j < 4; ++j) {
      const substrate::Ellipse& e = p.patches[j];
      const Vec2 along = {std::cos(e.angle_rad), std::sin(e.angle_rad)}, arm = at - e.centre_um;
      if (std::hypot(dot(arm, along) / e.semi_major_um, cross(along, arm) / e.semi_minor_um) <= 1)
        traction += 1 / (std::numbers::pi * e.semi_major_um * e.semi_minor_um) * p.forces_nN[j];
    }
    return traction;
  };
  const CellField found = field_of(cell, fttc(), kLambda_um_per_kPa),
                  model = blurred(truth, cell, fttc(), kLambda_um_per_kPa);
  double difference = 0, size = 0;
  for (double y = -30; y <= 30; y += 2)
    for (double x = -30; x <= 30; x += 2) {
      const Vec2 a = found.at({x, y})->traction_kPa, b = model.at({x, y})->traction_kPa;
      difference += dot(a - b, a - b);
      size += dot(a, a);
    }
  // the truth's sharp rims lie between nodes of 0.7 um: a twentieth of a patch of 8 to 12 um
  EXPECT_LT(std::sqrt(difference / size), 0.05);
}

using Samples = std::vector<std::vector<std::optional<Sample>>>;

/// Fields that are noise alone, of beads in other places each.
Samples noise_fields(int n_cells, const std::vector<Vec2>& nodes) {
  Samples samples;
  std::mt19937_64 random(11);
  std::normal_distribution<double> noise(0, 0.02);
  std::uniform_real_distribution<double> across(-50, 50), angle(0, 6);
  tractions::TractionParameters parameters = fttc();
  parameters.spacing_um = 4;
  for (int k = 0; k < n_cells; ++k) {
    DisplacementField beads;
    for (int i = 0; i < 500; ++i)
      beads.push_back({.position_um = {across(random), across(random)},
                       .displacement_um = {noise(random), noise(random)},
                       .sigma_um = 0.02});
    const CellField field = field_of(registered(beads, {{0, 0}, {0, 0}, angle(random), false}), parameters, 0.3);
    auto& of_cell = samples.emplace_back();
    for (const Vec2 node : nodes) of_cell.push_back(field.at(node));
  }
  return samples;
}

TEST(Mean, noise_falls_with_the_root_of_the_number_and_error_bars_cover_the_truth) {
  const Polygon disc = spiked(30, 0, 0, 100);
  const std::vector<Vec2> nodes = lattice_over(disc, 0, 6);
  const Samples all = noise_fields(192, nodes);
  const auto rms_of = [&](int from, int n) {
    double sum = 0;
    const auto means = mean_of(nodes, {all.begin() + from, all.begin() + from + n}, disc);
    for (const NodeMean& node : means) sum += dot(node.mean.traction_kPa, node.mean.traction_kPa);
    return sum / static_cast<double>(means.size());
  };
  const auto average_rms = [&](int n) {
    double sum = 0;
    for (int from = 0; from < 192; from += n) sum += rms_of(from, n) * n / 192;
    return std::sqrt(sum);
  };
  EXPECT_NEAR(average_rms(4) / average_rms(16), 2, 0.4);
  EXPECT_NEAR(average_rms(4) / average_rms(64), 4, 0.8);
  constexpr int kCells = 8;
  constexpr double kStudent = 2.3646;  // 97.5 % of seven degrees of freedom
  int n = 0, n_covered = 0;
  for (int from = 0; from < 192; from += kCells)
    for (const NodeMean& node : mean_of(nodes, {all.begin() + from, all.begin() + from + kCells}, disc)) {
      n += 2;
      n_covered += std::abs(node.mean.traction_kPa.x) < kStudent * node.sigma->traction_kPa.x ? 1 : 0;
      n_covered += std::abs(node.mean.traction_kPa.y) < kStudent * node.sigma->traction_kPa.y ? 1 : 0;
    }
  EXPECT_NEAR(static_cast<double>(n_covered) / n, 0.95, 0.02) << n;
}

/// By its definition: the standard deviation of the cells, by n - 1 of them, over the root of n.
TEST(Mean, two_cells_have_the_error_of_half_their_difference) {
  const std::vector<Vec2> nodes = {{0, 0}};
  const auto of = [](std::initializer_list<double> values) {
    Samples samples;
    for (const double v : values) samples.push_back({Sample{{v, 2 * v}, {-3 * v, 0}}});
    return samples;
  };
  const Sample two = *mean_of(nodes, of({1, 5}), spiked(30, 0, 0, 100)).at(0).sigma;
  EXPECT_NEAR(two.displacement_um.x, 2, 1e-14);
  EXPECT_NEAR(two.displacement_um.y, 4, 1e-14);
  EXPECT_NEAR(two.traction_kPa.x, 6, 1e-14);
  EXPECT_EQ(two.traction_kPa.y, 0);
  // 1, 2, 6 about 3: squares of 14 over 2, over 3
  const Sample three = *mean_of(nodes, of({1, 2, 6}), spiked(30, 0, 0, 100)).at(0).sigma;
  EXPECT_NEAR(three.displacement_um.x, std::sqrt(14.0 / 6), 1e-14);
}

TEST(Mean, the_blur_of_a_gaussian_is_its_standard_deviation) {
  constexpr double kSigma_um = 3, kStep = 1.001;
  std::vector<WaveShare> shares;
  for (double wavelength = 1; wavelength < 100; wavelength *= kStep) {
    const double phase = 2 * std::numbers::pi * kSigma_um / wavelength;
    shares.push_back({.wavelength_um = wavelength, .along = std::exp(-phase * phase / 2)});
  }
  const double blur = gaussian_um(shares, [](const WaveShare& one) { return one.along; });
  EXPECT_GE(blur, kSigma_um * (1 - 1e-12));  // the first wave of which half is left
  EXPECT_LE(blur, kSigma_um * kStep * (1 + 1e-12));
}

/// Tractions towards the middle of a spiked shape: `tip` at its tips, 1 along the rest of its edge, with scatter.
Samples pulled_edges(const std::vector<Vec2>& nodes, const std::vector<EdgePart>& parts, double tip, int n_cells,
                     std::mt19937_64& random) {
  std::normal_distribution<double> scatter(0, 0.3);
  Samples samples(n_cells);
  for (auto& cell : samples) {
    const double of_cell = 1 + 0.3 * scatter(random), at_tips = tip * (1 + 0.5 * scatter(random));
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const double pull = parts[k] == EdgePart::tip ? at_tips : parts[k] == EdgePart::edge ? 1 : 0;
      const Vec2 inward = (-of_cell * pull / std::max(1e-9, norm(nodes[k]))) * nodes[k];
      cell.push_back(Sample{{}, inward + Vec2{scatter(random), scatter(random)}});
    }
  }
  return samples;
}

TEST(Mean, the_interval_of_tips_over_edge_holds_the_truth_as_often_as_it_says) {
  const Polygon shape = spiked(40, 20, 0, 360);
  const std::vector<Vec2> nodes = lattice_over(shape, 0, 3);
  const auto parts = edge_parts(nodes, shape, 6, 12);
  EXPECT_EQ(tips_of(shape).size(), 4u);
  EXPECT_TRUE(tips_of(spiked(40, 0, 0, 360)).empty());
  std::mt19937_64 random(21);
  int n_covered = 0;
  constexpr int kRuns = 200, kCells = 17;
  for (int run = 0; run < kRuns; ++run) {
    const auto ratio = tip_over_edge(nodes, pulled_edges(nodes, parts, 1.4, kCells, random), parts, {0, 0}, run);
    ASSERT_TRUE(ratio);
    n_covered += ratio->low < 1.4 && 1.4 < ratio->high ? 1 : 0;
  }
  // percentiles of 17 cells cover 92 to 93 %; three binomial errors of 200 runs are 5 %
  EXPECT_NEAR(static_cast<double>(n_covered) / kRuns, 0.93, 0.05);
}

}  // namespace
}  // namespace mbtfm::mean
