#include "network/mesh/size_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/extent.h"

namespace mbtfm::mesh {

SizeField::SizeField(double edge_um, double growth, const std::vector<Vec2>& around_um)
    : edge_um_(edge_um), growth_(growth) {
  const auto [low, high] = extent_of(around_um);
  low_um_ = low + Vec2{-edge_um, -edge_um};  // adhesions may lie that far outside
  const Vec2 size = high - low_um_ + Vec2{edge_um, edge_um};
  // half an edge: a few sources a bin; fewer bins where a field of this fineness could never be filled with vertices
  constexpr double kMostBins = 4e6;
  bin_um_ = std::max(0.5 * edge_um, std::sqrt(size.x * size.y / kMostBins));
  columns_ = static_cast<int>(size.x / bin_um_) + 1;
  rows_ = static_cast<int>(size.y / bin_um_) + 1;
  bins_.assign(static_cast<std::size_t>(columns_) * rows_, {.bound_um = edge_um});
}

int SizeField::column_of(double x_um) const {
  return static_cast<int>(std::clamp((x_um - low_um_.x) / bin_um_, 0.0, columns_ - 1.0));
}

int SizeField::row_of(double y_um) const {
  return static_cast<int>(std::clamp((y_um - low_um_.y) / bin_um_, 0.0, rows_ - 1.0));
}

Vec2 SizeField::centre_of(int column, int row) const { return low_um_ + bin_um_ * Vec2{column + 0.5, row + 0.5}; }

void SizeField::refine(Vec2 point_um, double size_um) {
  if (size_um >= at(point_um)) return;
  const double reach = (edge_um_ - size_um) / growth_;
  const double half_diagonal = bin_um_ / std::numbers::sqrt2;
  for (int row = row_of(point_um.y - reach); row <= row_of(point_um.y + reach); ++row) {
    for (int column = column_of(point_um.x - reach); column <= column_of(point_um.x + reach); ++column) {
      Bin& bin = bins_[static_cast<std::size_t>(row) * columns_ + column];
      const Vec2 centre = centre_of(column, row);
      const auto least = [&](const Source& s) {
        return s.size_um + growth_ * std::max(0.0, norm(centre - s.point_um) - half_diagonal);
      };
      const Source source = {point_um, size_um};
      if (least(source) >= bin.bound_um) continue;
      bin.bound_um = std::min(bin.bound_um, size_um + growth_ * (norm(centre - point_um) + half_diagonal));
      std::erase_if(bin.sources, [&](const Source& s) { return least(s) > bin.bound_um; });
      bin.sources.push_back(source);
    }
  }
}

double SizeField::at(Vec2 point_um) const {
  double size = edge_um_;
  const Bin& bin = bins_[static_cast<std::size_t>(row_of(point_um.y)) * columns_ + column_of(point_um.x)];
  for (const Source& s : bin.sources) {
    const Vec2 gap = point_um - s.point_um;
    size = std::min(size, s.size_um + growth_ * std::sqrt(dot(gap, gap)));
  }
  return size;
}

}  // namespace mbtfm::mesh
