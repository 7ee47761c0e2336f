/// Image content that moves right and down ends as a force to the right and down in the report.
#include <regex>

#include "pipeline/files/csv_files.h"
#include "segment/images/image.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

constexpr double kPixel_um = 0.1;
constexpr int kSize_px = 512;
constexpr Vec2 kUpperLeft_um{18, 20};
constexpr Vec2 kLowerRight_um{33, 31};

/// Two places drawn towards each other: right and down at the upper left one, left and up at the lower right one.
Vec2 displacement_um(Vec2 p) {
  const auto bump = [&](Vec2 centre) { return std::exp(-dot(p - centre, p - centre) / (2 * 2.0 * 2.0)); };
  return 0.4 * (bump(kUpperLeft_um) - bump(kLowerRight_um)) * Vec2{1, 1};
}

void add_spot(images::Image& image, Vec2 p_um) {
  const double x = p_um.x / kPixel_um - 0.5, y = p_um.y / kPixel_um - 0.5, sigma = 1.4;
  for (int row = std::max(0, int(y) - 6); row < std::min(kSize_px, int(y) + 8); ++row)
    for (int column = std::max(0, int(x) - 6); column < std::min(kSize_px, int(x) + 8); ++column) {
      const double squared = (column - x) * (column - x) + (row - y) * (row - y);
      image.at(column, row) += static_cast<float>(3000 * std::exp(-squared / (2 * sigma * sigma)));
    }
}

void write_bead_images(const fs::path& cell) {
  const std::size_t n_pixels = std::size_t{kSize_px} * kSize_px;
  images::Image relaxed{.width = kSize_px,
                        .height = kSize_px,
                        .pixels = std::vector<float>(n_pixels, 200),
                        .pixel_size_um = kPixel_um,
                        .full_scale = 65535};
  images::Image stressed = relaxed;
  std::mt19937_64 random(1);
  std::normal_distribution<float> noise(0, 20);
  for (int i = 0; i < 2500; ++i) {
    const Vec2 p{std::generate_canonical<double, 53>(random) * kSize_px * kPixel_um,
                 std::generate_canonical<double, 53>(random) * kSize_px * kPixel_um};
    add_spot(relaxed, p);
    add_spot(stressed, p + displacement_um(p));
  }
  for (images::Image* image : {&relaxed, &stressed})
    for (float& value : image->pixels) value += noise(random);
  images::write_tiff(cell / "beads_relaxed.tif", relaxed);
  images::write_tiff(cell / "beads_stressed.tif", stressed);
}

Adhesion adhesion(int id, Vec2 position_um) {
  return {.adhesion_id = id,
          .position_um = position_um,
          .area_um2 = 2,
          .major_axis_um = 2,
          .minor_axis_um = 4 / M_PI,
          .angle_rad = 0.6,
          .eccentricity = 0.77,
          .mean_intensity = 1};
}

void write_segmentation(const fs::path& folder) {
  fs::create_directory(folder);
  files::write_adhesions(folder / "adhesions.csv", {adhesion(1, kUpperLeft_um), adhesion(2, kLowerRight_um)});
  files::write_fibres(folder / "fibres.csv", folder / "fibre_points.csv",
                      {{.fibre_id = 1,
                        .type = FibreType::ventral,
                        .width_um = 0.6,
                        .start_adhesion_id = 1,
                        .end_adhesion_id = 2,
                        .points_um = {kUpperLeft_um, kLowerRight_um}}});
  Polygon outline;
  const Vec2 centre = 0.5 * (kUpperLeft_um + kLowerRight_um);
  for (int i = 0; i < 60; ++i)
    outline.push_back(centre + 12.0 * Vec2{std::cos(i * M_PI / 30), std::sin(i * M_PI / 30)});
  files::write_outline(folder / "outline.csv", outline);
}

TEST(Signs, image_content_moved_right_and_down_is_a_force_right_and_down_up_to_the_report) {
  const TemporaryFolder folder;
  const fs::path cell = folder / "cell";
  fs::create_directory(cell);
  files::write_text(cell / "cell.toml", "[gel]\nyoungs_modulus_kPa = 8.4\n[fit]\nn_meshes = 1\n");
  write_bead_images(cell);
  write_segmentation(cell / "1_segment");
  output_of("mbtfm run " + cell.string());

  int n_near = 0;
  for (const Bead& bead : files::read_displacement(cell / "2_track/displacement.csv")) {
    if (!bead.flag.empty() || norm(bead.position_um - kUpperLeft_um) > 1.5) continue;
    EXPECT_GT(bead.displacement_um.x, 0.1);
    EXPECT_GT(bead.displacement_um.y, 0.1);
    ++n_near;
  }
  EXPECT_GE(n_near, 3);

  const auto forces = files::read_adhesion_forces(cell / "4_fit/adhesion_forces.csv");
  ASSERT_EQ(forces.size(), 2u);
  EXPECT_GT(forces[0].force_nN.x, 0.5);
  EXPECT_GT(forces[0].force_nN.y, 0.5);
  EXPECT_LT(forces[1].force_nN.x, -0.5);
  EXPECT_LT(forces[1].force_nN.y, -0.5);

  const std::string report = files::read_text(cell / "report.html");
  const auto map = report.find("aria-label=\"Forces on the substrate\"");
  ASSERT_NE(map, std::string::npos);
  const std::regex arrow(R"--(translate\(([-\d.]+),([-\d.]+)\)" d="M0,0l([-\d.]+),([-\d.]+)m)--");
  std::sregex_iterator at(report.begin() + static_cast<std::ptrdiff_t>(map), report.end(), arrow);
  const std::smatch first = *at, second = *++at;
  EXPECT_LT(std::stod(first[1]), std::stod(second[1])) << "adhesion 1 is drawn left of adhesion 2";
  EXPECT_LT(std::stod(first[2]), std::stod(second[2])) << "and above it, where";
  std::smatch ends;
  const std::string from_map = report.substr(map, 2000);
  ASSERT_TRUE(std::regex_search(from_map, ends, std::regex(R"--(data-side="y" data-ends="([-\d.]+) ([-\d.]+)")--")));
  EXPECT_GT(std::stod(ends[1]), std::stod(ends[2])) << "the axis runs down the page";
  EXPECT_GT(std::stod(first[3]), 0) << "its arrow points right";
  EXPECT_GT(std::stod(first[4]), 0) << "and down";
  EXPECT_LT(std::stod(second[3]), 0);
  EXPECT_LT(std::stod(second[4]), 0);
}

}  // namespace
}  // namespace mbtfm
