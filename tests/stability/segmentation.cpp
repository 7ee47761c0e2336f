/// Images without a cell give none, and say why.
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "tests/support/drawn_image.h"
#include "tests/support/segmentation_accuracy.h"

namespace mbtfm::cells {
namespace {

using namespace mbtfm::test;

void expect_nothing(const images::Image& image, double pixel_um = 0.1) {
  EXPECT_TRUE(find_adhesions(image, pixel_um, AdhesionParameters{}).empty());
  EXPECT_TRUE(find_fibres(image, {}, {}, pixel_um, FibreParameters{}).empty());
  EXPECT_TRUE(find_outline(image, {}, pixel_um, OutlineParameters{}).empty());
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

TEST_F(ImagesOfTwoCells, are_told_from_those_of_one) {
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
    EXPECT_LT(sound.adhesions_off_actin, 0.7 * most_adhesions);
    EXPECT_LT(sound.outline_off_actin, 0.5 * most_outline);
    EXPECT_GT(segmented(cell.adhesion, cell.actin, others).outline_off_actin, most_outline);
    EXPECT_GT(segmented(upside_down(cell.adhesion), cell.actin).adhesions_off_actin, most_adhesions);
    EXPECT_GT(segmented(other.adhesion, cell.actin).adhesions_off_actin, most_adhesions);
  }
}

}  // namespace
}  // namespace mbtfm::cells
