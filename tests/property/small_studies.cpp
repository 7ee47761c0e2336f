/// Studies of two to six cells in which next to nothing can be known: every table, figure and sentence says so.
/// MBTFM_ALL_STUDIES=1 reads all of them from folders and makes all pages, too, instead of one in ten.
#include <cctype>

#include "pipeline/contract/errors.h"
#include "pipeline/files/csv.h"
#include "pipeline/statistics/analysis.h"
#include "pipeline/statistics/study_files.h"
#include "samples/plan/cell_numbers.h"
#include "tests/support/small_study.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::statistics {
namespace {

constexpr int kStudies = 300;
bool are_all() { return std::getenv("MBTFM_ALL_STUDIES") != nullptr; }

const StudyParameters kFewDraws{.bootstrap_draws = 200};

/// Columns of a table that hold words.
const std::set<std::string> kWords = {
    "included", "enters",    "part",   "model", "space_method", "converged", "connected", "identifiable", "origin",
    "cell",     "condition", "reason", "type",  "kind",         "quantity",  "component", "force",        "size",
    "remark",   "question",  "within", "test",  "unit",         "group_a",   "group_b",   "effect_is",    "relation"};

/// An estimate with the columns of its interval. Sums, means and medians of what has no negative values have none.
struct Bounded {
  std::string value, low, high;
  bool is_positive = true;
};
const std::vector<Bounded> kIntervals = {{"mean", "mean_low", "mean_high"},
                                         {"model_mean", "model_low", "model_high"},
                                         {"median", "median_low", "median_high"},
                                         {"mean_nN", "mean_low_nN", "mean_high_nN"},
                                         {"model_mean_nN", "model_low_nN", "model_high_nN"},
                                         {"median_nN", "median_low_nN", "median_high_nN"},
                                         {"fraction_above_1_nN", "fraction_above_1_nN_low", "fraction_above_1_nN_high"},
                                         {"fraction_above_5_nN", "fraction_above_5_nN_low", "fraction_above_5_nN_high"},
                                         {"slope", "slope_low", "slope_high"},
                                         {"mean_force_nN", "low_nN", "high_nN"},
                                         {"tension_nN", "low_nN", "high_nN"},
                                         {"mean_angle_deg", "low_deg", "high_deg"},
                                         {"mean_cosine", "cosine_low", "cosine_high", false},
                                         {"effect", "effect_low", "effect_high", false}};

std::vector<std::string> header_of(const std::string& text) {
  std::istringstream line(text.substr(0, text.find('\n')));
  std::vector<std::string> header;
  for (std::string column; std::getline(line, column, ',');) header.push_back(column);
  return header;
}

/// The fibres' force is a difference, and a fit may find that a sheet expands.
bool may_be_negative(const files::CsvTable& table, int row) {
  const std::set<std::string> signed_ones = {"fibre_force_nN", "contraction_nN_per_um", "mean_tension_nN_per_um",
                                             "contraction_over_stiffness", "space_contractile_moment_nN_um"};
  for (const char* column : {"quantity", "force"})
    if (table.has(column) && signed_ones.contains(table.text(row, column))) return true;
  return false;
}

void expect_intervals(const files::CsvTable& table, int row, const std::string& name) {
  for (const Bounded& b : kIntervals) {
    if (!table.has(b.value) || !table.has(b.low)) continue;
    const auto value = table.optional_number(row, b.value), low = table.optional_number(row, b.low),
               high = table.optional_number(row, b.high);
    EXPECT_EQ(low.has_value(), high.has_value()) << name << " row " << row << " " << b.value;
    if (!low || !high) continue;
    // sums in another order: rounding
    const double rounding = 1e-12 * (std::abs(*low) + std::abs(*high));
    ASSERT_TRUE(value) << name << " row " << row << " " << b.value;
    EXPECT_LE(*low, *value + rounding) << name << " row " << row << " " << b.value;
    EXPECT_GE(*high, *value - rounding) << name << " row " << row << " " << b.value;
    if (!b.is_positive || may_be_negative(table, row)) continue;
    EXPECT_GE(*low, 0) << name << " row " << row << " " << b.value;
  }
}

void expect_table(const std::string& text, const std::string& name) {
  const files::CsvTable table(text, name);
  const std::vector<std::string> header = header_of(text);
  for (int row = 0; row < table.n_rows(); ++row) {
    for (const std::string& column : header) {
      if (kWords.contains(column)) continue;
      const auto value = table.optional_number(row, column);  // refuses nan and inf
      if (!value) continue;
      const bool is_probability = column == "p" || column == "p_holm" || column.starts_with("fraction_above");
      EXPECT_TRUE(!is_probability || (*value >= 0 && *value <= 1)) << name << " row " << row << " " << column;
      // beyond what any quantity of a cell is: a stand-in for infinity
      EXPECT_LT(std::abs(*value), 1e100) << name << " row " << row << " " << column;
    }
    expect_intervals(table, row, name);
  }
}

bool says_nan(const std::string& text) {
  for (const std::string word : {"nan", "inf"})
    for (std::size_t at = text.find(word); at != text.npos; at = text.find(word, at + 1)) {
      const bool is_begun = at > 0 && std::isalpha(static_cast<unsigned char>(text[at - 1]));
      const std::size_t end = at + word.size();
      if (!is_begun && (end == text.size() || !std::isalpha(static_cast<unsigned char>(text[end])))) return true;
    }
  return false;
}

enum class Page { made, left_out };

void expect_whole(const Study& study, Page page) {
  const Analysis analysis = analyse(study, kFewDraws);
  for (const auto& [name, text] : tables_of(study, analysis)) expect_table(text, name);
  const auto figures = figures_of(study, analysis, kFewDraws);
  for (const Figure& figure : figures) {
    EXPECT_FALSE(figure.charts.empty() && figure.caption.empty()) << figure.name;
    EXPECT_FALSE(!figure.charts.empty() && says_nan(svg_of(figure))) << figure.name;
  }
  for (const Findings& findings : findings_of(analysis, kFewDraws)) {
    EXPECT_FALSE(findings.sentences.empty()) << findings.title;
    for (const std::string& s : findings.sentences) EXPECT_FALSE(says_nan(s)) << s;
    for (const std::string& s : findings.unclear) EXPECT_FALSE(says_nan(s)) << s;
  }
  for (const std::string& warning : analysis.warnings) EXPECT_FALSE(says_nan(warning)) << warning;
  if (page == Page::left_out) return;
  EXPECT_FALSE(study_html(study, analysis, figures, kFewDraws, "statistics").empty());
}

TEST(SmallStudies, whatever_lacks_every_number_is_finite_or_its_field_empty) {
  expect_whole(test::simulated_study({.n_cells = 1}), Page::made);
  for (int seed = 1; seed <= kStudies; ++seed) {
    const test::Lack lack = test::drawn_lack(static_cast<std::uint64_t>(seed));
    SCOPED_TRACE("seed " + std::to_string(seed) + ": " + lack.str());
    // a page holds its charts' library, a megabyte: one in ten shows what breaks it
    expect_whole(test::small_study(lack, static_cast<std::uint64_t>(seed)),
                 are_all() || seed % 10 == 1 ? Page::made : Page::left_out);
  }
}

/// Into two conditions, and with cells with fibres beside them; each in half of the cases.
void divide_and_mix(Study& study, int seed, std::mt19937_64& random) {
  if (random() % 2 == 0) {
    study.conditions = {"a", "b"};
    for (StudyCell& cell : study.cells) cell.condition = static_cast<int>(random() % 2);
  }
  if (random() % 2 == 0) {
    for (StudyCell& cell : test::small_study(test::drawn_lack(static_cast<std::uint64_t>(seed)), 3).cells) {
      cell.condition = 0;
      study.cells.push_back(std::move(cell));
    }
  }
}

/// Sheets alone, and beside cells with fibres; of some the beads do not tell the contraction, of some nobody asked for
/// it.
TEST(SmallStudies, whatever_sheets_lack_every_number_is_finite_or_its_field_empty) {
  for (int seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(static_cast<std::uint64_t>(seed));
    const auto once_in = [&](unsigned n) { return random() % n == 0; };
    Study study = test::simulated_sheets({.n_sheets = 1 + static_cast<int>(random() % 5),
                                          .n_conditions = 1,
                                          .contraction_nN_per_um = once_in(3) ? 0.0 : 2.0,
                                          .sheet_sd_nN_per_um = once_in(3) ? 0.0 : 1.0,
                                          .error_nN_per_um = once_in(3) ? 0.0 : 0.1,
                                          .seed = static_cast<std::uint64_t>(seed)});
    for (StudyCell& cell : study.cells) {
      for (SheetEstimate& e : cell.sheet->estimates) {
        if (once_in(4)) e.sigma = e.high = std::nullopt, e.identifiable = false;
        if (once_in(6)) e.low = e.high = e.value, e.sigma = 0;
        if (once_in(6)) e.part = once_in(2) ? "edge" : "cell 4";
      }
      if (once_in(4)) cell.sheet->estimates.clear();
      if (once_in(4)) cell.sheet->strain_energy_fJ = std::nullopt;
    }
    divide_and_mix(study, seed, random);
    expect_whole(study, are_all() || seed % 10 == 1 ? Page::made : Page::left_out);
  }
}

/// Cells in space alone, and beside others; of some the figures are equal, or not known, or zero.
TEST(SmallStudies, whatever_cells_in_space_lack_every_number_is_finite_or_its_field_empty) {
  for (int seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(static_cast<std::uint64_t>(seed));
    const auto once_in = [&](unsigned n) { return random() % n == 0; };
    Study study = test::simulated_cells_in_space({.n_cells = 1 + static_cast<int>(random() % 5),
                                                  .n_conditions = 1,
                                                  .force_nN = 400,
                                                  .cell_sd_nN = once_in(3) ? 0.0 : 50.0,
                                                  .error_nN = once_in(3) ? 0.0 : 30.0,
                                                  .n_adhesions = static_cast<int>(random() % 3),
                                                  .seed = static_cast<std::uint64_t>(seed)});
    for (StudyCell& cell : study.cells) {
      SpaceFigures& s = *cell.space;
      if (once_in(4)) s.total_force_sigma_nN = s.contractile_moment_sigma_nN_um = std::nullopt;
      if (once_in(4)) s.contractile_moment_nN_um = s.contractile_moment_sigma_nN_um = std::nullopt;
      if (once_in(4)) s.resolution_um = std::nullopt;
      if (once_in(4)) cell.cell.outline_um.clear();
      if (once_in(6)) {  // no bead has moved
        s.total_force_nN = s.normal_force_nN = s.strain_energy_fJ = s.largest_traction_kPa = 0;
        s.adhesions.clear();
      }
    }
    divide_and_mix(study, seed, random);
    expect_whole(study, are_all() || seed % 10 == 1 ? Page::made : Page::left_out);
  }
}

/// One file, or several, of each second cell gone.
TEST(SmallStudies, cells_that_lack_files_are_left_out_with_a_reason) {
  for (int seed = 1; seed <= kStudies; seed += are_all() ? 1 : 10) {
    const test::Lack lack = test::drawn_lack(static_cast<std::uint64_t>(seed));
    SCOPED_TRACE("seed " + std::to_string(seed) + ": " + lack.str());
    const Study whole = test::small_study(lack, static_cast<std::uint64_t>(seed));
    const test::TemporaryFolder folder;
    std::mt19937_64 random(static_cast<std::uint64_t>(seed));
    std::size_t n_damaged = 0;
    for (const StudyCell& cell : whole.cells) {
      test::write_finished_cell(folder / cell.name, cell);
      if (&cell == &whole.cells.front() || random() % 2 == 0) continue;
      ++n_damaged;
      const auto& files = in_study(CellKind::plane).files;
      std::filesystem::remove(folder / cell.name / files[random() % files.size()]);
    }
    const Study read = read_study(folder.path(), kFewDraws, {}, 2);
    EXPECT_EQ(read.left_out.size(), n_damaged);
    for (const LeftOutCell& cell : read.left_out) EXPECT_FALSE(cell.reason.empty());
    expect_whole(read, Page::left_out);
  }
}

/// What `mbtfm stats` writes is what `mbtfm plan --study` reads.
TEST(SmallStudies, a_plan_takes_means_and_scatter_from_the_tables) {
  const Study study = test::simulated_study({.n_cells = 30, .type_in_cell_sd_nN = 0.5});
  const test::TemporaryFolder folder;
  for (const auto& [name, text] : tables_of(study, analyse(study, kFewDraws)))
    files::write_text(folder / std::filesystem::path(name).filename(), text);
  std::vector<plan::Scatter> scatter(3);
  scatter[0].type = plan::Quantity::dorsal;
  scatter[1].type = plan::Quantity::arc;
  scatter[2].type = plan::Quantity::ventral;
  scatter = plan::scatter_of_study(folder.path(), scatter);
  const double means_nN[] = {11.5, 12.5, 14};
  for (std::size_t k = 0; k < scatter.size(); ++k) {
    EXPECT_EQ(scatter[k].source, "the study's mixed model") << k;
    EXPECT_NEAR(scatter[k].mean_nN, means_nN[k], 4 * std::hypot(1, 0.5, 0.5) / std::sqrt(30)) << k;
    EXPECT_NEAR(scatter[k].between_cells_nN, std::hypot(1, 0.5), 0.5)
        << k;  // of 30 cells: 13 %, with the two parts' errors
    EXPECT_NEAR(scatter[k].within_nN, 1, 0.3) << k;
    const double n_fibres = k == 2 ? 8 : 4;  // edge fibres count as ventral ones
    EXPECT_NEAR(scatter[k].fibres_per_cell, n_fibres, 4 * std::sqrt(n_fibres / 30)) << k;
  }
  files::write_text(folder / "variances.csv", "quantity,component,standard_deviation\ntension_nN,another name,1\n");
  EXPECT_THROW(plan::scatter_of_study(folder.path(), {{.type = plan::Quantity::ventral}}), InputError);
}

}  // namespace
}  // namespace mbtfm::statistics
