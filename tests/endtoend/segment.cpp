// mbtfm-segment on images of several channels and on selections drawn by hand.

#include "pipeline/files/csv_files.h"
#include "segment/rois/roi.h"
#include "tests/support/drawn_image.h"
#include "tests/support/findings.h"
#include "tests/support/program.h"
#include "tests/support/segmentation_accuracy.h"
#include "tests/support/tiff_pages.h"

namespace mbtfm {
namespace {

using rois::Roi;
using rois::RoiShape;
using test::fires;

class Segment : public testing::Test {
 protected:
  const test::TemporaryFolder folder_;
  test::DrawnScene scene_ = test::drawn_scene(10, 1);

  void SetUp() override {
    for (auto* image : {&scene_.adhesion_image, &scene_.actin_image}) image->pixel_size_um = scene_.kPixel_um;
    images::write_tiff(folder_ / "paxillin.tif", scene_.adhesion_image);
    images::write_tiff(folder_ / "actin.tif", scene_.actin_image);
  }
  Outcome segment(const std::string& out, const std::string& arguments) const {
    return run_in(folder_, "mbtfm-segment --out " + out + " " + arguments);
  }
  static inline const std::string kBoth = "--adhesion-image paxillin.tif --actin-image actin.tif";
};

/// 0.2 um pixels still show what is 0.5 um wide; where it lies does not depend on the pixels.
TEST_F(Segment, binned_images_show_the_same_cell_at_the_same_place) {
  ASSERT_EQ(segment("whole", kBoth).code, 0);
  const Outcome binned = segment("binned", kBoth + " --binning 2 --outline-roi outline.roi");
  EXPECT_EQ(binned.code, 3) << binned.output;  // there is none yet
  const std::vector<rois::Roi> rois = rois::read_rois(folder_ / "whole/RoiSet.zip");
  files::write_text(folder_ / "outline.roi", rois::encode_roi(rois.front()));
  ASSERT_EQ(segment("binned", kBoth + " --binning 2 --outline-roi outline.roi").code, 0);
  const Cell fine = files::read_cell(folder_ / "whole"), coarse = files::read_cell(folder_ / "binned");
  const double step_um = scene_.kPixel_um;  // the outline's corners are stored in pixels, with fractions
  ASSERT_EQ(coarse.outline_um.size(), fine.outline_um.size());
  for (std::size_t i = 0; i < fine.outline_um.size(); ++i)
    EXPECT_LT(norm(coarse.outline_um[i] - fine.outline_um[i]), 0.01 * step_um);
  int n_there = 0;
  for (const Adhesion& a : fine.adhesions)
    for (const Adhesion& b : coarse.adhesions) n_there += norm(a.position_um - b.position_um) < step_um;
  EXPECT_GE(n_there, 0.9 * static_cast<double>(fine.adhesions.size()));
  const std::vector<rois::Roi> again = rois::read_rois(folder_ / "binned/RoiSet.zip");
  EXPECT_LT(norm(again.front().points_px[0] - rois.front().points_px[0]), 0.01);
}

TEST_F(Segment, one_file_of_two_channels_is_segmented_as_two_files_of_one) {
  const std::string ome =
      "<OME><Image><Pixels DimensionOrder='XYZCT' SizeC='2' SizeZ='2' SizeT='1' PhysicalSizeX='100' "
      "PhysicalSizeXUnit='nm'><Channel Name='paxillin'/><Channel Name='actin'/></Pixels></Image></OME>";
  const images::Image dark = test::even_image(256, 256, 0);  // a slice that adds nothing to the projection
  test::write_pages<std::uint16_t>(folder_ / "both.ome.tif", {dark, scene_.adhesion_image, dark, scene_.actin_image},
                                   ome);
  const std::string file = "both.ome.tif";
  const Outcome one = segment(
      "one", "--adhesion-image " + file + " --actin-image " + file + " --adhesion_channel paxillin --actin_channel 2");
  ASSERT_EQ(one.code, 0) << one.output;
  ASSERT_EQ(segment("two", kBoth).code, 0);
  for (const char* name : {"adhesions.csv", "fibres.csv", "fibre_points.csv", "outline.csv", "RoiSet.zip"})
    EXPECT_EQ(files::read_text(folder_ / "one" / name), files::read_text(folder_ / "two" / name)) << name;

  EXPECT_TRUE(has_words(output_of(segment("none", "--actin-image " + file), 3), "2 channels: 1 'paxillin', 2 'actin'",
                        "actin_channel"));
  EXPECT_FALSE(fs::exists(folder_ / "none"));
}

TEST_F(Segment, channels_of_different_pixel_sizes_are_an_error) {
  scene_.actin_image.pixel_size_um = 0.11;
  images::write_tiff(folder_ / "actin.tif", scene_.actin_image);
  EXPECT_TRUE(has_words(output_of(segment("out", kBoth), 3), "0.11 um"));
  EXPECT_EQ(segment("out", kBoth + " --pixel_size_um 0.1").code, 0);
}

TEST_F(Segment, what_is_drawn_by_hand_takes_the_place_of_what_would_be_found) {
  rois::Roi fibre, outline, adhesion;
  fibre.name = "dorsal 1";
  fibre.shape = rois::RoiShape::polyline;
  fibre.points_px = {{70, 80}, {120, 128}, {184, 180}};
  adhesion.name = "mine";
  adhesion.points_px = {{60, 75}, {80, 75}, {80, 85}, {60, 85}};
  outline.name = "outline";
  outline.points_px = {{20, 20}, {236, 20}, {236, 236}, {20, 236}};
  rois::write_roi_set(folder_ / "fibres.zip", {fibre});
  rois::write_roi_set(folder_ / "adhesions.zip", {adhesion});
  rois::write_roi_set(folder_ / "outline.zip", {outline});
  const std::string outcome = output_of(
      segment("out", kBoth + " --fibre-rois fibres.zip --adhesion-rois adhesions.zip --outline-roi outline.zip"));
  EXPECT_TRUE(has_words(outcome, "fibres drawn by hand"));
  const Cell cell = files::read_cell(folder_ / "out");
  ASSERT_EQ(cell.fibres.size(), 1u);
  EXPECT_EQ(cell.fibres[0].type, FibreType::dorsal);
  EXPECT_EQ(cell.fibres[0].start_adhesion_id, 1);
  ASSERT_EQ(cell.adhesions.size(), 1u);
  EXPECT_NEAR(cell.adhesions[0].area_um2, 2, 1e-9);
  EXPECT_NEAR(norm(cell.adhesions[0].position_um - Vec2{7, 8}), 0, 1e-9);
  EXPECT_NEAR(signed_area_um2(cell.outline_um), 21.6 * 21.6, 1e-9);
  EXPECT_TRUE(fires("images-mismatch", "of the given outline", outcome)) << "a square about a disc: " << outcome;

  EXPECT_TRUE(
      has_words(output_of(segment("swapped", kBoth + " --fibre-rois adhesions.zip"), 3), "'mine': expected a line"));
}

/// Of 255 where `is_in` has a place, in um.
template <class IsIn>
images::Image mask_of(const IsIn& is_in) {
  images::Image mask = test::even_image(256, 256, 0);
  for (int j = 0; j < mask.height; ++j)
    for (int i = 0; i < mask.width; ++i)
      if (is_in(test::centre_of_pixel_um(i, j, test::DrawnScene::kPixel_um))) mask.at(i, j) = 255;
  return mask;
}

double radius_um(Vec2 place) { return norm(place - Vec2{12.8, 12.8}); }

TEST_F(Segment, a_sound_cell_has_no_findings) {
  const std::string said = segment("out", kBoth).output;
  test::expect_silent(
      {"lossy-image", "saturated", "unusual-value", "adhesions-left-out", "bleed-through", "bright-actin",
       "images-mismatch", "channel-shift", "adhesions-assumed", "fibre-ends-anchored", "input-not-used"},
      said);
  EXPECT_FALSE(fires("cells-touch", said)) << said;
  EXPECT_FALSE(fires("outline-doubtful", said)) << said;
}

TEST_F(Segment, an_outline_far_beyond_all_adhesions_is_doubted) {
  images::Image few = test::even_image(256, 256, 100);
  test::draw_ellipse(few, test::ellipse(1, {12.8, 12.8}, 20, 20, 0), 100, 0.15, scene_.kPixel_um);
  for (const Vec2 at : {Vec2{6, 9}, Vec2{6, 16}, Vec2{5, 12.5}})
    test::draw_ellipse(few, test::ellipse(1, at, 1.6, 0.6, 0.6), 500, 0.13, scene_.kPixel_um);
  test::add_noise(few, 10, 1);
  few.pixel_size_um = scene_.kPixel_um;
  images::write_tiff(folder_ / "paxillin.tif", few);
  const std::string said = segment("out", kBoth).output;
  EXPECT_TRUE(fires("outline-doubtful", "beyond all adhesions", said)) << said;
}

TEST_F(Segment, a_second_cell_that_touches_is_cut_off_and_named) {
  test::draw_ellipse(scene_.actin_image, test::ellipse(1, {23, 23}, 7.4, 7.4, 0), 200, 0.13, scene_.kPixel_um);
  images::write_tiff(folder_ / "actin.tif", scene_.actin_image);
  const std::string said = segment("out", kBoth + " --outline_smallest_um2 20").output;
  EXPECT_TRUE(fires("cells-touch", said)) << said;
  EXPECT_FALSE(contains(files::read_cell(folder_ / "out").outline_um, {23, 23}));
}

TEST_F(Segment, an_adhesion_beside_the_cell_is_left_out_and_named) {
  test::draw_ellipse(scene_.adhesion_image, test::ellipse(6, {23, 23}, 1.6, 0.6, 0.6), 500, 0.13, scene_.kPixel_um);
  images::write_tiff(folder_ / "paxillin.tif", scene_.adhesion_image);
  const std::string said = segment("out", kBoth).output;
  EXPECT_TRUE(fires("adhesions-left-out", said)) << said;
  EXPECT_TRUE(fires("images-mismatch", "of the adhesions' area", said)) << said;
}

TEST_F(Segment, a_speck_beside_the_cell_is_left_out_and_named) {
  test::draw_ellipse(scene_.actin_image, test::ellipse(1, {24.2, 24.2}, 2, 2, 0), 400, 0.13, scene_.kPixel_um);
  images::write_tiff(folder_ / "actin.tif", scene_.actin_image);
  const std::string said = segment("out", kBoth).output;
  EXPECT_TRUE(fires("adhesions-left-out", said)) << said;
  EXPECT_TRUE(has_words(said, "1 bright thing too small for a cell"));
}

TEST_F(Segment, an_end_that_no_adhesion_holds_and_an_input_that_does_not_count_are_named) {
  rois::Roi fibre, outline;
  fibre.name = "ventral 1";
  fibre.shape = rois::RoiShape::polyline;
  fibre.points_px = {{70, 80}, {120, 128}};
  outline.name = "outline";
  for (const Vec2 p : {Vec2{30, 128}, {128, 30}, {226, 128}, {128, 226}}) outline.points_px.push_back(p);
  rois::write_roi_set(folder_ / "fibres.zip", {fibre});
  rois::write_roi_set(folder_ / "outline.zip", {outline});
  images::write_tiff(folder_ / "mask.tif", mask_of([](Vec2 p) { return radius_um(p) < 10; }));
  const std::string said =
      segment("out", kBoth + " --fibre-rois fibres.zip --outline-roi outline.zip --outline-mask mask.tif").output;
  EXPECT_TRUE(fires("fibre-ends-anchored", said)) << said;
  EXPECT_TRUE(fires("input-not-used", said)) << said;
  EXPECT_FALSE(fires("images-mismatch", "of the given outline", said)) << said;
}

/// An adhesive ring is a pattern; the adhesions themselves and the whole cell are none.
TEST_F(Segment, a_mask_that_is_no_pattern_is_named) {
  const auto with = [&](const images::Image& mask) {
    images::write_tiff(folder_ / "mask.tif", mask);
    return segment("out", "--actin-image actin.tif --adhesions pattern --adhesion-mask mask.tif").output;
  };
  const std::string ring = with(mask_of([](Vec2 p) { return std::abs(radius_um(p) - 7.5) < 2; }));
  test::expect_silent({"pattern-unsuitable"}, ring);
  EXPECT_TRUE(fires("adhesions-assumed", ring)) << ring;
  const std::string fine = with(mask_of([](Vec2 p) {  // dots of 0.6 um, 1.2 um apart
    return norm(Vec2{std::remainder(p.x, 1.2), std::remainder(p.y, 1.2)}) < 0.3;
  }));
  EXPECT_TRUE(fires("pattern-unsuitable", "candidate adhesion", fine)) << fine;
  const std::string cell = with(mask_of([](Vec2 p) { return radius_um(p) < 10; }));
  EXPECT_TRUE(fires("pattern-unsuitable", "of the cell's area", cell)) << cell;
}

/// A small cell with ten fibres, as the simulator draws it.
TEST_F(Segment, images_that_are_shifted_or_exchanged_and_actin_that_is_no_fibre_are_named) {
  constexpr std::uint64_t kSeed = 1;
  constexpr int kSide_px = 420;
  files::write_text(folder_ / "scenario.toml",
                    "pixel_size_um = 0.1\n[gel]\nyoungs_modulus_kPa = 8.4\n[scenario]\ndiameter_um = 30\n"
                    "n_adhesions = 30\nn_ventral = 6\nn_dorsal = 4\nn_arc = 0\n");
  const test::SimulatedCell cell =
      test::simulated_cell((folder_ / "scenario.toml").string(), "ordinary", kSeed, kSide_px);
  const auto found = [&](const images::Image& adhesion, const images::Image& actin) {
    images::write_tiff(folder_ / "paxillin.tif", adhesion);
    images::write_tiff(folder_ / "actin.tif", actin);
    return segment("out", kBoth).output;
  };
  const images::Image &adhesion = cell.adhesion.image, &actin = cell.actin.image;
  test::expect_silent({"channel-shift", "bleed-through", "bright-actin"}, found(adhesion, actin));
  const std::string shifted = found(adhesion, test::mapped(actin, [&](int column, int row) {
                                      return std::pair((column + 4) % actin.width, (row + 3) % actin.height);
                                    }));
  EXPECT_TRUE(fires("channel-shift", "actin image is shifted", shifted)) << shifted;
  const std::string exchanged = found(actin, adhesion);
  EXPECT_TRUE(fires("bleed-through", "as long as wide", exchanged)) << exchanged;
  images::Image bled = adhesion;
  for (std::size_t k = 0; k < bled.pixels.size(); ++k) bled.pixels[k] += 0.3f * actin.pixels[k];
  const std::string through = found(bled, actin);
  EXPECT_TRUE(fires("bleed-through", "shows the fibres with", through)) << through;
  // a ring as of a podosome rosette: a line for the eye, too bent for a fibre
  images::Image with_ring = actin;
  const float bright = *std::ranges::max_element(actin.pixels);
  Vec2 middle;
  for (const Vec2 p : cell.truth.outline_um) middle += 1.0 / static_cast<double>(cell.truth.outline_um.size()) * p;
  Polyline ring;
  for (int k = 0; k <= 60; ++k) {
    const double angle = 2 * std::numbers::pi * k / 60;
    ring.push_back(middle + 1.5 * Vec2{std::cos(angle), std::sin(angle)});
  }
  test::draw_line(with_ring, ring, 2 * bright, 0.5, cell.actin.image.pixel_size_um.value());
  const std::string rosette = found(adhesion, with_ring);
  EXPECT_TRUE(fires("bright-actin", rosette)) << rosette;
}

}  // namespace
}  // namespace mbtfm
