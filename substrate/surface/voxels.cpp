#include "substrate/surface/voxels.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::surface {
namespace {

/// Voxels of gel and of what is above it, once specks and bubbles are left out.
class Voxels {
 public:
  explicit Voxels(const VoxelStack& s) : s_(s), plane_(static_cast<std::size_t>(s.n_x) * s.n_y) {
    for (const float share : s.share) is_gel_.push_back(share >= 0.5f);
    seen_.assign(is_gel_.size(), 0);
  }

  /// Gel goes on below the last slice, what is above it over the first: a piece that does not reach that far, and is
  /// not the largest of its kind, becomes of the other kind. @return how many voxels did
  std::int64_t leave_out_pieces() {
    std::array<Piece, 2> largest;  // above, gel
    std::vector<Piece> pieces;
    for (std::size_t at = 0; at < is_gel_.size(); ++at) {
      if (seen_[at]) continue;
      const Piece piece = mark_piece(at, 1);
      pieces.push_back(piece);
      Piece& most = largest[is_gel_[at]];
      if (piece.n > most.n) most = piece;
    }
    std::int64_t n = 0;
    for (const Piece& piece : pieces) {
      const bool is_largest = piece.first == largest[0].first || piece.first == largest[1].first;
      if (is_largest || piece.goes_on) continue;
      const char kind = is_gel_[piece.first];
      n += mark_piece(piece.first, 2, [&](std::size_t at) { is_gel_[at] = static_cast<char>(1 - kind); }).n;
    }
    return n;
  }

  bool is_gel(std::size_t column, int slice) const {
    return is_gel_[column + plane_ * static_cast<std::size_t>(slice)];
  }
  std::size_t n_columns() const { return plane_; }

 private:
  struct Piece {
    std::size_t first = SIZE_MAX;
    std::int64_t n = 0;
    bool goes_on = false;  ///< beyond the stack, on its own side
  };

  Piece mark_piece(std::size_t first, char mark, const std::function<void(std::size_t)>& change = {}) {
    const char kind = is_gel_[first];
    std::vector<std::size_t> open = {first};
    seen_[first] = mark;
    const std::size_t own_end = kind ? static_cast<std::size_t>(s_.n_z) - 1 : 0;
    Piece piece{.first = first};
    while (!open.empty()) {
      const std::size_t at = open.back();
      open.pop_back();
      ++piece.n;
      const auto visit = [&](bool is_there, std::size_t next) {
        if (!is_there || seen_[next] == mark || is_gel_[next] != kind) return;
        seen_[next] = mark;
        open.push_back(next);
      };
      const std::size_t n_x = static_cast<std::size_t>(s_.n_x), x = at % n_x, y = at / n_x % s_.n_y, z = at / plane_;
      visit(x > 0, at - 1);
      visit(x + 1 < n_x, at + 1);
      visit(y > 0, at - n_x);
      visit(y + 1 < static_cast<std::size_t>(s_.n_y), at + n_x);
      visit(z > 0, at - plane_);
      visit(z + 1 < static_cast<std::size_t>(s_.n_z), at + plane_);
      piece.goes_on = piece.goes_on || z == own_end;
      if (change) change(at);
    }
    return piece;
  }

  const VoxelStack& s_;
  std::size_t plane_;
  std::vector<char> is_gel_, seen_;
};

}  // namespace

VoxelPoints points_of_masks(const VoxelStack& s) {
  MBTFM_ASSERT(s.share.size() == static_cast<std::size_t>(s.n_x) * s.n_y * s.n_z);
  Voxels voxels(s);
  VoxelPoints found{
      .points_um = {}, .sigma_um = s.step_um / std::sqrt(12), .n_voxels_left_out = voxels.leave_out_pieces()};
  for (std::size_t column = 0; column < voxels.n_columns(); ++column) {
    const Vec2 at = {(static_cast<double>(column % s.n_x) + 0.5) * s.pixel_um,
                     (static_cast<double>(column / s.n_x) + 0.5) * s.pixel_um};
    int first = 0, last = s.n_z;  // first slice of gel; first slice from which on all is gel
    while (first < s.n_z && !voxels.is_gel(column, first)) ++first;
    while (last > 0 && voxels.is_gel(column, last - 1)) --last;
    if (first == 0 || first == s.n_z) continue;  // begins above the stack, or below it
    constexpr int kMostOverhang = 2;             // slices: noise of a mask
    if (last - first > kMostOverhang) {
      throw InvalidData(
          "masks at x, y = " + brief(at.x) + ", " + brief(at.y) + " um", "a surface that is seen from above as a whole",
          "an overhang: gel from slice " + std::to_string(first + 1) + " on, none in slice " + std::to_string(last));
    }
    const auto share = [&](int slice) {
      return static_cast<double>(s.share[column + voxels.n_columns() * static_cast<std::size_t>(slice)]);
    };
    const double above = share(first - 1), in = share(first);
    const double between = above < 0.5 && in > 0.5 ? (0.5 - above) / (in - above) : 0.5;
    found.points_um.push_back({at.x, at.y, (first - 1 + between) * s.step_um});
  }
  if (2 * found.points_um.size() < voxels.n_columns()) {
    throw InvalidData("masks", "slices from above the gel's surface to below it, the gel white",
                      "a surface in " + std::to_string(found.points_um.size()) + " of " +
                          std::to_string(voxels.n_columns()) + " columns");
  }
  return found;
}

}  // namespace mbtfm::surface
