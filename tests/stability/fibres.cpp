/// Actin images without fibres give none; what looks like fibres but is not is left out.
#include <opencv2/core.hpp>

#include "tests/support/drawn_image.h"
#include "tests/support/find_fibres.h"
#include "tests/support/segmentation_accuracy.h"

namespace mbtfm::cells {
namespace {

using namespace mbtfm::test;

std::vector<Fibre> fibres_of(const images::Image& image) { return find_fibres(image, {}, {}, 0.1, FibreParameters{}); }

TEST(Fibres, of_a_saturated_image_are_none) {
  images::Image image = even_image(300, 300, 70000);
  add_noise(image, 3000, 1);
  for (float& value : image.pixels) value = std::min(value, 65535.0f);
  EXPECT_TRUE(fibres_of(image).empty());
}

TEST(Fibres, of_a_cell_with_meshwork_alone_are_two_at_most) {
  for (const std::string quality : {"poor", "ordinary", "good"}) {
    SCOPED_TRACE(quality);
    const SimulatedCell cell = simulated_cell("no-fibres", quality, 1);
    const FibreParameters p;
    EXPECT_LE(find_fibres(cell.actin.image, cell.truth.outline_um, cell.truth.adhesions, 0.1, p).size(), 2u);
  }
}

TEST(Fibres, of_a_step_are_none) {
  images::Image image = even_image(256, 256, 100);
  for (int row = 0; row < 256; ++row)
    for (int column = 0; column < 256; ++column)
      if (column + row / 4 > 150) image.at(column, row) = 400;
  add_noise(image, 10, 1);
  EXPECT_TRUE(fibres_of(image).empty());
}

TEST(Fibres, are_the_same_for_any_number_of_threads) {
  const DrawnScene scene = drawn_scene(20, 1);
  const int before = cv::getNumThreads();
  std::vector<std::vector<Fibre>> found;
  for (const int threads : {1, 2, 4}) {
    cv::setNumThreads(threads);
    found.push_back(find_fibres(scene.actin_image, {}, scene.adhesions, scene.kPixel_um, FibreParameters{}));
  }
  cv::setNumThreads(before);
  for (const auto& fibres : found) {
    ASSERT_EQ(fibres.size(), found[0].size());
    for (std::size_t i = 0; i < fibres.size(); ++i) {
      EXPECT_EQ(fibres[i].points_um, found[0][i].points_um);
      EXPECT_EQ(fibres[i].width_um, found[0][i].width_um);
      EXPECT_EQ(fibres[i].confidence, found[0][i].confidence);
      EXPECT_EQ(fibres[i].type_reason, found[0][i].type_reason);
    }
  }
}

}  // namespace
}  // namespace mbtfm::cells
