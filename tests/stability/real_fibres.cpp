/// Fibres in images that no one here made, where they are at hand (../shared/data); skipped elsewhere.
#include "segment/cells/segment_cell.h"
#include "tests/support/find_fibres.h"
#include "tests/support/folders.h"
#include "tests/support/segmentation_score.h"

namespace mbtfm::images {
namespace {

using namespace mbtfm::test;

const std::filesystem::path kActin = test::source_folder() / "../shared/data/actin";

#define REQUIRE_DATA()                  \
  if (!std::filesystem::exists(kActin)) \
  GTEST_SKIP() << "needs the microscope images of ../shared/data, not in this tree"

/// Single cells on discs of 1 800 um²; the second page of one file is actin.
struct DiscCell {
  const char* file;
  int page;
};
const DiscCell kDiscCells[] = {{"Control/0001_20Feb20_siNT.tif", 0},  {"Control/0003_20Feb20_siNT.tif", 0},
                               {"Control/0005_20Feb20_siNT.tif", 0},  {"Control/0001_control.tif", 1},
                               {"siINF2/0001_20Feb20_siINF2.tif", 0}, {"siINF2/0002_20Feb20_siINF2.tif", 0}};

Image image_of(const DiscCell& cell) { return read_image(kActin / "micropattern_chirality" / cell.file, cell.page); }

Cell segmented(const Image& image, const cells::SegmentParameters& p = {}) {
  return cells::segment_cell(std::nullopt, Channel{"actin", image}, p).cell;
}

double length_um(const std::vector<Fibre>& fibres) {
  double sum = 0;
  for (const Fibre& f : fibres) sum += mbtfm::length_um(f.points_um);
  return sum;
}

template <class Move>
double agreement(const std::vector<Fibre>& a, std::vector<Fibre> b, double tolerance_um, Move back) {
  for (Fibre& f : b)
    for (Vec2& p : f.points_um) p = back(p);
  return score_lines(a, b, tolerance_um).f1();
}

TEST(RealFibres, of_cells_on_discs_lie_inside_the_cell) {
  REQUIRE_DATA();
  for (const DiscCell& disc : kDiscCells) {
    SCOPED_TRACE(disc.file);
    const Cell cell = segmented(image_of(disc));
    for (const Fibre& f : cell.fibres)
      for (const Vec2 p : f.points_um) EXPECT_TRUE(contains(cell.outline_um, p));
    EXPECT_GT(length_um(cell.fibres), 350);  // 0.48 to 0.81 mm are found of the 0.5 to 3 mm that an eye follows
    EXPECT_LT(length_um(cell.fibres), 3000);
  }
}

/// Lines near the limit come and go with the least change of an image, and a cell has a dozen of them.
TEST(RealFibres, are_the_same_in_brighter_turned_and_mirrored_images) {
  REQUIRE_DATA();
  std::map<std::string, double> mean;
  for (const DiscCell& disc : kDiscCells) {
    SCOPED_TRACE(disc.file);
    const Image image = image_of(disc);
    const Cell cell = segmented(image);
    const double pixel_um = *image.pixel_size_um, tolerance_um = 3 * pixel_um;
    const double height_um = image.height * pixel_um, width_um = image.width * pixel_um;
    const auto expect_same = [&](const std::string& change, const Image& changed, auto back) {
      const double f1 = agreement(cell.fibres, segmented(changed).fibres, tolerance_um, back);
      EXPECT_GE(f1, 0.85) << change;
      mean[change] += f1 / static_cast<double>(std::size(kDiscCells));
    };
    for (const float gain : {0.8f, 1.2f}) {
      Image other = image;
      for (float& value : other.pixels) value *= gain;
      expect_same(gain < 1 ? "darker" : "brighter", other, [](Vec2 p) { return p; });
    }
    Image turned = image, mirrored = image;
    turned.width = image.height, turned.height = image.width;
    for (int row = 0; row < image.height; ++row)
      for (int column = 0; column < image.width; ++column) {
        turned.at(image.height - 1 - row, column) = image.at(column, row);
        mirrored.at(image.width - 1 - column, row) = image.at(column, row);
      }
    expect_same("turned", turned, [&](Vec2 p) { return Vec2{p.y, height_um - p.x}; });
    expect_same("mirrored", mirrored, [&](Vec2 p) { return Vec2{width_um - p.x, p.y}; });
  }
  for (const auto& [change, f1] : mean) EXPECT_GE(f1, 0.9) << change;
}

/// Share of the pixels of `a` within two pixels of one of `b`.
double near_share(const Image& a, const Image& b) {
  int n = 0, n_near = 0;
  for (int row = 0; row < a.height; ++row)
    for (int column = 0; column < a.width; ++column) {
      if (a.at(column, row) == 0) continue;
      bool is_near = false;
      for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx) {
          const int x = column + dx, y = row + dy;
          is_near |= dx * dx + dy * dy <= 4 && x >= 0 && y >= 0 && x < b.width && y < b.height && b.at(x, y) > 0;
        }
      ++n;
      n_near += is_near;
    }
  return 1.0 * n_near / std::max(1, n);
}

/// A carpet of 1 000 straight sticks of 1 to 2 pixels' width, 20 pixels long. No pixel size is known: 0.3 um makes them
/// as wide as fibres are. By default most of a carpet is meshwork, of which any number is allowed here.
TEST(RealFibres, of_a_carpet_of_sticks_lie_on_the_sticks) {
  REQUIRE_DATA();
  constexpr double kAssumedPixel_um = 0.3;
  const Image image = read_image(kActin / "synthetic_segmentfibers/SBXIQ_gauss.tif");
  const Image truth = read_image(kActin / "synthetic_segmentfibers/SBXIQ_binary.tif");
  cells::FibreParameters p;
  p.fibre_least_probability = 0;
  p.fibre_shortest_um = 2;
  p.fibre_gap_um = 0.5;
  Image lines = truth;
  std::fill(lines.pixels.begin(), lines.pixels.end(), 0.0f);
  for (const Fibre& f : cells::find_fibres(image, {}, {}, kAssumedPixel_um, p))
    for (const Vec2 u : densely(f.points_um))
      lines.at(std::min(image.width - 1, static_cast<int>(u.x / kAssumedPixel_um)),
               std::min(image.height - 1, static_cast<int>(u.y / kAssumedPixel_um))) = 1;
  const double recall = near_share(truth, lines), precision = near_share(lines, truth);
  EXPECT_GE(2 * recall * precision / (recall + precision), 0.97) << recall << ' ' << precision;
}

TEST(RealFibres, of_a_layer_of_many_cells_are_found_without_an_outline) {
  REQUIRE_DATA();
  const Image image = read_image(kActin / "bronchial_monolayer/U13_72_P1_5_SF.tif");
  const auto fibres = cells::find_fibres(image, {}, {}, *image.pixel_size_um, cells::FibreParameters{});
  EXPECT_GT(fibres.size(), 20u);
  for (const Fibre& f : fibres) EXPECT_GE(mbtfm::length_um(f.points_um), cells::FibreParameters{}.fibre_shortest_um);
}

}  // namespace
}  // namespace mbtfm::images
