#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "tests/support/findings.h"
#include "tests/support/program.h"
#include "tests/support/tiff_pages.h"
#include "tests/support/weak_beads.h"

namespace mbtfm {
namespace {

using test::fires;

/// In its folder, to `out`.
Outcome run_track(const test::TemporaryFolder& folder, const std::string& arguments) {
  return run_in(folder, "mbtfm-track --out out " + arguments);
}

std::string files(const std::string& relaxed, const std::string& stressed) {
  return "--relaxed " + relaxed + " --stressed " + stressed;
}

void write(const fs::path& file, images::Image image, std::optional<double> pixel_size_um) {
  image.pixel_size_um = pixel_size_um;
  images::write_tiff(file, image);
}

/// r.tif and two frames of the same beads, shifted by (2, 1) and (-3, 2) px of 0.2 um.
void write_series(const test::TemporaryFolder& folder) {
  const auto one = test::draw_bead_pair({}, {.width = 128, .n_beads = 330, .drift = {2, 1}});
  const auto two = test::draw_bead_pair({}, {.width = 128, .n_beads = 330, .drift = {-3, 2}});
  write(folder / "r.tif", one.relaxed, 0.2);
  fs::create_directory(folder / "frames");
  write(folder / "frames/t2.tif", one.stressed, 0.2);
  write(folder / "frames/t10.TIF", two.stressed, 0.2);
  files::write_text(folder / "frames/._t2.tif", "as a Mac leaves on a stick");
}

using TrackEndToEnd = test::InFolder;

TEST_F(TrackEndToEnd, frames_are_tracked_in_the_order_of_their_numbers_and_one_that_is_lost_again) {
  write_series(folder);
  const std::string arguments = files("r.tif", "frames") + " --record out/record.json";
  output_of(run_track(folder, arguments));
  const files::CsvTable frames(folder / "out/frames.csv");
  ASSERT_EQ(frames.n_rows(), 2);
  EXPECT_NEAR(frames.number(0, "drift_x_um"), 0.4, 0.005);
  EXPECT_NEAR(frames.number(1, "drift_x_um"), -0.6, 0.005);
  const std::string first = files::read_text(folder / "out/displacement_0001.csv");
  EXPECT_EQ(files::read_text(folder / "out/displacement.csv"), first);
  const std::string list = files::read_text(folder / "out/frames.csv"),
                    lost = files::read_text(folder / "out/displacement_0002.csv");
  const std::string other = files::read_text(folder / "out/displacement.csv") + "1,1,0,0,0.1,by hand\n";
  files::write_text(folder / "out/displacement_0001.csv", other);  // no tracking would give it
  fs::remove(folder / "out/displacement_0002.csv");
  output_of(run_track(folder, arguments + " --kept out"));
  EXPECT_EQ(files::read_text(folder / "out/displacement_0002.csv"), lost);
  EXPECT_EQ(files::read_text(folder / "out/displacement_0001.csv"), other);
  EXPECT_EQ(files::read_text(folder / "out/frames.csv"), list);
  EXPECT_TRUE(has_words(files::read_text(folder / "out/record.json"), "\"n_frames_kept\": 1"));
}

TEST_F(TrackEndToEnd, displacements_of_another_program_take_the_place_of_images) {
  files::write_text(folder / "piv.csv", "x,y,u,v\n0,0,1,0\n10,0,1,0\n0,10,1,0\n10,10,NaN,0\n");
  const std::string given = "--displacement piv.csv";
  const std::string columns = " --x_column x --y_column y --ux_column u --uy_column v";
  EXPECT_TRUE(
      has_words(output_of(run_track(folder, given + columns + " --length_unit px --pixel_size_um 0.5")), "1 flagged"));
  const DisplacementField field = files::read_displacement(folder / "out/displacement.csv");
  ASSERT_EQ(field.size(), 4u);
  EXPECT_EQ(field[1].position_um, (Vec2{5.25, 0.25}));
  EXPECT_EQ(field[1].displacement_um, (Vec2{0.5, 0}));
  EXPECT_EQ(field[3].flag, "not a number");
  EXPECT_EQ(run_track(folder, given).code, 3);                                  // other columns
  EXPECT_EQ(run_track(folder, given + columns + " --length_unit px").code, 2);  // of which size?
  EXPECT_EQ(run_track(folder, given + " --relaxed piv.csv").code, 2);           // which of them?
  EXPECT_EQ(run_track(folder, "").code, 2);
}

TEST_F(TrackEndToEnd, what_is_wrong_with_the_images_is_said_and_nothing_is_left) {
  const auto pair = test::draw_bead_pair({}, {.width = 128, .n_beads = 330});
  const images::Image dark = test::draw_bead_pair({}, {.width = 128, .n_beads = 0}).relaxed;
  images::Image one = dark, broken = pair.stressed;
  test::add_bead(one, {60.3, 50.8}, 3000, 1.3);
  broken.at(6, 11) = std::numeric_limits<float>::quiet_NaN();
  write(folder / "r.tif", pair.relaxed, 0.2);
  write(folder / "s.tif", pair.stressed, 0.2);
  write(folder / "small.tif", test::draw_bead_pair({}, {.width = 96, .n_beads = 200}).stressed, 0.2);
  write(folder / "dark.tif", dark, 0.2);
  write(folder / "one.tif", one, 0.2);
  write(folder / "other_scale.tif", pair.stressed, 0.25);
  write(folder / "no_scale.tif", pair.stressed, std::nullopt);
  test::write_pages<float>(folder / "nan.tif", {broken}, "ImageJ=1.53t\nimages=1\n");
  fs::copy_file(folder / "r.tif", folder / "cut.tif");
  fs::resize_file(folder / "cut.tif", 3000);
  const struct {
    const char *relaxed, *stressed;
    std::vector<std::string> said;
  } cases[] = {{"r.tif", "none.tif", {"none.tif"}},
               {"r.tif", "cut.tif", {"cut.tif"}},
               {"r.tif", "small.tif", {"small.tif", "r.tif", "128 x 128", "96 x 96"}},
               {"dark.tif", "s.tif", {"dark.tif", "the relaxed image", "beads", "none"}},
               {"r.tif", "dark.tif", {"dark.tif", "the stressed image", "beads", "none"}},
               {"dark.tif", "dark.tif", {"beads", "none"}},
               {"one.tif", "s.tif", {"one.tif", "8 beads at least", "found 1"}},
               {"r.tif", "one.tif", {"one.tif", "8 beads at least", "found 1"}},
               {"r.tif", "nan.tif", {"nan.tif", "finite pixel values", "NaN"}},
               {"nan.tif", "s.tif", {"nan.tif", "finite pixel values", "NaN"}},
               {"r.tif", "r.tif", {"two images", "the same pixels in both"}},
               {"r.tif", "other_scale.tif", {"other_scale.tif", "r.tif", "0.25"}},
               {"no_scale.tif", "no_scale.tif", {"no_scale.tif", "calibration", "pixel_size_um"}}};
  for (const auto& c : cases) {
    const Outcome ended = run_track(folder, files(c.relaxed, c.stressed));
    EXPECT_EQ(ended.code, 3) << c.relaxed << ' ' << c.stressed << ended.output;
    for (const std::string& word : c.said) EXPECT_TRUE(has_words(ended.output, word));
    EXPECT_FALSE(fs::exists(folder / "out")) << c.relaxed << ' ' << c.stressed;
  }
}

TEST_F(TrackEndToEnd, a_frame_that_is_refused_does_not_stop_the_others) {
  const auto one = test::draw_bead_pair({}, {.width = 128, .n_beads = 330, .drift = {2, 1}});
  const auto two = test::draw_bead_pair({}, {.width = 128, .n_beads = 330, .drift = {-3, 2}});
  const auto dark = test::draw_bead_pair({}, {.width = 128, .n_beads = 0});
  write(folder / "r.tif", one.relaxed, 0.2);
  fs::create_directory(folder / "frames");
  write(folder / "frames/a.tif", dark.stressed, 0.2);
  write(folder / "frames/b.tif", one.stressed, 0.2);
  files::write_text(folder / "frames/c.tif", "no image");
  write(folder / "frames/d.tif", two.stressed, 0.2);
  EXPECT_TRUE(has_words(output_of(run_track(folder, files("r.tif", "frames")), 4), "2 of 4 frames"));
  const files::CsvTable frames(folder / "out/frames.csv");
  ASSERT_EQ(frames.n_rows(), 4);
  EXPECT_TRUE(has_words(frames.text(0, "refused"), "bright beads"));
  EXPECT_EQ(frames.text(0, "n_tracked"), "");
  EXPECT_EQ(frames.text(1, "refused"), "");
  EXPECT_TRUE(has_words(frames.text(2, "refused"), "c.tif"));
  EXPECT_NEAR(frames.number(3, "drift_x_um"), -0.6, 0.005);
  for (const char* missing : {"1", "3"})
    EXPECT_FALSE(fs::exists(folder / ("out/displacement_000" + std::string(missing) + ".csv")));
  EXPECT_EQ(files::read_text(folder / "out/displacement.csv"), files::read_text(folder / "out/displacement_0002.csv"));
  EXPECT_EQ(files::read_displacement(folder / "out/displacement_0004.csv").size(),
            files::read_displacement(folder / "out/displacement.csv").size());
  fs::remove(folder / "frames/b.tif");
  fs::remove(folder / "frames/d.tif");
  fs::remove_all(folder / "out");
  EXPECT_EQ(run_track(folder, files("r.tif", "frames")).code, 3);  // of no frame is there a field
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST_F(TrackEndToEnd, channel_time_and_page_are_chosen_for_both_images_alike) {
  const auto one = test::draw_bead_pair({}, {.width = 128, .n_beads = 330, .drift = {2, 1}});
  const auto two = test::draw_bead_pair({}, {.width = 128, .n_beads = 330, .drift = {-3, 2}});
  const images::Image other = test::draw_bead_pair({}, {.width = 128, .n_beads = 0}).relaxed;
  // times 1 and 2 pull, 3 is relaxed; channel 1 shows something else
  test::write_pages<float>(folder / "s.tif", {other, one.stressed, other, two.stressed, other, one.relaxed},
                           "ImageJ=1.53t\nimages=6\nchannels=2\nslices=1\nframes=3\nhyperstack=true\n");
  // of a series the places are those of its first frame, of a frame alone its own: the relaxed one is the same for both
  const std::string both = files("s.tif", "s.tif") + " --pixel_size_um 0.2 --cell_with relaxed";
  const std::string relaxed = " --relaxed_channel 2 --relaxed_time 3", beads = " --stressed_channel 2";
  Outcome ended = run_track(folder, both + relaxed + beads + " --stressed_time 1 --stressed_last 2");
  ASSERT_EQ(ended.code, 0) << ended.output;
  const files::CsvTable frames(folder / "out/frames.csv");
  ASSERT_EQ(frames.n_rows(), 2);
  EXPECT_NEAR(frames.number(0, "drift_x_um"), 0.4, 0.005);
  EXPECT_NEAR(frames.number(1, "drift_x_um"), -0.6, 0.005);
  const std::string of_time = files::read_text(folder / "out/displacement_0002.csv");
  ended = run_track(folder, both + " --relaxed_page 6 --stressed_page 4");
  ASSERT_EQ(ended.code, 0) << ended.output;
  EXPECT_EQ(files::read_text(folder / "out/displacement.csv"), of_time);
  EXPECT_EQ(run_track(folder, both).code, 3);                                           // which of them?
  EXPECT_EQ(run_track(folder, both + relaxed + beads).code, 3);                         // of which time?
  EXPECT_EQ(run_track(folder, both + relaxed + beads + " --stressed_last 2").code, 2);  // from where?
  EXPECT_EQ(run_track(folder, both + relaxed + beads + " --stressed_time 3 --stressed_last 2").code, 2);
}

TEST_F(TrackEndToEnd, exchanged_images_are_an_error_with_the_remedy) {
  const auto pair = test::draw_bead_pair(test::ring_of_adhesions(384, 6), {.width = 384, .n_beads = 2950});
  write(folder / "r.tif", pair.relaxed, 0.2);
  write(folder / "s.tif", pair.stressed, 0.2);
  const Outcome sound = run_track(folder, files("r.tif", "s.tif"));
  EXPECT_EQ(sound.code, 0);
  const DisplacementField field = files::read_displacement(folder / "out/displacement.csv");
  EXPECT_GT(field.size(), 1500u);
  for (const Bead& bead : field) EXPECT_LE(std::max(bead.position_um.x, bead.position_um.y), 384 * 0.2);
  EXPECT_TRUE(fs::exists(folder / "out/displacement.vtp"));
  test::expect_silent({"nothing-moves", "pushes-outward", "field-smoothed", "defocused", "beads-not-round", "saturated",
                       "lossy-image", "unusual-value"},
                      sound.output);
  EXPECT_TRUE(has_words(output_of(run_track(folder, files("s.tif", "r.tif")), 3),
                        "exchange the files of --stressed and --relaxed"));
  const Outcome pushed = run_track(folder, files("s.tif", "r.tif") + " --may_push");
  EXPECT_EQ(pushed.code, 0);
  EXPECT_TRUE(fires("pushes-outward", "mean cosine", pushed.output)) << pushed.output;
}

TEST_F(TrackEndToEnd, beads_narrower_than_a_lens_shows_them_are_named) {
  const auto pair = test::draw_bead_pair({}, {.width = 128, .n_beads = 330});  // 1.3 px: 0.26 and 0.065 um
  for (const double pixel_um : {0.2, 0.05}) {
    write(folder / "r.tif", pair.relaxed, pixel_um);
    write(folder / "s.tif", pair.stressed, pixel_um);
    const std::string ended = output_of(run_track(folder, files("r.tif", "s.tif")));
    EXPECT_EQ(ended.find("of the beads in the images is 0.0") != std::string::npos, pixel_um < 0.1) << ended;
    EXPECT_EQ(fires("unusual-value", ended), pixel_um < 0.1) << ended;
  }
}

TEST_F(TrackEndToEnd, images_out_of_focus_mixed_of_oblong_pixels_or_of_weak_beads_are_named) {
  const auto output_for = [&](const test::BeadPair& pair) {
    write(folder / "r.tif", pair.relaxed, 0.2);
    write(folder / "s.tif", pair.stressed, 0.2);
    return output_of(run_track(folder, files("r.tif", "s.tif")));
  };
  test::BeadScene scene{.width = 256, .n_beads = 1300, .drift = {2, 1}};
  std::vector<test::Peak> peaks = test::ring_of_adhesions(scene.width, 3);
  test::BeadScene defocused = scene, oblong = scene, weak = scene;
  defocused.defocus = 1.8;
  oblong.bead_aspect = 1.2;
  weak.brightness = 25;
  EXPECT_TRUE(fires("defocused", output_for(test::draw_bead_pair(peaks, defocused))));
  test::BeadScene wide = scene;  // 0.4 um, as beads of 1.4 um
  wide.bead_sigma = 2;
  EXPECT_TRUE(fires("defocused", "beads look", output_for(test::draw_bead_pair(peaks, wide))));
  EXPECT_FALSE(fires("defocused", "beads look", output_for(test::draw_bead_pair(peaks, scene))));
  const std::string of_oblong = output_for(test::draw_bead_pair(peaks, oblong));
  EXPECT_TRUE(fires("beads-not-round", of_oblong)) << of_oblong;
  EXPECT_TRUE(has_words(of_oblong, "caution (beads-not-round)"));
  test::BeadPair mixed = test::draw_bead_pair(peaks, scene);
  EXPECT_FALSE(fires("pictures-mixed", output_for(mixed)));
  for (std::size_t k = 0; k < mixed.relaxed.pixels.size(); ++k)
    mixed.relaxed.pixels[k] = 0.8f * mixed.relaxed.pixels[k] + 0.2f * mixed.stressed.pixels[k];
  EXPECT_TRUE(fires("pictures-mixed", "relaxed", output_for(mixed)));
  for (test::Peak& peak : peaks) peak.radius *= 4;  // narrower ones no window shows
  const std::string of_weak = output_for(test::weakened(test::draw_bead_pair(peaks, weak), {.levels = 40}, 1));
  EXPECT_TRUE(fires("field-smoothed", "Windows of", of_weak)) << of_weak;
}

/// Dots in a lattice instead of beads: any of its periods fits, so the least shift is the right one.
TEST_F(TrackEndToEnd, dots_in_a_lattice_find_their_partners_and_a_choice_is_named) {
  constexpr int kWidth = 256, kPitch = 16;
  const std::vector<test::Peak> peaks = test::ring_of_adhesions(kWidth, kPitch / 6.0);
  const auto lattice = [&](Vec2 shift, bool is_pulled, std::uint64_t seed) {
    images::Image image{.width = kWidth, .height = kWidth, .pixels = {}, .pixel_size_um = {}};
    image.pixels.assign(kWidth * kWidth, 150);
    for (int j = -1; j <= kWidth / kPitch; ++j) {
      for (int i = -1; i <= kWidth / kPitch; ++i) {
        const Vec2 at{(i + 0.5) * kPitch, (j + 0.5) * kPitch};
        test::add_bead(image, at + shift + (is_pulled ? test::displacement(peaks, at) : Vec2{}), 1500, 2);
      }
    }
    std::mt19937_64 random(seed);
    for (float& value : image.pixels) value = static_cast<float>(std::poisson_distribution<int>(value)(random));
    return image;
  };
  write(folder / "r.tif", lattice({}, false, 1), 0.1);
  for (const std::uint64_t seed : {2, 3}) {
    write(folder / "s.tif", lattice({0.3, -0.2}, true, seed), 0.1);
    const std::string told = output_of(run_track(folder, files("r.tif", "s.tif")));
    EXPECT_FALSE(fires("pattern-repeats", told)) << told;
    int n_good = 0;
    for (const Bead& bead : files::read_displacement(folder / "out/displacement.csv")) {
      if (!bead.flag.empty()) continue;
      ++n_good;
      const Vec2 truth = 0.1 * test::displacement(peaks, 10 * bead.position_um - Vec2{0.5, 0.5});
      EXPECT_LT(norm(bead.displacement_um - truth), 0.05) << seed;  // a third of what moves; a period is 1.6
    }
    EXPECT_GT(n_good, 0.9 * 16 * 16) << seed;
  }
  write(folder / "s.tif", lattice({7, 0}, true, 4), 0.1);
  const std::string told = output_of(run_track(folder, files("r.tif", "s.tif")));
  EXPECT_TRUE(fires("pattern-repeats", told)) << told;
}

TEST_F(TrackEndToEnd, a_field_that_does_not_move_and_one_with_positions_twice_are_named) {
  std::string still = "x_um,y_um,ux_um,uy_um\n", twice = still;
  for (int k = 0; k < 64; ++k) {
    const std::string place = std::to_string(k % 8) + "," + std::to_string(k / 8) + ",";
    still += place + "0,0\n";
    twice += place + std::to_string(0.01 * (k % 8)) + ",0\n";
  }
  files::write_text(folder / "still.csv", still);
  files::write_text(folder / "twice.csv", twice + "3,3,0.03,0\n");
  const auto given = [&](const std::string& file) { return run_track(folder, "--displacement " + file); };
  const Outcome of_still = given("still.csv");
  EXPECT_EQ(of_still.code, 0);
  EXPECT_TRUE(fires("nothing-moves", of_still.output)) << of_still.output;
  EXPECT_TRUE(has_words(of_still.output, "Nothing moves: 0 of 64 beads"));
  EXPECT_TRUE(has_words(output_of(given("twice.csv")), "1 flagged"));
  EXPECT_EQ(files::read_displacement(folder / "out/displacement.csv").back().flag, "duplicate");
}

TEST_F(TrackEndToEnd, a_table_of_another_program_is_named_and_its_masked_vectors_counted) {
  const auto peaks = test::ring_of_adhesions(320, 3);
  std::string table =
      "PIV\r\nconversion factor xy (px -> m): 1, conversion factor uv (px/frame -> m/s): 1\r\n"
      "x [px],y [px],u [px/frame],v [px/frame],Vector type [-]\r\n";
  const std::string head = table;
  std::string sound = head;
  for (int k = 0; k < 400; ++k) {
    const Vec2 place{16.0 * (k % 20) + 9, 16.0 * (k / 20) + 9}, u = test::displacement(peaks, place);
    const std::string at = std::to_string(place.x) + "," + std::to_string(place.y) + ",";
    const std::string moved = std::to_string(u.x) + "," + std::to_string(u.y) + ",1\r\n";
    sound += at + moved;
    table += at + (k % 20 < 7 ? "-9999,-9999,1\r\n" : moved);
  }
  files::write_text(folder / "masked.txt", table);
  files::write_text(folder / "sound.txt", sound);
  const auto given = [&](const std::string& file) {
    return run_track(folder, "--pixel_size_um 0.1 --displacement " + file);
  };
  const std::string of_sound = output_of(given("sound.txt"));
  EXPECT_FALSE(fires("input-not-used", of_sound)) << of_sound;
  EXPECT_TRUE(has_words(of_sound, "400 displacements read as PIVlab writes them"));
  const std::string of_masked = output_of(given("masked.txt"));
  EXPECT_TRUE(fires("input-not-used", of_masked)) << of_masked;
  EXPECT_TRUE(has_words(of_masked, "35 % of the vectors were masked"));
  for (const Bead& bead : files::read_displacement(folder / "out/displacement.csv"))
    EXPECT_LT(norm(bead.displacement_um), 1);
}

}  // namespace
}  // namespace mbtfm
