#include "segment/survey/survey.h"

#include <algorithm>
#include <cmath>

#include "pipeline/charts/chart.h"
#include "pipeline/files/base64.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::survey {
namespace {

constexpr int kSide_px = 200;

images::Image middle_of(const images::Image& image) {
  images::Image middle;
  middle.width = std::min(kSide_px, image.width), middle.height = std::min(kSide_px, image.height);
  const int left = (image.width - middle.width) / 2, top = (image.height - middle.height) / 2;
  for (int j = 0; j < middle.height; ++j)
    for (int i = 0; i < middle.width; ++i) middle.pixels.push_back(image.at(left + i, top + j));
  return middle;
}

images::Image reduced(const images::Image& image) {
  const int side = std::max(image.width, image.height);
  return images::binned(image, std::clamp((side + kSide_px - 1) / kSide_px, 1, std::min(image.width, image.height)));
}

images::Picture grey(const images::Image& image) {
  std::vector<double> values(image.pixels.begin(), image.pixels.end());
  const double low = numerics::quantile(values, 0.01), high = numerics::quantile(std::move(values), 0.995);
  images::Picture picture{.width = image.width, .height = image.height, .rgb = {}};
  for (const float value : image.pixels) {
    const double level = high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0;
    picture.rgb.insert(picture.rgb.end(), 3, static_cast<std::uint8_t>(std::lround(255 * level)));
  }
  return picture;
}

std::string html_of(const Thumbnail& thumbnail, const std::string& kind) {
  return "<img class=\"" + kind + "\" alt=\"" + thumbnail.what + "\" src=\"data:image/png;base64," +
         files::base64(images::png_of(thumbnail.picture)) + "\">";
}

bool is_of_beads(const Thumbnail& thumbnail) { return thumbnail.what.starts_with("beads"); }

std::string html_of(const PageRow& row) {
  std::string html = "<tr><td><b>" + charts::html_escaped(row.cell) + "</b><br>" + charts::html_escaped(row.facts);
  for (const std::string& doubt : row.doubts) html += "<p class=\"doubt\">" + charts::html_escaped(doubt) + "</p>";
  if (row.doubts.empty()) html += "<p class=\"fine\">fine</p>";
  html += "</td>";
  std::string beads;
  for (const Thumbnail& t : row.thumbnails) {
    if (is_of_beads(t))
      beads += html_of(t, beads.empty() ? "beads" : "beads second");
    else
      html += "<td>" + html_of(t, "still") + t.what + "</td>";
  }
  if (!beads.empty()) html += "<td><div class=\"pair\">" + beads + "</div>beads, relaxed and stressed</td>";
  return html + "</tr>\n";
}

}  // namespace

std::vector<Thumbnail> thumbnails_of(const CellImages& images) {
  std::vector<Thumbnail> thumbnails;
  if (images.adhesion) thumbnails.push_back({"adhesion", grey(reduced(images.adhesion->image))});
  if (images.actin) thumbnails.push_back({"actin", grey(reduced(images.actin->image))});
  if (images.beads_relaxed) thumbnails.push_back({"beads_relaxed", grey(middle_of(images.beads_relaxed->image))});
  if (images.beads_stressed) thumbnails.push_back({"beads_stressed", grey(middle_of(images.beads_stressed->image))});
  return thumbnails;
}

std::string page_of(const std::string& title, const std::vector<PageRow>& rows) {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" + charts::html_escaped(title) +
      "</title>\n<style>body{font:15px sans-serif;margin:1.5em}td{vertical-align:top;padding:.4em 1em .8em 0;"
      "border-top:1px solid #ccc;color:#555;font-size:13px}td:first-child{width:24em;color:#222;font-size:15px}"
      "img{width:200px;display:block}.pair{position:relative;min-height:1px}.second{position:absolute;top:0;left:0;"
      "animation:blink 1.2s steps(1) infinite}@keyframes blink{0%{opacity:0}50%{opacity:1}}"
      ".doubt{color:#9a4500;margin:.4em 0}.fine{color:#1a6e2e;margin:.4em 0}</style></head>\n<body><h1>" +
      charts::html_escaped(title) +
      "</h1>\n<p>Does each column show what it says? The bead images take turns: beads near the cell must move, those "
      "far from it stay or all move alike.</p>\n<table>\n";
  for (const PageRow& row : rows) html += html_of(row);
  return html + "</table></body></html>\n";
}

}  // namespace mbtfm::survey
