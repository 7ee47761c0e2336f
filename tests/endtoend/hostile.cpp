/// Cell folders from elsewhere, made to lead the programs astray: nothing outside of them is read beyond what their
/// settings name, nor written, emptied or deleted; damage is told as an error of that cell, and the others go on.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <nlohmann/json.hpp>
#include <regex>

#include "tests/support/program.h"
#include "tests/support/script_stages.h"

namespace mbtfm {
namespace {

using nlohmann::ordered_json;

constexpr const char* kSecret = "WITNESS-7f3a";

/// A study of a hostile and a sound cell, and what lies beside it.
struct Scene {
  fs::path root;
  fs::path study() const { return root / "study"; }
  fs::path cell() const { return root / "study/hostile"; }
  fs::path outside() const { return root / "outside"; }

  void link(const std::string& in_cell, const std::string& in_outside) const {
    fs::remove_all(cell() / in_cell);
    fs::create_symlink(outside() / in_outside, cell() / in_cell);
  }
  void link_in_study(const std::string& in_study, const std::string& in_outside) const {
    fs::create_directories((study() / in_study).parent_path());
    fs::create_symlink(outside() / in_outside, study() / in_study);
  }
  void second_name(const std::string& in_cell) const {
    fs::remove(cell() / in_cell);
    fs::create_hard_link(outside() / "precious.txt", cell() / in_cell);
  }
  void pipe(const std::string& in_cell) const {
    fs::remove(cell() / in_cell);
    ASSERT_EQ(mkfifo((cell() / in_cell).c_str(), 0600), 0);
  }
  void write(const std::string& in_cell, const std::string& text) const { files::write_text(cell() / in_cell, text); }
  void change(const std::string& in_cell, const std::function<void(ordered_json&)>& edit) const {
    ordered_json json = ordered_json::parse(files::read_text(cell() / in_cell));
    edit(json);
    write(in_cell, json.dump(1) + "\n");
  }
  /// The record of the fit calls this file an output of the last run.
  void name_output(const std::string& name) const {
    change("4_fit/record.json", [&](ordered_json& record) { record["run"]["outputs"][name] = std::string(64, '0'); });
    fs::remove(cell() / "4_fit/tensions.csv");  // the fit is run again, and outputs that it has no more deleted
  }
  /// Of nothing: it takes no room on the disk.
  void make_terabyte(const std::string& in_cell) const { fs::resize_file(cell() / in_cell, std::uintmax_t{1} << 40); }
  std::string precious() const { return (outside() / "precious.txt").string(); }
};

/// Exit codes of the commands; of the study's where it holds a sound cell beside the hostile one.
struct Codes {
  int verify, batch, run;
  std::optional<int> stats = {};  ///< asked only where it reads or writes what is odd: it draws for half a second
};
constexpr Codes kReplaced = {3, 0, 0};                          // run.json is not there at first
constexpr Codes kRefused = {3, 1, 3}, kLeftOut = {3, 1, 3, 0};  // and left out of the statistics
constexpr Codes kPassedOver = {3, 0, 0, 0};

struct Way {
  std::string name;
  std::function<void(const Scene&)> make;
  Codes codes = kReplaced;
  enum class RunRecord { removed, kept } run_record = RunRecord::removed;  ///< removed: there is something to write
  std::string further = {};  ///< a further command; CELL and STUDY stand for the folders
  int further_code = 3;
  std::string is_said = {};  ///< by batch, list, table and stats
};

std::string nested(int levels) { return std::string(levels, '[') + std::string(levels, ']'); }

/// Folders in each other until no path reaches the innermost: it cannot be opened, not even by root.
void make_bottomless(const fs::path& folder) {
  fs::create_directories(folder);
  const std::string name(200, 'd');
  int at = open(folder.c_str(), O_RDONLY | O_DIRECTORY);
  for (int level = 0; level < 25; ++level) {  // 25 * 201 > PATH_MAX
    ASSERT_EQ(mkdirat(at, name.c_str(), 0700), 0);
    const int next = openat(at, name.c_str(), O_RDONLY | O_DIRECTORY);
    close(at);
    at = next;
  }
  close(at);
}

const std::vector<Way>& ways() {
  using enum Way::RunRecord;
  static const std::vector<Way> list = {
      // links and the like in the place of what is written
      {"log-is-a-link", [](const Scene& s) { s.link("run.log", "precious.txt"); }},
      {"log-is-a-second-name", [](const Scene& s) { s.second_name("run.log"); }},
      {"log-is-a-pipe", [](const Scene& s) { s.pipe("run.log"); }},
      {"run-record-is-a-link", [](const Scene& s) { s.link("run.json", "cell/run.json"); }},
      {"report-is-a-link", [](const Scene& s) { s.link("report.html", "precious.txt"); }},
      {"script-is-a-link", [](const Scene& s) { s.link("view_in_paraview.py", "precious.txt"); }},
      {"lock-is-a-link", [](const Scene& s) { s.link(".mbtfm.lock", "precious.txt"); }, kRefused},
      {"lock-is-a-link-to-nothing", [](const Scene& s) { s.link(".mbtfm.lock", "new"); }, kRefused},
      {"hashes-are-a-link", [](const Scene& s) { s.link(".mbtfm.hashes", "precious.txt"); }},
      {"hashes-are-a-link-to-nothing", [](const Scene& s) { s.link(".mbtfm.hashes", "new"); }},
      {"hashes-are-a-second-name", [](const Scene& s) { s.second_name(".mbtfm.hashes"); }},
      {"hashes-are-a-pipe", [](const Scene& s) { s.pipe(".mbtfm.hashes"); }},
      {"table-is-a-link", [](const Scene& s) { s.link_in_study("batch.csv", "precious.txt"); }},
      {"statistics-are-a-link", [](const Scene& s) { s.link_in_study("statistics", "cell"); }, {3, 0, 0, 3}},
      {"figures-are-a-link", [](const Scene& s) { s.link_in_study("statistics/figures", "cell"); }, {3, 0, 0, 3}},
      {"table-of-cells-is-a-link", [](const Scene& s) { s.link_in_study("statistics/cells.csv", "precious.txt"); },
       kPassedOver},
      {"cost-is-a-link", [](const Scene& s) { s.link("cost", "cost"); }, kReplaced, removed, "cost CELL"},
      {"scratch-is-a-link",
       [](const Scene& s) {
         fs::create_directories(s.cell() / "cost");
         s.link("cost/scratch", "cost/scratch");
       },
       kReplaced, removed, "cost CELL"},
      // links and the like in the place of what is read
      {"stage-is-a-link", [](const Scene& s) { s.link("1_segment", "cell/1_segment"); }, kLeftOut},
      {"stage-is-a-link-to-nothing", [](const Scene& s) { s.link("4_fit", "new"); }, kLeftOut},
      {"stage-is-a-file",
       [](const Scene& s) {
         fs::remove_all(s.cell() / "3_network");
         s.write("3_network", "");
       },
       kRefused},
      {"output-is-a-link", [](const Scene& s) { s.link("4_fit/tensions.csv", "cell/4_fit/tensions.csv"); }, kLeftOut},
      {"output-is-a-pipe", [](const Scene& s) { s.pipe("1_segment/fibre_points.csv"); }, kLeftOut},
      {"record-is-a-link", [](const Scene& s) { s.link("4_fit/record.json", "cell/4_fit/record.json"); }, kRefused},
      {"picture-is-a-link",
       [](const Scene& s) {
         s.link("1_segment/images.jpg", "precious.txt");
         s.write("1_segment/images.csv", "x_um,y_um,width_um,height_um\n0,0,60,60\n");
       },
       kRefused},
      {"truth-is-a-link", [](const Scene& s) { s.link("truth", "cell/4_fit"); }, kLeftOut},
      {"image-is-a-loop",
       [](const Scene& s) {
         fs::remove(s.cell() / "paxillin.tif");
         fs::create_symlink("paxillin.tif", s.cell() / "paxillin.tif");
       },
       kRefused},
      {"image-name-is-too-long",
       [](const Scene& s) {
         s.write("cell.toml", "pixel_size_um = 0.1\n[gel]\nyoungs_modulus_kPa = 8.4\n[images]\nadhesion = \"" +
                                  std::string(5000, 'a') + "\"\n");
       },
       kRefused},
      {"settings-are-a-terabyte", [](const Scene& s) { s.make_terabyte("cell.toml"); }, kRefused},
      {"output-is-a-terabyte", [](const Scene& s) { s.make_terabyte("1_segment/adhesions.csv"); }, kLeftOut},
      // names in records
      {"output-is-absolute", [](const Scene& s) { s.name_output(s.precious()); }, kRefused},
      {"output-is-above", [](const Scene& s) { s.name_output("../../outside/precious.txt"); }, kRefused},
      {"output-is-above-in-disguise", [](const Scene& s) { s.name_output("4_fit/../../../outside/precious.txt"); },
       kRefused},
      {"output-leads-through-a-link",
       [](const Scene& s) {
         fs::create_directories(s.cell() / "4_fit/deep");
         s.link("4_fit/deep/elsewhere", "");
         s.name_output("4_fit/deep/elsewhere/precious.txt");
       },
       kRefused},
      {"output-is-an-image", [](const Scene& s) { s.name_output("paxillin.tif"); }, kRefused},
      {"stage-tells-of-files-above",
       [](const Scene& s) {
         s.change("4_fit/record.json", [](ordered_json& record) {
           record["outputs"].push_back({{"file", "../../../outside/precious.txt"}, {"sha256", "0"}});
         });
       },
       kReplaced, removed, "verify CELL"},
      {"run-record-names-an-input-above",
       [](const Scene& s) {
         s.change("run.json", [](ordered_json& run) {
           run["stages"]["fit"]["inputs"].push_back({{"file", "../../../outside/precious.txt"}, {"sha256", "0"}});
         });
       },
       {1, 0, 0, 0},
       kept},
      {"run-record-names-an-output-above",
       [](const Scene& s) {
         s.change("run.json", [](ordered_json& run) {
           run["stages"]["fit"]["outputs"].push_back({{"file", "../../../outside/precious.txt"}, {"sha256", "0"}});
         });
       },
       {3, 0, 0, 0},
       kept,
       "repeat CELL --out STUDY/again"},
      {"run-record-gives-files-above",
       [](const Scene& s) {
         s.change("run.json", [&](ordered_json& run) {
           run["stages"]["fit"]["state"] = "given";
           run["stages"]["fit"]["outputs"] = {{"../../outside/new", files::sha256_of_file(s.precious())}};
         });
       },
       {3, 0, 0, 0},
       kept,
       "repeat CELL --out STUDY/again"},
      // damaged records
      {"run-record-is-of-another-shape", [](const Scene& s) { s.write("run.json", "{\"stages\":[1,2]}"); }, kRefused,
       kept},
      {"run-record-has-no-hashes",
       [](const Scene& s) {
         s.change("run.json", [](ordered_json& run) { run["stages"]["fit"]["inputs"] = {{{"file", "a"}}}; });
       },
       {3, 0, 0, 0},
       kept},
      {"run-record-nests-deep", [](const Scene& s) { s.write("run.json", "{\"stages\":" + nested(100000) + "}"); },
       kRefused, kept},
      {"run-record-is-a-terabyte", [](const Scene& s) { s.make_terabyte("run.json"); }, kRefused, kept},
      {"record-has-effects-of-texts",
       [](const Scene& s) {
         s.change("4_fit/record.json", [](ordered_json& record) { record["effects"] = {"a", "b"}; });
       },
       kRefused},
      {"record-nests-deep", [](const Scene& s) { s.write("4_fit/record.json", "{\"run\":" + nested(100000) + "}"); },
       kRefused},
      {"record-has-a-huge-number",
       [](const Scene& s) { s.write("4_fit/record.json", "{\"run\":{\"finished\":1e999}}"); }, kRefused},
      {"fit-cannot-be-read",
       [](const Scene& s) { s.write("4_fit/fit.json", "{\"noise_um\": \"\\ud800\"}"); },
       {1, 1, 3, 0},
       kept},
      // the study's folder
      {"folder-is-a-loop", [](const Scene& s) { fs::create_symlink("loop", s.study() / "loop"); }, kPassedOver},
      {"folder-is-a-link-upwards", [](const Scene& s) { fs::create_symlink("..", s.study() / "up"); }, kPassedOver},
      {"settings-are-a-loop",
       [](const Scene& s) {
         fs::create_directories(s.study() / "odd");
         fs::create_symlink("cell.toml", s.study() / "odd/cell.toml");
       },
       kPassedOver,
       removed,
       {},
       0,
       "study/odd"},
      {"folder-has-no-bottom",
       [](const Scene& s) { make_bottomless(s.study() / "deep"); },
       kPassedOver,
       removed,
       {},
       0,
       "study/deep"},
      {"image-leads-above", [](const Scene& s) { files::write_text(s.study() / ".._pax.tif", ""); }, kReplaced, removed,
       "batch STUDY --pattern adhesion={cell}_pax.tif"},
      {"image-leads-through-a-link",
       [](const Scene& s) {
         files::write_text(s.study() / "evil_pax.tif", "");
         s.link_in_study("evil", "cell");
       },
       kReplaced, removed, "batch STUDY --pattern adhesion={cell}_pax.tif"},
  };
  return list;
}

struct Witness {
  fs::file_type type{};
  std::string bytes;             ///< or where a link points
  bool has_second_name = false;  ///< in the cell: the cell's own to read
};

std::map<std::string, Witness> witnesses_in(const fs::path& folder) {
  std::map<std::string, Witness> all;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    Witness& witness = all[entry.path().lexically_relative(folder)];
    witness.type = entry.symlink_status().type();
    witness.has_second_name = entry.is_regular_file() && entry.hard_link_count() > 1;
    if (entry.is_symlink()) witness.bytes = fs::read_symlink(entry.path());
    if (!entry.is_symlink() && entry.is_regular_file()) witness.bytes = files::read_text(entry.path());
  }
  return all;
}

// Written after it was read: file systems that note reading at all then note the next one.
constexpr timespec kTimes[2] = {{.tv_sec = 1'500'000'000, .tv_nsec = 0}, {.tv_sec = 1'600'000'000, .tv_nsec = 0}};

void set_times(const fs::path& folder) {
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    utimensat(AT_FDCWD, entry.path().c_str(), kTimes, AT_SYMLINK_NOFOLLOW);
  utimensat(AT_FDCWD, folder.c_str(), kTimes, AT_SYMLINK_NOFOLLOW);
}

bool was_written(const fs::path& path) {
  struct stat status {};
  lstat(path.c_str(), &status);
  return status.st_mtim.tv_sec != kTimes[1].tv_sec || status.st_mtim.tv_nsec != kTimes[1].tv_nsec;
}

bool was_read(const fs::path& path) {
  struct stat status {};
  lstat(path.c_str(), &status);
  return status.st_atim.tv_sec != kTimes[0].tv_sec || status.st_atim.tv_nsec != kTimes[0].tv_nsec;
}

/// @param before  what was there when the times were set
void expect_untouched(const fs::path& folder, const std::map<std::string, Witness>& before, bool are_reads_noted) {
  EXPECT_FALSE(was_written(folder));
  for (const auto& [name, was] : before) {
    EXPECT_FALSE(was_written(folder / name)) << name;
    // Folders are read by the test itself.
    const bool is_file = was.type == fs::file_type::regular && !was.has_second_name;
    EXPECT_FALSE(are_reads_noted && is_file && was_read(folder / name)) << name;
  }
  const auto after = witnesses_in(folder);
  for (const auto& [name, witness] : after) EXPECT_TRUE(before.contains(name)) << name << " is new";
  for (const auto& [name, was] : before) {
    const auto found = after.find(name);
    const bool is_same = found != after.end() && found->second.type == was.type && found->second.bytes == was.bytes;
    EXPECT_TRUE(is_same) << name;
  }
}

class HostileCells : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene_ = new TemporaryFolder;
    stages_ = test::make_script_stages(*scene_ / "first", 1);
    make_finished(*scene_ / "cell", stages_);
    make_finished(*scene_ / "sound", test::make_script_stages(*scene_ / "second", 2));
  }
  static void TearDownTestSuite() { delete scene_; }

  static void make_finished(const fs::path& cell, const fs::path& stages) {
    test::make_unfinished_cell(cell);
    test::output_of("mbtfm run --stages-dir " + stages.string() + " " + cell.string());
  }
  static void copy_cell(const std::string& name, const fs::path& to) {
    fs::create_directories(to.parent_path());
    fs::copy(*scene_ / name, to, fs::copy_options::recursive);
  }

  /// Exit code 124: it hangs.
  static Outcome mbtfm(const std::string& arguments) {
    return test::run_program("mbtfm " + arguments + " --stages-dir " + stages_.string(), "timeout -k 5 60 ");
  }

  static inline TemporaryFolder* scene_ = nullptr;
  static inline fs::path stages_;
};

/// What is outside: a finished cell, files and folders that nobody may touch.
void make_outside(const fs::path& folder) {
  files::write_text(folder / "precious.txt", kSecret);
  fs::create_directories(folder / "cost/scratch");
  files::write_text(folder / "cost/scratch/precious.txt", kSecret);
  files::write_text(folder / "cost/precious.txt", kSecret);
  files::write_text(folder / "cell/1_segment/precious.txt", kSecret);
}

bool holds_the_secret(const fs::path& folder) {
  std::error_code too_deep;
  for (fs::recursive_directory_iterator entry(folder, too_deep), end; entry != end; entry.increment(too_deep)) {
    if (too_deep) return false;
    constexpr std::uintmax_t kLarge = 1 << 26;
    // A second name of a witness is the witness.
    if (entry->is_symlink() || !entry->is_regular_file() || entry->file_size() > kLarge) continue;
    if (entry->hard_link_count() > 1) continue;
    if (files::read_text(entry->path()).find(kSecret) != std::string::npos) return true;
  }
  return false;
}

std::string with_folders(std::string command, const Scene& scene) {
  command = std::regex_replace(command, std::regex("CELL"), scene.cell().string());
  return std::regex_replace(command, std::regex("STUDY"), scene.study().string());
}

TEST_F(HostileCells, touch_nothing_outside_and_stop_no_other_cell) {
  const TemporaryFolder probe;
  files::write_text(probe / "probe", "");
  set_times(probe.path());
  files::read_text(probe / "probe");
  const bool are_reads_noted = was_read(probe / "probe");  // not where the file system is mounted with noatime
  for (const Way& way : ways()) {
    SCOPED_TRACE(way.name);
    const TemporaryFolder folder;
    const Scene scene{folder.path()};
    copy_cell("cell", scene.cell());
    copy_cell("sound", scene.study() / "sound");
    copy_cell("cell", scene.outside() / "cell");
    make_outside(scene.outside());
    if (way.run_record == Way::RunRecord::removed) {
      fs::remove(scene.cell() / "run.json");
      fs::remove(scene.cell() / "report.html");
    }
    way.make(scene);
    const auto before = witnesses_in(scene.outside());
    set_times(scene.outside());

    const std::string cell = scene.cell().string(), study = scene.study().string();
    const auto run_further = [&] {
      if (way.further.empty()) return;
      const Outcome further = test::run_program("mbtfm " + with_folders(way.further, scene), "timeout -k 5 60 ");
      EXPECT_EQ(further.code, way.further_code) << further.output;
    };
    if (way.run_record == Way::RunRecord::kept) run_further();  // before the next run writes another
    const Outcome verify = test::run_program("mbtfm verify " + cell, "timeout -k 5 60 ");
    EXPECT_EQ(verify.code, way.codes.verify) << verify.output;
    const Outcome list = mbtfm("batch --list " + study);
    EXPECT_EQ(list.code, 0) << list.output;
    const Outcome batch = mbtfm("batch --quiet " + study);
    EXPECT_EQ(batch.code, way.codes.batch) << batch.output;
    const Outcome run = mbtfm("run --quiet " + cell);
    EXPECT_EQ(run.code, way.codes.run) << run.output;
    if (way.codes.stats) {
      const Outcome stats = test::run_program("mbtfm stats " + study + " --bootstrap_draws 100", "timeout -k 5 60 ");
      EXPECT_EQ(stats.code, *way.codes.stats) << stats.output;
    }
    if (!way.is_said.empty()) {
      const Outcome table = mbtfm("batch --table " + study);
      EXPECT_EQ(table.code, way.codes.batch) << table.output;
      for (const Outcome* outcome : {&batch, &list, &table}) EXPECT_TRUE(has_words(outcome->output, way.is_said));
      const std::string left_out = fs::path(way.is_said).filename().string();
      EXPECT_TRUE(has_words(files::read_text(scene.study() / "statistics/cells.csv"), left_out));
    }
    if (way.run_record == Way::RunRecord::removed) run_further();
    expect_untouched(scene.outside(), before, are_reads_noted);
    EXPECT_FALSE(holds_the_secret(scene.study()));
    EXPECT_FALSE(fs::exists(scene.root / "cell.toml"));
    EXPECT_TRUE(fs::exists(fs::symlink_status(scene.cell() / "paxillin.tif")));
    EXPECT_TRUE(has_words(files::read_text(scene.study() / "sound/run.json"), "\"outcome\": \"done\""));
  }
}

/// The superuser may read everything, unless told not to.
std::string as_owner_alone() {
  if (geteuid() != 0) return {};
  const std::string none = "-dac_override,-dac_read_search";
  return "setpriv --bounding-set=" + none + " --inh-caps=" + none + " ";
}

TEST_F(HostileCells, a_folder_that_may_not_be_read_is_skipped_and_named) {
  if (!as_owner_alone().empty() && std::system((as_owner_alone() + "true").c_str()) != 0)
    GTEST_SKIP() << "setpriv takes no rights away here";
  const TemporaryFolder folder;
  const fs::path study = folder / "study", closed = study / "lost+found";
  copy_cell("sound", study / "sound");
  fs::create_directories(closed);
  fs::permissions(closed, fs::perms::none);
  const std::string stages = " --stages-dir " + stages_.string();
  for (const std::string& command : {"batch --list " + study.string() + stages, "batch " + study.string() + stages,
                                     "batch --table " + study.string() + stages, "stats " + study.string()}) {
    const Outcome outcome = test::run_program("mbtfm " + command, as_owner_alone());
    EXPECT_EQ(outcome.code, 0) << command << ": " << outcome.output;
    if (!command.starts_with("stats")) EXPECT_TRUE(has_words(outcome.output, "lost+found")) << command;
  }
  EXPECT_TRUE(has_words(files::read_text(study / "statistics/cells.csv"), "lost+found"));
  fs::permissions(closed, fs::perms::owner_all);
}

TEST_F(HostileCells, a_link_under_the_name_of_an_unfinished_table_is_not_followed) {
  const TemporaryFolder folder;
  const Scene scene{folder.path()};
  copy_cell("sound", scene.study() / "sound");
  fs::create_directories(scene.outside());
  files::write_text(scene.outside() / "precious.txt", kSecret);
  // The number of the process is in the name: the shell has it, and becomes mbtfm.
  const std::string link = (scene.study() / ".partial-$$-batch.csv").string();
  const Outcome batch = test::run_program("mbtfm batch " + scene.study().string() + " --stages-dir " + stages_.string(),
                                          "ln -s " + scene.precious() + " " + link + "; exec ");
  EXPECT_EQ(batch.code, 0) << batch.output;
  EXPECT_EQ(files::read_text(scene.precious()), kSecret);
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(scene.study() / "batch.csv")));
}

TEST_F(HostileCells, a_cell_folder_and_its_images_and_settings_may_be_links) {
  const TemporaryFolder folder;
  const Scene scene{folder.path()};
  fs::create_directories(scene.study());
  test::make_unfinished_cell(scene.root / "disk/cell");
  test::make_unfinished_cell(scene.root / "images");
  for (const char* input : {"paxillin.tif", "beads_relaxed.tif", "cell.toml"}) {
    fs::remove(scene.root / "disk/cell" / input);
    fs::create_symlink("../../images/" + std::string(input), scene.root / "disk/cell" / input);
  }
  fs::create_symlink("../disk/cell", scene.cell());
  test::output_of(mbtfm("run " + scene.cell().string()));
  test::output_of("mbtfm verify " + scene.cell().string());
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(scene.root / "disk/cell/report.html")));
}

TEST(HostileCellsPage, lists_every_way_that_is_tried) {
  const std::string page = files::read_text(test::source_folder() / "notes/reliability.md");
  const auto begin = page.find("## Hostile cell folders");
  const std::string section = page.substr(begin, page.find("\n## ", begin) - begin);
  std::set<std::string> listed, tried;
  const std::regex row(R"(\n\| `([a-z-]+)` \|)");
  for (std::sregex_iterator match(section.begin(), section.end(), row), end; match != end; ++match)
    listed.insert((*match)[1]);
  for (const Way& way : ways()) tried.insert(way.name);
  EXPECT_EQ(listed, tried);
  EXPECT_GE(tried.size(), 30u);
}

}  // namespace
}  // namespace mbtfm
