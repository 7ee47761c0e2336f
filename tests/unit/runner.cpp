/// The runner on stages that are shell scripts: which it runs, which it leaves, what it says.
#include <nlohmann/json.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/files/text.h"
#include "pipeline/runner/batch.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/runner/images.h"
#include "pipeline/runner/lock.h"
#include "pipeline/runner/run_cell.h"
#include "pipeline/runner/stage_result.h"
#include "pipeline/runner/stages.h"
#include "pipeline/runner/verify.h"
#include "pipeline/stage/effects.h"
#include "tests/support/folders.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::runner {
namespace {

void make_executable(const fs::path& file, const std::string& text) {
  files::write_text(file, text);
  fs::permissions(file, fs::perms::owner_all);
}

std::string stage_script() { return files::read_text(test::source_folder() / "tests/data/stage.sh"); }

class Runner : public testing::Test {
 protected:
  TemporaryFolder folder_;
  const fs::path cell_ = folder_ / "cell";
  const fs::path bin_ = folder_ / "bin";
  RunOptions options_{.stage_folder = bin_, .threads = 2, .is_quiet = true, .version = "1"};

  void SetUp() override {
    fs::create_directories(cell_);
    fs::create_directories(bin_);
    for (const Stage& stage : stages()) make_executable(bin_ / ("mbtfm-" + stage.name), stage_script());
    write_parameters("");
    for (const char* image : {"paxillin.tif", "actin.tif", "beads_stressed.tif", "beads_relaxed.tif"})
      files::write_text(cell_ / image, image);
  }

  void write_parameters(const std::string& further) {
    files::write_text(cell_ / "cell.toml", "pixel_size_um = 0.1\n[gel]\nyoungs_modulus_kPa = 8\n" + further);
  }

  /// Names of the stages that a run starts, sorted: two of them start at the same time.
  std::string started() {
    fs::remove(bin_ / "calls");
    last_ = run_cell(cell_, options_);
    return calls();
  }
  std::string calls() {
    if (!fs::exists(bin_ / "calls")) return "";
    std::istringstream lines(files::read_text(bin_ / "calls"));
    std::vector<std::string> names;
    for (std::string name; lines >> name;) names.push_back(name);
    std::sort(names.begin(), names.end());
    std::string list;
    for (const std::string& name : names) list += (list.empty() ? "" : " ") + name;
    return list;
  }
  StageState state_of(const std::string& stage) const {
    for (const StageOutcome& outcome : last_.stages)
      if (outcome.stage == stage) return outcome.status.state;
    throw InternalError("no stage " + stage);
  }
  CellOutcome last_;
};

TEST_F(Runner, runs_again_exactly_what_depends_on_a_changed_table) {
  started();
  write_parameters("[fit]\nn_meshes = 2\n");
  EXPECT_EQ(started(), "fit");
  write_parameters("[fit]\nn_meshes = 2\n[track]\nx = 1\n");
  EXPECT_EQ(started(), "fit track");  // the script's displacement differs for another cell.toml
  write_parameters("[fit]\nn_meshes = 2\n[track]\nx = 1\n[segment]\ny = 1\n");
  EXPECT_EQ(started(), "segment");  // its outputs are the same bytes: nothing after it is affected
}

TEST_F(Runner, a_single_frame_of_a_series_that_is_lost_or_changed_is_made_anew_and_the_others_kept) {
  files::write_text(bin_ / "series", "");
  EXPECT_EQ(started(), "fit network segment track");
  EXPECT_EQ(started(), "");
  fs::remove(cell_ / "2_track/displacement_0003.csv");
  EXPECT_EQ(started(), "track-keeping");  // it comes out as it was: the fit holds
  EXPECT_TRUE(fs::exists(cell_ / "2_track/displacement_0003.csv"));
  EXPECT_EQ(started(), "");
  files::write_text(cell_ / "2_track/displacement_0001.csv", "by hand");
  EXPECT_EQ(started(), "fit-keeping");
  EXPECT_EQ(state_of("track"), StageState::replaced);
  EXPECT_EQ(started(), "");
  fs::remove(cell_ / "2_track/displacement_0003.csv");
  EXPECT_EQ(started(), "track-keeping");
  EXPECT_EQ(files::read_text(cell_ / "2_track/displacement_0001.csv"), "by hand");
  EXPECT_EQ(started(), "");
  EXPECT_EQ(state_of("track"), StageState::replaced);  // still the user's
  fs::remove(cell_ / "2_track/displacement_0003.csv");
  write_parameters("[track]\nx = 1\n");
  EXPECT_EQ(started(), "fit track");  // nothing that other parameters gave is kept
  EXPECT_EQ(files::read_text(cell_ / "2_track/displacement_0001.csv"), "1\n");
}

TEST_F(Runner, what_is_left_of_a_series_does_not_outlive_it) {
  files::write_text(bin_ / "series", "");
  started();
  fs::remove(bin_ / "series");
  files::write_text(cell_ / "beads_stressed.tif", "a single image");
  EXPECT_EQ(started(), "fit track");
  EXPECT_FALSE(fs::exists(cell_ / "2_track/frames.csv"));
  EXPECT_FALSE(fs::exists(cell_ / "2_track/displacement_0003.csv"));
  EXPECT_EQ(started(), "");
}

TEST(Stages, every_effect_belongs_to_a_stage_that_runs_again_for_it) {
  std::vector<std::string> of_stages;
  for (const Stage& stage : stages()) of_stages.insert(of_stages.end(), stage.effects.begin(), stage.effects.end());
  for (const std::string& key : stage::effect_keys())
    EXPECT_NE(std::ranges::find(of_stages, key), of_stages.end()) << key;
}

/// Names of the stages of a cell with these settings, its kind before them.
class Kinds : public Runner {
 protected:
  CellStages stages_with(const std::string& toml) {
    write_parameters(toml);
    return stages_of(cell_, read_image_names(cell_));
  }
  static std::string told(const CellStages& of) {
    std::string names = name_of(of.kind);
    for (const Stage& stage : of.stages) names += " " + stage.name;
    return names;
  }
  static std::string arguments(const Stage& stage) {
    std::string flags;
    for (const PathArgument& argument : stage.arguments) flags += argument.flag + " ";
    return flags;
  }
};

TEST_F(Kinds, beads_are_in_space_where_the_tracker_follows_them_there) {
  fs::remove(cell_ / "paxillin.tif");
  fs::remove(cell_ / "actin.tif");
  const std::string plane = "plane segment track network fit", space = "space track surface traction";
  EXPECT_EQ(told(stages_with("")), plane);
  EXPECT_EQ(told(stages_with("[track]\nz_points = 'into-gel'\n")), space);
  EXPECT_EQ(told(stages_with("[track]\ndimensions = 'space'\n")), space);
  EXPECT_EQ(told(stages_with("[track]\nz_points = 'into-gel'\ndimensions = 'plane'\n")), plane);
  EXPECT_EQ(told(stages_with("[track]\nz_points = 'into-gel'\nrelaxed_z = 3\n")), plane);
}

TEST_F(Kinds, what_lies_in_the_folder_decides_where_surface_and_cell_come_from) {
  const std::string toml = "[track]\nz_points = 'into-gel'\n";
  const CellStages whole = stages_with(toml);
  EXPECT_EQ(told(whole), "space segment track surface traction");
  EXPECT_EQ(arguments(whole.stages[2]), "beads ");
  EXPECT_EQ(arguments(whole.stages[3]), "displacement surface outline adhesions ");
  fs::remove(cell_ / "paxillin.tif");
  files::write_text(cell_ / "surface_beads.tif", "a stack");
  const CellStages without = stages_with(toml);
  EXPECT_EQ(arguments(without.stages[2]), "points ");
  EXPECT_EQ(arguments(without.stages[3]), "displacement surface outline ");
  EXPECT_EQ(arguments(stages_with(toml + "[surface]\nformula = 'wave'\n").stages[2]), "");
}

TEST_F(Kinds, a_sheet_has_stages_of_its_own_and_takes_its_outline_from_images_or_from_a_mask) {
  const std::string toml = "[run]\nmodel = 'sheet'\n";
  CellStages of = stages_with(toml);
  EXPECT_EQ(told(of), "sheet segment track sheet");
  EXPECT_EQ(arguments(of.stages[2]), "displacement outline adhesions ");
  EXPECT_TRUE(of.stages[0].settings.empty());
  EXPECT_EQ(arguments(stages_with(toml + "bundles = true\n").stages[2]), "displacement outline adhesions bundles ");
  fs::remove(cell_ / "paxillin.tif");
  of = stages_with(toml);
  EXPECT_EQ(arguments(of.stages[2]), "displacement outline ");
  ASSERT_EQ(of.stages[0].settings.size(), 1u);  // no candidates: a sheet asks for none
  EXPECT_EQ(of.stages[0].settings[0].value, "none");
  fs::remove(cell_ / "actin.tif");
  files::write_text(cell_ / "outline_mask.tif", "mask");
  of = stages_with(toml);
  EXPECT_EQ(told(of), "sheet track sheet");
  ASSERT_EQ(of.stages[1].images.size(), 1u);
  EXPECT_EQ(of.stages[1].images[0].key, "outline_mask");
  EXPECT_THROW(stages_with(toml + "bundles = true\n"), InputError);  // nothing shows any
}

TEST_F(Kinds, what_the_table_run_cannot_mean_is_refused) {
  EXPECT_THROW(stages_with("[run]\nmodel = 'sheets'\n"), InputError);
  EXPECT_THROW(stages_with("[run]\nmodle = 'sheet'\n"), InputError);
  EXPECT_THROW(stages_with("[run]\nmodel = 'sheet'\n[track]\nz_points = 'into-gel'\n"), InputError);
}

TEST_F(Runner, a_cell_that_becomes_a_sheet_is_segmented_again_only_where_that_differs) {
  make_executable(bin_ / "mbtfm-sheet", stage_script());
  started();
  write_parameters("[run]\nmodel = 'sheet'\n");
  EXPECT_EQ(started(), "sheet");  // outline, adhesions and displacement are as they were
  EXPECT_EQ(started(), "");
  fs::remove(cell_ / "paxillin.tif");
  EXPECT_EQ(started(), "segment sheet");  // without candidates: its outputs are those of the script
  write_parameters("");
  EXPECT_EQ(started(), "segment");  // with them
}

TEST_F(Runner, order_and_comments_of_the_parameter_file_do_not_matter) {
  started();
  files::write_text(cell_ / "cell.toml", "pixel_size_um = 0.1 # calibrated\n\n[gel]\nyoungs_modulus_kPa = 8 # kPa\n");
  EXPECT_EQ(started(), "");
}

TEST_F(Runner, runs_again_for_a_changed_image_or_another_version) {
  started();
  files::write_text(cell_ / "beads_relaxed.tif", "another");
  EXPECT_EQ(started(), "fit track");
  options_.version = "2";
  EXPECT_EQ(started(), "fit network segment track");
}

TEST_F(Runner, keeps_an_output_that_was_changed_by_hand) {
  started();
  files::write_text(cell_ / "1_segment/fibres.csv", "drawn by hand");
  EXPECT_EQ(started(), "fit network");
  EXPECT_EQ(state_of("segment"), StageState::replaced);
  EXPECT_EQ(files::read_text(cell_ / "1_segment/fibres.csv"), "drawn by hand");
  EXPECT_TRUE(has_words(files::read_text(cell_ / "run.json"), "\"replaced\""));
  EXPECT_EQ(started(), "");
  options_.redo = {"segment"};
  EXPECT_EQ(started(), "fit network segment");
}

TEST_F(Runner, a_cell_is_not_done_before_the_run_record_shows_what_was_changed_by_hand) {
  started();
  files::write_text(cell_ / "report.html", "");
  EXPECT_TRUE(is_done(cell_, options_, look_at_cell(cell_, options_)));
  files::write_text(cell_ / "4_fit/tensions.csv", "by hand");
  EXPECT_FALSE(is_done(cell_, options_, look_at_cell(cell_, options_)));
  started();
  EXPECT_TRUE(is_done(cell_, options_, look_at_cell(cell_, options_)));
}

TEST_F(Runner, takes_given_outputs_without_images) {
  for (const char* file : {"adhesions.csv", "fibres.csv", "fibre_points.csv", "outline.csv"}) {
    fs::create_directories(cell_ / "1_segment");
    files::write_text(cell_ / "1_segment" / file, file);
  }
  fs::remove(cell_ / "paxillin.tif");
  fs::remove(cell_ / "actin.tif");
  EXPECT_EQ(started(), "fit network track");
  EXPECT_EQ(state_of("segment"), StageState::given);
  EXPECT_EQ(started(), "");
}

TEST_F(Runner, takes_a_displacement_field_instead_of_the_beads_images) {
  for (const char* image : {"beads_stressed.tif", "beads_relaxed.tif"}) fs::remove(cell_ / image);
  files::write_text(cell_ / "piv.csv", "x");
  write_parameters("[images]\ndisplacement = \"piv.csv\"\n");
  EXPECT_EQ(started(), "fit network segment track");
  EXPECT_EQ(started(), "");
  files::write_text(cell_ / "piv.csv", "y");
  EXPECT_EQ(started(), "fit track");
  for (const char* half : {"u.npy", "v.npy"}) files::write_text(cell_ / half, "x");  // of pyTFM
  write_parameters("[images]\ndisplacement = \"u.npy\"\n");
  EXPECT_EQ(started(), "fit segment track");
  files::write_text(cell_ / "v.npy", "y");
  EXPECT_EQ(started(), "track");
}

TEST_F(Runner, rejects_a_half_given_stage) {
  fs::create_directories(cell_ / "1_segment");
  files::write_text(cell_ / "1_segment/adhesions.csv", "given");
  EXPECT_THROW(started(), InputError);
  EXPECT_EQ(files::read_text(cell_ / "1_segment/adhesions.csv"), "given");
}

TEST_F(Runner, starts_nothing_where_an_image_lacks) {
  fs::remove(cell_ / "beads_relaxed.tif");
  const InputError error = test::thrown<InputError>([&] { started(); });
  EXPECT_TRUE(has_words(error.what(), "beads_relaxed.tif"));
  EXPECT_EQ(calls(), "");
}

TEST_F(Runner, starts_nothing_where_a_stage_refuses_its_parameters) {
  write_parameters("[fit]\nrefuse_fit = 1\n");
  EXPECT_THROW(started(), StageFailed);
  EXPECT_EQ(calls(), "");
}

TEST_F(Runner, runs_a_stage_again_that_was_interrupted) {
  started();
  write_begun(cell_ / "2_track/record.json", stages()[1]);  // as a kill in the middle of the stage leaves it
  EXPECT_EQ(started(), "track");
}

TEST_F(Runner, goes_on_after_a_stage_that_did_not_converge_and_never_forgets_it) {
  files::write_text(bin_ / "exit-network", "4");
  EXPECT_EQ(started(), "fit network segment track");
  EXPECT_FALSE(last_.converged());
  EXPECT_EQ(started(), "");
  EXPECT_FALSE(last_.converged());
}

TEST_F(Runner, only_runs_the_stages_asked_for) {
  options_.only = {"segment"};
  EXPECT_EQ(started(), "segment");
  options_.only = {"fit"};
  EXPECT_THROW(started(), InputError);  // no network yet
  options_.only = {"fits"};
  EXPECT_THROW(started(), UsageError);
}

TEST_F(Runner, keeps_away_from_a_cell_that_another_run_holds) {
  const CellLock lock(cell_, {});
  EXPECT_THROW(started(), CellBusy);
}

TEST_F(Runner, works_on_a_stage_while_another_run_holds_other_stages) {
  const CellLock lock(cell_, {"track", "fit"});
  options_.only = {"segment"};
  EXPECT_EQ(started(), "segment");
  options_.only = {"track"};
  EXPECT_THROW(started(), CellBusy);
}

nlohmann::json run_record(const fs::path& cell) { return nlohmann::json::parse(files::read_text(cell / "run.json")); }

TEST_F(Runner, says_in_run_json_which_stage_failed_and_why) {
  files::write_text(bin_ / "exit-network", "3");
  EXPECT_EQ(test::thrown<StageFailed>([&] { started(); }).failure.exit_code, 3);
  EXPECT_EQ(calls(), "network segment track");
  const auto run = run_record(cell_);
  EXPECT_EQ(run["outcome"], "failed");
  EXPECT_EQ(run["stages"]["segment"]["state"], "run");
  EXPECT_EQ(run["stages"]["network"]["state"], "failed");
  EXPECT_EQ(run["stages"]["network"]["failure"]["exit_code"], 3);
  EXPECT_EQ(run["stages"]["network"]["failure"]["message"], "mbtfm-network: error: made to fail");
  EXPECT_EQ(run["stages"]["fit"]["state"], "not run");
  fs::remove(bin_ / "exit-network");
  EXPECT_EQ(started(), "fit network");
  EXPECT_EQ(run_record(cell_)["outcome"], "done");
  EXPECT_FALSE(run_record(cell_)["stages"]["network"].contains("failure"));
}

TEST_F(Runner, names_in_run_json_a_crash_and_refused_parameters) {
  files::write_text(bin_ / "shell-track", "kill -SEGV $$");
  EXPECT_THROW(started(), StageFailed);
  EXPECT_EQ(run_record(cell_)["stages"]["track"]["failure"]["exit_code"], 128 + 11);
  write_parameters("[fit]\nrefuse_fit = 1\n");
  EXPECT_THROW(started(), StageFailed);
  EXPECT_EQ(run_record(cell_)["stages"]["fit"]["failure"]["how"], "does not accept cell.toml");
}

TEST_F(Runner, stages_that_are_run_one_by_one_leave_the_same_record) {
  for (const char* stage : {"segment", "track", "network", "fit"}) {
    options_.only = {stage};
    EXPECT_EQ(started(), stage);
  }
  const auto run = run_record(cell_);
  EXPECT_EQ(run["outcome"], "done");
  for (const auto& stage : run["stages"]) EXPECT_EQ(stage["state"], "run");
}

/// As the workflow runs a sheet of given beads: it has no job for the stage `track`.
TEST_F(Runner, what_was_given_is_named_though_no_run_asked_for_its_stage) {
  make_executable(bin_ / "mbtfm-sheet", stage_script());
  for (const char* image : {"beads_stressed.tif", "beads_relaxed.tif"}) fs::remove(cell_ / image);
  fs::create_directories(cell_ / "2_track");
  files::write_text(cell_ / "2_track/displacement.csv", "given");
  write_parameters("[run]\nmodel = 'sheet'\n");
  for (const char* stage : {"segment", "sheet"}) {
    options_.only = {stage};
    EXPECT_EQ(started(), stage);
  }
  EXPECT_EQ(run_record(cell_)["stages"]["track"]["state"], "given");
  EXPECT_EQ(run_record(cell_)["outcome"], "done");
  EXPECT_EQ(verify_cell(cell_).differences, std::vector<std::string>());
  files::write_text(cell_ / "2_track/displacement.csv", "another");
  EXPECT_EQ(verify_cell(cell_).differences,
            std::vector<std::string>{"2_track/displacement.csv differs (output of track)"});
}

TEST_F(Runner, what_was_changed_by_hand_is_named_though_no_run_asked_for_its_stage) {
  started();
  files::write_text(cell_ / "2_track/displacement.csv", "by hand");
  options_.only = {"fit"};
  EXPECT_EQ(started(), "fit");
  EXPECT_EQ(run_record(cell_)["stages"]["track"]["state"], "replaced");
  EXPECT_EQ(verify_cell(cell_).differences, std::vector<std::string>());
}

TEST_F(Runner, kills_a_stage_and_what_it_started_when_its_time_is_over) {
  // The stage waits for a child that would write a file later; neither may be left.
  files::write_text(bin_ / "shell-segment",
                    "(trap '' TERM; sleep 3; touch " + (folder_ / "survived").string() + ") & wait");
  options_.limits.seconds = 0.2;
  const StageFailed error = test::thrown<StageFailed>([&] { started(); });
  EXPECT_EQ(error.failure.exit_code, 6);
  EXPECT_TRUE(has_words(error.failure.how, "timed out"));
  EXPECT_EQ(run_process({"/bin/sh", "-c", "sleep 4"}).exit_code, 0);
  EXPECT_FALSE(fs::exists(folder_ / "survived"));
}

TEST_F(Runner, kills_a_stage_that_takes_too_much_memory) {
  files::write_text(
      bin_ / "shell-segment",
      "head -c 200000000 /dev/zero | tail -c 1 > /dev/null; x=$(head -c 200000000 /dev/zero | tr '\\0' x); sleep 60");
  options_.limits.memory_bytes = 100'000'000;
  const StageFailed error = test::thrown<StageFailed>([&] { started(); });
  EXPECT_EQ(error.failure.exit_code, 6);
  EXPECT_TRUE(has_words(error.failure.how, "took too much memory"));
}

TEST_F(Runner, limits_hold_while_a_stage_reads_its_parameters) {
  files::write_text(bin_ / "check-network", "sleep 60");
  options_.limits.seconds = 0.5;
  const StageFailed error = test::thrown<StageFailed>([&] { started(); });
  EXPECT_EQ(error.failure.exit_code, 6);
  EXPECT_TRUE(error.failure.how.starts_with("timed out after ")) << error.failure.how;
  EXPECT_TRUE(error.failure.how.ends_with(" s while it read cell.toml")) << error.failure.how;
  EXPECT_EQ(calls(), "") << "nothing runs before every stage has read its parameters";
}

TEST_F(Runner, a_stage_that_crashes_while_it_reads_its_parameters_is_named_as_that) {
  files::write_text(bin_ / "check-fit", "kill -SEGV $$");
  const StageFailed error = test::thrown<StageFailed>([&] { started(); });
  EXPECT_EQ(error.failure.exit_code, 128 + 11);
  EXPECT_EQ(error.failure.how, "killed by signal 11 (Segmentation fault) while it read cell.toml");
}

TEST_F(Runner, a_stage_that_found_no_answer_and_wrote_nothing_did_not_merely_fail_to_converge) {
  files::write_text(bin_ / "shell-network", "exit 4");
  EXPECT_EQ(test::thrown<StageFailed>([&] { started(); }).failure.exit_code, 7);
  EXPECT_EQ(run_record(cell_)["outcome"], "failed");
}

TEST_F(Runner, an_image_whose_name_is_not_utf8_is_recorded_readably_and_up_to_date) {
  const std::string name = "actin_caf\xE9.tif";
  fs::rename(cell_ / "actin.tif", cell_ / name);
  write_parameters("[images]\nactin = 'actin*.tif'\n");
  EXPECT_EQ(started(), "fit network segment track");
  EXPECT_EQ(run_record(cell_)["images"]["actin"], "actin_caf\\xE9.tif");
  EXPECT_EQ(started(), "");
  write_parameters("[images]\nactin = 'actin_caf\\xE9.tif'\n");  // named as the record names it
  EXPECT_EQ(started(), "fit segment track") << "[images] has changed, and is found";
}

TEST_F(Runner, a_file_that_was_changed_and_given_its_old_times_again_is_noticed) {
  const auto old = fs::file_time_type::clock::now() - std::chrono::hours(1);
  fs::last_write_time(cell_ / "beads_relaxed.tif", old);
  started();
  EXPECT_EQ(started(), "");
  files::write_text(cell_ / "beads_relaxed.tif", "baeds_relaxed.tif");  // the same size
  fs::last_write_time(cell_ / "beads_relaxed.tif", old);
  EXPECT_EQ(started(), "fit track");
}

TEST_F(Runner, a_damaged_list_of_hashes_does_no_harm) {
  started();
  for (const char* text : {"", "x", "0 1 2 3 4 5 cell.toml\n", "\xff\n\n"}) {
    files::write_text(cell_ / ".mbtfm.hashes", text);
    EXPECT_EQ(started(), "");
  }
}

TEST_F(Runner, removes_what_a_killed_run_left_half_written) {
  started();
  files::write_text(cell_ / "2_track/.partial-1-displacement.csv", "half");
  files::write_text(cell_ / ".partial-1-run.json", "half");
  options_.redo = {"track"};
  started();
  EXPECT_FALSE(fs::exists(cell_ / "2_track/.partial-1-displacement.csv"));
  EXPECT_FALSE(fs::exists(cell_ / ".partial-1-run.json"));
}

TEST_F(Runner, names_of_images_are_globs_that_fit_one_file) {
  files::write_text(cell_ / "c1_pax.tif", "");
  files::write_text(cell_ / "c2_pax.tif", "");
  ImageNames names;
  names.adhesion = "c1_*.tif";
  EXPECT_EQ(resolve_image(cell_, names, "adhesion"), cell_ / "c1_pax.tif");
  names.adhesion = "*_pax.tif";
  const InputError error = test::thrown<InputError>([&] { resolve_image(cell_, names, "adhesion"); });
  EXPECT_TRUE(has_words(error.what(), "c1_pax.tif, c2_pax.tif"));
}

TEST_F(Runner, a_file_whose_name_looks_like_a_glob_is_found) {
  files::write_text(cell_ / "cell[1].tif", "");
  ImageNames names;
  names.actin = "cell[1].tif";
  EXPECT_EQ(resolve_image(cell_, names, "actin"), cell_ / "cell[1].tif");
}

TEST_F(Runner, hand_drawn_rois_are_used_where_they_are_and_a_changed_one_runs_the_segmentation_again) {
  started();
  files::write_text(cell_ / "fibres.zip", "drawn");
  EXPECT_EQ(started(), "segment");
  EXPECT_EQ(started(), "");
  files::write_text(cell_ / "fibres.zip", "drawn better");
  EXPECT_EQ(started(), "segment");
  fs::remove(cell_ / "fibres.zip");
  EXPECT_EQ(started(), "segment");
  files::write_text(cell_ / "outline.roi", "drawn");
  EXPECT_EQ(started(), "segment");
  for (const char* image : {"paxillin.tif", "actin.tif"}) fs::remove(cell_ / image);
  EXPECT_EQ(started(), "");  // its images are gone: outputs kept
}

TEST_F(Runner, hand_drawn_rois_that_are_asked_for_by_name_must_be_there) {
  write_parameters("[images]\nfibre_rois = \"drawn.zip\"\n");
  EXPECT_THROW(run_cell(cell_, options_), InputError);
  EXPECT_EQ(calls(), "");
  files::write_text(cell_ / "drawn.zip", "");
  EXPECT_EQ(resolve_optional_image(cell_, read_image_names(cell_), "fibre_rois"), cell_ / "drawn.zip");
  ImageNames names;
  EXPECT_EQ(resolve_optional_image(cell_, names, "fibre_rois"), std::nullopt);
  files::write_text(cell_ / "fibres.roi", "");
  EXPECT_EQ(resolve_optional_image(cell_, names, "fibre_rois"), cell_ / "fibres.roi");
  files::write_text(cell_ / "fibres.zip", "");
  EXPECT_THROW(resolve_optional_image(cell_, names, "fibre_rois"), InputError);  // which of them?
}

TEST_F(Runner, a_cell_without_an_adhesion_image_is_run_and_one_that_names_its_image_must_have_it) {
  fs::remove(cell_ / "paxillin.tif");
  EXPECT_EQ(started(), "fit network segment track");
  EXPECT_FALSE(has_words(files::read_text(cell_ / "1_segment/record.json"), "--adhesion-image"));
  files::write_text(cell_ / "adhesion_mask.png", "mask");
  files::write_text(cell_ / "outline_mask.tif", "mask");
  EXPECT_EQ(started(), "segment");
  EXPECT_TRUE(has_words(files::read_text(cell_ / "1_segment/record.json"), "--adhesion-mask", "--outline-mask"));
  files::write_text(cell_ / "paxillin.tif", "it was elsewhere");
  EXPECT_EQ(started(), "segment");
  EXPECT_TRUE(has_words(files::read_text(cell_ / "1_segment/record.json"), "--adhesion-image"));
  write_parameters("[images]\nadhesion = \"vinculin.tif\"\n");
  EXPECT_THROW(run_cell(cell_, options_), InputError);
}

TEST_F(Runner, a_second_placement_of_the_adhesions_that_comes_or_goes_is_fitted_again) {
  started();
  files::write_text(cell_ / "1_segment/adhesions_2.csv", "at other places");
  EXPECT_EQ(started(), "fit");
  EXPECT_EQ(started(), "");
  fs::remove(cell_ / "1_segment/adhesions_2.csv");
  EXPECT_EQ(started(), "fit");
}

TEST(Batch, a_failed_cell_does_not_stop_the_others) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "bin");
  for (const Stage& stage : stages()) make_executable(folder / ("bin/mbtfm-" + stage.name), "#!/bin/sh\n");
  for (const char* name : {"a", "b", "deeper/c"}) {
    fs::create_directories(folder / name);
    files::write_text(folder / (std::string(name) + "/cell.toml"), "");
  }
  fs::create_directories(folder / "a/inner");
  files::write_text(folder / "a/inner/cell.toml", "");  // part of a, not a cell
  make_executable(folder / "mbtfm",
                  "#!/bin/sh\ncase $2 in */b) echo 'mbtfm: error: broken' >&2; exit 3;; */c) kill -9 $$;; esac\n");
  const auto cells = find_cells(folder.path()).cells;
  ASSERT_EQ(cells.size(), 3u);
  const auto outcomes = run_batch(
      cells,
      {.program = folder / "mbtfm", .jobs = 2, .threads = 2, .run = {.stage_folder = folder / "bin", .version = "1"}});
  EXPECT_EQ(outcomes[0].exit_code, 0);
  EXPECT_EQ(outcomes[1].exit_code, 3);
  EXPECT_EQ(outcomes[1].message, "mbtfm: error: broken");
  EXPECT_EQ(outcomes[2].exit_code, 128 + 9);
  files::write_text(folder / "a/run.log", "My notes of Monday\n");  // a person's
  const auto again = run_batch({cells[0], cells[2]},
                               {.program = folder / "mbtfm", .run = {.stage_folder = folder / "bin", .version = "1"}});
  EXPECT_EQ(again[0].exit_code, exit_code::kOutput);
  EXPECT_TRUE(has_words(again[0].message, "give it another name"));
  EXPECT_EQ(files::read_text(folder / "a/run.log"), "My notes of Monday\n");
  EXPECT_EQ(again[1].exit_code, 128 + 9) << "a log of ours is replaced";
}

TEST(Batch, a_folder_without_cells_is_an_error) {
  const TemporaryFolder folder;
  EXPECT_THROW(find_cells(folder.path()), InputError);
}

TEST(Told, is_one_line_for_the_stage_and_names_effects_that_are_on_unasked) {
  StageResult result{.stage = "fit",
                     .status = {StageState::must_run, "not run yet"},
                     .was_run = true,
                     .seconds = 2.34,
                     .report = StageReport{}};
  result.report->summary = "20 tensions";
  const auto effect = [](EffectKind kind, Switch setting, bool is_on) {
    return Effect{.kind = kind, .setting = setting, .is_on = is_on, .why = "because"};
  };
  result.report->effects = {effect(EffectKind::finite_thickness, Switch::automatic, true),
                            effect(EffectKind::robust_loss, Switch::on, true),
                            effect(EffectKind::large_strain, Switch::automatic, false)};
  EXPECT_EQ(text_of(result, Detail::brief),
            "fit      20 tensions (2.3 s)\n  on as your data call for it: finite thickness");
  EXPECT_TRUE(has_words(text_of(result, Detail::all), "finite thickness", "robust loss", "large strain"));
  result.report->effects.clear();
  result.status.why = "its parameters have changed";
  EXPECT_EQ(text_of(result, Detail::brief), "fit      20 tensions (2.3 s; its parameters have changed)");
}

TEST(Told, events_are_json_objects_a_line) {
  StageResult result{
      .stage = "track", .status = {StageState::must_run, "not run yet"}, .was_run = true, .report = StageReport{}};
  result.report->summary = "two\nlines and \"quotes\"";
  result.report->findings = {{.id = "nothing-moves", .severity = Severity::caution, .text = "Nothing moves."}};
  std::istringstream lines(events_of(result));
  std::vector<nlohmann::json> events;
  for (std::string line; std::getline(lines, line);) events.push_back(nlohmann::json::parse(line));
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0]["event"], "stage");
  EXPECT_EQ(events[0]["summary"], result.report->summary);
  EXPECT_EQ(events[1]["event"], "finding");
  EXPECT_EQ(events[1]["stage"], "track");
}

TEST_F(Runner, an_image_that_is_missing_is_answered_with_the_one_that_was_probably_meant) {
  const auto hint = [&](const std::string& there) {
    const fs::path folder = cell_ / "images";
    fs::remove_all(folder);
    fs::create_directory(folder);
    files::write_text(folder / there, "x");
    ImageNames names;
    const auto error = test::caught<InputError>([&] { resolve_image(folder, names, "actin"); });
    return error ? error->hint : std::string("found");
  };
  EXPECT_EQ(hint("actin.tif"), "found");
  EXPECT_TRUE(has_words(hint("Actin.TIF"), "there is 'Actin.TIF': capitals count"));
  EXPECT_TRUE(has_words(hint("actin.png"), "there is 'actin.png': name it as"));
  EXPECT_TRUE(has_words(hint("day1.nd2"), "bfconvert 'day1.nd2' 'day1.ome.tif'"));
  EXPECT_TRUE(has_words(hint("notes.txt"), "put it there"));
}

}  // namespace
}  // namespace mbtfm::runner
