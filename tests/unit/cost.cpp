#include "pipeline/contract/errors.h"
#include "pipeline/cost/accuracy.h"
#include "pipeline/cost/study.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/text.h"
#include "pipeline/report/space_results.h"
#include "pipeline/runner/cell_stages.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::cost {
namespace {

using report::SpaceMap;

/// Two fibres of 3 and 4 nN; parts of each tension's error in nN.
ErrorBudget budget(double beads, std::optional<double> mesh) {
  ErrorBudget b;
  for (const auto& [id, tension_nN] : {std::pair{0, 0.06}, {1, 3.0}, {2, 4.0}})
    b.tensions.push_back({.fibre_id = id, .tension_nN = tension_nN, .parts_nN = {.beads = beads, .mesh = mesh}});
  return b;
}

TEST(Accuracy, is_relative_to_the_fibres_tensions) {
  const RelativeError error = relative_error(budget(0.3, 0.4));
  EXPECT_NEAR(error.total, std::sqrt(2 * (0.09 + 0.16)) / 5, 1e-12);
  EXPECT_NEAR(error.unavoidable, std::sqrt(2 * 0.09) / 5, 1e-12);
  EXPECT_TRUE(error.is_complete);
  EXPECT_FALSE(relative_error(budget(0.3, {})).is_complete);
}

TEST(Accuracy, what_no_computing_removes_adds_up_in_squares) {
  ErrorBudget b = budget(0.3, 0);
  for (TensionError& t : b.tensions) t.parts_nN.segmentation = 0.4;
  EXPECT_NEAR(relative_error(b).unavoidable, 0.5 * std::sqrt(2.0) / 5, 1e-12);
}

TEST(Accuracy, is_asked_for_as_a_share_or_in_per_cent) {
  EXPECT_DOUBLE_EQ(parse_accuracy("1%"), 0.01);
  EXPECT_DOUBLE_EQ(parse_accuracy("2.5 %"), 0.025);
  EXPECT_DOUBLE_EQ(parse_accuracy("0.05"), 0.05);
  for (const char* wrong : {"", "%", "0", "-1%", "100%", "one", "1%%", "1 nN"})
    EXPECT_THROW(parse_accuracy(wrong), UsageError) << wrong;
}

TEST(Accuracy, takes_the_cheapest_preset_that_suffices) {
  std::vector<std::string> tried;
  const auto run = [&](const std::string& preset) {
    tried.push_back(preset);
    return preset == "fast" ? budget(0.1, 0.5) : budget(0.1, 0.1);
  };
  const AccuracyOutcome outcome = reach_accuracy(0.05, run);
  EXPECT_TRUE(outcome.is_met);
  EXPECT_EQ(outcome.preset, "standard");
  EXPECT_EQ(tried, (std::vector<std::string>{"fast", "standard"}));
}

TEST(Accuracy, does_not_believe_a_single_mesh) {
  const auto run = [&](const std::string& preset) { return preset == "fast" ? budget(0.01, {}) : budget(0.01, 0.01); };
  EXPECT_EQ(reach_accuracy(0.5, run).preset, "standard");
}

TEST(Accuracy, stops_where_noise_makes_it_unreachable_and_computing_is_in_vain) {
  std::vector<std::string> tried;
  const auto run = [&](const std::string& preset) {
    tried.push_back(preset);
    return budget(0.5, preset == "fast" ? 0.4 : 0.05);
  };
  const AccuracyOutcome outcome = reach_accuracy(0.01, run);
  EXPECT_FALSE(outcome.is_met);
  EXPECT_EQ(tried.size(), 2u);
  EXPECT_TRUE(has_words(outcome.verdict, "no computing reaches that"));
  // 0.5 nN of noise in each of two tensions, of 3 and 4 nN
  EXPECT_TRUE(has_words(outcome.verdict, "the beads' noise alone makes 14 %"));
}

TEST(Accuracy, does_not_take_the_misfit_of_a_coarse_model_for_unavoidable) {
  const auto run = [](const std::string& preset) {
    ErrorBudget b = budget(0.5, 0.05);
    for (TensionError& t : b.tensions) t.parts_nN.model = preset == "fast" ? 0.8 : 0.1;
    return b;
  };
  EXPECT_EQ(reach_accuracy(0.01, run).preset, "standard");
}

Measurement measured(double cpu_seconds, double error) {
  return {.rung = {.knob = "knob", .value = "1"},
          .seconds = cpu_seconds,
          .cpu_seconds = cpu_seconds,
          .n_runs = 1,
          .error = error};
}

TEST(Front, is_what_no_other_choice_beats_in_both) {
  std::vector<Measurement> all = {measured(4, 0.2), measured(1, 0.5), measured(2, 0.6), measured(3, 0.2),
                                  measured(9, 0.1)};
  Measurement failed = measured(0.1, 0.01);
  failed.failure = "fit: exit code 3";
  all.push_back(failed);
  EXPECT_EQ(front_of(all), (std::vector<int>{1, 3, 4}));
  EXPECT_DOUBLE_EQ(distance_to_front(all, 0), 0.25);  // a quarter less time for the same error
  EXPECT_DOUBLE_EQ(distance_to_front(all, 1), 0);
  EXPECT_DOUBLE_EQ(distance_to_front(all, 2), 0.5);
}

TEST(CostStudy, of_several_cells_has_root_mean_squares_of_errors_and_means_of_times) {
  Study one{.reference = "the truth", .has_images = false, .measurements = {measured(2, 0.3), measured(1, 0.1)}};
  one.measurements[1].rung.value = "2";
  Study other = one;
  other.measurements[0] = measured(4, 0.4);
  other.measurements[1].n_runs = 0;  // there was no time for it in this cell
  const Study both = combined({one, other});
  EXPECT_NEAR(both.measurements[0].error, std::sqrt((0.09 + 0.16) / 2), 1e-12);
  EXPECT_DOUBLE_EQ(both.measurements[0].cpu_seconds, 3);
  EXPECT_EQ(front_of(both.measurements), (std::vector<int>{0}));
}

TEST(CostStudy, of_cells_with_fibres_and_in_space_together_is_refused) {
  const Study one{.reference = "the truth", .has_images = false, .measurements = {measured(2, 0.3)}};
  Study other = one;
  other.kind = CellKind::space;
  EXPECT_THROW(combined({one, other}), UsageError);
}

TEST(CostStudy, of_a_cell_in_space_shows_tractions_and_no_tensions) {
  Study study{.kind = CellKind::space,
              .reference = "the truth",
              .has_images = false,
              .measurements = {measured(4, 0.2), measured(1, 0.5)}};
  study.measurements[0].rung = {.knob = kAsItIs, .value = ""};
  study.measurements[1].rung = {.knob = "spacing_um", .value = "9"};
  const test::TemporaryFolder folder;
  write_study(folder.path(), study, "cell");
  const files::CsvTable table(folder / "cost.csv");
  EXPECT_EQ(table.number(1, "traction_error"), 0.5);
  EXPECT_TRUE(table.text(1, "tension_error").empty());
  EXPECT_TRUE(table.text(1, "n_fibres").empty());
  study.kind = CellKind::plane;
  write_study(folder / "flat", study, "cell");
  const files::CsvTable flat(folder / "flat/cost.csv");
  EXPECT_EQ(flat.number(1, "tension_error"), 0.5);
  EXPECT_TRUE(flat.text(1, "traction_error").empty());
  const std::string page = files::read_text(folder / "cost.md"), svg = files::read_text(folder / "cost.svg");
  EXPECT_TRUE(has_words(page, "error of tractions"));
  EXPECT_FALSE(has_words(page, "fibres"));
  EXPECT_FALSE(has_words(page, "tensions"));
  EXPECT_TRUE(has_words(svg, "error of the tractions, relative"));
}

/// Tractions of one kPa along x on a square lattice of `n` places a side.
SpaceMap even_map(int n, double step_um, double traction_kPa) {
  SpaceMap map;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      map.at_um.push_back({i * step_um, j * step_um, 0});
      map.traction_kPa.push_back({traction_kPa, 0, 0});
      map.area_um2.push_back(step_um * step_um);
    }
  return map;
}

TEST(SpaceMaps, of_the_same_field_on_other_lattices_do_not_differ) {
  const auto slope = [](SpaceMap map) {  // bilinear itself
    for (std::size_t k = 0; k < map.at_um.size(); ++k) map.traction_kPa[k].z = 0.01 * map.at_um[k].x * map.at_um[k].y;
    return map;
  };
  EXPECT_NEAR(difference(slope(even_map(5, 3, 1)), slope(even_map(13, 1, 1))), 0, 1e-12);
  EXPECT_NEAR(difference(slope(even_map(13, 1, 1)), slope(even_map(5, 3, 1))), 0, 1e-12);
}

TEST(SpaceMaps, differ_by_the_share_of_the_reference) {
  EXPECT_NEAR(difference(even_map(5, 3, 0.75), even_map(13, 1, 1)), 0.25, 1e-12);
  EXPECT_NEAR(difference(even_map(5, 3, 2), even_map(13, 1, 1)), 1, 1e-12);
  // beyond its last place, and where a place lacks, a map has no tractions
  EXPECT_NEAR(difference(even_map(3, 3, 1), even_map(13, 1, 1)), std::sqrt(1 - 49. / 169), 1e-12);
  SpaceMap holed = even_map(3, 6, 1);
  holed.traction_kPa[4] = {};
  SpaceMap lacks = even_map(3, 6, 1);
  lacks.at_um.erase(lacks.at_um.begin() + 4);
  lacks.traction_kPa.erase(lacks.traction_kPa.begin() + 4);
  EXPECT_NEAR(difference(lacks, even_map(13, 1, 1)), difference(holed, even_map(13, 1, 1)), 1e-12);
  EXPECT_GT(difference(lacks, even_map(13, 1, 1)), 0.1);
}

/// A truth on steps of 2 um under a slope of 60 degrees: twice the area.
TEST(SpaceMaps, of_the_truth_have_the_area_of_the_surface) {
  const test::TemporaryFolder folder;
  std::string text = "x_um,y_um,z_um,nx,ny,nz,tx_kPa,ty_kPa,tz_kPa\n";
  for (int k = 0; k < 6; ++k)
    text += std::to_string(2 * (k % 3)) + "," + std::to_string(2 * (k / 3)) + ",0,0.8660254,0,-0.5,0,0,3\n";
  std::filesystem::create_directories(folder / "truth");
  EXPECT_FALSE(report::has_space_truth(folder.path()));
  files::write_text(folder / "truth/surface_traction.csv", text);
  ASSERT_TRUE(report::has_space_truth(folder.path()));
  EXPECT_NEAR(report::true_space_map(folder.path()).total_force_nN, 6 * 8 * 3, 1e-9);
}

TEST(Ladder, in_space_turns_knobs_that_the_stage_has) {
  std::vector<Rung> rungs = ladder_in_space(Extent::whole, 6);
  for (const char* preset : {"fast", "high"}) EXPECT_FALSE(preset_named(preset).in_space.empty()) << preset;
  for (const Rung& rung : rungs) {
    for (const runner::Setting& setting : rung.settings)
      EXPECT_FALSE(runner::flags_of(runner::stages_in_space().back(), {setting}).empty())
          << setting.table << "." << setting.key;
    const std::string group = group_of(rung.knob, CellKind::space);
    EXPECT_TRUE(std::ranges::count(groups_of(CellKind::space), group) == 1) << rung.knob;
  }
  const auto coarse = std::ranges::find_if(rungs, [](const Rung& r) { return r.knob == "spacing_um"; });
  EXPECT_EQ(coarse->settings.front().value, "12");
}

/// A rung whose settings no stage has would measure the default once more.
TEST(Ladder, turns_knobs_that_a_stage_has) {
  for (const Rung& rung : ladder(Extent::whole))
    for (const runner::Setting& setting : rung.settings) {
      const bool is_known = std::any_of(runner::stages().begin(), runner::stages().end(),
                                        [&](const auto& stage) { return !runner::flags_of(stage, {setting}).empty(); });
      EXPECT_TRUE(is_known) << setting.table << "." << setting.key;
    }
}

TEST(Settings, of_the_cell_win) {
  const test::TemporaryFolder folder;
  const auto toml = folder.path() / "cell.toml";
  std::ofstream(toml) << "[fit]\nn_meshes = 5\n";
  const auto left = runner::unset_in(toml, preset_named("high").settings);
  EXPECT_EQ(left.size(), preset_named("high").settings.size() - 1);
  for (const runner::Setting& setting : left) EXPECT_NE(setting.key, "n_meshes");
}

TEST(Settings, reach_the_stages_that_have_them) {
  for (const runner::Stage& stage : runner::stages()) {
    const auto flags = runner::flags_of(stage, {{"network", "edge_length_um", "1"}});
    EXPECT_EQ(flags.empty(), stage.name == "segment" || stage.name == "track") << stage.name;
  }
}

TEST(Settings, that_are_set_have_a_table_a_key_and_a_value) {
  const runner::Setting gel = runner::parse_setting("gel.youngs_modulus_kPa=4");
  EXPECT_EQ(gel.table + " " + gel.key + " " + gel.value, "gel youngs_modulus_kPa 4");
  EXPECT_EQ(runner::parse_setting("pixel_size_um=0.1").table, "");
  EXPECT_EQ(runner::parse_setting("track.x_column=a=b").value, "a=b");
  for (const char* list : {"adhesion_rim_level=0.3,0.5 adhesion_seed_noise=4,5", "0.1,.5", "a,b,"})
    EXPECT_EQ(runner::parse_setting(std::string("segment.contact_sheet=") + list).value, list) << "commas in a value";
  EXPECT_THROW(runner::parse_setting("gel.youngs_modulus_kPa=4,gel.poisson_ratio=0.4"), UsageError);
  for (const char* text :
       {"gel.youngs_modulus_kPa", "=4", "gel.=4", "gel.youngs_modulus_kPa=", "jel.youngs_modulus_kPa=4"})
    EXPECT_THROW(runner::parse_setting(text), UsageError) << text;
  const auto both = runner::with({{"fit", "n_meshes", "5"}, {"fit", "seed", "1"}}, {{"fit", "n_meshes", "2"}});
  EXPECT_EQ(both.size(), 2u);
  EXPECT_EQ(both.back().value, "2");
}

TEST(Presets, the_standard_one_is_the_defaults) {
  EXPECT_TRUE(preset_named("standard").settings.empty());
  EXPECT_THROW(preset_named("quick"), UsageError);
}

}  // namespace
}  // namespace mbtfm::cost
