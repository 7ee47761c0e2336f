#include "segment/cells/contact_sheet.h"

#include "pipeline/contract/errors.h"
#include "tests/support/drawn_image.h"

namespace mbtfm::images {
namespace {

TEST(ContactSheet, has_the_first_parameter_in_columns_and_the_second_in_rows) {
  const auto axes = cells::parse_axes("adhesion_seed_noise=3,4.5  fibre_false_per_cell=0.1");
  ASSERT_EQ(axes.size(), 2u);
  EXPECT_EQ(axes[0].parameter, "adhesion_seed_noise");
  EXPECT_EQ(axes[0].values, (std::vector<std::string>{"3", "4.5"}));
  EXPECT_EQ(axes[1].values, std::vector<std::string>{"0.1"});
}

TEST(ContactSheet, refuses_what_is_no_list_of_values) {
  for (const char* text : {"", "  ", "a", "a=", "=1,2", "a=1,,2", "a=1 b=2 c=3", "a=1 a=2"})
    EXPECT_THROW(cells::parse_axes(text), UsageError) << text;
  std::string many = "a=0";
  for (int i = 1; i < 65; ++i) many += "," + std::to_string(i);
  EXPECT_THROW(cells::parse_axes(many), UsageError);
}

struct Sheet {
  test::DrawnScene scene = test::drawn_scene(10, 1);
  Picture draw(const std::string& axes) const {
    cells::SegmentParameters p;
    p.pixel_size_um = scene.kPixel_um;
    p.contact_sheet = axes;
    return cells::draw_contact_sheet(Channel{"adhesion", scene.adhesion_image}, Channel{"actin", scene.actin_image}, p);
  }
};

TEST(ContactSheet, grows_with_the_number_of_values) {
  const Sheet sheet;
  const Picture one = sheet.draw("adhesion_seed_noise=5");
  const Picture four = sheet.draw("adhesion_seed_noise=5,6 fibre_shortest_um=3,5");
  const int gap = 10;
  EXPECT_EQ(four.width - gap, 2 * (one.width - gap));
  EXPECT_EQ(four.height - gap, 2 * (one.height - gap));
}

TEST(ContactSheet, shows_values_with_which_nothing_is_found) {
  const Sheet sheet;
  EXPECT_EQ(sheet.draw("adhesion_smallest_um2=0.1,20").rgb.size() % 3, 0u);
}

TEST(ContactSheet, names_the_parameter_that_was_meant) {
  const Sheet sheet;
  const UsageError error = test::thrown<UsageError>([&] { sheet.draw("adhesion_smalest_um2=3"); });
  EXPECT_TRUE(has_words(error.what(), "adhesion_smallest_um2"));
  EXPECT_THROW(sheet.draw("adhesion_smallest_um2=-1"), UsageError);
}

}  // namespace
}  // namespace mbtfm::images
