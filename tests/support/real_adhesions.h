/// A published fibroblast with its labels (Berginski et al. 2011), where the shared data are present.
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "segment/ellipse.h"
#include "segment/image.h"

namespace mbtfm::test {

inline const std::filesystem::path kFibroblast =
    std::filesystem::path(MBTFM_SOURCE_DIR).parent_path() / "shared/data/fa/faas_fibro100_wt02";

/// Rows of a table of numbers without a header.
inline std::vector<std::vector<double>> numbers_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<std::vector<double>> rows;
  for (std::string line; std::getline(in, line);) {
    std::istringstream fields(line);
    rows.emplace_back();
    for (std::string field; std::getline(fields, field, ',');) rows.back().push_back(std::stod(field));
  }
  return rows;
}

/// Pixels by label.
using Labels = std::map<int, std::vector<segment::CoveredPixel>>;

inline Labels labels_of(const segment::Image& image) {
  Labels labels;
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column)
      if (const int label = static_cast<int>(image.at(column, row))) labels[label].push_back({column, row, 1, 0});
  return labels;
}

struct Overlap {
  double dice = 0;  ///< of the pixels of all objects
  double f1 = 0;    ///< of the objects of at least five pixels, hit where intersection over union is 0.3
  int n_true = 0, n_found = 0;
};

inline Overlap overlap_of(const Labels& truth, const Labels& found) {
  std::map<std::pair<int, int>, int> label_at;
  std::size_t n_truth = 0, n_found = 0, n_both = 0;
  for (const auto& [label, pixels] : found)
    for (const auto& p : pixels) label_at[{p.column, p.row}] = label;
  n_found = label_at.size();
  std::map<std::pair<int, int>, int> shared;
  for (const auto& [label, pixels] : truth)
    for (const auto& p : pixels) {
      ++n_truth;
      const auto there = label_at.find({p.column, p.row});
      if (there == label_at.end()) continue;
      ++n_both;
      ++shared[{label, there->second}];
    }
  Overlap o;
  o.dice = 2.0 * n_both / (n_truth + n_found);
  for (const auto& [label, pixels] : truth) o.n_true += pixels.size() >= 5;
  for (const auto& [label, pixels] : found) o.n_found += pixels.size() >= 5;
  int n_hits = 0;
  for (const auto& [pair, n] : shared) {
    const std::size_t t = truth.at(pair.first).size(), f = found.at(pair.second).size();
    n_hits += t >= 5 && f >= 5 && 1.0 * n / static_cast<double>(t + f - n) >= 0.3;
  }
  o.f1 = 2.0 * n_hits / (o.n_true + o.n_found);
  return o;
}

}  // namespace mbtfm::test
