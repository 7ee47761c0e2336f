/// What people decided who looked at the overlays of a study.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string_view>

#include "pipeline/contract/counted.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/foreign_table.h"
#include "pipeline/files/hash.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/table_text.h"
#include "pipeline/report/page.h"
#include "pipeline/report/texts.h"
#include "pipeline/statistics/review.h"
#include "pipeline/statistics/study_files.h"

namespace mbtfm::statistics {

extern const std::string_view kReviewScript;  // review.js
extern const std::string_view kReviewStyle;   // review.css

namespace {

using report::html_escaped;

bool has(const std::vector<int>& ids, int id) { return std::ranges::find(ids, id) != ids.end(); }

/// Which lines the numbers of fibres mean: they change if the cell is segmented again.
std::string segmentation_of(const Path& cell) {
  const Path file = cell / "1_segment/fibre_points.csv";
  constexpr std::size_t kDigits = 12;
  return files::is_own_file(file) ? files::sha256_of_file(file).substr(0, kDigits) : "";
}

std::string button(const char* verdict, const char* words) {
  return fmt::format("<button type=\"button\" data-verdict=\"{}\">{}</button> ", verdict, words);
}

std::string fibres_of(const Path& folder, const std::vector<int>& left_out) {
  if (!files::is_own_file(folder / "1_segment/fibres.csv")) return {};
  const Cell cell = files::read_cell(folder / "1_segment");
  std::map<int, Tension> tensions;
  if (files::is_own_file(folder / "4_fit/tensions.csv"))
    for (const Tension& t : files::read_tensions(folder / "4_fit/tensions.csv")) tensions[t.fibre_id] = t;
  report::Table table{.caption = "Fibres",
                      .columns = {report::number("fibre"), "type", report::number("probability"),
                                  report::number("tension (nN)"), "95 % interval (nN)", "leave out"}};
  for (const Fibre& fibre : cell.fibres) {
    const auto found = tensions.find(fibre.fibre_id);
    std::string tension = "–", interval = "–";
    if (found != tensions.end()) {
      const Tension& t = found->second;
      tension = charts::readable(t.tension_nN);
      if (t.low_nN && t.high_nN) interval = charts::readable(*t.low_nN) + " – " + charts::readable(*t.high_nN);
      if (!t.identifiable) interval = "not identifiable";
    }
    const int id = fibre.fibre_id;
    table.rows.push_back({std::to_string(id), name_of(fibre.type), fmt::format("{:.2f}", fibre.confidence), tension,
                          interval,
                          fmt::format("<input type=\"checkbox\" value=\"{}\" aria-label=\"leave out fibre {}\"{}>", id,
                                      id, has(left_out, id) ? " checked" : "")});
  }
  return report::html_of(table);
}

std::string article_of(const Study& study, const std::string& name, const Review& review, const std::string& state,
                       const std::string& up) {
  const Path folder = study.folder_of(name);
  const std::string link = html_escaped(up + name + "/"), quoted = html_escaped(name);
  std::string html = fmt::format(
      "<article hidden data-cell=\"{}\" data-segmentation=\"{}\" data-verdict=\"{}\" data-note=\"{}\">\n<h2>{}</h2>\n",
      quoted, segmentation_of(folder), review.verdict, html_escaped(review.note), quoted);
  html += "<p class=\"sub\">" + html_escaped(state) + "</p>\n<div class=\"look\">";
  if (files::is_own_file(folder / "1_segment/overlay.png"))
    html += fmt::format(
        "<a href=\"{0}1_segment/overlay.png\"><img alt=\"overlay of {1}\" loading=\"lazy\" "
        "src=\"{0}1_segment/overlay.png\"></a>",
        link, quoted);
  html += "<div>\n<p>" + button("accepted", "accept (a)") + button("left out", "leave the cell out (x)") +
          "</p>\n<p><label>Note <input type=\"text\"></label></p>\n" + fibres_of(folder, review.fibres_left_out);
  if (files::is_own_file(folder / "report.html"))
    html += fmt::format("<p><a href=\"{}report.html\">report</a></p>\n", link);
  return html + "<p>In napari: <code>napari '" + html_escaped(fs::weakly_canonical(folder).string()) +
         "'</code> <button type=\"button\" class=\"copy\">copy</button></p>\n</div></div>\n</article>\n";
}

}  // namespace

std::vector<Review> reviews_of(const Path& study, const std::vector<std::string>& names,
                               const std::vector<Path>& folders) {
  std::vector<Review> reviews(names.size());
  const Path file = study / kReview;
  if (!files::is_own_file(file)) return reviews;
  const files::CsvTable rows = files::read_records(files::read_table_text(file), file.string(), "cell",
                                                   {"cell", "fibre_id", "verdict", "note", "segmentation"});
  rows.require({"cell", "fibre_id", "verdict"});
  for (int row = 0; row < rows.n_rows(); ++row) {
    const std::size_t i = index_of_cell(names, rows, row);
    Review& review = reviews[i];
    const std::string verdict = rows.text(row, "verdict");
    if (!verdict.empty() && verdict != kAccepted && verdict != kLeftOut)
      rows.fail(row, "verdict", std::string(kAccepted) + ", " + kLeftOut + " or nothing");
    const std::string note = rows.has("note") ? rows.text(row, "note") : "";
    if (rows.text(row, "fibre_id").empty()) {
      review.verdict = verdict;
      review.note = note;
      continue;
    }
    const int fibre = rows.integer(row, "fibre_id", 1);
    if (verdict != kLeftOut) continue;
    if (rows.has("segmentation") && rows.text(row, "segmentation") != segmentation_of(folders[i])) {
      review.is_of_other_fibres = true;
      continue;
    }
    review.fibres_left_out.push_back(fibre);
  }
  return reviews;
}

std::string reason_to_exclude(const Review& review) {
  if (review.verdict != kLeftOut) return {};
  return std::string("left out by ") + kReview + (review.note.empty() ? "" : ": " + review.note);
}

void take_review(const Review& review, StudyCell& cell, std::vector<std::string>& warnings) {
  const auto is_left_out = [&](int id) { return has(review.fibres_left_out, id); };
  cell.review = review;
  std::erase_if(cell.cell.fibres, [&](const Fibre& fibre) { return is_left_out(fibre.fibre_id); });
  std::erase_if(cell.tensions, [&](const Tension& t) { return is_left_out(t.fibre_id); });
  std::erase_if(cell.directions, [&](const Direction& d) { return d.fibre_id && is_left_out(*d.fibre_id); });
  if (review.is_of_other_fibres)
    warnings.push_back("Cell " + cell.name + " was segmented again after its review: what " + kReview +
                       " says of its fibres does not count. Review it again.");
}

std::string review_html(const Study& study, const Path& page_folder) {
  const std::string up = study.folder.lexically_proximate(page_folder).generic_string() + "/";
  std::string body = "<style>\n" + std::string(kReviewStyle) + "</style>\n";
  const Path file = study.folder / kReview;
  body += fmt::format("<div data-study=\"{} {}\"></div>\n", html_escaped(fs::weakly_canonical(study.folder).string()),
                      files::is_own_file(file) ? files::sha256_of_file(file) : "");
  body += report::text_of("study.review-buttons") + "\n" + report::note("study.review");
  for (const StudyCell& cell : study.cells) {
    const auto n_open = std::ranges::count_if(cell.findings, is_open);
    body += article_of(study, cell.name, cell.review,
                       n_open == 0 ? "no open finding" : counted(n_open, "open findings") + ": see the report", up);
  }
  for (const LeftOutCell& cell : study.left_out)
    if (files::is_own_file(study.folder_of(cell.name) / "1_segment/overlay.png"))
      body += article_of(study, cell.name, cell.review, "left out: " + cell.reason, up);
  body += "<script>\n" + std::string(kReviewScript) + "</script>\n";
  return report::html_of(report::Page{.title = "Review of the cells", .body = body});
}

}  // namespace mbtfm::statistics
