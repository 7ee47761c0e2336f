/// Bad input: an error that names file, place, expectation and finding; a non-zero exit code; nothing half-written.
#include <regex>

#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv_files.h"
#include "segment/images/image.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

constexpr int kFailed = 1, kUsage = 2, kInput = 3, kOutput = 5;

class Errors : public ::testing::Test {
 protected:
  /// A small cell: two adhesions and a fibre, with images.
  static void SetUpTestSuite() {
    scene_ = new TemporaryFolder;
    output_of("mbtfm-simulate --scenario two-adhesions --seed 3 --images --quiet --out " +
              (scene_->path() / "cell").string());
  }
  static void TearDownTestSuite() { delete scene_; }

  void SetUp() override { fs::copy(scene_->path() / "cell", cell_, fs::copy_options::recursive); }

  void replace_in_toml(const std::string& what, const std::string& by) const {
    std::string text = files::read_text(cell_ / "cell.toml");
    const auto at = text.find(what);
    ASSERT_NE(at, std::string::npos) << text;
    text.replace(at, text.find('\n', at) - at, by);
    files::write_text(cell_ / "cell.toml", text);
  }

  /// Run the cell, expect this code and these words, and that no output was left in `folder`.
  void expect_error(int code, const std::vector<std::string>& words, const std::string& folder) const {
    const std::string outcome = output_of("mbtfm run " + cell_.string(), code);
    for (const std::string& word : words) EXPECT_TRUE(has_words(outcome, word));
    if (!fs::exists(cell_ / folder)) return;
    for (const auto& entry : fs::directory_iterator(cell_ / folder)) ADD_FAILURE() << "left behind: " << entry.path();
  }

  TemporaryFolder folder_;
  fs::path cell_ = folder_ / "cell";
  static inline TemporaryFolder* scene_ = nullptr;
};

TEST_F(Errors, in_one_input_are_named_with_their_place_and_leave_nothing) {
  const auto change_adhesions = [&](const std::function<float()>& value) {
    images::Image image = images::read_image(cell_ / "paxillin.tif");
    for (float& pixel : image.pixels) pixel = value();
    images::write_tiff(cell_ / "paxillin.tif", image);
  };
  std::mt19937_64 random(1);
  struct Case {
    const char* what;
    std::function<void()> spoil;
    std::vector<std::string> words;
    const char* folder = "1_segment";
  };
  const std::vector<Case> cases = {
      {"a missing image", [&] { fs::remove(cell_ / "actin.tif"); }, {"actin.tif"}},
      {"an empty folder", [&] { fs::remove_all(cell_), fs::create_directory(cell_); }, {"cell.toml"}},
      {"a truncated image",
       [&] { fs::resize_file(cell_ / "actin.tif", fs::file_size(cell_ / "actin.tif") / 3); },
       {"actin.tif"}},
      {"a file of a microscope",
       [&] { files::write_text(cell_ / "actin.tif", std::string("ZISRAWFILE\0\0\0\0\0\0", 16)); },
       {"a Zeiss CZI file", "Bio-Formats", "bfconvert 'actin.tif' 'actin.ome.tif'"}},
      {"an image without adhesions",
       [&] { change_adhesions([&] { return 200 + static_cast<float>(random() % 32); }); },
       {"no adhesion", "paxillin.tif"}},
      {"a constant image", [&] { change_adhesions([] { return 200.0f; }); }, {"every pixel is 200", "paxillin.tif"}},
      {"an unknown key",
       [&] { replace_in_toml("pixel_size_um", "pixel_sise_um = 0.1"); },
       {"cell.toml:", "'pixel_sise_um'", "pixel_size_um"}},
      {"a negative modulus",
       [&] { replace_in_toml("youngs_modulus_kPa", "youngs_modulus_kPa = -8.4"); },
       {"cell.toml:", "youngs_modulus_kPa", "a number >= 0.001", "-8.4"}},
      {"a Poisson's ratio above one half",
       [&] { replace_in_toml("poisson_ratio", "poisson_ratio = 0.51"); },
       {"cell.toml:", "poisson_ratio", "<= 0.5", "'0.51'"}},
      {"no number in a table",
       [&] {
         fs::create_directory(cell_ / "2_track");
         files::write_text(cell_ / "2_track/displacement.csv",
                           "x_um,y_um,ux_um,uy_um,sigma_um\n1,2,0.1,0.1,0.02\n3,4,nan,0,0.02\n");
       },
       {"displacement.csv:3", "'ux_um'", "'nan'"},
       "4_fit"}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.what);
    fs::remove_all(cell_);
    SetUp();
    c.spoil();
    expect_error(kInput, c.words, c.folder);
  }
}

TEST_F(Errors, images_of_different_sizes_are_named_with_their_sizes) {
  for (const auto& [file, folder] : {std::pair("beads_relaxed.tif", "2_track"), std::pair("actin.tif", "1_segment")}) {
    const images::Image whole = images::read_image(cell_ / file);
    images::Image small = whole;
    small.height /= 2;
    small.pixels.resize(static_cast<std::size_t>(small.width) * small.height);
    images::write_tiff(cell_ / file, small);
    expect_error(kInput, {file, std::to_string(small.height)}, folder);
    images::write_tiff(cell_ / file, whole);
  }
}

/// As a camera binds 2 x 2 pixels, and a program keeps half of an image.
images::Image binned(const images::Image& fine) {
  images::Image coarse = fine;
  coarse.width /= 2, coarse.height /= 2;
  coarse.pixels.assign(static_cast<std::size_t>(coarse.width) * coarse.height, 0);
  coarse.pixel_size_um.reset();
  for (int j = 0; j < coarse.height; ++j)
    for (int i = 0; i < coarse.width; ++i)
      coarse.at(i, j) = 0.25F * (fine.at(2 * i, 2 * j) + fine.at(2 * i + 1, 2 * j) + fine.at(2 * i, 2 * j + 1) +
                                 fine.at(2 * i + 1, 2 * j + 1));
  return coarse;
}

TEST_F(Errors, bead_images_of_another_field_are_refused_before_anything_runs_and_with_their_own_pixels_taken) {
  for (const char* name : {"beads_relaxed.tif", "beads_stressed.tif"})
    images::write_tiff(cell_ / name, binned(images::read_image(cell_ / name)));
  const images::Image actin = images::read_image(cell_ / "actin.tif");
  const std::string pixel = shortest(2 * actin.pixel_size_um.value());
  const std::vector<std::string> words = {"beads_relaxed.tif", std::to_string(actin.width) + " x",
                                          std::to_string(actin.width / 2) + " x",
                                          "track.beads_pixel_size_um = " + pixel};
  expect_error(kInput, words, "1_segment");
  const Outcome check = run_program("mbtfm check " + cell_.string());
  EXPECT_NE(check.code, 0);
  EXPECT_TRUE(has_words(check.output, words.back()));

  files::write_text(cell_ / "cell.toml",
                    files::read_text(cell_ / "cell.toml") + "\n[track]\nbeads_pixel_size_um = " + pixel + "\n");
  output_of("mbtfm run " + cell_.string());
  double farthest_um = 0;
  for (const Bead& bead : files::read_displacement(cell_ / "2_track/displacement.csv"))
    farthest_um = std::max(farthest_um, bead.position_um.x);
  EXPECT_NEAR(farthest_um / (actin.width * actin.pixel_size_um.value()), 1, 0.05) << "places in the cell's own um";
}

TEST_F(Errors, a_missing_pixel_size_is_asked_for) {
  replace_in_toml("pixel_size_um", "");
  for (const char* name : {"paxillin.tif", "actin.tif", "beads_stressed.tif", "beads_relaxed.tif"}) {
    images::Image image = images::read_image(cell_ / name);
    image.pixel_size_um.reset();
    images::write_tiff(cell_ / name, image);
  }
  expect_error(kInput, {"pixel_size_um"}, "1_segment");
}

TEST_F(Errors, hints_of_a_stage_name_keys_under_a_run_and_flags_alone) {
  const std::string pattern = " adhesions = \"pattern\"\n";
  replace_in_toml("[gel]", "[segment]\n" + pattern + "[gel]");
  EXPECT_TRUE(has_words(output_of("mbtfm run " + cell_.string(), kUsage), "give it as adhesion_mask in [images]"));
  EXPECT_TRUE(has_words(output_of("mbtfm-segment --adhesions pattern --actin-image " + (cell_ / "actin.tif").string() +
                                      " --out " + (folder_ / "s").string(),
                                  kUsage),
                        "give it as --adhesion-mask"));
  EXPECT_TRUE(
      has_words(output_of("mbtfm run --set segment.cell=-3 " + cell_.string(), kUsage), "cell in [segment]: expected"));
  EXPECT_TRUE(has_words(output_of("mbtfm run --set segment.cell=0 " + cell_.string(), kUsage), "write cell = 0 below"));
}

TEST_F(Errors, an_adhesion_outside_the_outline_is_named) {
  fs::create_directory(cell_ / "1_segment");
  for (const char* file : {"adhesions.csv", "fibres.csv", "fibre_points.csv", "outline.csv"})
    fs::copy(cell_ / "truth" / file, cell_ / "1_segment" / file);
  auto adhesions = files::read_adhesions(cell_ / "1_segment/adhesions.csv");
  adhesions.push_back(adhesions.front());
  adhesions.back().adhesion_id = 77;
  adhesions.back().position_um = {1000, 1000};
  files::write_adhesions(cell_ / "1_segment/adhesions.csv", adhesions);
  expect_error(kInput, {"adhesion 77", "outline"}, "3_network");
}

TEST_F(Errors, a_full_disk_leaves_nothing_and_says_so) {
  // A limit on the size of files, its signal ignored, fails a write half-way as a full disk does.
  EXPECT_TRUE(has_words(output_of("mbtfm-network --edge_length_um 0.5 --cell " + (cell_ / "truth").string() +
                                      " --out " + (folder_ / "new/network.vtu").string(),
                                  kOutput, "trap '' XFSZ; ulimit -f 8; "),
                        "network.vtu"));
  EXPECT_FALSE(fs::exists(folder_ / "new")) << "neither the file nor the folder made for it";
}

TEST_F(Errors, a_wrong_flag_names_it) { EXPECT_TRUE(has_words(output_of("mbtfm-network --sed 3", kUsage), "--sed")); }

TEST_F(Errors, what_was_probably_meant_is_named) {
  const auto said = [](const std::string& command, int code) { return output_of(command, code); };
  EXPECT_TRUE(has_words(said("mbtfm run --thread 2 " + cell_.string(), kUsage), "did you mean '--threads'?"));
  EXPECT_TRUE(has_words(said("mbtfm bacth " + cell_.string(), kUsage), "did you mean 'batch'?"));
  EXPECT_TRUE(has_words(said("mbtfm-segment --fibre_contrst 2", kUsage), "did you mean"));
  EXPECT_TRUE(has_words(said("mbtfm run " + (cell_ / "actin.tif").string(), kInput),
                        "give the folder that it is in: " + cell_.string()));
  for (const auto& [command, remedy] : {std::pair<std::string, const char*>{"rnu CELL", "did you mean 'run'?"},
                                        {"RUN CELL", "did you mean 'run'?"},
                                        {"statistics CELL", "did you mean 'stats'?"},
                                        {"report CELL", "writes report.html"},
                                        {"run --only segment track CELL", "--only segment,track"},
                                        {"run -o results CELL", "the cell's own folder"},
                                        {"run --skip track CELL", "did you mean '--only'?"},
                                        {"run --set images.actin=a.tif CELL", "[images] is for cell.toml alone"},
                                        {"run --set gel.poisson_ratio=0.4,fit.n_meshes=2 CELL", "--set fit.n_meshes=2"},
                                        {"run --set track.may_push=perhaps CELL", "may_push in [track]"},
                                        {"run --set fit.loss=huber CELL", "'robust_loss in [effects]'"},
                                        {"stats CELL CELL", "one folder at a time"},
                                        {"stats CELL --exclude a", "column 'exclude'"},
                                        {"init CELL --E 4", "written in its cell.toml"},
                                        {"run CELL segment", "--only segment,track"},
                                        {"run --jobs 2 CELL", "did you mean '--threads'?"},
                                        {"run --set effects.thickness=on CELL", "did you mean 'finite_thickness'?"},
                                        {"noise CELL/actin.tif CELL/actin.tif --pixels 1", "'--pixel_size_um'"},
                                        {"run --loss huber CELL", "--set TABLE.KEY=VALUE"},
                                        {"run CELL CELL", "mbtfm batch FOLDER"},
                                        {"run --set youngs_modulus_kPa=4 CELL", "its table, too"},
                                        {"noise CELL/actin.tif", "mbtfm noise A.tif B.tif"},
                                        {"cost CELL --budget 0", "not in range 0.001"}})
    EXPECT_TRUE(
        has_words(said("mbtfm " + std::regex_replace(command, std::regex("CELL"), cell_.string()), kUsage), remedy))
        << command;
  for (const char* word : {"help run", "version"}) said(std::string("mbtfm ") + word, 0);
  const std::string misspelt = cell_.string() + "s";
  EXPECT_TRUE(has_words(said("mbtfm run " + misspelt, kInput), "did you mean 'cell'?"));
  EXPECT_TRUE(has_words(said("mbtfm compare " + misspelt, kInput), "did you mean 'cell'?"));
  EXPECT_TRUE(has_words(said("mbtfm run " + (cell_ / "truth").string(), kInput), "give the cell: " + cell_.string()));
  EXPECT_TRUE(has_words(said("mbtfm run '" + cell_.string() + "*'", kInput), "mbtfm batch FOLDER"));
  EXPECT_TRUE(has_words(said("mbtfm compare " + cell_.string(), kInput), "mbtfm run"));
  EXPECT_TRUE(has_words(said("mbtfm", 0), "check")) << "alone it prints its help";
}

TEST_F(Errors, check_finds_what_would_spoil_a_batch_and_nothing_in_a_good_cell) {
  EXPECT_TRUE(has_words(run_program("mbtfm check " + cell_.string()).output, " beads, "));
  EXPECT_TRUE(has_words(run_program("mbtfm check " + cell_.string() + " --json").output, "\"fine\":true"));
  EXPECT_TRUE(has_words(files::read_text(cell_ / "check.html"), "alt=\"actin image\"", "beads, relaxed and stressed",
                        "class=\"good\""));
  files::write_text(cell_ / "check.html", "the user's own");
  EXPECT_TRUE(has_words(run_program("mbtfm check " + cell_.string()).output, "did not make it"));
  fs::remove(cell_ / "check.html");
  const std::string toml = files::read_text(cell_ / "cell.toml");
  files::write_text(cell_ / "cell.toml", toml + "\n[network]\nedge_length_um = -1\n");
  EXPECT_TRUE(has_words(output_of("mbtfm check " + cell_.string(), kFailed), "edge_length_um"));
  fs::create_directory(cell_ / "frames");  // of a series the first is looked at
  fs::copy_file(cell_ / "beads_stressed.tif", cell_ / "frames/t2.tif");
  files::write_text(cell_ / "cell.toml", toml + "\n[images]\nbeads_stressed = \"frames\"\n");
  EXPECT_TRUE(has_words(run_program("mbtfm check " + cell_.string()).output, "; fine"));
  files::write_text(cell_ / "cell.toml", toml);
  const Outcome both = run_program("mbtfm check " + cell_.string() + " " + cell_.string());
  EXPECT_NE(both.output.find("1 of 1 cells are fine"), both.output.rfind("1 of 1 cells are fine")) << both.output;
  fs::copy_file(cell_ / "beads_stressed.tif", cell_ / "beads_relaxed.tif", fs::copy_options::overwrite_existing);
  EXPECT_TRUE(has_words(output_of("mbtfm check " + cell_.string(), kFailed),
                        "beads_stressed.tif and beads_relaxed.tif are the same picture"));
  images::Image actin = images::read_image(cell_ / "actin.tif");
  const float brightest = 0.1F * *std::ranges::max_element(actin.pixels);
  for (float& value : actin.pixels) value = std::min(value, brightest);
  images::write_tiff(cell_ / "actin.tif", actin);
  EXPECT_TRUE(has_words(run_program("mbtfm check " + cell_.string()).output, "actin.tif is saturated"));
  fs::remove(cell_ / "actin.tif");
  EXPECT_TRUE(has_words(output_of("mbtfm check " + cell_.parent_path().string(), kFailed),
                        "expected a file 'actin.tif', found none"));
}

TEST_F(Errors, check_names_a_copy_and_a_folder_that_lacks_its_settings) {
  fs::copy(cell_, folder_ / "cell10", fs::copy_options::recursive);
  fs::copy(cell_, folder_ / "cell2", fs::copy_options::recursive);
  fs::copy(cell_, folder_ / ".Trash", fs::copy_options::recursive);
  fs::remove(folder_ / "cell2/cell.toml");
  const Outcome check = run_program("mbtfm check " + folder_.path().string());
  EXPECT_EQ(check.code, kFailed);
  EXPECT_TRUE(has_words(check.output, "is the same picture as that of cell: a copy",
                        "cell2: error: pictures and no cell.toml: mbtfm init"));
  EXPECT_FALSE(has_words(check.output, "Trash"));
}

TEST_F(Errors, init_writes_what_is_missing_like_a_cell_and_names_what_it_cannot) {
  const std::string toml = files::read_text(cell_ / "cell.toml") + "[images]\nactin = \"cell_actin.tif\"\n";
  fs::rename(cell_ / "actin.tif", cell_ / "cell_actin.tif");
  files::write_text(cell_ / "cell.toml", toml);
  const auto add = [&](const std::string& name, const std::string& actin) {
    fs::create_directories((folder_ / name).parent_path());
    fs::copy(cell_, folder_ / name, fs::copy_options::recursive);
    fs::rename(folder_ / name / "cell_actin.tif", folder_ / name / actin);
    fs::remove(folder_ / name / "cell.toml");
  };
  add("day 1/c7", "c7_actin.tif");
  add("day 1/c8", "cell_actin.tif");
  add("day 2/c9", "other.tif");
  add("day 2/c10", "c10_actin.tif");
  files::write_text(folder_ / "day 2/c10/cell.toml", "# mine\n");
  EXPECT_TRUE(has_words(output_of("mbtfm init " + folder_.path().string() + " --like " + cell_.string(), kFailed),
                        "2 cell.toml written", "day 2/c9", "c9_actin.tif"));
  std::string of_c7 = toml;
  of_c7.replace(of_c7.find("cell_actin"), 4, "c7");
  EXPECT_EQ(files::read_text(folder_ / "day 1/c7/cell.toml"), of_c7);
  EXPECT_EQ(files::read_text(folder_ / "day 1/c8/cell.toml"), toml);
  EXPECT_EQ(files::read_text(folder_ / "day 2/c10/cell.toml"), "# mine\n");
  EXPECT_FALSE(fs::exists(folder_ / "day 2/c9/cell.toml"));
}

TEST_F(Errors, check_knows_channels_that_are_exchanged_blur_few_beads_and_a_cell_at_the_border) {
  const auto said = [&] { return run_program("mbtfm check " + cell_.string()).output; };
  const std::string paxillin = files::read_text(cell_ / "paxillin.tif"), actin = files::read_text(cell_ / "actin.tif"),
                    relaxed = files::read_text(cell_ / "beads_relaxed.tif");
  files::write_text(cell_ / "paxillin.tif", actin);
  files::write_text(cell_ / "actin.tif", paxillin);
  EXPECT_TRUE(has_words(said(), "paxillin.tif: Adhesions are"));
  files::write_text(cell_ / "paxillin.tif", paxillin);
  files::write_text(cell_ / "actin.tif", relaxed);
  files::write_text(cell_ / "beads_relaxed.tif", actin);
  EXPECT_TRUE(has_words(said(), "If one of them shows another channel"));
  files::write_text(cell_ / "actin.tif", actin);
  files::write_text(cell_ / "beads_relaxed.tif", relaxed);
  EXPECT_TRUE(has_words(said(), " % of the field in both"));
  const std::string stressed = files::read_text(cell_ / "beads_stressed.tif");
  images::Image mirrored = images::read_image(cell_ / "beads_stressed.tif");
  for (int j = 0; j < mirrored.height; ++j)
    std::ranges::reverse(mirrored.pixels.begin() + static_cast<std::ptrdiff_t>(j) * mirrored.width,
                         mirrored.pixels.begin() + static_cast<std::ptrdiff_t>(j + 1) * mirrored.width);
  images::write_tiff(cell_ / "beads_stressed.tif", mirrored);
  EXPECT_TRUE(has_words(said(), "beads_stressed.tif looks mirrored against beads_relaxed.tif"));
  files::write_text(cell_ / "beads_stressed.tif", stressed);
  EXPECT_FALSE(has_words(said(), "caution"));

  const auto changed = [&](const char* name, const auto& change) {
    images::Image image = images::read_image(cell_ / name);
    change(image);
    images::write_tiff(cell_ / name, image);
  };
  // only patches keep their beads
  for (const char* name : {"beads_relaxed.tif", "beads_stressed.tif"})
    changed(name, [](images::Image& image) {
      const float dark = *std::ranges::min_element(image.pixels);
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
          if (x % 256 > 40 || y % 256 > 40) image.pixels[y * image.width + x] = dark;
    });
  EXPECT_TRUE(has_words(said(), "um apart (limit 3 um)"));
  for (const char* name : {"paxillin.tif", "actin.tif"})
    changed(name, [](images::Image& image) {  // moved to the left border
      for (int y = 0; y < image.height; ++y) {
        const auto row = image.pixels.begin() + static_cast<std::ptrdiff_t>(y) * image.width;
        std::rotate(row, row + image.width / 5, row + image.width);
      }
    });
  EXPECT_TRUE(has_words(said(), "of the image's border (limit 5 um)"));
}

TEST_F(Errors, a_cell_toml_that_init_wrote_runs_once_the_modulus_is_in_it) {
  fs::remove(cell_ / "cell.toml");
  fs::rename(cell_ / "paxillin.tif", cell_ / "day1_Paxillin.tif");
  fs::rename(cell_ / "beads_relaxed.tif", cell_ / "beads_after_trypsin.tif");
  fs::rename(cell_ / "beads_stressed.tif", cell_ / "beads_with_cell.tif");
  files::write_text(cell_ / "._day1_Paxillin.tif", "as a Mac leaves on a stick");
  fs::create_symlink("round.tif", cell_ / "round.tif");  // a link that leads round in a circle is no image
  EXPECT_TRUE(has_words(output_of("mbtfm init " + cell_.string()), "complete in it: youngs_modulus_kPa in [gel]"));
  EXPECT_EQ(run_program("mbtfm init " + cell_.string()).code, kInput) << "a cell.toml that is there stays";
  expect_error(kUsage, {"youngs_modulus_kPa"}, "4_fit");
  replace_in_toml("# youngs_modulus_kPa", "youngs_modulus_kPa = 8.4");
  EXPECT_TRUE(has_words(output_of("mbtfm run --preset fast " + cell_.string()), "total force "));
}

TEST_F(Errors, init_takes_a_folder_of_bead_images_for_a_series) {
  fs::remove(cell_ / "cell.toml");
  fs::create_directory(cell_ / "Frames");
  fs::rename(cell_ / "beads_stressed.tif", cell_ / "Frames/t1.tif");
  fs::copy(cell_ / "Frames/t1.tif", cell_ / "Frames/t2.tif");
  output_of("mbtfm init " + cell_.string());
  EXPECT_TRUE(has_words(files::read_text(cell_ / "cell.toml"), "\nbeads_stressed = \"Frames\"", "2 pictures"));
}

}  // namespace
}  // namespace mbtfm
