#include "pipeline/report/report.h"

#include <gtest/gtest.h>

#include <regex>

#include "pipeline/contract/errors.h"
#include "pipeline/report/base64.h"
#include "pipeline/report/compare.h"
#include "pipeline/report/findings.h"
#include "pipeline/report/svg.h"
#include "tests/support/fake_cell.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::report {
namespace {

using test::TemporaryFolder;

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
  for (int fibre = 1; fibre <= 4; ++fibre) {
    EXPECT_NE(html.find("fibre " + std::to_string(fibre) + " ("), std::string::npos) << fibre;
  }
  for (int adhesion = 1; adhesion <= 12; ++adhesion) {
    EXPECT_NE(html.find("adhesion " + std::to_string(adhesion) + ": "), std::string::npos) << adhesion;
  }
}

TEST(Report, asks_for_nothing_from_anywhere) {
  const FakeCell cell;
  const std::string html = report_html(cell.folder.path());
  EXPECT_FALSE(std::regex_search(html, std::regex(R"((src|href)="(?!data:))")));
  EXPECT_EQ(html.find("url("), std::string::npos);
  EXPECT_EQ(html.find("@import"), std::string::npos);
}

TEST(Report, is_well_formed_where_names_hold_markup) {
  EXPECT_EQ(html_escaped("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;");
}

TEST(Report, writes_the_same_bytes_twice) {
  const FakeCell cell;
  EXPECT_EQ(report_html(cell.folder.path()), report_html(cell.folder.path()));
}

TEST(Report, is_written_again_only_where_something_has_changed) {
  const FakeCell cell;
  const auto file = cell.folder / "report.html";
  update_report(cell.folder.path());
  const auto first = std::filesystem::last_write_time(file);
  update_report(cell.folder.path());
  EXPECT_EQ(std::filesystem::last_write_time(file), first);
  test::write_invented_fit(cell.folder.path(), 2);
  const std::string before = read_text(file);
  update_report(cell.folder.path());
  EXPECT_NE(read_text(file), before);
}

TEST(Report, rejects_a_fitted_field_of_other_beads) {
  const FakeCell cell;
  const auto file = cell.folder / "4_fit/fitted_displacement.csv";
  DisplacementField field = read_displacement(file);
  field.front().position_um.x += 1;
  write_displacement(file, field);
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
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

TEST(Report, round_steps_are_one_two_five) {
  EXPECT_DOUBLE_EQ(round_below(0.99), 0.5);
  EXPECT_DOUBLE_EQ(round_below(1), 1);
  EXPECT_DOUBLE_EQ(round_below(49), 20);
  EXPECT_DOUBLE_EQ(round_below(0.0021), 0.002);
}

TEST(Compare, without_true_fibres_ids_are_the_same) {
  const FakeCell cell;
  std::filesystem::create_directories(cell.folder / "truth");
  std::string truth = "fibre_id,type,tension_nN\n0,network,0.05\n";
  double error2 = 0, truth2 = 0;
  for (const Tension& t : read_tensions(cell.folder / "4_fit/tensions.csv")) {
    if (t.fibre_id == 0) continue;
    const double value = t.tension_nN + 0.1 * t.fibre_id;
    truth += std::to_string(t.fibre_id) + ",arc," + shortest(value) + "\n";
    error2 += std::pow(0.1 * t.fibre_id, 2);
    truth2 += value * value;
  }
  write_text(cell.folder / "truth/tensions.csv", truth);
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
  write_fibres(cell.folder / "truth/fibres.csv", cell.folder / "truth/fibre_points.csv", truth);
  write_text(cell.folder / "truth/tensions.csv",
             "fibre_id,type,tension_nN\n0,network,0.06\n11,ventral,1\n12,ventral,1\n13,dorsal,1\n14,dorsal,1\n"
             "99,ventral,1\n");
  const Comparison comparison = compare_with_truth(cell.folder.path());
  EXPECT_EQ(comparison.n_matched, 4);
  EXPECT_EQ(comparison.n_long, 5);
  EXPECT_EQ(comparison.n_long_found_and_typed, 3);
  EXPECT_EQ(comparison.fibres.size(), 5u);
  EXPECT_FALSE(comparison.fibres.back().found);
  const std::string text = comparison_text(cell.folder.path());
  EXPECT_NE(text.find("3 of 5 found and typed right"), std::string::npos);
}

}  // namespace
}  // namespace mbtfm::report
