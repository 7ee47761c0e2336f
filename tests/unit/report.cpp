#include "pipeline/report/report.h"

#include <regex>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/base64.h"
#include "pipeline/report/compare.h"
#include "pipeline/report/kinds.h"
#include "pipeline/report/map_parts.h"
#include "pipeline/report/page.h"
#include "pipeline/report/results.h"
#include "pipeline/report/stage_page.h"
#include "pipeline/report/tensions.h"
#include "tests/support/fake_cell.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::report {
namespace {

struct FakeCell {
  TemporaryFolder folder;
  FakeCell() {
    test::write_given_stages(folder.path(), test::round_cell());
    test::write_invented_fit(folder.path());
  }
};

TEST(Report, names_every_fibre_and_adhesion) {
  const FakeCell cell;
  const std::string html = report_html(cell.folder.path());
  for (int fibre = 1; fibre <= 4; ++fibre)
    EXPECT_TRUE(has_words(html, "fibre " + std::to_string(fibre) + " (")) << fibre;
  for (int adhesion = 1; adhesion <= 12; ++adhesion)
    EXPECT_TRUE(has_words(html, "adhesion " + std::to_string(adhesion) + "\n")) << adhesion;
}

TEST(Charts, keys_are_dark_enough_to_read_on_white) {
  EXPECT_NEAR(charts::contrast_to_white("#000000"), 21, 1e-9);
  EXPECT_NEAR(charts::contrast_to_white("#FFFFFF"), 1, 1e-9);
  EXPECT_EQ(charts::readable_on_white("#0072B2"), "#0072B2") << "dark already";
  EXPECT_EQ(charts::readable_on_white("currentColor"), "currentColor");
  for (const char* colour : charts::kColours) {
    charts::Chart chart("title", {.label = "x"}, {.label = "y"});
    chart.key("name", colour);
    const std::string html = figure(chart, "", "");
    std::smatch found;
    ASSERT_TRUE(std::regex_search(html, found, std::regex("color:(#[0-9A-F]{6})\">name")));
    EXPECT_GE(charts::contrast_to_white(found[1]), 4.5) << colour;
  }
}

TEST(StagePage, its_picture_has_a_name_and_keeps_to_the_page_and_its_tables_have_captions) {
  const std::string html =
      html_of(StagePage{.title = "t",
                        .picture_svg = "<?xml version=\"1.0\"?><svg width=\"920\" height=\"5\"></svg>",
                        .picture_title = "Tension",
                        .picture_explained = "Left: a \"map\".",
                        .figures = {{"n", std::int64_t(1)}}});
  EXPECT_TRUE(has_words(html,
                        "<svg role=\"img\" aria-label=\"Tension. Left: a &quot;map&quot;.\" "
                        "style=\"max-width:100%;min-width:34rem;height:auto\" width=\"920\""));
  std::size_t n_tables = 0, n_captions = 0;
  for (std::size_t at = 0; (at = html.find("<table>", at)) != std::string::npos; ++at) ++n_tables;
  for (std::size_t at = 0; (at = html.find("<table><caption", at)) != std::string::npos; ++at) ++n_captions;
  EXPECT_EQ(n_tables, 1u);
  EXPECT_EQ(n_captions, n_tables);
}

TEST(ResultLine, counts_as_uncertain_what_is_not_identifiable_and_what_may_be_nothing_or_twice_as_much) {
  const FakeCell cell;
  const Path file = cell.folder / "4_fit/tensions.csv";
  std::vector<Tension> tensions = files::read_tensions(file);
  ASSERT_EQ(tensions.size(), 5u) << "the network and four fibres";
  const auto set = [&](std::size_t i, double tension_nN, double low_nN, double high_nN) {
    tensions[i].tension_nN = tension_nN;
    tensions[i].low_nN = low_nN;
    tensions[i].high_nN = high_nN;
    tensions[i].identifiable = true;
  };
  set(0, 0.05, 0, 0.2);  // the network is no fibre
  set(1, 2, 0.1, 3.9);
  set(2, 2, 0, 4.1);
  set(3, 0, 0, 1);
  set(4, 2, 1, 3);
  tensions[4].identifiable = false;
  files::write_tensions(file, tensions, files::read_cell(cell.folder / "1_segment").fibres);
  const std::string line = result_line(cell.folder.path());
  EXPECT_TRUE(line.ends_with("; 3 of 4 uncertain")) << line;
}

TEST(Report, asks_for_nothing_from_anywhere) {
  const FakeCell cell;
  const std::string whole = report_html(cell.folder.path());
  // what comes before the scripts; what these ask for shows in a browser (tests/endtoend/pages.cpp)
  const std::string html = whole.substr(0, whole.find("</main>"));
  EXPECT_FALSE(std::regex_search(html, std::regex(R"((src|href)="(?!data:|#))")));
  EXPECT_FALSE(has_words(html, "url("));
  EXPECT_FALSE(has_words(html, "@import"));
}

TEST(Report, is_well_formed_where_names_hold_markup) {
  EXPECT_EQ(charts::html_escaped("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;");
}

TEST(Report, is_written_again_only_where_something_has_changed) {
  const FakeCell cell;
  const auto file = cell.folder / "report.html";
  update_report(cell.folder.path());
  const auto first = std::filesystem::last_write_time(file);
  update_report(cell.folder.path());
  EXPECT_EQ(std::filesystem::last_write_time(file), first);
  test::write_invented_fit(cell.folder.path(), 2);
  const std::string before = files::read_text(file);
  update_report(cell.folder.path());
  EXPECT_NE(files::read_text(file), before);
}

TEST(Report, each_table_and_chart_has_a_name_for_those_who_hear_the_page) {
  const FakeCell cell;
  const std::string html = report_html(cell.folder.path());
  const auto count = [&](const std::string& what) {
    int n = 0;
    for (std::size_t at = html.find(what); at != html.npos; at = html.find(what, at + 1)) ++n;
    return n;
  };
  EXPECT_GE(count("<caption"), 3);
  EXPECT_EQ(count("<table><thead>"), 0) << "tables with titles of columns have a caption";
}

TEST(Report, the_methods_paragraph_has_the_numbers_of_this_cell) {
  const FakeCell cell;
  const std::string html = report_html(cell.folder.path());
  const std::size_t at = html.find("For-your-methods-section");
  ASSERT_NE(at, html.npos);
  const std::string paragraph = html.substr(html.find("<p class=\"cite\">", at));
  for (const char* part : {"8.4\u00a0kPa", "12 adhesions", "4 stress fibres"})
    EXPECT_LT(paragraph.find(part), paragraph.find("</p>")) << part;
}

TEST(Report, shows_the_bead_images_where_tracking_has_left_them) {
  const FakeCell cell;
  EXPECT_FALSE(has_words(report_html(cell.folder.path()), "<h3>Beads</h3>"));
  files::write_text(cell.folder / "2_track/beads.jpg", "a picture");
  files::write_text(cell.folder / "2_track/beads_picture.csv", "x_um,y_um,width_um,height_um\n0,0,80,80\n");
  EXPECT_TRUE(has_words(report_html(cell.folder.path()), "<h3>Beads</h3>", files::base64("a picture")));
}

TEST(Report, shows_what_the_usual_method_says_where_it_was_asked) {
  const FakeCell cell;
  const std::string title = "What the usual method says";
  EXPECT_FALSE(has_words(report_html(cell.folder.path()), title)) << "results of an older version";
  files::write_text(cell.folder / "4_fit/fttc.csv",
                    "x_um,y_um,tx_kPa,ty_kPa,area_um2,ux_um,uy_um\n30,30,0.3,0.4,4,0,0\n32,30,0,0,4,0,0\n");
  const auto figures = cell.folder / "4_fit/fttc.json";
  files::write_text(figures, R"({"total_force_nN": 123.4, "lambda_um_per_kPa": 0.056, "lambda_by": "risk"})");
  const std::string html = report_html(cell.folder.path());
  const std::size_t at = html.find("<h3>" + title);
  ASSERT_NE(at, html.npos);
  EXPECT_TRUE(has_words(html.substr(at, html.find("</figure>", at) - at), "λ = 0.056 µm/kPa (criterion: risk)",
                        "squares of 2 µm", "123 nN", "data:image/svg+xml;base64,"));

  files::write_text(figures, R"({"obstacle": "all beads on one line"})");
  const std::string without = report_html(cell.folder.path());
  EXPECT_FALSE(has_words(without, "<h3>" + title));
  EXPECT_TRUE(has_words(without, "has no answer for these beads: all beads on one line."));
  files::write_text(figures, R"({"total_force_nN": 1})");
  files::write_text(cell.folder / "4_fit/fttc.csv", "x_um,y_um\n1,2\n");
  EXPECT_THROW(report_html(cell.folder.path()), InputError);
}

TEST(Report, rejects_a_fitted_field_of_other_beads) {
  const FakeCell cell;
  const auto file = cell.folder / "4_fit/fitted_displacement.csv";
  DisplacementField field = files::read_displacement(file);
  field.front().position_um.x += 1;
  files::write_displacement(file, field);
  EXPECT_THROW(report_html(cell.folder.path()), InputError);
}

TEST(Report, forces_that_balance_have_no_net_force) {
  const FakeCell cell;
  // Each of 12 forces was shifted by a twelfth of their sum: what is left is rounding in 12 additions and in the
  // shortest round-trip numbers of the file, which are exact.
  EXPECT_LT(balance_of(read_results(cell.folder.path())).net_force, 1e-14);
}

TEST(Report, base64_is_rfc_4648s) {
  // RFC 4648, section 10
  EXPECT_EQ(files::base64(""), "");
  EXPECT_EQ(files::base64("f"), "Zg==");
  EXPECT_EQ(files::base64("fo"), "Zm8=");
  EXPECT_EQ(files::base64("foo"), "Zm9v");
  EXPECT_EQ(files::base64("foob"), "Zm9vYg==");
  EXPECT_EQ(files::base64("\xff\xfe\xfd"), "//79");
}

TEST(Report, round_steps_are_one_two_five) {
  EXPECT_DOUBLE_EQ(charts::round_below(0.99), 0.5);
  EXPECT_DOUBLE_EQ(charts::round_below(1), 1);
  EXPECT_DOUBLE_EQ(charts::round_below(49), 20);
  EXPECT_DOUBLE_EQ(charts::round_below(0.0021), 0.002);
}

TEST(Report, colour_bars_end_at_a_tick_that_shows_the_value) {
  EXPECT_DOUBLE_EQ(round_end(5.9), 6);
  EXPECT_DOUBLE_EQ(round_end(13.4), 15);
  EXPECT_DOUBLE_EQ(round_end(0.31), 0.4);
  EXPECT_DOUBLE_EQ(round_end(10), 10);
  EXPECT_EQ(round_end(0), 0);
}

std::string text_of(const CellResults& results) {
  std::string text;
  for (const std::string& fact : facts_of(results)) text += fact + "\n";
  return text;
}

Provenance fitted_here(std::vector<Finding> findings) {
  Provenance provenance;
  provenance.stages.emplace_back();
  provenance.stages.back().name = "fit";
  provenance.stages.back().state = "run";
  provenance.findings = std::move(findings);
  return provenance;
}

TEST(Report, a_tick_stands_only_where_no_finding_is_open) {
  const FakeCell cell;
  const CellResults results = read_results(cell.folder.path());
  const auto has_tick = [&](const Provenance& p) {
    return findings_section(facts_of(results), p).find("✓") != std::string::npos;
  };
  EXPECT_TRUE(has_tick(fitted_here({})));
  EXPECT_TRUE(has_tick(fitted_here({*noticed(Symptom::wide_interval, 1)})));
  EXPECT_FALSE(has_tick(fitted_here({*noticed(Symptom::missing_fibre, 1)})));
  EXPECT_FALSE(has_tick(fitted_here({*noticed(Symptom::not_identifiable, 2)})));
  Provenance not_converged = fitted_here({});
  not_converged.stages.front().converged = false;
  EXPECT_FALSE(has_tick(not_converged));
  EXPECT_FALSE(has_tick({}));  // nobody asked
}

TEST(Report, an_open_finding_shows_its_text_number_threshold_and_remedy) {
  const FakeCell cell;
  const Finding finding = *noticed(Symptom::missing_fibre, 3, {.at = "three <fibres>"});
  EXPECT_TRUE(has_words(findings_section(facts_of(read_results(cell.folder.path())), fitted_here({finding})),
                        std::string("three &lt;fibres&gt;"), charts::html_escaped(finding.remedy),
                        charts::html_escaped(finding.reason), std::string(": 3. Threshold: 0;")));
}

TEST(Report, shows_the_gravest_finding_first_and_prints_units_as_papers_do) {
  const FakeCell cell;
  Finding caution = *noticed(Symptom::missing_fibre, 3);
  caution.text = "off by 0.3 +- 0.1 um over 4 um2, see track.beads_pixel_size_um";
  Finding bad = caution;
  bad.severity = Severity::bad;
  bad.text = "must not be used";
  const std::string html = findings_section(facts_of(read_results(cell.folder.path())), fitted_here({caution, bad}));
  const std::string printed = "off by 0.3 ± 0.1 µm over 4 µm², see track.beads_pixel_size_um";
  ASSERT_NE(html.find(printed), std::string::npos) << html;
  EXPECT_LT(html.find(bad.text), html.find(printed));
}

TEST(Report, separates_the_noise_from_the_models_error) {
  const FakeCell cell;
  CellResults results = read_results(cell.folder.path());
  results.fit.relative_l2 = 0.5;
  results.fit.expected_relative_l2 = 0.4;  // 0.4² / 0.5² = 64 %
  EXPECT_TRUE(has_words(text_of(results), "64 % is the noise of the beads", "36 % the error of the model"));
  results.fit.relative_l2 = 0.39;
  EXPECT_TRUE(has_words(text_of(results), "All that the model leaves"));
}

TEST(Report, names_no_part_of_the_network_that_beads_do_not_show) {
  const FakeCell cell;
  CellResults results = read_results(cell.folder.path());
  results.tensions.at(0).identifiable = true;
  EXPECT_TRUE(has_words(text_of(results), "nN by the actin network"));
  results.tensions.at(0).identifiable = false;
  EXPECT_FALSE(has_words(text_of(results), "nN by the actin network"));
  EXPECT_TRUE(has_words(text_of(results), "The beads do not show"));
}

TEST(Report, says_first_that_the_beads_prefer_another_model) {
  const FakeCell cell;
  CellResults results = read_results(cell.folder.path());
  results.fit.more.emplace_back("best_model_by_bic", std::string("sheet"));
  results.fit.more.emplace_back("bic_of_cables_over_best", 1690.0);
  EXPECT_TRUE(has_words(facts_of(results).front(), "a sheet that contracts evenly (by 1690 in BIC"));
  results.fit.more.back().second = 0.0;
  EXPECT_FALSE(has_words(text_of(results), "prefer another"));
}

TEST(Report, shows_no_more_digits_of_a_tension_than_its_interval_warrants) {
  const FakeCell cell;
  CellResults results = read_results(cell.folder.path());
  for (auto& [id, tension] : results.tensions)
    tension = {.fibre_id = id, .tension_nN = 0.0251, .low_nN = 0, .high_nN = 4.29, .identifiable = true};
  results.tensions.at(0) = {.tension_nN = 0.04312, .low_nN = 0.016188, .high_nN = 0.07003, .identifiable = true};
  const Table table = tension_table(results);
  EXPECT_EQ(table.rows[0][2], "0.043");
  EXPECT_EQ(table.rows[0][3], "0.016 – 0.070");
  EXPECT_EQ(table.rows[1][2], "0.0");
  EXPECT_EQ(table.rows[1][3], "0.0 – 4.3");
}

TEST(Report, averages_arrows_over_squares_and_drops_those_of_few_beads) {
  VectorField field;
  for (int i = 0; i < 9; ++i) {
    field.positions_um.push_back({2.5, 2.5});
    field.vectors.push_back({i % 2 ? 1.0 : -1.0, 3});
  }
  field.positions_um.push_back({7.5, 7.5});
  field.vectors.push_back({5, 5});
  const AveragedField mean = averaged(field, {{0, 0}, {10, 10}}, 5);
  ASSERT_EQ(mean.means.vectors.size(), 1u);
  EXPECT_DOUBLE_EQ(mean.means.vectors[0].x, -1.0 / 9);
  EXPECT_DOUBLE_EQ(mean.means.vectors[0].y, 3);
}

TEST(StagePage, a_table_shows_three_digits_words_for_truth_and_no_empty_columns) {
  const std::string html = section_of({.title = "T",
                                       .explained = "",
                                       .name = "t.csv",
                                       .csv = "cell,part,angle_deg,misfit_um,bic,n,kept\n"
                                              "a,,122.3690627118605,0.0123456,3008.01,24629,TRUE\n"
                                              "b,,-16.919751115106486,,2996.4,3,FALSE\n",
                                       .columns = "cell, part, angle_deg, misfit_um, bic, n, kept"});
  const std::string table = html.substr(0, html.find("download"));
  for (const char* shown : {">122<", ">-16.9<", ">0.0123<", ">3008<", ">2996<", ">24629<", ">yes<", ">no<"})
    EXPECT_TRUE(has_words(table, shown)) << shown << html;
  EXPECT_FALSE(has_words(table, "part"));
}

TEST(StagePage, a_heading_has_the_unit_that_the_columns_name_ends_with) {
  EXPECT_EQ(heading_of("total_force_nN"), "total force (nN)");
  EXPECT_EQ(heading_of("contraction_nN_per_um"), "contraction (nN/µm)");
  EXPECT_EQ(heading_of("cell_area_um2"), "cell area (µm²)");
  EXPECT_EQ(heading_of("n_fibres"), "fibres");
  EXPECT_EQ(heading_of("p"), "p");
}

TEST(StagePage, a_table_has_the_rows_and_headings_that_are_asked_for) {
  const Table table = table_of({.title = "T",
                                .explained = {},
                                .name = "t.csv",
                                .csv = "quantity,model,mean\ntotal_force_nN,a,1\narea_um2,b,2\n",
                                .columns = "*quantity: measure, mean",
                                .only = {{"model", "b"}}});
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_EQ(table.rows[0], (std::vector<std::string>{"area (µm²)", "2"}));
  EXPECT_EQ(table.columns[0].title, "measure");
}

TEST(Charts, have_room_for_long_names_of_rows_and_a_line_for_each_word_below_a_narrow_frame) {
  const std::string name(40, 'x');
  const charts::Chart rows("t", {.label = "x"}, charts::row_axis({name})), plain("t", {.label = "x"}, {.label = "y"});
  EXPECT_GT(rows.width_px(), plain.width_px() + 200) << "40 letters of 8 px where 84 px were";
  charts::Axis types{.label = {}, .low = -0.5, .high = 3.5};
  for (int k = 0; k < 4; ++k) types.names.emplace_back(k, "transverse arc");
  const std::string svg = charts::Chart("t", types, {.label = "y"}).on_page();
  EXPECT_TRUE(has_words(svg, ">transverse</tspan>", ">arc</tspan>"));
}

TEST(Compare, without_true_fibres_ids_are_the_same) {
  const FakeCell cell;
  std::filesystem::create_directories(cell.folder / "truth");
  std::string truth = "fibre_id,type,tension_nN\n0,network,0.05\n";
  double error2 = 0, truth2 = 0;
  for (const Tension& t : files::read_tensions(cell.folder / "4_fit/tensions.csv")) {
    if (t.fibre_id == 0) continue;
    const double value = t.tension_nN + 0.1 * t.fibre_id;
    truth += std::to_string(t.fibre_id) + ",arc," + shortest(value) + "\n";
    error2 += std::pow(0.1 * t.fibre_id, 2);
    truth2 += value * value;
  }
  files::write_text(cell.folder / "truth/tensions.csv", truth);
  const Comparison comparison = compare_with_truth(cell.folder.path());
  EXPECT_EQ(comparison.n_matched, 4);
  EXPECT_NEAR(comparison.relative_error, std::sqrt(error2 / truth2), 1e-12);  // rounding in differences
  EXPECT_EQ(comparison.true_network_nN, 0.05);
}

TEST(Compare, counts_a_missed_and_a_mistyped_fibre) {
  const FakeCell cell;
  std::filesystem::create_directories(cell.folder / "truth");
  std::vector<Fibre> truth = test::round_cell().fibres;
  for (Fibre& fibre : truth) fibre.fibre_id += 10;  // other labels: matched by place
  truth[3].type = FibreType::dorsal;
  truth[3].start_adhesion_id = 5;
  truth.push_back(truth[0]);
  truth.back().fibre_id = 99;
  truth.back().start_adhesion_id = 12;
  truth.back().end_adhesion_id = 7;
  for (Vec2& p : truth.back().points_um) p += Vec2{0, -8};
  files::write_fibres(cell.folder / "truth/fibres.csv", cell.folder / "truth/fibre_points.csv", truth);
  files::write_text(cell.folder / "truth/tensions.csv",
                    "fibre_id,type,tension_nN\n0,network,0.06\n11,ventral,1\n12,ventral,1\n13,dorsal,1\n14,dorsal,1\n"
                    "99,ventral,1\n");
  const Comparison comparison = compare_with_truth(cell.folder.path());
  EXPECT_EQ(comparison.n_matched, 4);
  EXPECT_EQ(comparison.n_long, 5);
  EXPECT_EQ(comparison.n_long_found_and_typed, 3);
  EXPECT_EQ(comparison.fibres.size(), 5u);
  EXPECT_FALSE(comparison.fibres.back().found);
  EXPECT_TRUE(has_words(comparison_text(cell.folder.path()), "3 of 5 found and typed right"));
}

}  // namespace
}  // namespace mbtfm::report
