/// Exact fields under curved surfaces (tests/data/reference/curved).
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "pipeline/contract/gel.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/files/csv.h"
#include "samples/gels/field.h"
#include "tests/support/folders.h"
#include "tests/support/test.h"

namespace mbtfm {

using gels::FieldUnderASurface;

/// A case of tests/data/reference/curved.
struct CurvedCase {
  std::string name;
  std::function<double(Vec2)> height_um;
  double base_um = 0;
  std::vector<FieldUnderASurface::Source> sources;
  double youngs_modulus_kPa = 0;

  Gel gel(double poisson_ratio) const { return {youngs_modulus_kPa, poisson_ratio, base_um}; }
  FieldUnderASurface field(double poisson_ratio) const { return {sources, youngs_modulus_kPa, poisson_ratio, base_um}; }
};

struct CurvedValue {
  double poisson_ratio;
  Vec3 position_um;
  Eigen::Vector3d displacement_um;
};

inline std::filesystem::path curved_folder(const std::string& name) {
  return test::source_folder() / "tests/data/reference/curved" / name;
}

inline CurvedCase curved_case(const std::string& name) {
  std::ifstream file(curved_folder(name) / "case.json");
  const nlohmann::json json = nlohmann::json::parse(file);
  const auto number = [&](const char* key) { return json.at(key).get<double>(); };
  const std::string kind = json.at("surface").get<std::string>();
  CurvedCase made{.name = name, .base_um = number("base_z_um"), .youngs_modulus_kPa = number("youngs_modulus_kPa")};
  if (kind == "wave") {
    made.height_um = [a = number("amplitude_um"), period = number("period_um"), phase = number("phase_um")](Vec2 p) {
      return -a * std::cos(2 * std::numbers::pi * (p.x - phase) / period);
    };
  } else if (kind == "eggbox") {
    made.height_um = [a = number("amplitude_um"), k = 2 * std::numbers::pi / number("period_um")](Vec2 p) {
      return -a * std::cos(k * p.x) * std::cos(k * p.y);
    };
  } else {
    made.height_um = [w = number("width_um"), d = number("depth_um"), wall = number("wall_um")](Vec2 p) {
      return d / 2 * (std::tanh((p.x + w / 2) / wall) - std::tanh((p.x - w / 2) / wall));
    };
  }
  const files::CsvTable sources(curved_folder(name) / "sources.csv");
  for (int row = 0; row < sources.n_rows(); ++row) {
    const auto vector = [&](const char* x, const char* y, const char* z) {
      return Eigen::Vector3d(sources.number(row, x), sources.number(row, y), sources.number(row, z));
    };
    made.sources.push_back({vector("x_um", "y_um", "z_um"), vector("fx_nN", "fy_nN", "fz_nN")});
  }
  return made;
}

inline std::vector<CurvedValue> curved_values(const std::string& name, double poisson_ratio) {
  const files::CsvTable table(curved_folder(name) / "volume.csv");
  std::vector<CurvedValue> values;
  for (int row = 0; row < table.n_rows(); ++row) {
    if (table.number(row, "poisson_ratio") != poisson_ratio) continue;
    const auto at = [&](const char* column) { return table.number(row, column); };
    values.push_back({poisson_ratio, {at("x_um"), at("y_um"), at("z_um")}, {at("ux_um"), at("uy_um"), at("uz_um")}});
  }
  return values;
}

}  // namespace mbtfm
