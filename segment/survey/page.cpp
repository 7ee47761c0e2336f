#include "segment/survey/survey.h"

#include <algorithm>
#include <cmath>

#include "pipeline/files/base64.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/report/page.h"

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

std::string image(const Thumbnail& thumbnail) {
  return "<img alt=\"" + thumbnail.what + " image\" src=\"data:image/png;base64," +
         files::base64(images::png_of(thumbnail.picture)) + "\">";
}

std::string figure(const std::string& images, const std::string& caption) {
  return "<figure><div class=\"pair\">" + images + "</div><figcaption>" + caption + "</figcaption></figure>";
}

std::string pictures(const PageRow& row) {
  std::string html = "<div class=\"cells\" style=\"grid-template-columns:repeat(auto-fill,210px)\">", beads;
  for (const Thumbnail& t : row.thumbnails) {
    if (t.what.starts_with("beads"))
      beads += image(t);
    else
      html += figure(image(t), t.what);
  }
  return html + (beads.empty() ? "" : figure(beads, "beads, relaxed and stressed")) + "</div>\n";
}

std::string html_of(const PageRow& row) {
  std::string html = "<p>" + report::printed(row.facts) + "</p>\n<ul class=\"findings\">";
  for (const std::string& doubt : row.doubts) html += "<li class=\"caution\">" + report::printed(doubt) + "</li>";
  if (row.doubts.empty()) html += "<li class=\"good\">fine</li>";
  return report::section(row.cell, html + "</ul>\n" + pictures(row));
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
  report::Page page{.title = title,
                    .what =
                        "Does each picture show what it says? The bead images take turns: beads near the cell must "
                        "move, those far from it stay or all move alike."};
  for (const PageRow& row : rows) page.body += html_of(row);
  return report::html_of(page);
}

}  // namespace mbtfm::survey
