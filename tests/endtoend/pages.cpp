/// The reports as a person sees them, in a browser.
#include "pipeline/files/base64.h"
#include "pipeline/report/report.h"
#include "pipeline/statistics/analysis.h"
#include "pipeline/statistics/study_files.h"
#include "tests/support/browser.h"
#include "tests/support/fake_cell.h"
#include "tests/support/folders.h"

namespace mbtfm {
namespace {

using test::Browser;

/// Pages of an invented cell and of a study of two of them.
class Pages : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::has_browser()) GTEST_SKIP() << "no chromium here to look at the pages with (Debian: chromium)";
    for (const unsigned seed : {1u, 2u}) {
      const auto cell = folder_ / ("cell_" + std::to_string(seed));
      test::write_given_stages(cell, test::round_cell());
      test::write_invented_fit(cell, seed);
    }
    const Path file = folder_ / "cell_1/4_fit/fit.json";
    FitSummary fit = files::read_fit_summary(file);
    fit.error_budget = ErrorBudget{.tensions = {{0, 0.05, {.beads = 0.003}}, {2, 4, {.beads = 0.3, .mesh = 0.4}}},
                                   .total_force_nN = 90,
                                   .total_force_parts_nN = {.beads = 3, .mesh = 4}};
    files::write_fit_summary(file, fit);
    files::write_text(folder_ / "cell_1/run.json", R"({"version": "0", "stages": {}, "effects": []})");
    files::write_text(cell_page(), report::report_html(folder_ / "cell_1"));
    const statistics::StudyParameters parameters;
    const auto study = statistics::read_study(folder_.path(), parameters, {}, 2);
    const auto analysis = statistics::analyse(study, parameters);
    files::write_text(study_page(),
                      statistics::study_html(study, analysis, statistics::figures_of(study, analysis, parameters),
                                             parameters, "statistics"));
  }
  /// One for all tests: it takes seconds to start.
  static Browser& opened(const std::filesystem::path& page) {
    static Browser browser;
    browser.open(page);
    browser.evaluate(files::read_text(test::source_folder() / "tests/data/look.js"));
    return browser;
  }
  std::filesystem::path cell_page() const { return folder_ / "cell.html"; }
  std::filesystem::path study_page() const { return folder_ / "study.html"; }

  test::TemporaryFolder folder_;
};

/// Moves the mouse to the middle of what has this text, in the chart of this title. @returns where
Vec2 rest_on(Browser& browser, const std::string& chart, const std::string& text) {
  const test::json at = browser.evaluate(
      "(() => { const figure = [...document.querySelectorAll('figure')].find(f => f.querySelector('h3').textContent "
      "=== '" +
      chart + "');const path = [...figure.querySelectorAll('.ink [data-tip]')].find(e => e.dataset.tip.startsWith(" +
      test::json(text).dump() +
      "));path.scrollIntoView({block: 'center'});const b = path.getBBox();"  // a line, or the middle of an area
      "const p = (['path', 'polyline'].includes(path.tagName) ? path.getPointAtLength(path.getTotalLength() / 3) : new "
      "DOMPoint(b.x + b.width / 2, b.y + b.height / 2)).matrixTransform(path.getScreenCTM());return [p.x, p.y]; })()");
  browser.mouse("mouseMoved", at[0], at[1]);
  return {at[0], at[1]};
}

std::string tip(Browser& browser) {
  return browser.evaluate(
      "(() => { const t = document.querySelector('.tip'); return t.hidden ? '' : t.textContent })()");
}

TEST_F(Pages, open_without_network_and_without_a_word_in_the_console) {
  for (const auto& page : {cell_page(), study_page()}) {
    Browser& browser = opened(page);
    EXPECT_EQ(browser.console(), std::vector<std::string>{}) << page;
    for (const std::string& address : browser.requests())
      EXPECT_TRUE(address.starts_with("file://") || address.starts_with("data:")) << address.substr(0, 100);
  }
}

TEST_F(Pages, every_chart_is_drawn) {
  const std::string n_without =
      "[...document.querySelectorAll('.chart')].filter(c => !c.querySelector('svg %')).length";
  const auto without = [&](const std::string& what) {
    return std::string(n_without).replace(n_without.find('%'), 1, what);
  };
  Browser& browser = opened(cell_page());
  EXPECT_GE(browser.evaluate("document.querySelectorAll('.chart').length"), 8);
  EXPECT_EQ(browser.evaluate(without(".ink :is(path, rect, polyline, polygon, circle)")), 0);
  browser.open(study_page());
  EXPECT_GE(browser.evaluate("document.querySelectorAll('.chart').length"), 5);
  EXPECT_EQ(browser.evaluate(without(".axis text")), 0) << "a study of two cells leaves some frames empty";
}

TEST_F(Pages, the_mouse_reads_tensions_and_forces_with_their_errors) {
  Browser& browser = opened(cell_page());
  for (const char* chart : {"Where the fibres are", "Segmentation", "Tension of each fibre"}) {
    rest_on(browser, chart, "fibre 2 (");
    const std::string text = tip(browser);
    EXPECT_TRUE(text.starts_with("fibre 2 (ventral)\ntension ")) << chart << ": " << text;
    EXPECT_TRUE(has_words(text, "95 % interval")) << chart;
  }
  for (const char* chart : {"Segmentation", "Forces on the substrate"}) {
    rest_on(browser, chart, "adhesion 5\n");
    const std::string text = tip(browser);
    EXPECT_TRUE(text.starts_with("adhesion 5\nforce ")) << chart << ": " << text;
    EXPECT_TRUE(has_words(text, " ± ")) << chart;
  }
  browser.mouse("mouseMoved", 1, 1);
  EXPECT_EQ(tip(browser), "");
  rest_on(browser, "Where the errors come from", "ventral 2: 4 ± 0.5 nN\nmesh");
  EXPECT_TRUE(has_words(tip(browser), "64 % of the squared error"));  // 0.4² / 0.5²
}

TEST_F(Pages, charts_zoom_about_the_mouse_move_and_come_back) {
  Browser& browser = opened(cell_page());
  const std::string chart = "Segmentation";
  const auto ink = [&] {
    return browser.evaluate(
        "(() => { const r = [...document.querySelectorAll('figure')].find(f => f.querySelector('h3').textContent === "
        "'Segmentation').querySelector('.ink [style*=\"#00805C\"] > *').getBoundingClientRect(); return [r.left, "
        "r.width]; "
        "})()");
  };
  const Vec2 at = rest_on(browser, chart, "fibre 1 (");
  const test::json before = ink();
  constexpr int kCtrl = 2;  // the protocol's bit of that key
  browser.mouse("mouseWheel", at.x, at.y, {{"deltaX", 0}, {"deltaY", -200}, {"modifiers", kCtrl}});
  const double factor = std::exp(0.4), width = before[1];
  EXPECT_NEAR(ink()[1], factor * width, 0.05 * factor * width) << "the stroke's width does not grow";
  EXPECT_NEAR(ink()[0], at.x + factor * (double(before[0]) - at.x), 3) << "what lies below the mouse stays there";
  const double zoomed = ink()[0];
  browser.mouse("mousePressed", at.x, at.y, {{"button", "left"}, {"buttons", 1}});
  browser.mouse("mouseMoved", at.x + 20, at.y, {{"button", "left"}, {"buttons", 1}});
  browser.mouse("mouseReleased", at.x + 20, at.y, {{"button", "left"}});
  EXPECT_NEAR(ink()[0], zoomed + 20, 1.5);
  browser.click(at.x, at.y, 2);
  EXPECT_EQ(ink(), before);
}

TEST_F(Pages, no_heading_says_again_what_the_one_before_says) {
  for (const auto& page : {cell_page(), study_page()}) {
    Browser& browser = opened(page);
    EXPECT_EQ(browser.evaluate("[...document.querySelectorAll('h2, h3')].map(h => h.textContent).filter((t, i, all) => "
                               "i > 0 && t === all[i - 1])"),
              test::json::array())
        << page;
  }
}

TEST_F(Pages, nothing_reaches_beyond_the_window_and_no_text_is_small) {
  for (const auto& page : {cell_page(), study_page()}) {
    Browser& browser = opened(page);
    browser.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)");
    for (const int width_px : {400, 1000, 1600}) {
      browser.resize(width_px, 900);
      EXPECT_LE(browser.evaluate("document.documentElement.scrollWidth"), width_px) << page;
      // in px of the screen: of drawings that the page scales, too
      const test::json small = browser.evaluate("look.small()");
      EXPECT_EQ(small, test::json::array()) << page << " at " << width_px;
      // names and numbers along an axis
      const test::json overlapping = browser.evaluate("look.overlapping()");
      EXPECT_EQ(overlapping, test::json::array()) << page << " at " << width_px;
    }
  }
}

/// What a screen reader is given (WCAG 2.1: 1.1.1, 1.3.1, 2.5.3, 4.1.2), of what axe-core asks.
TEST_F(Pages, all_that_can_be_used_or_looked_at_has_a_name) {
  for (const auto& page : {cell_page(), study_page()}) {
    Browser& browser = opened(page);
    browser.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)");
    const test::json found_lists = browser.evaluate("look.lists()");
    for (const auto& [what, found] : found_lists.items()) EXPECT_EQ(found, test::json::array()) << page << ": " << what;
    EXPECT_EQ(browser.evaluate(
                  "[document.querySelectorAll('main').length, "
                  "document.querySelectorAll('h1').length,document.documentElement.lang, document.title !== '']"),
              test::json::array({1, 1, "en", true}))
        << page;
  }
}

/// WCAG 2.1, 1.4.3: 4.5 of text to what is behind it; 3 of large text. Text on pictures has a white rim instead.
TEST_F(Pages, all_text_stands_out_from_what_is_behind_it) {
  for (const auto& page : {cell_page(), study_page()}) {
    Browser& browser = opened(page);
    browser.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)");
    EXPECT_EQ(browser.evaluate("look.faint()"), test::json::array()) << page;
    // the law itself: grey that is too light is found
    browser.evaluate("document.querySelector('main p').style.color = '#999'");
    EXPECT_NE(browser.evaluate("look.faint()"), test::json::array()) << page;
  }
}

TEST_F(Pages, a_click_on_a_title_sorts_the_table) {
  Browser& browser = opened(cell_page());
  const std::string column =
      "[...document.querySelector('#Forces-of-the-adhesions table').tBodies[0].rows].map(r => "
      "parseFloat(r.cells[5].textContent))";
  for (const bool is_first : {true, false}) {
    browser.evaluate("document.querySelectorAll('#Forces-of-the-adhesions th span')[5].click()");
    std::vector<double> tractions = browser.evaluate(column);
    EXPECT_GT(tractions.size(), 5u);
    if (is_first) std::reverse(tractions.begin(), tractions.end());
    EXPECT_TRUE(std::is_sorted(tractions.begin(), tractions.end()));
  }
}

TEST_F(Pages, tables_can_be_taken_out_with_all_their_digits) {
  Browser& browser = opened(cell_page());
  const std::string text = browser.evaluate(
      "fetch ? atob(document.querySelector('a[download$=\"_tensions.csv\"]').href.split(',')[1]) : ''");
  EXPECT_EQ(text, files::read_text(folder_ / "cell_1/4_fit/tensions.csv"));
}

TEST_F(Pages, print_whole) {
  for (const auto& page : {cell_page(), study_page()}) {
    Browser& browser = opened(page);
    // A4 without the margins of the style sheet, at 96 px an inch
    constexpr int kPaper_px = (210 - 2 * 14) * 96 / 25.4;
    browser.call("Emulation.setEmulatedMedia", {{"media", "print"}});
    browser.resize(kPaper_px, 1000);
    EXPECT_LE(browser.evaluate("Math.max(...[...document.querySelectorAll('main *')].filter(e => "
                               "!e.closest('.ink')).map(e => e.getBoundingClientRect().right))"),
              kPaper_px + 0.5)
        << page;
    const std::string pdf = browser.call("Page.printToPDF", {{"preferCSSPageSize", true}})["data"];
    EXPECT_TRUE(pdf.starts_with(files::base64("%PDF-1"))) << page;
  }
}

}  // namespace
}  // namespace mbtfm
