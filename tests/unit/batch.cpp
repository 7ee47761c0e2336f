/// Images by file-name patterns, and the table of a batch.
#include "pipeline/runner/batch.h"
#include "pipeline/contract/errors.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/text.h"
#include "pipeline/runner/batch_table.h"
#include "pipeline/runner/image_sets.h"
#include "pipeline/runner/run_cell.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::runner {
namespace {

struct ImageFolder {
  TemporaryFolder folder;
  explicit ImageFolder(const std::vector<std::string>& files) {
    for (const std::string& file : files) {
      fs::create_directories((folder / file).parent_path());
      files::write_text(folder / file, "x");
    }
  }
  std::vector<std::string> make(const std::vector<std::string>& patterns, const std::string& settings = {}) {
    std::vector<ImagePattern> parsed;
    for (const std::string& p : patterns) parsed.push_back(parse_pattern(p));
    fs::path file;
    if (!settings.empty()) files::write_text(file = folder / "settings.toml", settings);
    return make_cell_folders(folder / ".", parsed, file);
  }
};

TEST(ImageSets, files_that_share_a_name_become_a_cell) {
  ImageFolder f({"wt 1_pax.tif", "wt 1_act.tif", "ko(2)_pax.tif", "ko(2)_act.tif", "notes.txt"});
  EXPECT_EQ(f.make({"adhesion={cell}_pax.tif", "actin={cell}_act.tif"}, "pixel_size_um = 0.1\n"),
            (std::vector<std::string>{"ko(2)", "wt 1"}));
  const ImageNames names = read_image_names(f.folder / "wt 1");
  EXPECT_TRUE(fs::equivalent(resolve_image(f.folder / "wt 1", names, "adhesion"), f.folder / "wt 1_pax.tif"));
  EXPECT_TRUE(fs::equivalent(resolve_image(f.folder / "wt 1", names, "actin"), f.folder / "wt 1_act.tif"));
  EXPECT_TRUE(files::read_text(f.folder / "ko(2)/cell.toml").starts_with("pixel_size_um = 0.1\n"));
}

TEST(ImageSets, a_cell_may_be_a_folder) {
  ImageFolder f({"day1/a/pax_01.tif", "day1/b/pax_07.tif"});
  EXPECT_EQ(f.make({"adhesion=day1/{cell}/pax_??.tif"}), (std::vector<std::string>{"a", "b"}));
}

TEST(ImageSets, names_may_hold_quotes) {
  const std::string name = "Ann's \"best\"";
  ImageFolder f({name + "_pax.tif"});
  EXPECT_EQ(f.make({"adhesion={cell}_pax.tif"}), std::vector<std::string>{name});
  const ImageNames names = read_image_names(f.folder / name);
  EXPECT_TRUE(fs::equivalent(resolve_image(f.folder / name, names, "adhesion"), f.folder / (name + "_pax.tif")));
}

TEST(ImageSets, settings_that_are_there_stay) {
  ImageFolder f({"a_pax.tif"});
  f.make({"adhesion={cell}_pax.tif"});
  files::write_text(f.folder / "a/cell.toml", "mine");
  f.make({"adhesion={cell}_pax.tif"});
  EXPECT_EQ(files::read_text(f.folder / "a/cell.toml"), "mine");
}

TEST(ImageSets, a_dot_of_a_pattern_is_a_dot) {
  ImageFolder f({"a_pax.tif", "b_paxxtif"});
  EXPECT_EQ(f.make({"adhesion={cell}_pax.tif"}), std::vector<std::string>{"a"});
}

TEST(ImageSets, refuse_what_is_unclear) {
  ImageFolder f({"a_pax_1.tif", "a_pax_2.tif"});
  EXPECT_THROW(f.make({"adhesion={cell}_pax_*.tif"}), InputError);                // two images of one cell
  EXPECT_THROW(f.make({"adhesion={cell}_paxillin.tif"}), InputError);             // none
  EXPECT_THROW(f.make({"adhesion={cell}_pax_1.tif"}, "[images]\n"), InputError);  // said twice
  EXPECT_THROW(parse_pattern("adhesion=pax.tif"), UsageError);
  EXPECT_THROW(parse_pattern("adhesion={cell}{cell}.tif"), UsageError);
  EXPECT_THROW(parse_pattern("adhesions={cell}.tif"), UsageError);
}

TEST(Cells, that_are_links_or_whose_settings_have_another_name_are_named_with_what_to_do) {
  const ImageFolder f({"elsewhere/cell.toml", "study/a/Cell.toml", "study/b/cell.toml"});
  fs::create_directory_symlink(f.folder / "elsewhere", f.folder / "study/linked");
  const FoundCells found = search_cells(f.folder / "study");
  EXPECT_EQ(found.cells, std::vector<fs::path>{f.folder / "study/b"});
  ASSERT_EQ(found.skipped.size(), 2u);
  EXPECT_TRUE(has_words(found.skipped[0].why, "Cell.toml", "rename"));
  EXPECT_TRUE(has_words(found.skipped[1].why, "a link", "leads to"));
  const auto hint = [](const auto& read) { return test::thrown<InputError>(read).hint; };
  EXPECT_TRUE(has_words(hint([&] { read_image_names(f.folder / "study/a"); }), "rename Cell.toml to cell.toml"));
  EXPECT_TRUE(has_words(hint([&] { search_cells(f.folder / "study/b/cell.toml"); }), "the folder that it is in"));
  EXPECT_TRUE(has_words(hint([&] { search_cells(f.folder / "studi"); }), "did you mean 'study'?"));
  EXPECT_TRUE(has_words(hint([&] { search_cells("~/study"); }), "~ in quotes"));
  fs::create_directory(f.folder / "study/b/4_fit");
  EXPECT_TRUE(has_words(hint([&] { find_cells(f.folder / "study/b/4_fit"); }), "it is in the cell"));
  fs::create_symlink("/nowhere/actin.tif", f.folder / "study/b/actin.tif");
  EXPECT_TRUE(
      has_words(hint([&] { resolve_image(f.folder / "study/b", {}, "actin"); }), "a link to /nowhere/actin.tif"));
}

TEST(BatchTable, has_a_column_for_every_figure_and_a_row_for_every_cell) {
  TemporaryFolder folder;
  const auto record = [&](const std::string& cell, const std::string& text) {
    fs::create_directories(folder / cell / "1_segment");
    files::write_text(folder / cell / "1_segment/record.json", text);
  };
  record("a", R"({"summary": "two", "figures": {"n_adhesions": 2}})");
  record("b", R"({"summary": "none", "figures": {"n_adhesions": 0, "why": "a, b"}})");
  record("c", R"({"summary": "old", "figures": {"n_adhesions": 7}})");
  record("d", "{ damaged");
  std::vector<BatchCell> cells(4);
  for (int i = 0; i < 4; ++i) cells[i].cell = folder / std::string(1, static_cast<char>('a' + i));
  cells[2].exit_code = 3;
  cells[2].message = "no image";
  EXPECT_EQ(last_summary(cells[0].cell, {"segment"}), "two");
  EXPECT_EQ(last_summary(cells[0].cell, {"track"}), "");
  EXPECT_EQ(last_summary(cells[3].cell, {}), "");
  EXPECT_EQ(write_batch_tables(folder / ".", cells, {}, {}).counts, "3 done: 3 fine; 1 failed");
  const files::CsvTable table(folder / "batch_all.csv");
  ASSERT_EQ(table.n_rows(), 4);
  EXPECT_EQ(table.integer(0, "segment.n_adhesions", 0), 2);
  EXPECT_EQ(table.text(1, "segment.why"), "a, b");
  EXPECT_EQ(table.text(2, "message"), "no image");
  EXPECT_EQ(table.text(2, "segment.n_adhesions"), "");  // what lies there is of an earlier run
  EXPECT_EQ(table.text(3, "segment.n_adhesions"), "");
}

}  // namespace
}  // namespace mbtfm::runner
