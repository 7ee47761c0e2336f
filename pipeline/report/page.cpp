#include "pipeline/report/page.h"

#include <fmt/format.h>

#include <cctype>
#include <regex>

#include "pipeline/contract/version.h"
#include "pipeline/files/base64.h"
#include "pipeline/files/text.h"

namespace mbtfm::report {

// page.css and page.js, made into one C++ file by the build
extern const std::string_view kStyle, kScript;

namespace {

std::string anchor_of(const std::string& title) {
  std::string anchor;
  for (const char c : title) anchor += c == ' ' ? '-' : c;
  return anchor;
}

/// Heard, not seen: a heading above the table says the same.
std::string caption_of(const std::string& text) {
  return text.empty() ? "" : "<caption class=\"heard\">" + html_escaped(text) + "</caption>";
}

/// Links to the sections of a body.
std::string contents(const std::string& body) {
  static const std::string kOpening = "<section id=\"", kTitle = "<h2>", kEnd = "</h2>";
  std::string links;
  for (std::size_t at = 0; (at = body.find(kOpening, at)) != body.npos;) {
    at += kOpening.size();
    const std::string id = body.substr(at, body.find('"', at) - at);
    const std::size_t title = body.find(kTitle, at) + kTitle.size();
    links += "<a href=\"#" + id + "\">" + body.substr(title, body.find(kEnd, title) - title) + "</a>";
  }
  return "<nav>" + links + "</nav>\n";
}

}  // namespace

std::string html_of(const Table& table) {
  // no <button>: browsers leave these out of the titles that they repeat on each printed page
  std::string html = "<div class=\"scroll\" tabindex=\"0\"><table>" + caption_of(table.caption) + "<thead><tr>";
  for (const Table::Column& column : table.columns) {
    html += std::string("<th") + (column.is_number ? " class=\"n\"" : "") +
            " scope=\"col\"><span role=\"button\" tabindex=\"0\" title=\"click to sort\">" +
            html_escaped(column.title) + "</span></th>";
  }
  html += "</tr></thead><tbody>\n";
  for (const auto& row : table.rows) {
    html += "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i)
      html += std::string(table.columns[i].is_number ? "<td class=\"n\">" : "<td>") + row[i] + "</td>";
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

std::string html_of(const Table& table, const Download& csv) {
  return "<div class=\"table\">" + html_of(table) +
         fmt::format(
             "<a class=\"download\" download=\"{0}\" href=\"data:text/csv;base64,{1}\">Download {0}</a></div>\n",
             html_escaped(csv.name), files::base64(csv.text));
}

std::string html_of_pairs(const std::string& caption, const std::vector<std::pair<std::string, std::string>>& pairs) {
  std::string html = "<div class=\"scroll\" tabindex=\"0\"><table>" + caption_of(caption) + "<tbody>\n";
  for (const auto& [name, value] : pairs) {
    html += "<tr><th scope=\"row\">" + html_escaped(name) + "</th><td class=\"long\">" + html_escaped(value) +
            "</td></tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

std::string data_address(const Path& picture, const char* type) {
  return fmt::format("data:{};base64,{}", type, files::base64(files::read_text(picture)));
}

std::string printed(const std::string& text) {
  static const std::regex length(R"(\bum\b)"), area(R"(\bum2\b)"), plus_minus(R"(\+-)");
  const std::string lengths = std::regex_replace(text, length, "µm"), all = std::regex_replace(lengths, area, "µm²");
  return html_escaped(std::regex_replace(all, plus_minus, "±"));
}

std::string capitalised(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

std::string section(const std::string& title, const std::string& content) {
  return "<section id=\"" + html_escaped(anchor_of(title)) + "\"><h2>" + html_escaped(title) + "</h2>\n" + content +
         "</section>\n";
}

std::string folded(const std::string& title, const std::string& content) {
  return "<details><summary>" + html_escaped(title) + "</summary>\n" + content + "</details>\n";
}

std::string figure(const charts::Chart& chart, const std::string& caption, const std::string& legend) {
  std::string html = "<figure><h3>" + html_escaped(chart.title()) + "</h3>\n";
  if (!chart.subtitle().empty()) {
    html += fmt::format("<div class=\"note\" style=\"color:{}\">{}</div>\n",
                        charts::readable_on_white(chart.subtitle_colour()), html_escaped(chart.subtitle()));
  }
  if (!chart.keys().empty()) {
    html += "<div class=\"keys\">";
    for (const auto& [text, colour] : chart.keys())
      html += fmt::format("<span style=\"color:{}\">{}</span>", charts::readable_on_white(colour), html_escaped(text));
    html += "</div>\n";
  }
  return html + "<div class=\"chart\" role=\"img\" aria-label=\"" + html_escaped(chart.title()) + "\">" +
         chart.on_page() + "</div>\n" + legend +
         (caption.empty() ? "" : "<figcaption>" + html_escaped(caption) + "</figcaption>") + "</figure>\n";
}

std::string html_of(const Page& page) {
  const auto line = [](const char* kind, const std::string& text) {
    return text.empty() ? text : fmt::format("<p class=\"{}\">{}</p>\n", kind, html_escaped(text));
  };
  const std::string title = html_escaped(page.title);
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
         "content=\"width=device-width,initial-scale=1\"><link rel=\"icon\" href=\"data:,\"><title>" +
         title + " – mbtfm</title><style>" + std::string(kStyle) + "</style></head>\n<body><main>\n<h1>" + title +
         "</h1>" + line("what", page.what) +
         line("sub", page.sub + (page.sub.empty() ? "" : " · ") + "mbtfm " + std::string(kVersion)) +
         contents(page.body) + page.body + "</main><script>" + std::string(kScript) + "</script>\n</body></html>\n";
}

}  // namespace mbtfm::report
