#include "pipeline/contract/polyline.h"
#include "tests/support/test.h"

namespace mbtfm {
namespace {

const Polyline kCorner_um = {{0, 0}, {4, 0}, {4, 0}, {4, 4}};  // with a point twice

TEST(Polyline, shares_of_the_length_are_walked_round_corners) {
  EXPECT_EQ(point_along_um(kCorner_um, 0), (Vec2{0, 0}));
  EXPECT_EQ(point_along_um(kCorner_um, 0.25), (Vec2{2, 0}));
  EXPECT_EQ(point_along_um(kCorner_um, 0.75), (Vec2{4, 2}));
  EXPECT_EQ(point_along_um(kCorner_um, 1), (Vec2{4, 4}));
}

TEST(Polyline, the_distance_is_to_the_nearest_piece_or_end) {
  EXPECT_EQ(distance_to_line_um(kCorner_um, {1, 3}), 3);
  EXPECT_EQ(distance_to_line_um(kCorner_um, {7, 8}), 5);
  EXPECT_EQ(distance_to_line_um(kCorner_um, {3, 0}), 0);
  EXPECT_TRUE(std::isinf(distance_to_line_um({{1, 1}}, {3, 0})));
}

TEST(Polyline, a_label_keeps_clear_of_crossing_fibres_where_it_can) {
  std::vector<Fibre> fibres(2);
  fibres[0].fibre_id = 1;
  fibres[0].points_um = {{0, 0}, {10, 0}};
  fibres[1].fibre_id = 2;
  fibres[1].points_um = {{5, -1}, {5, 1}};
  const std::vector<Vec2> places = label_places_um(fibres[0], fibres, 0.5);
  EXPECT_EQ(places.front(), (Vec2{4, 0}));
  EXPECT_EQ(places.back(), (Vec2{5, 0}));
  EXPECT_EQ(label_places_um(fibres[0], fibres, 100).front(), (Vec2{5, 0})) << "no place is clear";
}

}  // namespace
}  // namespace mbtfm
