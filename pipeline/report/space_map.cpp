#include "pipeline/report/space_map.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "pipeline/contract/errors.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/own_files.h"
#include "pipeline/report/space_results.h"

namespace mbtfm::report {
namespace {

constexpr const char* kTruth = "truth/surface_traction.csv";

/// The lines of a lattice, each once: files have nine digits.
std::vector<double> lines_of(const std::vector<Vec3>& places, double Vec3::*axis) {
  std::vector<double> all;
  for (const Vec3& at : places) all.push_back(at.*axis);
  std::ranges::sort(all);
  constexpr double kSame_um = 1e-3;
  std::vector<double> lines;
  for (const double x : all)
    if (lines.empty() || x - lines.back() > kSame_um) lines.push_back(x);
  return lines;
}

int nearest_line(const std::vector<double>& lines, double x) {
  const auto after = std::ranges::lower_bound(lines, x);
  if (after == lines.begin()) return 0;
  if (after == lines.end()) return static_cast<int>(lines.size()) - 1;
  const auto i = static_cast<int>(after - lines.begin());
  return *after - x < x - *(after - 1) ? i : i - 1;
}

/// The interval of two lines in which x lies, and where in it; none outside.
std::optional<std::pair<int, double>> interval_of(const std::vector<double>& lines, double x) {
  if (lines.size() < 2 || x < lines.front() || x > lines.back()) return std::nullopt;
  const auto after = std::ranges::upper_bound(lines, x);
  const auto i = std::min(static_cast<int>(after - lines.begin()), static_cast<int>(lines.size()) - 1) - 1;
  const auto at = static_cast<std::size_t>(i);
  return std::pair{i, (x - lines[at]) / (lines[at + 1] - lines[at])};
}

/// Bilinear between the places of a map.
class Between {
 public:
  explicit Between(const SpaceMap& map) : x_(lines_of(map.at_um, &Vec3::x)), y_(lines_of(map.at_um, &Vec3::y)) {
    for (std::size_t k = 0; k < map.at_um.size(); ++k)
      at_[{nearest_line(x_, map.at_um[k].x), nearest_line(y_, map.at_um[k].y)}] = map.traction_kPa[k];
  }
  Vec3 operator()(const Vec3& place) const {
    const auto x = interval_of(x_, place.x), y = interval_of(y_, place.y);
    if (!x || !y) return {};
    Vec3 sum;
    for (const int i : {0, 1}) {
      for (const int j : {0, 1}) {
        const auto found = at_.find({x->first + i, y->first + j});
        const double share = (i == 1 ? x->second : 1 - x->second) * (j == 1 ? y->second : 1 - y->second);
        if (found != at_.end()) sum += share * found->second;
      }
    }
    return sum;
  }

 private:
  std::vector<double> x_, y_;
  std::map<std::pair<int, int>, Vec3> at_;
};

}  // namespace

SpaceMap read_space_map(const fs::path& cell) {
  const SpaceResults results = read_space_results(cell);
  SpaceMap map;
  map.total_force_nN = results.number("total_force_nN");
  double errors = 0, size = 0;
  bool has_errors = true;
  for (const SurfaceTraction& t : results.tractions) {
    map.at_um.push_back(t.at_um);
    map.traction_kPa.push_back(t.traction_kPa);
    map.area_um2.push_back(t.area_um2);
    size += t.area_um2 * dot(t.traction_kPa, t.traction_kPa);
    has_errors = has_errors && t.sigma_kPa;
    if (t.sigma_kPa) errors += t.area_um2 * dot(*t.sigma_kPa, *t.sigma_kPa);
  }
  if (has_errors && size > 0) map.stated_error = std::sqrt(errors / size);
  return map;
}

bool has_space_truth(const fs::path& cell) { return files::is_own_file(cell / kTruth); }

SpaceMap true_space_map(const fs::path& cell) {
  const files::CsvTable table(cell / kTruth);
  table.require({"x_um", "y_um", "z_um", "nz", "tx_kPa", "ty_kPa", "tz_kPa"});
  SpaceMap map;
  for (int row = 0; row < table.n_rows(); ++row) {
    map.at_um.push_back({table.number(row, "x_um"), table.number(row, "y_um"), table.number(row, "z_um")});
    map.traction_kPa.push_back({table.number(row, "tx_kPa"), table.number(row, "ty_kPa"), table.number(row, "tz_kPa")});
    map.area_um2.push_back(1 / std::abs(table.number(row, "nz")));
  }
  const std::vector<double> x = lines_of(map.at_um, &Vec3::x), y = lines_of(map.at_um, &Vec3::y);
  if (x.size() < 2 || y.size() < 2)
    throw InputError((cell / kTruth).string(), "a lattice of places", std::to_string(map.at_um.size()) + " in a line");
  const double step_um2 = (x[1] - x[0]) * (y[1] - y[0]);
  for (std::size_t k = 0; k < map.at_um.size(); ++k) {
    map.area_um2[k] *= step_um2;
    map.total_force_nN += map.area_um2[k] * norm(map.traction_kPa[k]);
  }
  return map;
}

double difference(const SpaceMap& map, const SpaceMap& reference) {
  const Between found(map);
  double wrong = 0, size = 0;
  for (std::size_t k = 0; k < reference.at_um.size(); ++k) {
    const Vec3 off = found(reference.at_um[k]) - reference.traction_kPa[k];
    wrong += reference.area_um2[k] * dot(off, off);
    size += reference.area_um2[k] * dot(reference.traction_kPa[k], reference.traction_kPa[k]);
  }
  return size > 0 ? std::sqrt(wrong / size) : 0;
}

}  // namespace mbtfm::report
