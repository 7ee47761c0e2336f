#include "pipeline/contract/errors.h"
#include "pipeline/statistics/analysis.h"
#include "pipeline/statistics/drawing.h"
#include "pipeline/statistics/picture.h"
#include "pipeline/statistics/samples.h"
#include "pipeline/statistics/study_files.h"
#include "pipeline/statistics/summaries.h"
#include "tests/support/small_study.h"
#include "tests/support/tables.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::statistics {
namespace {

using test::row_with;

/// Two conditions of two finished cells each, one cell without a fit and one that did not converge.
struct FakeStudy {
  test::TemporaryFolder folder;
  FakeStudy() {
    for (const unsigned seed : {1u, 2u, 3u, 4u, 5u}) {
      const auto cell = folder / (seed % 2 == 1 ? "control" : "treated") / ("cell_" + std::to_string(seed));
      test::write_given_stages(cell, test::round_cell());
      test::write_invented_fit(cell, seed);
    }
    FitSummary fit = files::read_fit_summary(folder / "control/cell_5/4_fit/fit.json");
    fit.converged = false;
    files::write_fit_summary(folder / "control/cell_5/4_fit/fit.json", fit);
    test::write_given_stages(folder / "treated/cell_6", test::round_cell());
  }
  /// @param table  text of study.csv; empty: none
  Study read(const StudyParameters& parameters = {}, const std::string& table = {}) const {
    if (!table.empty()) files::write_text(folder / "study.csv", table);
    return read_study(folder.path(), parameters, table.empty() ? std::optional<Path>() : folder / "study.csv", 2);
  }
};

bool says(const Analysis& analysis, const char* what) {
  return std::ranges::any_of(analysis.warnings, [&](const std::string& w) { return w.find(what) != w.npos; });
}

std::string reason_of(const Study& study, const std::string& cell) {
  for (const LeftOutCell& c : study.left_out)
    if (c.name == cell) return c.reason;
  return {};
}

TEST(Study, leaves_out_cells_with_a_reason_that_the_table_keeps) {
  const FakeStudy fake;
  const Study study = fake.read();
  EXPECT_EQ(study.cells.size(), 4u);
  EXPECT_EQ(reason_of(study, "treated/cell_6").substr(0, 6), "no fit");
  EXPECT_EQ(reason_of(study, "control/cell_5"), "the fit did not converge");
  EXPECT_EQ(fake.read({.with_not_converged = true}).cells.size(), 5u);
  const files::CsvTable cells(tables_of(study, analyse(study, {}))[0].second, "cells.csv");
  ASSERT_EQ(cells.n_rows(), 6);
  EXPECT_EQ(cells.text(4, "cell"), "control/cell_5");
  EXPECT_EQ(cells.text(4, "included"), "FALSE");
  EXPECT_EQ(cells.text(4, "reason"), "the fit did not converge");
}

TEST(Study, obeys_the_review_of_cells_and_of_their_present_fibres) {
  const FakeStudy fake;
  const auto review = [&](const std::string& rows) {
    files::write_text(fake.folder / "review.csv", "cell,fibre_id,verdict,note,segmentation\n" + rows);
    return fake.read();
  };
  const std::string page = review_html(fake.read(), fake.folder / "statistics"), mark = "data-segmentation=\"";
  const std::string segmentation = page.substr(page.find(mark) + mark.size(), 12);
  EXPECT_NE(page.find("data-cell=\"control/cell_1\""), page.npos);
  const int fibre = fake.read().cells.front().cell.fibres.front().fibre_id;
  const auto n_directions = [&](const StudyCell& cell) {
    return std::ranges::count(cell.directions, std::optional(fibre), &Direction::fibre_id);
  };
  EXPECT_GT(n_directions(fake.read().cells.front()), 0);
  const std::string of_fibre = "control/cell_1," + std::to_string(fibre) + ",left out,,";

  const Study study = review("control/cell_3,,left out,\"out of focus, twice\",\n" + of_fibre + segmentation + "\n");
  EXPECT_EQ(reason_of(study, "control/cell_3"), "left out by review.csv: out of focus, twice");
  ASSERT_EQ(study.cells.front().name, "control/cell_1");
  EXPECT_EQ(tension_of(study.cells.front(), fibre), nullptr);
  EXPECT_EQ(n_directions(study.cells.front()), 0);
  EXPECT_NE(list_of_cells(study).find("TRUE,," + std::to_string(fibre) + "\n"), std::string::npos);
  EXPECT_NE(tension_of(study.cells.back(), fibre), nullptr);

  const Study of_other_fibres = review(of_fibre + "0123456789ab\n");
  EXPECT_NE(tension_of(of_other_fibres.cells.front(), fibre), nullptr);
  ASSERT_EQ(of_other_fibres.warnings.size(), 1u);
  EXPECT_NE(of_other_fibres.warnings.front().find("control/cell_1 was segmented again"), std::string::npos);

  EXPECT_THROW(review("control/cell_9,,left out,,\n"), InputError);
  EXPECT_THROW(review("control/cell_1,,maybe,,\n"), InputError);
}

TEST(Study, one_cell_a_condition_is_why_nothing_is_compared_and_a_condition_keeps_its_name) {
  const FakeStudy fake;
  const StudyParameters parameters{.condition_from = "folder"};
  const Study study =
      fake.read({.condition_from = "folder"}, "cell,exclude\ncell_1,\ncell_2,\ncell_3,x\ncell_4,x\ncell_5,x\n");
  std::string all;
  for (const Findings& findings : findings_of(analyse(study, parameters), parameters))
    for (const std::string& sentence : findings.sentences) all += sentence + "\n";
  EXPECT_TRUE(has_words(all,
                        "total force of cells differs between conditions cannot be said: each needs values of two "
                        "cells."));
  EXPECT_TRUE(has_words(all, "\ncontrol: the mean total force"));
  EXPECT_EQ(all.find("Control"), all.npos);
}

TEST(Study, a_copy_of_a_cell_is_no_further_cell_and_a_neighbour_in_the_same_picture_is) {
  const FakeStudy fake;
  const auto of_1 = fake.folder / "control/cell_1";
  std::filesystem::copy(of_1, fake.folder / "treated/again", std::filesystem::copy_options::recursive);
  std::filesystem::copy(of_1, fake.folder / "treated/beside", std::filesystem::copy_options::recursive);
  Polygon outline = files::read_cell(of_1 / "1_segment").outline_um;
  for (Vec2& p : outline) p.x += 60;
  files::write_outline(fake.folder / "treated/beside/1_segment/outline.csv", outline);
  // a crescent, whose vertices' mean lies outside of it
  const auto crescent = fake.folder / "treated/crescent";
  std::filesystem::copy(fake.folder / "treated/cell_2", crescent, std::filesystem::copy_options::recursive);
  const Polygon bow = {{0, 0}, {60, 0}, {60, 60}, {0, 60}, {0, 55}, {55, 55}, {55, 5}, {0, 5}};
  for (const auto& folder : {crescent, fake.folder / "treated/cell_2"})
    files::write_outline(folder / "1_segment/outline.csv", bow);
  const Study study = fake.read();
  EXPECT_EQ(study.cells.size(), 5u);
  EXPECT_EQ(reason_of(study, "treated/crescent").substr(0, 36), "the same cell as treated/cell_2: the");
  EXPECT_EQ(reason_of(study, "treated/again").substr(0, 36), "the same cell as control/cell_1: the");
  EXPECT_EQ(reason_of(study, "treated/beside"), "");
}

TEST(Study, conditions_come_from_a_folder_or_a_table) {
  const FakeStudy fake;
  const Study by_folder = fake.read({.condition_from = "folder"});
  EXPECT_EQ(by_folder.conditions, (std::vector<std::string>{"control", "treated"}));
  EXPECT_EQ(by_folder.cells[3].condition, 1);
  const Study by_table =
      fake.read({.condition_from = "drug"},
                "cell,drug,exclude\ncell_1,none,\ncontrol/cell_3,none,dividing\ncell_2,blebbistatin,\ncell_5,none,\n");
  EXPECT_EQ(by_table.conditions, (std::vector<std::string>{"blebbistatin", "none"}));
  EXPECT_EQ(reason_of(by_table, "control/cell_3"), "dividing");
  EXPECT_EQ(reason_of(by_table, "treated/cell_4"), "not in the table");
  const Study by_gel = fake.read({.condition_from = "gel"}, "cell,gel\ncell_1,10 kPa\ncell_2,2 kPa\n");
  EXPECT_EQ(by_gel.conditions, (std::vector<std::string>{"2 kPa", "10 kPa"}));
}

TEST(Study, a_column_called_condition_counts_without_being_asked_for) {
  const FakeStudy fake;
  const std::string table =
      "cell,condition,day\ncell_1,untreated,mon\ncell_2,drug,mon\ncell_3,untreated,tue\ncell_4,drug,tue\n";
  const Study study = fake.read({}, table);
  EXPECT_EQ(study.conditions, (std::vector<std::string>{"drug", "untreated"}));
  EXPECT_EQ(study.cells[0].replicate, "mon");
  EXPECT_EQ(study.cells[1].replicate, "tue");
  const Study ordered = fake.read({.conditions = "untreated , drug"}, table);
  EXPECT_EQ(ordered.conditions, (std::vector<std::string>{"untreated", "drug"}));
  EXPECT_EQ(ordered.cells[0].condition, 0);
  EXPECT_THROW(fake.read({.conditions = "control"}, table), UsageError);
}

TEST(Study, a_table_of_conditions_is_read_as_people_write_it) {
  const FakeStudy fake;
  const auto expected = fake.read({}, "cell,condition\ncell_1,ctrl\ncell_2,drug\ncell_3,ctrl\ncell_4,drug\n");
  for (const std::string table :
       {"cell,condition\ncell_1,ctrl\ncell_2,drug\n\ncell_3,ctrl\ncell_4,drug\n\n,\n,\n",
        "\xEF\xBB\xBFsep=;\r\ncell ;condition;;\r\ncell_1;ctrl ;;\r\ncell_2; "
        "drug;;\r\ncell_3;ctrl;;\r\ncell_4;drug;;\r\n;;;\r\n",
        "My study\nCell\tCondition\ncontrol\\cell_1\tctrl\n./treated/cell_2/\tdrug\ncell_3/\tctrl\n\"cell_4\"\tdrug",
        "cell,Treatment,remark\nCell_1,ctrl,\"two\nlines\"\nCELL_2,drug,\"a \"\"word\"\"\n\nmore\"\ncell_3,ctrl,5\" "
        "dish\ncell_4,drug,\n"}) {
    const Study study = fake.read({}, table);
    EXPECT_EQ(study.conditions, expected.conditions) << table;
    ASSERT_EQ(study.cells.size(), 4u) << table;
    EXPECT_TRUE(study.warnings.empty()) << table;
  }
  const auto hint = [&](const std::string& cell) {
    const std::string table = "cell,condition\ncell_1,ctrl\n" + cell + ",drug\ncell_3,ctrl\n";
    return test::thrown<InputError>([&] { fake.read({}, table); }).hint;
  };
  EXPECT_TRUE(has_words(hint("D:\\data\\treated\\cell_2"), "write 'treated/cell_2'"));
  EXPECT_TRUE(has_words(hint("treated/cell_2/actin.tif"), "write 'treated/cell_2'"));
  EXPECT_TRUE(has_words(hint("02. Jan"), "has no row yet", "dates"));
  EXPECT_TRUE(has_words(fake.read({}, "cell,colour\ncell_1,red\ncell_2,blue\n").warnings.at(0), "--condition-from"));
  EXPECT_THROW(fake.read({}, "name,condition\ncell_1,ctrl\n"), InputError);
  EXPECT_THROW(fake.read({}, "cell,condition\ncell_1,ctrl,more\n"), InputError);
  EXPECT_THROW(fake.read({}, "cell,condition\n,ctrl\n"), InputError);
}

TEST(Study, names_that_differ_in_capitals_are_one_condition_and_no_is_no_reason) {
  const FakeStudy fake;
  const Study study =
      fake.read({.conditions = "CTRL"},
                "cell,condition,exclude\ncell_1,ctrl,no\ncell_2,drug,0\ncell_3,Ctrl,FALSE\ncell_4,drug,yes\n");
  EXPECT_EQ(study.conditions, (std::vector<std::string>{"ctrl", "drug"}));
  EXPECT_EQ(study.cells.size(), 3u);
  EXPECT_EQ(reason_of(study, "treated/cell_4"), "yes");
  ASSERT_EQ(study.warnings.size(), 1u);
  EXPECT_TRUE(has_words(study.warnings[0], "ctrl and Ctrl"));
  for (const std::string table :
       {"Cell;Condition;Exclude?\ncell_1;a;nein\ncell_2;a;-\ncell_3;a;\ncell_4;a;out of focus\n",
        "cell,condition,excluded\ncell_1,a,\ncell_2,a,non\ncell_3,a,no\ncell_4,a,1\n",
        "cell,condition,include\ncell_1,a,yes\ncell_2,a,1\ncell_3,a,\ncell_4,a,no\n",
        "cell,condition\ncell_1,a\ncell_2,a\ncell_3,a\ncell_4,#N/A\n",
        "cell,condition\ncell_1,a\ncell_2,a\ncell_3,a\ncell_4,#REF!\n",
        "cell,condition,exclude\ncell_1,a,\ncell_2,a,\ncell_3,a,\ncell_4,a,?\n"}) {
    const Study some = fake.read({}, table);
    EXPECT_EQ(some.cells.size(), 3u) << table;
    EXPECT_FALSE(reason_of(some, "treated/cell_4").empty()) << table;
  }
  EXPECT_EQ(analyse(study, {}).warnings.front(), study.warnings.front());
}

TEST(Study, a_column_called_condition_that_nobody_filled_in_asks_for_nothing) {
  const FakeStudy fake;
  const Study study = fake.read({}, "cell,condition,day\ncell_1,,\ncell_2,,\n");
  EXPECT_EQ(study.conditions, std::vector<std::string>{""});
  EXPECT_EQ(study.cells.size(), 2u);
}

TEST(Study, cells_with_a_finding_that_excludes_are_left_out_with_it_as_the_reason) {
  const FakeStudy fake;
  files::write_text(fake.folder / "control/cell_1/run.json",
                    R"({"findings":[{"id":"cell-cut","severity":"caution","text":"cut"},)"
                    R"({"id":"saturated","severity":"note","text":"a little"}]})");
  EXPECT_EQ(fake.read({.exclude_findings = "saturated"}).cells.size(), 4u) << "a note is not open";
  const Study study = fake.read({.exclude_findings = "misfit, cell-cut"});
  EXPECT_EQ(study.cells.size(), 3u);
  EXPECT_EQ(reason_of(study, "control/cell_1"), "the finding cell-cut is open (stats.exclude_findings)");
  EXPECT_THROW(fake.read({.exclude_findings = "cell-cutt"}), UsageError);
}

TEST(Study, a_cell_that_a_finding_says_not_to_use_is_left_out_and_one_with_unknown_fibres_is_not) {
  const FakeStudy fake;
  const auto find = [&](const char* cell, const char* id) {
    files::write_text(fake.folder / cell / "run.json",
                      std::string("{\"findings\": [{\"id\": \"") + id +
                          "\", \"severity\": \"bad\", \"text\": \"so\", \"remedy\": \"\"}]}");
  };
  find("control/cell_1", "misfit");
  find("treated/cell_2", "not-identifiable");
  const Study study = fake.read();
  EXPECT_EQ(reason_of(study, "control/cell_1"), "not usable, as misfit says (stats.with_bad)");
  EXPECT_EQ(study.cells.size(), 3u);
  EXPECT_EQ(fake.read({.with_bad = true}).cells.size(), 4u);
}

TEST(Study, the_list_has_every_cell_and_its_reason_also_if_none_enters) {
  const FakeStudy fake;
  fs::create_directories(fake.folder / ".Trash/cell_9");
  files::write_text(fake.folder / ".Trash/cell_9/cell.toml", "");
  const auto list_of = [&] { return files::CsvTable(list_of_cells(fake.read({.list = true})), "list"); };
  EXPECT_EQ(list_of().n_rows(), 6);
  fs::create_directories(fake.folder / "treated/forgotten");
  for (const char* name : {"a.tif", "b.tif", "frames/t1.tif", "frames/t2.tif"}) {
    fs::create_directories((fake.folder / "treated/forgotten" / name).parent_path());
    files::write_text(fake.folder / "treated/forgotten" / name, "x");
  }
  for (const int i : {1, 3}) fs::remove(fake.folder / ("control/cell_" + std::to_string(i)) / "4_fit/fit.json");
  for (const int i : {2, 4}) fs::remove(fake.folder / ("treated/cell_" + std::to_string(i)) / "4_fit/fit.json");
  const files::CsvTable none = list_of();
  ASSERT_EQ(none.n_rows(), 7);
  for (int row = 0; row < 7; ++row) EXPECT_EQ(none.text(row, "included"), "FALSE");
  EXPECT_EQ(none.text(6, "cell"), "treated/forgotten");
  EXPECT_TRUE(has_words(none.text(6, "reason"), "mbtfm init"));
}

TEST(Study, what_cannot_be_assigned_is_an_error_that_says_so) {
  const FakeStudy fake;
  EXPECT_THROW(fake.read({.condition_from = "drug"}), UsageError);
  EXPECT_THROW(fake.read({.condition_from = "folder2"}), InputError);
  EXPECT_THROW(fake.read({.condition_from = "drug"}, "cell,dose\ncell_1,2\n"), InputError);
  EXPECT_THROW(fake.read({}, "cell\ncell_77\n"), InputError);
  EXPECT_THROW(fake.read({}, "cell\ncell_1\ncontrol/cell_1\n"), InputError);
  files::write_text(fake.folder / "study.csv", "cell\nx\n");
  EXPECT_THROW(notes_of({"a/x", "b/x"}, "", "", fake.folder / "study.csv"), InputError);
}

TEST(Study, a_folder_without_a_finished_cell_is_an_error) {
  const test::TemporaryFolder folder;
  test::write_given_stages(folder / "cell", test::round_cell());
  EXPECT_THROW(read_study(folder.path(), {}, {}, 1), InputError);
}

TEST(Study, where_no_cell_enters_each_reason_is_named) {
  const FakeStudy fake;
  const InputError error = test::thrown<InputError>(
      [&] { fake.read({}, "cell,exclude\ncell_1,blurred\ncell_2,blurred\ncell_3,dividing\n"); });
  EXPECT_TRUE(has_words(error.what(), "2: blurred, 1: dividing"));
}

TEST(Study, tensions_that_cannot_be_identified_do_not_enter) {
  const FakeStudy fake;
  Study study = fake.read();
  const auto all = measured_fibres(study).size();
  for (Tension& t : study.cells[0].tensions)
    if (t.fibre_id == 2) t.identifiable = false;
  EXPECT_EQ(measured_fibres(study).size(), all - 1);
  EXPECT_TRUE(says(analyse(study, {}), "could not be identified"));
}

TEST(Study, edge_and_unclassified_fibres_are_listed_and_compared_as_types_if_asked) {
  const FakeStudy fake;
  for (const int n_types : {3, 4, 5}) {
    const StudyParameters parameters{.primary_type = FibreType::unclassified, .fibre_types = n_types};
    Study study = fake.read(parameters);
    EXPECT_EQ(primary_choice(study, analyse(study, parameters), parameters).measure == nullptr, n_types < 5);
    const std::size_t n_ventral = sample_of(study, "tension_nN").of_group(0, 2).size();
    study.cells[0].cell.fibres[0].type = FibreType::edge;
    for (StudyCell& cell : study.cells) cell.cell.fibres[3].type = FibreType::unclassified;
    const Analysis analysis = analyse(study, parameters);
    const Sample& sample = analysis.tensions().sample;
    EXPECT_EQ(sample.values.size(), measured_fibres(study).size());
    EXPECT_EQ(sample.of_group(0, 2).size(), n_ventral - (n_types > 3 ? 1 : 0));
    EXPECT_EQ(n_types > 3 ? sample.of_group(0, 3).size() : 1u, 1u);
    EXPECT_EQ(std::ranges::count(analysis.tensions().summaries, "unclassified", &Summary::kind), 1);
    EXPECT_EQ(std::ranges::count(analysis.tensions().comparisons, "unclassified", &Comparison::group_b) > 0,
              n_types == 5);
    EXPECT_FALSE(primary_choice(study, analysis, parameters).measure == nullptr);
    const files::CsvTable cells(tables_of(study, analysis)[0].second, "cells.csv");
    EXPECT_EQ(cells.integer(0, "n_edge", 0) + cells.integer(0, "n_unclassified", 0), 2);
    const std::vector<Figure> figures = figures_of(study, analysis, parameters);
    const std::string page = study_html(study, analysis, figures, parameters, "statistics");
    EXPECT_TRUE(has_words(page, "1 edge fibre runs along", "4 fibres are unclassified"));
    EXPECT_EQ(has_words(page, "no test compares them"), n_types < 5);
  }
}

TEST(Study, adhesions_that_nobody_saw_do_not_enter) {
  const FakeStudy fake;
  Study study = fake.read();
  const std::size_t n = sample_of(study, "adhesion_force_nN").values.size();
  const double area_um2 = figures_of(study.cells[0]).adhesion_area_um2;
  Adhesion& a = study.cells[0].cell.adhesions[0];
  a.origin = AdhesionOrigin::anchor;
  study.cells[0].cell.adhesions[1].origin = AdhesionOrigin::candidate;
  EXPECT_EQ(sample_of(study, "adhesion_force_nN").values.size(), n - 2);
  EXPECT_EQ(sample_of(study, "adhesion_area_um2").values.size(), n - 2);
  EXPECT_LT(figures_of(study.cells[0]).adhesion_area_um2, area_um2);
  for (StudyCell& c : study.cells)
    for (Adhesion& all : c.cell.adhesions) all.origin = AdhesionOrigin::candidate;
  EXPECT_NO_THROW(tables_of(study, analyse(study, {})));
}

/// A cell whose fibres and network pull the same adhesions: the fit's share of the network may be anything.
TEST(Study, forces_of_a_network_that_cannot_be_identified_do_not_enter) {
  Study study = test::simulated_study({.n_cells = 4});
  study.cells[0].tensions[0].identifiable = false;
  study.cells[0].fit.network_force_nN = 3e5;
  study.cells[0].fit.fibre_force_nN = -3e5;
  const Analysis analysis = analyse(study, {.bootstrap_draws = 100});
  for (const Measure* m : analysis.of_cells(CellKind::plane))
    if (m->sample.each == Observed::cells)
      EXPECT_EQ(m->sample.values.size(), m->sample.column == "total_force_nN" ? 4u : 3u) << m->sample.column;
  for (const Correlation& c : analysis.correlations)
    EXPECT_EQ(c.x.size(), c.force == "fibre_force_nN" || c.force == "network_force_nN" ? 3u : 4u) << c.force;
  const files::CsvTable cells(tables_of(study, analysis)[0].second, "cells.csv");
  EXPECT_FALSE(cells.optional_number(0, "network_force_nN"));
  EXPECT_TRUE(cells.optional_number(1, "network_force_nN"));
  EXPECT_TRUE(says(analysis, "network's tension of 1 of 4 cells"));
}

TEST(Study, four_cells_have_no_line_and_five_have_one) {
  for (const int n_cells : {4, 5}) {
    const Study study = test::simulated_study({.n_cells = n_cells});
    const Analysis analysis = analyse(study, {.bootstrap_draws = 100});
    ASSERT_FALSE(analysis.correlations.empty());
    for (const auto& [file, table] : tables_of(study, analysis)) {
      if (!file.ends_with("correlations.csv")) continue;
      const files::CsvTable correlations(table, file);
      int row = 0;
      while (correlations.text(row, "size") != "n_fibres") ++row;
      for (const char* column : {"slope", "slope_error", "slope_low", "slope_high", "r"})
        EXPECT_EQ(correlations.optional_number(row, column).has_value(), n_cells == 5) << column;
    }
  }
}

TEST(Study, the_error_of_a_tension_is_that_of_the_side_zero_does_not_cut) {
  EXPECT_NEAR(*standard_error_nN({.tension_nN = 4, .low_nN = 2, .high_nN = 6}), 4 / (2 * 1.96), 1e-4);
  EXPECT_NEAR(*standard_error_nN({.tension_nN = 1, .low_nN = 0, .high_nN = 5}), 4 / 1.96, 1e-3);
  EXPECT_FALSE(standard_error_nN({.tension_nN = 1}));
}

TEST(Study, holes_are_not_of_a_cells_area) {
  StudyCell cell{.name = "a", .condition = 0, .cell = test::round_cell()};
  const double whole = figures_of(cell).cell_area_um2;
  cell.cell.holes_um = {{{30, 30}, {32, 30}, {32, 33}, {30, 33}}};
  EXPECT_NEAR(figures_of(cell).cell_area_um2, whole - 6, 1e-9);
}

TEST(Study, cells_drawn_as_they_are_have_their_own_mean_and_median) {
  const Study study = test::simulated_study({.n_cells = 7, .seed = 3});
  const std::vector<CellWeights> draws(200, CellWeights(study.cells.size(), 1));
  int n_odd = 0;
  for (const Summary& s : summarise(sample_of(study, "tension_nN"), {}, draws)) {
    EXPECT_NEAR(s.mean_interval->low, s.plain.mean, 1e-9);
    EXPECT_NEAR(s.mean_interval->high, s.plain.mean, 1e-9);
    if (s.n % 2 == 0) continue;  // the median of a draw is one of its values
    ++n_odd;
    EXPECT_EQ(s.median_interval->low, s.plain.median);
    EXPECT_EQ(s.median_interval->high, s.plain.median);
  }
  EXPECT_GE(n_odd, 1);
}

TEST(Study, every_adhesion_is_in_one_bin_of_its_area) {
  Study study;
  study.conditions = {""};
  for (int c = 0; c < 2; ++c) {
    StudyCell cell{.name = std::to_string(c), .condition = 0, .cell = test::round_cell()};
    cell.cell.adhesions.clear();
    for (int i = 1; i <= 100; ++i) {
      cell.cell.adhesions.emplace_back();
      cell.cell.adhesions.back().adhesion_id = i;
      cell.cell.adhesions.back().area_um2 = 0.1 * (1 + i % 37);
      cell.forces.push_back({.adhesion_id = i, .force_nN = {1, 0}, .connected = i % 2 == 0});
    }
    study.cells.push_back(std::move(cell));
  }
  int n = 0;
  for (const AreaBin& bin : bin_by_area(study, draw_cells(study, {}))) {
    n += bin.n_adhesions;
    EXPECT_LE(bin.low_um2, bin.mean_area_um2);
    EXPECT_LE(bin.mean_area_um2, bin.high_um2);
  }
  EXPECT_EQ(n, 200);
}

/// A cell of two adhesions that face each other, a straight fibre between them, beads that move inwards.
TEST(Directions, of_a_fibre_that_pulls_its_adhesions_are_zero) {
  Cell cell = test::round_cell();
  cell.adhesions.resize(2);
  for (int i = 0; i < 2; ++i) {
    cell.adhesions[i].position_um = {10.0 + 20 * i, 30};
    cell.adhesions[i].angle_rad = 0;
  }
  cell.fibres.resize(1);
  cell.fibres[0] = {.fibre_id = 1,
                    .type = FibreType::ventral,
                    .width_um = 0.6,
                    .start_adhesion_id = 1,
                    .end_adhesion_id = 2,
                    .points_um = {{10, 30}, {30, 30}}};
  DisplacementField measured, across;
  for (const double x : {10.0, 10.5, 30.0, 29.5}) {
    measured.push_back({.position_um = {x, 30.1}, .displacement_um = {x < 20 ? 0.5 : -0.5, 0}});
    across.push_back({.position_um = {x, 30.1}, .displacement_um = {0, 0.1}});
  }
  const Displacements fields{measured, measured, across, 0.01, 1.5};
  const auto list = directions_of(cell, fields);
  EXPECT_EQ(list.size(), 8u);  // each of four relations at each end
  for (const Direction& d : list)
    EXPECT_NEAR(d.angle_deg, d.relation == Relation::without_fibres_measured ? 90 : 0, 1e-9) << name_of(d.relation);
  Displacements noisy = fields;
  noisy.noise_um = 1;  // the displacement of some beads then says nothing of its direction
  EXPECT_EQ(directions_of(cell, noisy).size(), 2u);
}

TEST(Analysis, tests_are_made_by_fibre_and_by_cell_between_types_and_conditions) {
  const Study study = test::simulated_study({.n_cells = 24, .n_conditions = 2, .condition_effect_nN = 2});
  const Analysis analysis = analyse(study, {.bootstrap_draws = 200});
  std::set<std::string> tests;
  for (const Comparison& t : analysis.tensions().comparisons) {
    tests.insert(name_of(t.question) + std::string(", ") + name_of(t.test) + ", " + name_of(t.unit));
    EXPECT_GE(t.p_value, 0);
    EXPECT_LE(t.p_value, 1);
    EXPECT_GE(t.p_holm.value_or(1), t.p_value);
    EXPECT_TRUE(!t.group_b.empty() || t.question == Question::between_kinds);  // two conditions need no omnibus test
  }
  // between kinds: Kruskal-Wallis, Mann-Whitney by fibre and by median; clustered; mixed. Between conditions: no K-W
  EXPECT_EQ(tests.size(), 6u + 4u);
  EXPECT_EQ(analysis.tensions().summaries.size(), 6u);
  EXPECT_EQ(analysis.correlations.size(), 2u * (12u + 3u));
}

/// Truth: dorsal 1.5, arcs 2.5, ventral 4 nN, and 2 more under the second condition.
TEST(Analysis, the_mixed_model_finds_the_means_and_the_scatter_behind_the_errors) {
  const test::StudySettings settings{.n_cells = 200, .n_conditions = 2, .condition_effect_nN = 2, .error_nN = 1};
  const Analysis analysis = analyse(test::simulated_study(settings), {.bootstrap_draws = 200});
  for (const Summary& s : analysis.tensions().summaries) {
    const double truth = (s.kind == "dorsal" ? 1.5
                          : s.kind == "arc"  ? 2.5
                                             : 4) +
                         (s.condition == "b" ? 2 : 0) + settings.offset_nN;
    // four standard errors: one in 16 000
    EXPECT_NEAR(s.model->estimate, truth, 4 * s.model->standard_error) << s.condition << s.kind;
    const double scatter =
        std::sqrt(settings.cell_sd_nN * settings.cell_sd_nN + settings.fibre_sd_nN * settings.fibre_sd_nN);
    EXPECT_NEAR(s.without_error->standard_deviation, scatter, 0.15 * scatter)
        << s.kind;  // 100 cells' sd: 7 %, two of it
  }
}

/// Conditions that do not differ, cells that do. docs/statistics.md has the same with 1 500 studies.
TEST(Analysis, tests_by_cell_hold_their_level_where_those_by_fibre_do_not) {
  constexpr int kStudies = 200;
  std::map<std::string, int> n_rejected;
  for (int i = 0; i < kStudies; ++i) {
    const Sample sample = sample_of(test::simulated_study({.n_cells = 12,
                                                           .n_conditions = 2,
                                                           .types_differ = false,
                                                           .type_in_cell_sd_nN = 0.7,
                                                           .seed = 100 + static_cast<std::uint64_t>(i)}),
                                    "tension_nN");
    for (const Comparison& c : compare(sample, model_of(sample).model))
      if (c.question == Question::between_conditions && c.within == "ventral" && c.p_value < 0.05)
        ++n_rejected[name_of(c.test) + std::string(", ") + name_of(c.unit)];
  }
  // 5 % of 200 are 10, with a standard deviation of 3.1; four of it
  EXPECT_LE(n_rejected["mixed model, cell"], 22);
  EXPECT_LE(n_rejected["clustered rank sum, cell"], 22);
  EXPECT_LE(n_rejected["Mann-Whitney, cell median"], 22);
  EXPECT_GT(n_rejected["Mann-Whitney, observation"], 30);
}

TEST(Analysis, the_same_bytes_for_the_same_seed) {
  const Study study = test::simulated_study({.n_cells = 12});
  const auto once = tables_of(study, analyse(study, {.bootstrap_draws = 200}));
  EXPECT_EQ(once, tables_of(study, analyse(study, {.bootstrap_draws = 200})));
  const FakeStudy fake;
  const Study one = read_study(fake.folder.path(), {}, {}, 1), four = read_study(fake.folder.path(), {}, {}, 4);
  EXPECT_EQ(tables_of(one, analyse(one, {})), tables_of(four, analyse(four, {})));
}

TEST(Analysis, a_single_cell_of_a_condition_is_warned_of) {
  Study study = test::simulated_study({.n_cells = 5, .n_conditions = 2});
  for (StudyCell& c : study.cells) c.condition = &c == &study.cells[0] ? 0 : 1;
  const auto warnings = analyse(study, {.bootstrap_draws = 100}).warnings;
  EXPECT_EQ(warnings.front().substr(0, 16), "a: 1 cell only: ");
}

TEST(Primary, compares_each_condition_with_the_reference_by_the_test_that_was_named) {
  const Study study = test::simulated_study({.n_cells = 24, .n_conditions = 3, .condition_effect_nN = 3, .seed = 4});
  StudyParameters parameters{.bootstrap_draws = 100};
  const Analysis analysis = analyse(study, parameters);
  const Primary& primary = analysis.primary;
  ASSERT_EQ(primary.differences.size(), 2u);
  EXPECT_EQ(primary.reference, "a");
  EXPECT_EQ(primary.differences[1].condition, "c");
  EXPECT_GT(primary.differences[0].difference.low, 0);
  EXPECT_NEAR(primary.differences[1].difference.estimate, 6, 3 * primary.differences[1].difference.standard_error);
  // the same numbers as among all tests
  for (const Comparison& c : analysis.tensions().comparisons) {
    if (c.test != statistics::Test::mixed_model || c.within != "ventral" || c.group_a != "b" || c.group_b != "a")
      continue;
    EXPECT_NEAR(primary.differences[0].difference.estimate, c.effect, 1e-12);
    EXPECT_NEAR(primary.differences[0].difference.low, c.interval->low, 1e-9);
    EXPECT_NEAR(primary.differences[0].difference.p_value, c.p_value, 1e-9);
  }
  parameters.primary = PrimaryMeasure::total_force;
  EXPECT_EQ(analyse(study, parameters).primary.measure, "total force of cells");
}

TEST(Primary, with_replicates_compares_their_means_in_pairs) {
  Study study = test::simulated_study({.n_cells = 12, .n_conditions = 2, .seed = 9});
  for (std::size_t i = 0; i < study.cells.size(); ++i) study.cells[i].replicate = std::string(1, "xyz"[i % 3]);
  const Analysis analysis = analyse(study, {.bootstrap_draws = 100});
  ASSERT_EQ(analysis.primary.differences.size(), 1u);
  const PrimaryDifference& d = analysis.primary.differences[0];
  EXPECT_EQ(d.replicates, 3);
  EXPECT_EQ(d.difference.degrees, 2);
  // by hand: means of cells, of replicates, of their differences
  const Sample& sample = analysis.tensions().sample;
  std::map<std::pair<int, std::string>, std::vector<double>> cells_of;
  for (std::size_t i = 0; i < study.cells.size(); ++i) {
    std::vector<double> own;
    for (const Observation& o : sample.values)
      if (o.cell == static_cast<int>(i) && o.kind == 2) own.push_back(o.value);
    if (!own.empty()) cells_of[{study.cells[i].condition, study.cells[i].replicate}].push_back(describe(own).mean);
  }
  double sum = 0;
  for (const char* replicate : {"x", "y", "z"})
    sum += describe(cells_of.at({1, replicate})).mean - describe(cells_of.at({0, replicate})).mean;
  EXPECT_NEAR(d.difference.estimate, sum / 3, 1e-12);
  for (StudyCell& cell : study.cells) cell.replicate = "one day";
  EXPECT_FALSE(analyse(study, {.bootstrap_draws = 100}).primary.obstacle.empty());
}

TEST(Figures, are_drawn_into_pixels) {
  const test::TemporaryFolder folder;
  const Study study = test::simulated_study({.n_cells = 6});
  const StudyParameters parameters{.bootstrap_draws = 100};
  const Figure figure = figures_of(study, analyse(study, parameters), parameters).front();
  write_png(folder / "figure.png", svg_of(figure), 85, 300);
  const std::string bytes = files::read_text(folder / "figure.png");
  EXPECT_EQ(bytes.substr(1, 3), "PNG");
  const auto big_endian = [&](std::size_t at) {
    return (static_cast<unsigned char>(bytes[at + 2]) << 8) + static_cast<unsigned char>(bytes[at + 3]);
  };
  EXPECT_EQ(big_endian(16), std::lround(85 / 25.4 * 300));
  const std::size_t at = bytes.find("pHYs");
  ASSERT_NE(at, bytes.npos);
  EXPECT_EQ(big_endian(at + 4), std::lround(300 / 0.0254)) << "pixels in a metre";
  EXPECT_GT(bytes.size(), 10000u);  // an empty page of this size has some 4 kB
  EXPECT_THROW(write_png(folder / "nowhere/figure.png", svg_of(figure), 85, 300), OutputError);
  write_animation(folder / "moving.png", {svg_of(figure), svg_of(figure), svg_of(figure)});
  const std::string moving = files::read_text(folder / "moving.png");
  EXPECT_TRUE(has_words(moving, std::string("acTL\0\0\0\3", 8)));
  int n_frames = 0;
  for (std::size_t i = moving.find("fcTL"); i != moving.npos; i = moving.find("fcTL", i + 1)) ++n_frames;
  EXPECT_EQ(n_frames, 3);
  EXPECT_LT(moving.size(), 1.5 * static_cast<double>(moving.find("fdAT"))) << "frames that are alike take no room";
  write_pdf(folder / "figure.pdf", svg_of(figure), 85);
  write_pdf(folder / "again.pdf", svg_of(figure), 85);
  const std::string pdf = files::read_text(folder / "figure.pdf");
  EXPECT_EQ(pdf.substr(0, 5), "%PDF-");
  EXPECT_EQ(pdf, files::read_text(folder / "again.pdf"));
}

files::CsvTable table_of(const Study& study, const std::string& name) {
  const auto tables = tables_of(study, analyse(study, {}));
  const auto at = std::ranges::find_if(tables, [&](const auto& t) { return t.first == name; });
  return {at->second, name};
}

/// Written as folders and read again.
Study read_again(const Study& study, const test::TemporaryFolder& folder, const StudyParameters& parameters = {}) {
  for (const StudyCell& cell : study.cells) {
    const Path at = folder / study.conditions[cell.condition] / cell.name;
    if (cell.kind() == CellKind::sheet) test::write_finished_sheet(at, cell);
    if (cell.kind() == CellKind::space) test::write_finished_cell_in_space(at, cell);
    if (cell.kind() == CellKind::plane) test::write_finished_cell(at, cell);
  }
  StudyParameters by_folder = parameters;
  by_folder.condition_from = "folder";
  return read_study(folder.path(), by_folder, {}, 2);
}

std::string page_of(const Study& study, const Analysis& analysis) {
  return study_html(study, analysis, figures_of(study, analysis, {}), {}, study.folder);
}

void expect_no_word_of_fibres(const std::string& page) {
  for (const char* of_fibres : {"ibre type", "Stress-fibre", "transverse", "No tension", "Not drawn"})
    EXPECT_FALSE(has_words(page, of_fibres)) << of_fibres;
}

/// No figure is of cells of two kinds, and each quantity has a column of its own.
void expect_unmixed(const Study& study, const Analysis& analysis) {
  std::set<std::string> columns;
  for (const Measure& m : analysis.measures) {
    EXPECT_TRUE(columns.insert(m.sample.column).second) << m.sample.column << " is two quantities";
    for (const Observation& o : m.sample.values)
      EXPECT_EQ(study.cells[o.cell].kind(), m.sample.of_cells()) << m.sample.column;
  }
  for (const Correlation& c : analysis.correlations)
    for (const int cell : c.cells) EXPECT_EQ(study.cells[cell].kind(), CellKind::plane) << c.force;
}

const Sample* sample_named(const Analysis& analysis, const std::string& column) {
  const Measure* m = analysis.find(column);
  return m ? &m->sample : nullptr;
}

struct FigureOfCell {
  const char *column, *in_cells, *unit;
  std::function<double(const StudyCell&)> of;
  std::function<double(const StudyCell&)> sigma = {};
};

/// Samples and table hold the figures of the cells that were made, under their names, units and conditions.
void expect_figures(const Study& study, const Study& made, const std::vector<FigureOfCell>& all) {
  const Analysis analysis = analyse(study, {});
  const files::CsvTable cells = table_of(study, "cells.csv");
  for (const FigureOfCell& e : all) {
    const Sample* sample = sample_named(analysis, e.column);
    ASSERT_NE(sample, nullptr) << e.column;
    EXPECT_EQ(sample->unit, e.unit) << e.column;
    ASSERT_EQ(sample->values.size(), study.cells.size()) << e.column;
    for (const Observation& o : sample->values) {
      const std::string name = study.cells[o.cell].name;
      const auto at = std::ranges::find_if(made.cells, [&](const StudyCell& c) { return name.ends_with(c.name); });
      ASSERT_NE(at, made.cells.end()) << name;
      const double value = e.of(*at);
      EXPECT_NEAR(o.value, value, 1e-7 * value) << e.column << ": nine digits";
      EXPECT_EQ(o.group, at->condition) << e.column;
      if (e.sigma) EXPECT_NEAR(std::sqrt(o.error_variance), e.sigma(*at), 1e-6 * value) << e.column;
      const int row = row_with(cells, {{"cell", name}});
      EXPECT_EQ(cells.text(row, "condition"), study.conditions[at->condition]);
      if (*e.in_cells) EXPECT_NEAR(cells.number(row, e.in_cells), value, 1e-5 * value) << e.column << ": six digits";
    }
  }
}

TEST(Study, the_sentence_of_the_primary_comparison_has_the_signs_of_its_chart) {
  const Primary primary{.measure = "tension of ventral fibres", .unit = "nN", .reference = "control", .test = {}};
  const PrimaryDifference less{.condition = "drug", .difference = {.estimate = -1.4, .low = -4.4, .high = 1.6}};
  EXPECT_TRUE(has_words(sentence_of(primary, less), "drug minus control: −1.4 nN", "[95 % CI −4.4 to 1.6 nN]"));
}

TEST(Study, conditions_and_types_of_fibres_share_no_colour) {
  for (int condition = 0; condition < 8; ++condition)
    for (const FibreType type : kFibreTypes) EXPECT_NE(condition_colour(condition), charts::colour_of(type));
}

TEST(Study, relates_forces_of_the_usual_method_to_size_where_they_are_known) {
  Study study = test::simulated_study({.n_cells = 6, .n_conditions = 1});
  for (StudyCell& cell : study.cells) cell.fttc_force_nN = 2 * figures_of(cell).cell_area_um2;
  study.cells[0].fttc_force_nN.reset();
  const auto all = correlate_forces(study, draw_cells(study, {.bootstrap_draws = 100}));
  const auto found = std::ranges::find_if(
      all, [](const Correlation& c) { return c.force == "fttc_force_nN" && c.size == "cell_area_um2"; });
  ASSERT_NE(found, all.end());
  EXPECT_EQ(found->x.size(), 5u);
  ASSERT_TRUE(found->line);
  EXPECT_NEAR(found->line->slope, 2, 1e-12);
}

using SheetStudy = test::InFolder;

TEST_F(SheetStudy, has_what_the_fit_found_and_compares_the_contraction_first) {
  const Study made = test::simulated_sheets({.condition_effect_nN_per_um = 1});
  const Study study = read_again(made, folder);
  ASSERT_EQ(study.cells.size(), 12u);
  EXPECT_EQ(n_of_kind(study, CellKind::sheet), 12);
  const Analysis analysis = analyse(study, {});
  EXPECT_EQ(analysis.primary.measure, "contraction of sheets");
  ASSERT_EQ(analysis.primary.differences.size(), 1u) << analysis.primary.obstacle;
  const Contrast& found = analysis.primary.differences[0].difference;
  // two conditions of six: scatter and error of 0.22 make 0.13 of the difference; four of these
  EXPECT_NEAR(found.estimate, 1, 0.52);
  EXPECT_LT(analysis.primary.differences[0].p_holm, 0.01);
  for (const char* column : {"contraction_nN_per_um", "mean_tension_nN_per_um", "sheet_force_nN", "strain_energy_fJ",
                             "sheet_area_um2", "stiffness_nN_per_um", "contraction_over_stiffness"}) {
    const Sample* sample = sample_named(analysis, column);
    ASSERT_NE(sample, nullptr) << column;
    EXPECT_EQ(sample->values.size(), 12u) << column;
  }
  EXPECT_EQ(sample_named(analysis, "line_tension_nN"), nullptr) << "nobody asked for it";
  EXPECT_EQ(sample_named(analysis, "tension_nN"), nullptr) << "there is no fibre";
  for (const auto& [name, text] : tables_of(study, analysis)) EXPECT_FALSE(text.empty()) << name;
  const std::string page = page_of(study, analysis);
  EXPECT_TRUE(has_words(page, "<h1>Contraction of 12 sheets</h1>"));
  expect_no_word_of_fibres(page);
}

TEST_F(SheetStudy, its_figures_are_those_of_each_sheet_under_their_names_units_and_conditions) {
  const Study study = test::simulated_sheets({.condition_effect_nN_per_um = 1});
  using S = StudyCell;
  expect_figures(study, study,
                 {{"contraction_nN_per_um", "contraction_nN_per_um", "nN/µm",
                   [](const S& s) { return s.sheet->estimates[0].value; }},
                  {"mean_tension_nN_per_um", "mean_tension_nN_per_um", "nN/µm",
                   [](const S& s) { return s.sheet->mean_tension_nN_per_um; }},
                  {"sheet_force_nN", "sheet_force_nN", "nN", [](const S& s) { return s.sheet->total_force_nN; }},
                  {"strain_energy_fJ", "strain_energy_fJ", "fJ", [](const S& s) { return *s.sheet->strain_energy_fJ; }},
                  {"sheet_area_um2", "cell_area_um2", "µm²", [](const S& s) { return s.sheet->area_um2; }},
                  {"stiffness_nN_per_um", "", "nN/µm", [](const S& s) { return s.sheet->estimates[1].value; }}});
}

/// Of twelve sheets of 2 nN/um one says 22 ± 20: the plain mean is off by 1.7.
TEST_F(SheetStudy, a_sheet_that_the_beads_hardly_show_counts_little_in_the_mean) {
  Study study = test::simulated_sheets({.n_conditions = 1});
  SheetEstimate& poor = study.cells[3].sheet->estimates[0];
  poor.value += 20;
  poor.parts.beads = 20;
  poor.sigma = 20;
  poor.low = poor.value - 39;
  poor.high = poor.value + 39;
  const Sample sample = sample_of(study, "contraction_nN_per_um");
  const Contrast mean = contrast_of(model_of(sample).model->fit, Eigen::VectorXd::Ones(1));
  EXPECT_NEAR(mean.estimate, 2, 0.3) << "scatter and error of 0.22 make 0.07 of the mean of eleven; four of these";
  EXPECT_LT(mean.standard_error, 0.15);
}

/// The error of the gel's modulus is larger than all scatter here. Counted as one of each sheet, it would hide the
/// difference: nearly all intervals would hold the truth, and many no difference, too.
TEST_F(SheetStudy, intervals_of_the_difference_hold_it_and_leave_out_what_sheets_share) {
  constexpr int kStudies = 200;
  int n_held = 0, n_found = 0;
  for (int seed = 1; seed <= kStudies; ++seed) {
    const Study study =
        test::simulated_sheets({.condition_effect_nN_per_um = -0.6, .seed = static_cast<std::uint64_t>(seed)});
    const Sample sample = sample_of(study, "contraction_nN_per_um");
    ASSERT_EQ(sample.column, "contraction_nN_per_um");
    const SampleModel model = *model_of(sample).model;
    const Contrast c = contrast_of(model.fit, Eigen::Vector2d(-1, 1));
    n_held += c.low <= -0.6 && -0.6 <= c.high ? 1 : 0;
    n_found += c.high < 0 ? 1 : 0;
  }
  // 95 % of 200 are 190 ± 3.1: three standard deviations of the count
  EXPECT_GE(n_held, 181);
  EXPECT_LE(n_held, 199);
  // -0.6 is 4.6 standard errors of 0.13, with ten degrees of freedom: found in 98 % and more
  EXPECT_GE(n_found, 190);
}

TEST_F(SheetStudy, other_primary_comparisons_are_made_if_they_are_asked_for) {
  const Study study = test::simulated_sheets({.condition_effect_nN_per_um = 1});
  EXPECT_EQ(analyse(study, {.primary = PrimaryMeasure::mean_tension}).primary.measure, "mean tension of sheets");
  EXPECT_EQ(analyse(study, {.primary = PrimaryMeasure::total_force}).primary.measure, "total force of sheets");
  const Primary of_fibres = analyse(study, {.primary = PrimaryMeasure::tension}).primary;
  EXPECT_EQ(of_fibres.measure, "tension of ventral fibres");
  EXPECT_TRUE(of_fibres.differences.empty());
  EXPECT_FALSE(of_fibres.obstacle.empty());
  EXPECT_EQ(analyse(test::simulated_study({.n_conditions = 2}), {}).primary.measure, "tension of ventral fibres");
}

TEST_F(SheetStudy, takes_no_value_that_was_given_or_that_the_beads_limit_to_one_side) {
  Study made = test::simulated_sheets({.n_sheets = 6, .n_conditions = 2});
  SheetEstimate& given = made.cells[0].sheet->estimates[1];
  given.low = given.high = given.value;
  given.sigma = 0;
  SheetEstimate& open = made.cells[1].sheet->estimates[1];
  open.high = open.sigma = std::nullopt;
  open.identifiable = false;
  const Study study = read_again(made, folder);
  const Analysis analysis = analyse(study, {});
  EXPECT_EQ(sample_named(analysis, "stiffness_nN_per_um")->values.size(), 4u);
  EXPECT_EQ(sample_named(analysis, "contraction_nN_per_um")->values.size(), 6u);
  EXPECT_TRUE(says(analysis, "limit the stiffness of sheets to one side only, or not at all, in 1 of 5 fits"));
  const files::CsvTable sheets = table_of(study, "sheets.csv");
  EXPECT_EQ(sheets.text(row_with(sheets, {{"cell", "a/sheet_0"}, {"quantity", "stiffness_nN_per_um"}}), "enters"),
            "FALSE");
  const int row = row_with(sheets, {{"cell", "a/sheet_0"}, {"quantity", "contraction_nN_per_um"}});
  EXPECT_EQ(sheets.text(row, "enters"), "TRUE");
  EXPECT_NEAR(sheets.number(row, "sigma"), 0.1, 1e-6) << "without the part of the gel";
}

/// Edges and insides are kinds, which are compared within sheets; labels of cells are not the same from sheet to sheet.
TEST_F(SheetStudy, parts_of_sheets_are_kinds_and_cells_in_it_one_kind) {
  Study study = test::simulated_sheets({.n_sheets = 8, .n_conditions = 1});
  for (StudyCell& cell : study.cells) {
    std::vector<SheetEstimate> parts;
    for (const char* part : {"edge", "inside", "cell 3", "cell 17", "no cell"}) {
      parts.push_back(cell.sheet->estimates[0]);
      parts.back().part = part;
      if (std::string(part) == "edge") parts.back().value += 2;
    }
    cell.sheet->estimates = parts;
  }
  const Analysis analysis = analyse(study, {});
  const Sample* contraction = sample_named(analysis, "contraction_nN_per_um");
  EXPECT_EQ(contraction->kinds, (std::vector<std::string>{"edge", "inside", "cell", "no cell"}));
  EXPECT_EQ(contraction->of_group(0, 2).size(), 16u);
  const files::CsvTable tests = table_of(study, "tests.csv");
  const int row = row_with(tests, {{"quantity", "contraction_nN_per_um"},
                                   {"question", "between kinds"},
                                   {"test", "mixed model"},
                                   {"group_a", "edge"},
                                   {"group_b", "inside"}});
  EXPECT_LT(tests.number(row, "p_holm"), 0.01);
  EXPECT_GT(tests.number(row, "effect"), 1);
}

TEST_F(SheetStudy, leaves_out_a_copy_a_sheet_without_its_fit_and_one_that_did_not_converge) {
  const Study made = test::simulated_sheets({.n_sheets = 6});
  read_again(made, folder);
  const DisplacementField field = {{.position_um = {1, 2}, .sigma_um = 1}};
  const auto a = [&](const char* name) { return folder / "a" / name; };
  for (const char* name : {"sheet_0", "sheet_1"}) {
    std::filesystem::create_directories(a(name) / "2_track");
    files::write_displacement(a(name) / "2_track/displacement.csv", field);  // beside each other in one picture
  }
  std::filesystem::remove(a("sheet_0") / "1_segment/outline.csv");  // of a mask: its nodes tell where it is
  std::filesystem::copy(a("sheet_0"), a("sheet_9"), std::filesystem::copy_options::recursive);
  std::filesystem::remove(a("sheet_2") / "3_sheet/sheet.json");
  files::write_text(folder / "b/sheet_3/run.json",
                    "{\"stages\": {\"sheet\": {\"converged\": false}}, \"findings\": []}");
  const Study study = read_study(folder.path(), {.condition_from = "folder"}, {}, 2);
  EXPECT_EQ(reason_of(study, "a/sheet_9").substr(0, 30), "the same cell as a/sheet_0: th");
  EXPECT_EQ(reason_of(study, "a/sheet_2"), "no fit: 3_sheet/sheet.json is not there");
  EXPECT_EQ(reason_of(study, "b/sheet_3"), "the fit did not converge");
  EXPECT_EQ(study.cells.size(), 4u);
}

using SpaceStudy = test::InFolder;

TEST_F(SpaceStudy, has_the_figures_of_each_cell_and_compares_the_total_force_first) {
  const Study made = test::simulated_cells_in_space({.condition_effect_nN = 200});
  const Study study = read_again(made, folder);
  ASSERT_EQ(n_of_kind(study, CellKind::space), 12);
  const Analysis analysis = analyse(study, {});
  EXPECT_EQ(analysis.primary.measure, "total force of cells in space");
  ASSERT_EQ(analysis.primary.differences.size(), 1u) << analysis.primary.obstacle;
  // two conditions of six: scatter and error of 58 make 34 of the difference; four of these
  EXPECT_NEAR(analysis.primary.differences[0].difference.estimate, 200, 136);
  EXPECT_LT(analysis.primary.differences[0].p_holm, 0.01);
  using S = StudyCell;
  const auto exact = [](const S&) { return 0.0; };
  expect_figures(study, made,
                 {{"space_force_nN", "space_force_nN", "nN", [](const S& s) { return s.space->total_force_nN; },
                   [](const S& s) { return *s.space->total_force_sigma_nN; }},
                  {"space_strain_energy_fJ", "space_strain_energy_fJ", "fJ",
                   [](const S& s) { return s.space->strain_energy_fJ; }, exact},
                  {"space_contractile_moment_nN_um", "space_contractile_moment_nN_um", "nN µm",
                   [](const S& s) { return *s.space->contractile_moment_nN_um; },
                   [](const S& s) { return *s.space->contractile_moment_sigma_nN_um; }},
                  {"space_normal_share", "space_normal_share", "",
                   [](const S& s) { return s.space->normal_force_nN / s.space->total_force_nN; }, exact},
                  {"space_largest_traction_kPa", "space_largest_traction_kPa", "kPa",
                   [](const S& s) { return s.space->largest_traction_kPa; }, exact},
                  {"space_resolution_um", "space_resolution_um", "µm",
                   [](const S& s) { return *s.space->resolution_um; }, exact}});
  const files::CsvTable cells = table_of(study, "cells.csv");
  const Sample* forces = sample_named(analysis, "space_adhesion_force_nN");
  ASSERT_NE(forces, nullptr);
  EXPECT_EQ(forces->values.size(), 60u);
  EXPECT_NEAR(forces->values[7].value, made.cells[1].space->adhesions[2].force_nN, 1e-6);
  EXPECT_EQ(table_of(study, "adhesions_in_space.csv").n_rows(), 60);
  for (const char* unknown : {"net_force_nN", "space_net_force_nN", "tension_nN", "adhesion_force_nN"})
    EXPECT_EQ(sample_named(analysis, unknown), nullptr) << unknown;
  const int row = row_with(cells, {{"cell", "a/space_0"}});
  EXPECT_EQ(cells.text(row, "model"), "space");
  EXPECT_NEAR(cells.number(row, "space_net_force_nN"), 20, 1e-4);
  EXPECT_NEAR(cells.number(row, "space_net_moment_nN_um"), 300, 1e-3);
  EXPECT_NEAR(cells.number(row, "cell_area_um2"), 1600, 0.01);
  for (const char* of_others : {"total_force_nN", "n_fibres", "sheet_force_nN", "strain_energy_fJ", "n_adhesions",
                                "expected_relative_l2", "n_meshes"})
    EXPECT_TRUE(cells.text(row, of_others).empty()) << of_others;
  const std::string page = page_of(study, analysis);
  EXPECT_TRUE(has_words(page, "<h1>Forces of 12 cells in space</h1>", "All measures",
                        "the mean contractile moment of cells in space is"));
  expect_no_word_of_fibres(page);
}

/// A mean tension of a sheet is no tension of a fibre, and the forces of a sheet's triangles are none of adhesions.
TEST_F(SpaceStudy, beside_cells_with_fibres_and_sheets_no_figure_mixes_them) {
  Study made = test::simulated_cells_in_space({.n_cells = 6});
  for (StudyCell& cell : test::simulated_study({.n_cells = 5, .n_conditions = 2}).cells)
    made.cells.push_back(std::move(cell));
  for (StudyCell& cell : test::simulated_sheets({.n_sheets = 4}).cells) made.cells.push_back(std::move(cell));
  const Study study = read_again(made, folder);
  ASSERT_EQ(study.cells.size(), 15u);
  const Analysis analysis = analyse(study, {});
  expect_unmixed(study, analysis);
  EXPECT_EQ(analysis.primary.measure, "total force of cells in space") << "most cells are of them";
  EXPECT_EQ(analyse(study, {.primary = PrimaryMeasure::tension}).primary.measure, "tension of ventral fibres");
  EXPECT_EQ(analyse(study, {.primary = PrimaryMeasure::contraction}).primary.measure, "contraction of sheets");
  EXPECT_EQ(analyse(study, {.primary = PrimaryMeasure::strain_energy}).primary.measure,
            "strain energy of cells in space");
  EXPECT_EQ(analyse(study, {.primary = PrimaryMeasure::contractile_moment}).primary.measure,
            "contractile moment of cells in space");
  EXPECT_EQ(sample_named(analysis, "total_force_nN")->values.size(), 5u);
  EXPECT_EQ(sample_named(analysis, "sheet_force_nN")->values.size(), 4u);
  const files::CsvTable cells = table_of(study, "cells.csv");
  for (int row = 0; row < cells.n_rows(); ++row) {
    const std::string model = cells.text(row, "model");
    for (const char* of_fibres : {"total_force_nN", "n_fibres", "network_force_nN", "n_adhesions", "n_meshes"})
      EXPECT_EQ(cells.text(row, of_fibres).empty(), model == "sheet" || model == "space") << row << of_fibres;
    for (const char* of_sheet :
         {"contraction_nN_per_um", "mean_tension_nN_per_um", "sheet_force_nN", "strain_energy_fJ"})
      EXPECT_EQ(cells.text(row, of_sheet).empty(), model != "sheet") << row << of_sheet;
    EXPECT_FALSE(cells.text(row, "cell_area_um2").empty());
  }
  EXPECT_TRUE(has_words(page_of(study, analysis),
                        "Stress-fibre tensions of 5 cells, contraction of 4 sheets and forces of 6 cells in space"));
}

TEST_F(SpaceStudy, of_cells_without_images_that_older_versions_made_has_what_they_show) {
  Study made = test::simulated_cells_in_space({.n_cells = 6, .n_adhesions = 0});
  for (StudyCell& cell : made.cells) {
    cell.cell.outline_um.clear();
    cell.space->contractile_moment_nN_um = cell.space->contractile_moment_sigma_nN_um = std::nullopt;
    cell.space->total_force_sigma_nN = cell.space->resolution_um = std::nullopt;  // thesis-cg tells no errors
  }
  const Study study = read_again(made, folder);
  ASSERT_EQ(study.cells.size(), 6u);
  const Analysis analysis = analyse(study, {});
  EXPECT_EQ(sample_named(analysis, "space_force_nN")->values.size(), 6u);
  EXPECT_EQ(sample_named(analysis, "space_contractile_moment_nN_um"), nullptr);
  EXPECT_EQ(sample_named(analysis, "space_adhesion_force_nN"), nullptr);
  EXPECT_TRUE(table_of(study, "cells.csv").text(0, "cell_area_um2").empty());
}

TEST_F(SpaceStudy, leaves_out_a_copy_one_without_its_tractions_and_one_that_did_not_converge) {
  const Study made = test::simulated_cells_in_space({.n_cells = 6});
  read_again(made, folder);
  const auto a = [&](const char* name) { return folder / "a" / name; };
  std::filesystem::copy(a("space_0"), a("space_9"), std::filesystem::copy_options::recursive);
  std::filesystem::remove(a("space_1") / "1_segment/outline.csv");  // the whole field is the cell
  std::filesystem::copy(a("space_1"), a("space_8"), std::filesystem::copy_options::recursive);
  std::filesystem::remove(a("space_2") / "4_traction/traction.json");
  files::write_text(folder / "b/space_3/run.json",
                    "{\"stages\": {\"traction\": {\"converged\": false}}, \"findings\": []}");
  const Study study = read_study(folder.path(), {.condition_from = "folder"}, {}, 2);
  EXPECT_EQ(
      reason_of(study, "a/space_9"),
      "the same cell as a/space_0: their 2_track/displacement_3d.csv are the same bytes and their outlines overlap");
  EXPECT_EQ(reason_of(study, "a/space_8"),
            "the same cell as a/space_1: their 2_track/displacement_3d.csv are the same bytes");
  EXPECT_EQ(reason_of(study, "a/space_2"), "no fit: 4_traction/traction.json is not there");
  EXPECT_EQ(reason_of(study, "b/space_3"), "the fit did not converge");
  EXPECT_EQ(study.cells.size(), 4u);
}

TEST_F(SpaceStudy, says_where_methods_or_resolutions_make_the_difference) {
  constexpr const char *kMethods = "different methods", *kCoarser = "are coarser under b than under a";
  Study study = test::simulated_cells_in_space({.condition_effect_nN = 200});
  EXPECT_FALSE(says(analyse(study, {}), kMethods));
  EXPECT_FALSE(says(analyse(study, {}), "coarser"));
  study.cells[3].space->method = "tikhonov";
  EXPECT_TRUE(says(analyse(study, {}), kMethods));
  for (StudyCell& cell : study.cells)
    if (cell.condition == 1) *cell.space->resolution_um *= 1.3;
  EXPECT_TRUE(says(analyse(study, {}), kCoarser));
}

}  // namespace
}  // namespace mbtfm::statistics
