/// Images that others took or made, where ../shared is at hand.
#include "pipeline/contract/errors.h"
#include "pipeline/files/text.h"
#include "pipeline/numerics/order_statistics.h"
#include "segment/beads/plane.h"
#include "tests/support/folders.h"
#include "tests/support/mat_tracks.h"
#include "tests/support/piv.h"

namespace mbtfm::beads {
namespace {

const std::filesystem::path kBeads = test::source_folder() / "../shared/data/beads";

/// Rows of four numbers, separated by commas or blanks; a header is skipped.
std::vector<std::array<double, 4>> rows_of_four(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<std::array<double, 4>> rows;
  for (std::string line; std::getline(in, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream text(line);
    std::array<double, 4> row;
    if (text >> row[0] >> row[1] >> row[2] >> row[3]) rows.push_back(row);
  }
  return rows;
}

TEST(RealBeads, a_layer_of_cells_moves_its_gel_as_image_correlation_says) {
  const auto folder = kBeads / "mdck_pdms_bism";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not here";
  for (const int frame : {1, 2}) {
    SCOPED_TRACE(frame);
    const auto image = [&](int k) {
      return images::read_image(folder / "forPIV" / ("000" + std::to_string(k) + ".tif"));
    };
    const images::Image relaxed = image(2 * frame - 2);
    const Tracking tracking = track_beads(relaxed, image(2 * frame - 1), 1.0, test::in_relaxed_frame(), 2);
    test::PivGrid grid;
    std::vector<Vec2> theirs;
    for (const auto& row : rows_of_four(folder / "reference" / ("PIV" + std::to_string(frame) + ".txt"))) {
      grid.middles.push_back({row[0] - test::kPivOrigin_px, row[1] - test::kPivOrigin_px});
      theirs.push_back({row[2], row[3]});
    }
    const test::BeadPair pair = test::redrawn(relaxed, tracking);
    const test::Agreement found = test::agreement(piv_in_two_passes(pair.relaxed, pair.stressed, grid, 32), theirs);
    RecordProperty("median_px_" + std::to_string(frame), std::to_string(found.median_px));
    // The bar of the data set. How the published correlation was done (windows, passes, origin) is not told with it:
    // the model of it was chosen with the pair in view, by what it makes of the images themselves (0.12 and 0.11 px,
    // which two correlations of one pair differ by); the tracking was not.
    EXPECT_LE(found.median_px, 0.15);
    EXPECT_GE(found.correlation, 0.95);
  }
}

TEST(RealBeads, a_cell_that_the_border_cuts_moves_nothing_beyond_its_reach) {
  const auto file = kBeads.parent_path() / "real/adhesions_and_beads/bead_a.tif";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not here";
  TrackParameters parameters = test::in_relaxed_frame();  // as others state places
  parameters.drift_affine = Switch::automatic;
  const images::Image stressed = images::read_image(file, {.page = 1}), relaxed = images::read_image(file, {.page = 2});
  constexpr double kPixel_um = 0.02025;
  for (const bool is_exchanged : {false, true}) {  // no false word of exchanged images, either way round
    const Tracking tracking = is_exchanged ? track_beads(stressed, relaxed, kPixel_um, parameters, 2)
                                           : track_beads(relaxed, stressed, kPixel_um, parameters, 2);
    EXPECT_TRUE(tracking.common.has_far_field);
    Vec2 sum;
    double n = 0;
    for (const Bead& bead : tracking.field) {  // above the cell
      if (!bead.flag.empty() || bead.position_um.y > 0.15 * 902 * kPixel_um) continue;
      sum += bead.displacement_um;
      ++n;
    }
    EXPECT_LE(std::abs(sum.x / n), 0.02);  // raw correlation: 0.01
    EXPECT_LE(std::abs(sum.y / n), 0.02);
  }
}

Vec2 median_of(const std::vector<Vec2>& values) {
  std::vector<double> x, y;
  for (const Vec2 v : values) x.push_back(v.x), y.push_back(v.y);
  return {numerics::quantile(x, 0.5), numerics::quantile(y, 0.5)};
}

std::vector<Vec2> less_median(std::vector<Vec2> values) {
  const Vec2 median = median_of(values);
  for (Vec2& value : values) value = value - median;
  return values;
}

TEST(RealBeads, weak_beads_on_a_mottled_ground_are_followed_by_windows_as_image_correlation_says) {
  const auto folder = kBeads / "axon";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not here";
  TrackParameters parameters = test::in_relaxed_frame();  // as others state places
  parameters.drift_affine = Switch::automatic;
  const Tracking tracking = track_beads(images::read_image(folder / "beads_relaxed.tif"),
                                        images::read_image(folder / "beads_stressed.tif"), 1.0, parameters, 2);
  EXPECT_TRUE(tracking.windows.is_on);
  test::PivGrid grid;
  std::vector<Vec2> published;
  for (const auto& row : rows_of_four(folder / "published_piv.csv")) {
    grid.middles.push_back({row[0], row[1]});
    published.push_back({row[2], row[3]});
  }
  const GridField theirs = grid.field(std::move(published));
  std::vector<Vec2> ours, there;
  for (const Bead& window : tracking.field) {
    if (!window.flag.empty()) continue;
    ours.push_back(window.displacement_um);
    there.push_back(theirs.at(window.position_um).u);
  }
  const test::Agreement whole = test::agreement(less_median(ours), less_median(there));
  RecordProperty("median_px", std::to_string(whole.median_px));
  RecordProperty("correlation", std::to_string(whole.correlation));
  // Reached: 0.21 and 0.91, where a median of these 68 windows is known to 0.02: both fields have their noise. This
  // limit is one such error beyond what is reached.
  EXPECT_LE(whole.median_px, 0.23);
  EXPECT_GE(whole.correlation, 0.85);
  // The data set states what another correlation reaches by component, x/y, and its bar for the median, 0.2 px, is such
  // a number: a vector differs by more than either of its components. (r by component: 0.850 and 0.934.)
  for (const Vec2 axis : {Vec2{1, 0}, Vec2{0, 1}}) {
    const auto along = [&](std::vector<Vec2> values) {
      for (Vec2& value : values) value = {dot(value, axis), 0};
      return values;
    };
    EXPECT_LE(test::agreement(along(less_median(ours)), along(less_median(there))).median_px, 0.2)
        << (axis.x > 0 ? "x" : "y");
  }
}

TEST(RealBeads, a_growth_cone_moves_its_gel_as_published_tracks_say) {
  const auto folder = kBeads.parent_path() / "real/growth_cone_thin_gel";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not here";
  constexpr double kPixel_um = 0.116;
  TrackParameters parameters = test::in_relaxed_frame();  // as others state places
  parameters.drift_affine = Switch::automatic;
  const Tracking tracking = track_beads(images::read_image(folder / "image1.tif"),
                                        images::read_image(folder / "image2.tif"), kPixel_um, parameters, 2);
  EXPECT_FALSE(tracking.windows.is_on);
  const auto columns =
      test::matrices_of(files::read_text(folder / "example_tracks.mat"));  // r, r stressed, displacement; in m
  ASSERT_EQ(columns.size(), 3u);
  const std::vector<Vec2>&places_m = columns[0], &displacements_m = columns[2];
  ASSERT_EQ(places_m.size(), 2093u);
  std::vector<Vec2> positions;
  for (const Bead& bead : tracking.field) positions.push_back(bead.position_um);
  const Neighbours ours(std::move(positions), 1);
  std::vector<Vec2> found, theirs;
  for (std::size_t k = 0; k < places_m.size(); ++k) {
    // they count pixels from 1, with the place in the pixel's middle
    const Vec2 place = 1e6 * places_m[k] - Vec2{0.5 * kPixel_um, 0.5 * kPixel_um};
    const auto nearest = ours.within(place, kPixel_um, 1);  // beyond it lies another bead
    if (nearest.empty() || !tracking.field[nearest[0]].flag.empty()) continue;
    found.push_back(tracking.field[nearest[0]].displacement_um);
    theirs.push_back(1e6 * displacements_m[k]);
  }
  EXPECT_GE(static_cast<double>(found.size()), 0.75 * static_cast<double>(places_m.size()));
  const test::Agreement agreement = test::agreement(less_median(found), less_median(theirs));
  RecordProperty("median_nm", std::to_string(1e3 * agreement.median_px));
  EXPECT_LE(agreement.median_px, 0.010);  // um: the bar of the data set
}

class TurnedBeads : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(folder_)) GTEST_SKIP() << folder_ << " is not here";
    for (const auto& row : rows_of_four(folder_ / "truth_1001_1002.csv")) {
      truth_[0].push_back({row[0] - 1, row[1] - 1});  // they count from 1
      truth_[1].push_back({row[2] - 1, row[3] - 1});
    }
    for (const int k : {0, 1}) images_[k] = images::read_image(folder_ / ("img_100" + std::to_string(k + 1) + ".tif"));
  }
  std::filesystem::path folder_ = kBeads / "synthetic_rotation_serialtrack";
  std::vector<Vec2> truth_[2];
  images::Image images_[2];
};

TEST_F(TurnedBeads, are_detected) {
  for (const int k : {0, 1}) {
    const auto found = detect_beads(images_[k]);
    std::vector<char> is_taken(found.size(), 0);
    int n_true = 0, n_hit = 0;
    double squares = 0;
    for (const Vec2 bead : truth_[k]) {
      if (std::min({bead.x, bead.y, images_[k].width - 1 - bead.x, images_[k].height - 1 - bead.y}) < 0) continue;
      ++n_true;
      double best = 1;  // px
      std::optional<std::size_t> hit;
      for (std::size_t b = 0; b < found.size(); ++b) {
        const double distance = norm(found[b].position_px - bead);
        if (!is_taken[b] && distance < best) best = distance, hit = b;
      }
      if (!hit) continue;
      is_taken[*hit] = 1;
      squares += best * best;
      ++n_hit;
    }
    EXPECT_GE(n_hit, 0.97 * n_true);
    EXPECT_GE(n_hit, 0.97 * static_cast<double>(found.size()));
    EXPECT_LE(std::sqrt(squares / n_hit), 0.1);
  }
}

TEST_F(TurnedBeads, are_refused_as_shifted_ones_and_followed_as_turned_ones) {
  EXPECT_THROW(track_beads(images_[0], images_[1], 1.0), InvalidData);
  {
    TrackParameters parameters = test::in_relaxed_frame();  // as others state places
    parameters.drift_affine = Switch::on;
    const Tracking tracking = track_beads(images_[0], images_[1], 1.0, parameters, 2);
    EXPECT_NEAR(tracking.common.turn_rad * 180 / std::numbers::pi, 10, 0.01);
    EXPECT_GE(tracking.n_good, 0.85 * static_cast<double>(tracking.field.size()));  // the others have left
    for (const Bead& bead : tracking.field) {
      if (!bead.flag.empty()) continue;
      EXPECT_LE(norm(bead.displacement_um), 0.5);  // the beads were turned and nothing else
    }
  }
}

}  // namespace
}  // namespace mbtfm::beads
