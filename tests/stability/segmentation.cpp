/// Images without a cell give none, and say why.
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "tests/support/drawn_image.h"
#include "tests/support/find_fibres.h"
#include "tests/support/segmentation_accuracy.h"

namespace mbtfm::cells {
namespace {

using namespace mbtfm::test;

void expect_nothing(const images::Image& image, double pixel_um = 0.1) {
  EXPECT_TRUE(find_adhesions(image, pixel_um, AdhesionParameters{}).empty());
  EXPECT_TRUE(find_fibres(image, {}, {}, pixel_um, FibreParameters{}).empty());
  EXPECT_TRUE(find_cells(image, {}, pixel_um, {}).cells.empty());
}

TEST(Segmentation, finds_nothing_in_a_constant_image) {
  for (const float level : {0.0f, 100.0f, 65535.0f}) expect_nothing(even_image(200, 150, level));
}

TEST(Segmentation, finds_nothing_in_noise_alone) {
  for (const std::uint64_t seed : {1, 2, 3})
    for (const double pixel_um : {0.05, 0.1, 0.2}) {
      SCOPED_TRACE(std::to_string(seed) + " " + std::to_string(pixel_um));
      images::Image image = even_image(512, 384, 200);
      add_noise(image, 15, seed);
      expect_nothing(image, pixel_um);
    }
}

TEST(Segmentation, takes_images_of_few_pixels) {
  for (const int side : {1, 2, 5, 17})
    for (const int length : {side, 700}) expect_nothing(even_image(side, length, 3));
}

TEST(Segmentation, says_how_small_a_thing_is_that_is_too_small_for_a_cell) {
  images::Image image = even_image(300, 300, 100);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      if (std::hypot(x - 150, y - 150) < 30) image.at(x, y) = 400;  // 28 um²
  add_noise(image, 5, 1);
  SegmentParameters p;
  p.pixel_size_um = 0.1;
  p.candidates.adhesions = AdhesionSource::none;
  const InputError error = test::thrown<InputError>([&] { segment_cell({}, images::Channel{"small.tif", image}, p); });
  EXPECT_TRUE(has_words(error.found, "the largest covers 2", "at least 50 um²"));
  EXPECT_TRUE(has_words(error.hint, "outline_smallest_um2", "pixel_size_um"));
}

TEST(Segmentation, says_what_is_missing) {
  SegmentParameters p;
  const images::Channel flat{"flat.tif", even_image(64, 64, 5)}, wide{"wide.tif", even_image(80, 64, 5)};
  EXPECT_THROW(segment_cell({}, {}, p), UsageError);
  const InputError error = test::thrown<InputError>([&] { segment_cell(flat, {}, p); });
  EXPECT_EQ(error.where, "flat.tif");
  EXPECT_TRUE(has_words(error.hint, "pixel_size_um"));
  p.pixel_size_um = 0.1;
  EXPECT_EQ(test::thrown<InputError>([&] { segment_cell(flat, {}, p); }).found, "every pixel is 5");
  EXPECT_THROW(segment_cell(flat, wide, p), InputError);
  images::Channel one = flat, two = flat;
  one.image.pixel_size_um = 0.1;
  two.image.pixel_size_um = 0.2;
  EXPECT_THROW(images::common_pixel_size_um(one, two, std::nullopt), InputError);
}

class ImagesOfTwoCells : public testing::Test {
 protected:
  static std::shared_ptr<const LabelMask> mask_of(const Polygon& outline_um, const images::Image& like) {
    LabelMask mask{.name = "mask.png", .width = like.width, .height = like.height, .is_binary = true};
    for (int j = 0; j < like.height; ++j)
      for (int i = 0; i < like.width; ++i)
        mask.labels.push_back(contains(outline_um, centre_of_pixel_um(i, j, kPixel_um)) ? 1 : 0);
    return std::make_shared<const LabelMask>(std::move(mask));
  }
  static images::Channel upside_down(const images::Channel& channel) {
    const int height = channel.image.height;
    return {channel.name,
            mapped(channel.image, [=](int column, int row) { return std::pair(column, height - 1 - row); })};
  }
  Segmentation segmented(const images::Channel& adhesion, const images::Channel& actin,
                         const HandDrawn& drawn = {}) const {
    return segment_cell(adhesion, actin, SegmentParameters{}, drawn);
  }
  static double threshold(Symptom kind) { return properties_of(kind).threshold; }
  static constexpr double kPixel_um = 0.1;
};

TEST_F(ImagesOfTwoCells, differ_from_those_of_one) {
  const double most_adhesions = threshold(Symptom::adhesions_off_actin),
               most_outline = threshold(Symptom::outline_off_actin);
  for (const std::uint64_t seed : {71, 72, 73}) {
    SCOPED_TRACE(seed);
    const SimulatedCell cell = simulated_cell("u2os", "ordinary", seed),
                        other = simulated_cell("u2os", "ordinary", seed + 1000);
    HandDrawn own, others;
    own.outline_mask = mask_of(cell.truth.outline_um, cell.actin.image);
    others.outline_mask = mask_of(other.truth.outline_um, cell.actin.image);
    const Segmentation sound = segmented(cell.adhesion, cell.actin, own);
    EXPECT_LT(sound.adhesions_beyond, 0.7 * most_adhesions);
    EXPECT_LT(sound.outline_off_actin, 0.5 * most_outline);
    EXPECT_GT(segmented(cell.adhesion, cell.actin, others).outline_off_actin, most_outline);
    EXPECT_GT(segmented(upside_down(cell.adhesion), cell.actin).adhesions_beyond, most_adhesions);
    EXPECT_GT(segmented(other.adhesion, cell.actin).adhesions_beyond, most_adhesions);
  }
}

TEST_F(ImagesOfTwoCells, half_a_cell_leaves_adhesions_outside) {
  for (const std::uint64_t seed : {71, 72}) {
    SimulatedCell cell = simulated_cell("u2os", "ordinary", seed);
    const double ground = *std::ranges::min_element(cell.actin.image.pixels);
    const auto [low, high] = extent_of(cell.truth.outline_um);
    const int middle = static_cast<int>((low.x + high.x) / 2 / kPixel_um);
    for (int j = 0; j < cell.actin.image.height; ++j)
      for (int i = middle; i < cell.actin.image.width; ++i)
        cell.actin.image.at(i, j) = static_cast<float>(ground + 0.1 * (cell.actin.image.at(i, j) - ground));
    EXPECT_GT(segmented(cell.adhesion, cell.actin).adhesions_beyond, threshold(Symptom::adhesions_off_actin));
  }
}

/// As registration leaves it: nothing beyond a line through `at_um` that is turned by `angle_rad` from the vertical.
images::Image padded(images::Image image, Vec2 at_um, double angle_rad, double pixel_um) {
  for (int j = 0; j < image.height; ++j)
    for (int i = 0; i < image.width; ++i)
      if (dot(centre_of_pixel_um(i, j, pixel_um) - at_um, {std::cos(angle_rad), std::sin(angle_rad)}) > 0)
        image.at(i, j) = 0;
  return image;
}

TEST_F(ImagesOfTwoCells, padding_of_a_turned_image_is_no_edge) {
  const SimulatedCell cell = simulated_cell("u2os", "ordinary", 71);
  const auto outlined = [&](const images::Image& image) {
    return find_cells(image, {}, kPixel_um, OutlineParameters{}).cells.front();
  };
  const CellOutline whole = outlined(cell.actin.image);
  const auto [low, high] = extent_of(whole.outer_um);
  const double turn = 0.1, width_um = cell.actin.image.width * kPixel_um;
  const CellOutline beside = outlined(padded(cell.actin.image, {high.x + 4, width_um / 2}, turn, kPixel_um));
  EXPECT_GT(intersection_over_union(whole.outer_um, beside.outer_um), 0.99);
  EXPECT_FALSE(beside.is_cut_by_border());

  const Vec2 through_um = 0.5 * (low + high), normal{std::cos(turn), std::sin(turn)};
  const CellOutline cut = outlined(padded(cell.actin.image, through_um, turn, kPixel_um));
  for (std::size_t i = 0; i < cut.outer_um.size(); ++i) {
    const double beyond_um = dot(cut.outer_um[i] - through_um, normal);
    EXPECT_LT(beyond_um, 0.3);
    if (std::abs(beyond_um) < 0.3 ||
        beyond_um < -0.7)  // between them the ring goes round a corner, on a grid of 0.4 um
      EXPECT_EQ(cut.is_cut[i], beyond_um > -0.5) << cut.outer_um[i].y << " um: " << beyond_um;
    if (beyond_um < -0.5) EXPECT_LT(distance_to_boundary_um(whole.outer_um, cut.outer_um[i]), 0.5);
  }
  EXPECT_GT(cut.area_um2, 0.3 * whole.area_um2);
}

TEST_F(ImagesOfTwoCells, the_edge_of_the_light_is_no_edge_of_a_cell) {
  const SimulatedCell cell = simulated_cell("u2os", "ordinary", 71);
  const Segmentation sound = segmented(cell.adhesion, cell.actin);
  constexpr double kHaze = 250;  // counts of the ground in the light, of some 300 of the cell
  const auto lit = [&](images::Channel channel, auto light_at) {
    const float ground = *std::ranges::min_element(channel.image.pixels);
    for (int j = 0; j < channel.image.height; ++j)
      for (int i = 0; i < channel.image.width; ++i) {
        float& value = channel.image.at(i, j);
        value = ground + static_cast<float>(light_at(i - 512.0) * (value - ground + kHaze));
      }
    return channel;
  };
  const auto in_a_slit = [](double x) { return 1 / (1 + std::exp((std::abs(x) - 470) / 6)); };
  const Segmentation found = segmented(lit(cell.adhesion, in_a_slit), lit(cell.actin, in_a_slit));
  EXPECT_GT(intersection_over_union(sound.cell.outline_um, found.cell.outline_um), 0.97);
  EXPECT_LT(sound.reach_um, 0.7 * kOutlineReach_um);

  // what no threshold can separate is asked about
  const auto uneven = [](double x) { return 1.2 + x / 512; };
  EXPECT_GT(segmented(lit(cell.adhesion, uneven), lit(cell.actin, uneven)).reach_um, kOutlineReach_um);
}

}  // namespace
}  // namespace mbtfm::cells
