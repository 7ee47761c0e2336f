/// mbtfm-surface on files, and mbtfm-substrate on a gel with such a surface.
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/vtk_files.h"
#include "segment/images/image.h"
#include "tests/support/findings.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

using test::fires;

double wave(Vec2 p) { return -4 * std::cos(2 * std::numbers::pi * p.x / 40); }

class Surface : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return (folder_.path() / name).string(); }
  Outcome run(const std::string& arguments) const {
    return run_in(folder_, "mbtfm-surface --out surface.vtp " + arguments);
  }
  void write(const std::string& name, const std::string& text) const { files::write_text(file(name), text); }
  /// Points of a lattice of one micrometre, the heights as `z` has them.
  template <class Z>
  std::string table(double half_um, const Z& z) const {
    std::string text = "x_um,y_um,z_um\n";
    for (double y = -half_um; y <= half_um; ++y)
      for (double x = -half_um; x <= half_um; ++x) text += brief(x) + "," + brief(y) + "," + z(Vec2{x, y}) + "\n";
    return text;
  }
  double largest_error(const HeightMap& map, double rim_um = 0) const {
    double largest = 0;
    for (int k = 0; k < map.n_x * map.n_y; ++k) {
      const Vec2 at = map.vertex_um(static_cast<std::size_t>(k));
      if (std::max(std::abs(at.x), std::abs(at.y)) > 20 - rim_um) continue;
      largest = std::max(largest, std::abs(map.z_um[k] - wave(at)));
    }
    return largest;
  }
  HeightMap surface() const { return files::read_surface(file("surface.vtp")); }

  test::TemporaryFolder folder_;
};

const std::string kSquare = " --low_x_um -20 --low_y_um -20 --high_x_um 20 --high_y_um 20";

TEST_F(Surface, of_a_formula_a_table_and_its_points_is_the_same) {
  ASSERT_EQ(run("--formula 'wave amplitude_um=4 period_um=40'" + kSquare).code, 0);
  EXPECT_LT(largest_error(surface()), 1e-12);
  EXPECT_TRUE(has_words(files::read_text(file("surface.svg")), "data:image/png"));
  write("lattice.csv", table(20, [](Vec2 p) { return shortest(wave(p)); }));
  const auto whole = run("--z_points into-gel --height_map lattice.csv");
  ASSERT_EQ(whole.code, 0);
  test::expect_silent({"surface-repaired", "surface-misplaced", "beads-off-gel"}, whole.output);
  EXPECT_LT(largest_error(surface()), 1e-12);
  write("mirrored.csv", table(20, [](Vec2 p) { return shortest(-wave(p)); }));
  ASSERT_EQ(run("--z_points out-of-gel --height_map mirrored.csv").code, 0);
  EXPECT_LT(largest_error(surface()), 1e-12);
  ASSERT_EQ(run("--z_points into-gel --points lattice.csv").code, 0);
  EXPECT_LT(largest_error(surface(), 1), 0.02);  // points without errors: a two-hundredth of the heights' range
}

TEST_F(Surface, of_an_image_of_heights_has_its_holes_filled_or_refused_by_place) {
  images::Image image{.width = 80, .height = 80, .pixel_size_um = 0.5};
  for (int k = 0; k < 6400; ++k)
    image.pixels.push_back(static_cast<float>(std::lround(1000 + 100 * wave({(k % 80 + 0.5) / 2 - 20, 0}))));
  images::write_tiff(file("map.tif"), image);
  ASSERT_EQ(run("--z_points into-gel --z_unit_um 0.01 --height_map map.tif").code, 0);
  const HeightMap map = surface();
  EXPECT_NEAR(map.spacing_um.x, 0.5, 1e-9);
  EXPECT_NEAR(map.z_um[40], 10 + wave({0.25, 0}), 0.006);  // grey values are whole numbers: half a hundredth
  EXPECT_EQ(run("--z_points into-gel --height_map map.tif").code, 2);  // no z_unit_um
  write("holes.csv", table(20, [](Vec2 p) { return norm(p) < 1.5 ? std::string() : shortest(wave(p)); }));
  const auto filled = run("--z_points into-gel --height_map holes.csv");
  ASSERT_EQ(filled.code, 0);
  EXPECT_TRUE(fires("surface-repaired", filled.output)) << filled.output;
  EXPECT_LT(largest_error(surface()), 0.05);  // (pi/20)⁴ 4 um r⁴/64, r = 2 um; and as much for the lattice
  write("hole.csv", table(20, [](Vec2 p) { return norm(p) < 6 ? std::string() : shortest(wave(p)); }));
  EXPECT_TRUE(has_words(output_of(run("--z_points into-gel --height_map hole.csv"), 3), "near x, y = 0, 0"));
}

TEST_F(Surface, from_beads_knows_its_error_and_shows_beads_above_it) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> across(-20, 20), down(-10, 40);
  std::string text = "x_um,y_um,z_um\n";
  for (int k = 0; k < 3000; ++k) {
    const Vec3 at = {across(random), across(random), down(random)};
    if (at.z > wave({at.x, at.y})) text += brief(at.x) + "," + brief(at.y) + "," + brief(at.z) + "\n";
  }
  for (int k = 0; k < 40; ++k) text += brief(across(random)) + "," + brief(across(random)) + ",-30\n";
  write("beads.csv", text);
  const std::string beads = "--z_points into-gel --beads beads.csv";
  EXPECT_EQ(run(beads).code, 2);  // no error of z
  const std::string outcome = output_of(run(beads + " --sigma_z_um 0.3"));
  EXPECT_TRUE(fires("beads-off-gel", "off the surface", outcome)) << outcome;
  EXPECT_FALSE(fires("surface-misplaced", outcome)) << outcome;
  const HeightMap map = surface();
  ASSERT_EQ(map.sigma_um.size(), map.z_um.size());
  EXPECT_LT(largest_error(map, 5), 1.9);  // half of the beads' distance, three standard errors
  ASSERT_EQ(run(beads + " --method alpha-shape").code, 0);
  EXPECT_TRUE(surface().sigma_um.empty());
}

TEST_F(Surface, that_beads_find_level_may_be_the_end_of_the_images) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> across(-20, 20), down(0, 40);
  std::string text = "x_um,y_um,z_um\n";
  for (int k = 0; k < 2000; ++k)
    text += brief(across(random)) + "," + brief(across(random)) + "," + brief(down(random)) + "\n";
  write("beads.csv", text);
  const std::string outcome = output_of(run("--z_points into-gel --sigma_z_um 0.1 --beads beads.csv"));
  EXPECT_TRUE(fires("surface-misplaced", outcome)) << outcome;
  EXPECT_FALSE(fires("beads-off-gel", "off the surface", outcome)) << outcome;
}

/// Masks of the gel below the wave, 40 pixels of a micrometre to each side, slices of half a micrometre.
void write_masks(const std::string& file, bool is_upside_down) {
  constexpr int kSide = 40, kSlices = 40;
  std::vector<images::Image> slices(kSlices, {.width = kSide, .height = kSide});
  for (int page = 0; page < kSlices; ++page) {
    const double z = 0.5 * (is_upside_down ? kSlices - 1 - page : page) - 10;
    for (int k = 0; k < kSide * kSide; ++k)
      slices[page].pixels.push_back(z > wave({k % kSide + 0.5 - 20, 0}) ? 255 : 0);
  }
  images::write_tiff(file, slices);
}

TEST_F(Surface, of_masks_lies_between_their_slices_whichever_comes_first) {
  write_masks(file("down.tif"), false);
  write_masks(file("up.tif"), true);
  const std::string known = " --pixel_size_um 1 --z_step_um 0.5 --masks ";
  const auto error_of = [&](double zero_um) {
    const HeightMap map = surface();
    double largest = 0;
    for (std::size_t k = 0; k < map.z_um.size(); ++k) {
      const Vec2 at = map.vertex_um(k) - Vec2{20, 20};
      largest = std::max(largest, std::abs(map.z_um[k] - zero_um - wave(at)));
    }
    return largest;
  };
  ASSERT_EQ(run("--z_points into-gel" + known + "down.tif").code, 0);
  EXPECT_LT(error_of(10), 0.5);  // a slice; the first is the file's z = 0, ten micrometres above that of the wave
  ASSERT_EQ(run("--z_points out-of-gel" + known + "up.tif").code, 0);
  EXPECT_LT(error_of(-9.5), 0.5);
  const auto black = run("--z_points out-of-gel" + known + "down.tif");
  EXPECT_EQ(black.code, 3) << black.output;  // gel above what is none
  EXPECT_TRUE(has_words(
      output_of(run("--z_points into-gel --z_unit_um 0.01 --pixel_size_um 1 --height_map down.tif"), 3), "40 pages"));
}

TEST_F(Surface, asks_for_what_no_file_says) {
  write("points.csv", table(20, [](Vec2 p) { return shortest(wave(p)); }));
  EXPECT_TRUE(has_words(output_of(run("--points points.csv"), 2), "z_points"));
  EXPECT_EQ(run("").code, 2);
  EXPECT_EQ(run("--formula 'flat'" + kSquare + " --z_points into-gel --points points.csv").code, 2);
  EXPECT_EQ(run("--formula flat").code, 2);
  EXPECT_EQ(run("--formula flat --low_x_um -20 --low_y_um -20 --high_y_um 20 --high_x_um 1e300").code, 2);
  write("broken.csv", "x_um,y_um,z_um\n0,0,nan\n");
  EXPECT_EQ(run("--z_points into-gel --points broken.csv").code, 3);
  write("mesh.stl", "solid\nendsolid\n");
  EXPECT_EQ(run("--z_points into-gel --mesh mesh.stl").code, 2);  // no unit
  EXPECT_EQ(run("--z_points into-gel --length_unit_um 1 --mesh mesh.stl").code, 3);
}

class Gel : public Surface {
 protected:
  void SetUp() override {
    write("gel.toml", "[gel]\nyoungs_modulus_kPa = 10\npoisson_ratio = 0.45\nthickness_um = 30\n");
    write("forces.csv", "adhesion_id,fx_nN,fy_nN,fz_nN\n1,30,5,0\n2,-20,0,15\n");
    write("adhesions.csv",
          "adhesion_id,x_um,y_um,area_um2,major_axis_um,minor_axis_um,angle_deg,eccentricity,mean_intensity\n"
          "1,-5,2,12.566370614359172,4,4,0,0,1\n2,6,-3,12.566370614359172,4,4,0,0,1\n");
    std::string points = "x_um,y_um,z_um\n";
    for (const Vec2 p : {Vec2{-9, 2}, Vec2{0, 0}, Vec2{3, 5}, Vec2{12, -3}})
      points += brief(p.x) + "," + brief(p.y) + ",5\n";
    write("points.csv", points);
  }
  Outcome substrate(const std::string& arguments) const {
    return run_in(folder_,
                  "mbtfm-substrate --quiet --gel gel.toml --adhesions adhesions.csv --forces forces.csv " + arguments);
  }
  std::vector<Vec3> displaced(const std::string& name) const {
    const files::CsvTable csv(file(name));
    std::vector<Vec3> u;
    for (int row = 0; row < csv.n_rows(); ++row)
      u.push_back({csv.number(row, "ux_um"), csv.number(row, "uy_um"), csv.number(row, "uz_um")});
    return u;
  }
  double difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) const {
    double square = 0, size = 0;
    for (std::size_t k = 0; k < a.size(); ++k) {
      square += dot(a[k] - b[k], a[k] - b[k]);
      size += dot(b[k], b[k]);
    }
    return std::sqrt(square / size);
  }
};

TEST_F(Gel, under_a_level_surface_anywhere_is_a_flat_one) {
  ASSERT_EQ(run("--formula 'flat z_um=4' --spacing_um 4" + kSquare).code, 0);
  const std::string points = " --points points.csv --out ";
  output_of(substrate("--model curved --surface surface.vtp" + points + "raised.csv"));
  write("gel.toml", "[gel]\nyoungs_modulus_kPa = 10\npoisson_ratio = 0.45\nthickness_um = 26\n");
  std::string below = "x_um,y_um,z_um\n";
  for (const Vec2 p : {Vec2{-9, 2}, Vec2{0, 0}, Vec2{3, 5}, Vec2{12, -3}})
    below += brief(p.x) + "," + brief(p.y) + ",1\n";
  write("points.csv", below);
  ASSERT_EQ(substrate("--model layer" + points + "flat.csv").code, 0);
  EXPECT_LT(difference(displaced("raised.csv"), displaced("flat.csv")), 0.04);  // displacement_tolerance 0.02, twice
}

TEST_F(Gel, whose_surface_is_not_flat_is_computed_by_the_model_that_has_it) {
  ASSERT_EQ(run("--formula 'wave amplitude_um=4 period_um=40' --spacing_um 1" + kSquare).code, 0);
  const std::string given = " --surface surface.vtp --points points.csv --out ";
  output_of(substrate("--displacement_tolerance 0.1" + given + "wavy.csv"));
  ASSERT_EQ(substrate("--points points.csv --out flat.csv").code, 0);
  EXPECT_GT(difference(displaced("wavy.csv"), displaced("flat.csv")), 0.1);
  EXPECT_TRUE(has_words(output_of(substrate("--model layer" + given + "layer.csv"), 2), "curved or auto"));
}

TEST_F(Gel, carries_a_lattice_of_tractions_on_its_surface) {
  ASSERT_EQ(run("--formula 'wave amplitude_um=4 period_um=40' --spacing_um 1" + kSquare).code, 0);
  std::string tractions = "x_um,y_um,tx_kPa,ty_kPa,tz_kPa\n";
  for (double y = -16; y <= 16; y += 4)
    for (double x = -16; x <= 16; x += 4)
      tractions += brief(x) + "," + brief(y) + "," + brief(std::exp(-(x * x + y * y) / 50)) + ",0,0.2\n";
  write("tractions.csv", tractions);
  const std::string gel =
      "mbtfm-substrate --quiet --displacement_tolerance 0.1 --gel gel.toml --surface surface.vtp --traction "
      "tractions.csv";
  output_of(run_in(folder_, gel + " --points points.csv --out u.csv"));
  for (const Vec3& u : displaced("u.csv")) EXPECT_GT(u.z, 0);  // pressed into the gel
  output_of(run_in(folder_, gel + " --out u.vtu"));
  EXPECT_TRUE(has_words(files::read_text(file("u.vtu")), "traction_kPa"));
  output_of(run_in(folder_, gel + " --out volume.vtu"), 2);
}

TEST_F(Gel, whose_surface_does_not_hold_the_level_from_which_its_thickness_counts_is_named) {
  const std::string substrate =
      "mbtfm-substrate --gel gel.toml --adhesions adhesions.csv --forces forces.csv --surface surface.vtp --points "
      "points.csv --displacement_tolerance 0.1 --out u.csv";
  ASSERT_EQ(run("--formula 'flat z_um=4' --spacing_um 4" + kSquare).code, 0);
  const std::string told = output_of(run_in(folder_, substrate));
  EXPECT_TRUE(fires("surface-misplaced", told)) << told;
  EXPECT_TRUE(has_words(told, "% of the gel's thickness from z = 0"));
  ASSERT_EQ(run("--formula 'flat z_um=4' --zero_at mean --spacing_um 4" + kSquare).code, 0);
  EXPECT_FALSE(fires("surface-misplaced", run_in(folder_, substrate).output));
}

TEST_F(Gel, is_known_no_further_than_its_surface) {
  ASSERT_EQ(
      run("--formula 'wave amplitude_um=4 period_um=40' --low_x_um -10 --low_y_um -20 --high_x_um 5 --high_y_um 20")
          .code,
      0);
  EXPECT_TRUE(
      has_words(output_of(substrate("--surface surface.vtp --points points.csv --out u.csv"), 3), "surface is known"));
}

}  // namespace
}  // namespace mbtfm
