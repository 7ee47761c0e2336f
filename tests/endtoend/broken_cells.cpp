/// A study of twelve cells of which some are broken, each in its way: every program and package names the same ones.
#include <nlohmann/json.hpp>

#include "pipeline/files/csv.h"
#include "tests/support/program.h"
#include "tests/support/script_stages.h"

namespace mbtfm {
namespace {

using nlohmann::ordered_json;

bool succeeds(const std::string& command) { return std::system((command + " >/dev/null 2>&1").c_str()) == 0; }

/// What `command` prints for programs.
std::string printed(const std::string& command, const fs::path& folder) {
  const fs::path file = folder / "printed";
  EXPECT_EQ(std::system((command + " >'" + file.string() + "'").c_str()), 0) << command;
  return files::read_text(file);
}

class BrokenCells : public testing::Test {
 protected:
  /// Seven good cells, named so that the alphabet would order them otherwise, and five that are not.
  void SetUp() override {
    for (const char* name : {"control/c1", "control/c2", "control/c10", "drug/c1", "drug/c2", "drug/c3", "drug/c10"})
      add(name);
    add("control/c3");
    fs::remove(study_ / "control/c3/cell.toml");
    for (const char* picture : {"actin.tif", "paxillin.tif"}) files::write_text(study_ / "control/c3" / picture, "");
    add("control/c4");
    fs::rename(study_ / "control/c4/cell.toml", study_ / "control/c4/cell.toml.txt");
    add("control/c5");
    files::write_text(study_ / "control/c5/cell.toml", "[geel]\nyoungs_modulus_kPa = 8\n");
    fs::copy(study_ / "control/c10", study_ / "drug/c11", fs::copy_options::recursive);
    add("drug/c12");
    fs::create_directories(study_ / ".snapshot/control");
    fs::copy(study_ / "control/c1", study_ / ".snapshot/control/c1", fs::copy_options::recursive);
    fs::remove(folder_ / "scripts/made/4_fit/fitted_displacement.csv");  // of other beads
    output_of(batch_, 1);
    distrust("drug/c12");
  }
  /// The segmentation and the beads are given; scripts take the place of network and fit.
  void add(const std::string& name) {
    test::write_given_stages(study_ / name, test::round_cell());
    const fs::path cell = study_ / name;
    // beads of its own, whatever the cells of another condition are called
    DisplacementField field = files::read_displacement(cell / "2_track/displacement.csv");
    field.front().displacement_um.x += 1e-4 * ++n_added_;
    files::write_displacement(cell / "2_track/displacement.csv", field);
    files::write_text(cell / "beads_stressed.tif", name);
  }
  /// As a fit does that explains next to nothing.
  void distrust(const std::string& name) {
    for (const char* file : {"run.json", "4_fit/record.json"}) {
      ordered_json record = ordered_json::parse(files::read_text(study_ / name / file));
      record["findings"].push_back({{"id", "misfit"},
                                    {"severity", "bad"},
                                    {"text", "It is the wrong model."},
                                    {"number", 0.9},
                                    {"threshold", 0.4},
                                    {"number_is", "a share"},
                                    {"reason", ""},
                                    {"remedy", "Disregard the results."}});
      files::write_text(study_ / name / file, record.dump());
    }
  }

  TemporaryFolder folder_;
  const fs::path study_ = folder_ / "study";
  int n_added_ = 0;
  const std::string batch_ =
      "mbtfm batch " + study_.string() + " --stages-dir " + test::make_script_stages(folder_ / "scripts").string();
  const std::vector<std::string> good_ = {"control/c1", "control/c2", "control/c10", "drug/c1",
                                          "drug/c2",    "drug/c3",    "drug/c10"};
  const std::map<std::string, std::string> broken_ = {{"control/c3", "mbtfm init"},
                                                      {"control/c4", "cell.toml.txt"},
                                                      {"control/c5", "geel"},
                                                      {"drug/c11", "the same cell as control/c10"},
                                                      {"drug/c12", "misfit"}};

  void expect_listed(const files::CsvTable& table, const std::string& by, const auto& is_in) const {
    ASSERT_EQ(table.n_rows(), 12) << by;
    std::vector<std::string> good;
    for (int row = 0; row < table.n_rows(); ++row) {
      const std::string cell = table.text(row, "cell");
      if (is_in(row)) {
        good.push_back(cell);
        continue;
      }
      ASSERT_TRUE(broken_.contains(cell)) << by << ": " << cell << ": " << table.text(row, "reason");
      EXPECT_TRUE(has_words(table.text(row, "reason"), broken_.at(cell))) << by << ": " << cell;
    }
    EXPECT_EQ(good, good_) << by;
  }
};

TEST_F(BrokenCells, are_named_alike_by_batch_stats_python_and_r_and_the_others_are_not) {
  // check comes before the first run: it cannot know what the fit will say
  EXPECT_TRUE(has_words(run_program("mbtfm check " + study_.string()).output,
                        "control/c3: error: pictures and no cell.toml: mbtfm init", "cell.toml.txt", "geel",
                        "same picture as that of control/c10"));

  EXPECT_TRUE(has_words(output_of(batch_, 1), "9 done: 7 fine, 1 not usable, 1 copy; 1 failed; 2 skipped",
                        "drug/c11: the same cell as", "drug/c12: not usable, as misfit says",
                        "control/c3: pictures and no cell.toml", "cell.toml.txt", "geel"));
  const files::CsvTable batch(study_ / "batch.csv");
  expect_listed(batch, "batch", [&](int row) { return batch.text(row, "state") == "fine"; });

  const files::CsvTable list(
      printed((test::build_folder() / "bin/mbtfm").string() + " stats '" + study_.string() + "' --list --quiet",
              folder_.path()),
      "list");
  expect_listed(list, "stats", [&](int row) { return list.text(row, "included") == "TRUE"; });
  EXPECT_FALSE(fs::exists(study_ / "statistics"));
  const std::string stats = output_of("mbtfm stats " + study_.string() + " --condition-from folder");
  EXPECT_TRUE(has_words(stats, "7 cells", "5 cells left out"));
  EXPECT_TRUE(has_words(output_of("mbtfm stats " + study_.string() + " --with-bad"), "4 cells left out"));

  const std::string bin = (test::build_folder() / "bin").string(), from = test::source_folder().string();
  if (succeeds("/usr/bin/python3 -c 'import pandas'")) {
    const files::CsvTable rows(
        printed("MBTFM_BIN='" + bin + "' PYTHONPATH='" + from +
                    "/python' PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 -c '" +
                    "import mbtfm, sys; f = mbtfm.study(\"" + study_.string() +
                    "\"); assert f.included.all(); left = f.attrs[\"left_out\"];"
                    "print(\"cell,reason\"); [print(c + \",\") for c in f.cell.unique()];"
                    "[print(c + \",\\\"\" + r.replace(chr(34), chr(39)) + chr(34)) for c, r in left.items()]'",
                folder_.path()),
        "python");
    expect_listed(rows, "Python", [&](int row) { return rows.text(row, "reason").empty(); });
  }
  if (succeeds("command -v Rscript")) {
    const files::CsvTable rows(
        printed("PATH='" + bin + "':$PATH Rscript -e 'source(\"" + from +
                    "/docs/recipes/study.R\"); f <- mbtfm_study(\"" + study_.string() +
                    "\", with_left_out = TRUE); cells <- mbtfm_cells(\"" + study_.string() +
                    "\"); stopifnot(identical(unique(f$cell[f$included]), cells$cell[cells$included == \"TRUE\"]));"
                    "write.csv(cells, stdout(), row.names = FALSE)' 2>/dev/null",
                folder_.path()),
        "R");
    expect_listed(rows, "R", [&](int row) { return rows.text(row, "included") == "TRUE"; });
  }
}

}  // namespace
}  // namespace mbtfm
