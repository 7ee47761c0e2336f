/// The half-space and the layer against closed forms, brute-force quadrature and independently computed values.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>

#include "substrate/layer.h"

namespace mbtfm::substrate {
namespace {

using std::numbers::pi;

/// Rows of numbers below a header line.
std::vector<std::vector<double>> rows_of(const std::string& name) {
  std::ifstream file(std::string(MBTFM_SOURCE_DIR) + "/tests/data/reference/substrate/" + name);
  std::vector<std::vector<double>> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream fields(line);
    std::string field;
    rows.emplace_back();
    while (std::getline(fields, field, ',')) rows.back().push_back(std::stod(field));
  }
  return rows;
}

/// The gel of the first columns; a thickness of inf is the half-space, told by a gel without one.
Gel gel_of(const std::vector<double>& row) {
  return {.youngs_modulus_kPa = row[0], .poisson_ratio = row[1], .thickness_um = row[2]};
}

/// One table for each gel of the rows.
const Layer& layer_of(const Gel& gel) {
  static std::map<std::pair<double, double>, Layer> layers;
  return layers.try_emplace({gel.poisson_ratio, gel.thickness_um}, gel).first->second;
}

double relative_difference(const Sym2& value, const Sym2& reference) {
  const auto size = [](double xx, double xy, double yy) { return std::sqrt(xx * xx + 2 * xy * xy + yy * yy); };
  return size(value.xx - reference.xx, value.xy - reference.xy, value.yy - reference.yy) /
         size(reference.xx, reference.xy, reference.yy);
}

Sym2 cerruti_surface(const Gel& gel, Vec2 offset) {
  const double r = norm(offset);
  const Vec2 e = (1 / r) * offset;
  const double nu = gel.poisson_ratio;
  return 1 / (2 * pi * shear_modulus_kPa(gel) * r) *
         Sym2{1 - nu + nu * e.x * e.x, nu * e.x * e.y, 1 - nu + nu * e.y * e.y};
}

TEST(Layer, equals_independent_values_of_a_point_force_in_every_row) {
  const auto rows = rows_of("layer_point.csv");
  ASSERT_EQ(rows.size(), 96u);
  for (const auto& row : rows) {
    const Gel gel = gel_of(row);
    const Vec2 offset = {row[3], row[4]};
    const Sym2 reference = {row[5], row[6], row[7]};
    const Sym2 value =
        std::isinf(gel.thickness_um) ? cerruti_surface(gel, offset) : layer_of(gel).point_compliance_um_per_nN(offset);
    // the rows are good to 1e-9, the table to 1e-12 of the half-space's field
    EXPECT_LT(relative_difference(value, reference), 1e-8)
        << "nu " << row[1] << " h " << row[2] << " r " << norm(offset);
  }
}

TEST(Layer, equals_independent_values_of_an_ellipse_in_every_row) {
  const auto rows = rows_of("layer_ellipse.csv");
  ASSERT_EQ(rows.size(), 96u);
  for (const auto& row : rows) {
    const Gel gel = gel_of(row);
    const Ellipse ellipse = {
        .centre_um = {3, -7}, .semi_major_um = row[3], .semi_minor_um = row[4], .angle_rad = row[5]};
    const Vec2 point = ellipse.centre_um + Vec2{row[6], row[7]};
    const Sym2 reference = {row[8], row[9], row[10]};
    double difference = 0;
    if (std::isinf(gel.thickness_um)) {
      difference = relative_difference(HalfSpaceEllipse(gel, ellipse).compliance_um_per_nN(point), reference);
    } else {
      difference = relative_difference(LayerEllipse(layer_of(gel), ellipse).compliance_um_per_nN(point), reference);
    }
    // the rules leave out less than 1e-8 of the nearby field
    EXPECT_LT(difference, 1e-8) << "nu " << row[1] << " h " << row[2] << " r " << norm({row[6], row[7]});
  }
}

}  // namespace
}  // namespace mbtfm::substrate
