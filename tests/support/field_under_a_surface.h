/// The exact field of point forces above the surface of a gel on a rigid base: whatever the surface below them, the
/// gel under it is at rest if the surface carries the tractions of this field (tests/data/reference/curved).
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <complex>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "pipeline/contract/gel.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/files/csv.h"

namespace mbtfm {

class FieldUnderASurface {
 public:
  struct Source {
    Eigen::Vector3d position_um, force_nN;
  };
  FieldUnderASurface(std::vector<Source> sources, double youngs_modulus_kPa, double poisson_ratio, double base_um)
      : sources_(std::move(sources)), modulus_(youngs_modulus_kPa), nu_(poisson_ratio), base_(base_um) {}

  Eigen::Vector3d displacement_um(const Eigen::Vector3d& p) const { return at<double>(p); }
  /// By steps along the imaginary axis: exact to rounding.
  Eigen::Matrix3d gradient(const Eigen::Vector3d& p) const {
    using Complex = std::complex<double>;
    constexpr double kStep = 1e-30;
    Eigen::Matrix3d gradient;
    for (int j = 0; j < 3; ++j) {
      Eigen::Matrix<Complex, 3, 1> moved = p.cast<Complex>();
      moved[j] += Complex(0, kStep);
      gradient.col(j) = at<Complex>(moved).imag() / kStep;
    }
    return gradient;
  }
  Eigen::Matrix3d stress_kPa(const Eigen::Vector3d& p) const {
    const Eigen::Matrix3d g = gradient(p);
    const double mu = modulus_ / (2 * (1 + nu_)), lambda = 2 * mu * nu_ / (1 - 2 * nu_);
    return mu * (g + g.transpose()) + lambda * g.trace() * Eigen::Matrix3d::Identity();
  }

 private:
  // Kelvin's solution, its pressure, and the image behind the clamped plane: zeta = base - z upwards
  template <class Real>
  Eigen::Matrix<Real, 3, 1> at(const Eigen::Matrix<Real, 3, 1>& p) const {
    using Vector = Eigen::Matrix<Real, 3, 1>;
    const double mu = modulus_ / (2 * (1 + nu_)), k = 1 / (8 * std::numbers::pi * mu * (1 - nu_)), n = 3 - 4 * nu_;
    Vector sum = Vector::Zero();
    for (const Source& source : sources_) {
      const Eigen::Vector3d f(source.force_nN.x(), source.force_nN.y(), -source.force_nN.z());
      const Real zeta = base_ - p.z();
      const double zeta_s = base_ - source.position_um.z();
      const Vector x(p.x() - source.position_um.x(), p.y() - source.position_um.y(), zeta - zeta_s);
      const Vector m(x.x(), x.y(), -zeta - zeta_s);
      const auto dot_f = [&](const Vector& a) -> Real { return f.x() * a.x() + f.y() * a.y() + f.z() * a.z(); };
      const auto length = [](const Vector& a) -> Real {
        using std::sqrt;
        return sqrt(a.x() * a.x() + a.y() * a.y() + a.z() * a.z());
      };
      const auto kelvin = [&](const Vector& a) -> Vector {
        const Real r = length(a), g = dot_f(a) / (r * r * r);
        Vector u;
        for (int i = 0; i < 3; ++i) u[i] = 0.5 * k * (n * f[i] / r + a[i] * g);
        return u;
      };
      const Real r = length(m), r3 = r * r * r, r5 = r3 * r * r, fm = dot_f(m);
      const Real pressure = -k * fm / r3;
      Vector slope_u, slope_p;  // of the mirrored fields
      for (int i = 0; i < 3; ++i) {
        slope_u[i] = 0.5 * k * (-n * f.z() * m[i] / r3 + m.z() * f[i] / r3 - 3.0 * m.z() * fm * m[i] / r5);
        if (i == 2) slope_u[i] += 0.5 * k * fm / r3;
        slope_p[i] = -k * (f[i] / r3 - 3.0 * fm * m[i] / r5);
      }
      slope_u.z() = -slope_u.z();
      slope_p.z() = -slope_p.z();
      Vector u = kelvin(x) - kelvin(m);
      for (int i = 0; i < 3; ++i) u[i] += 2.0 / n * zeta * (slope_u[i] - 0.5 * zeta * slope_p[i]);
      u.z() += (1 - 1 / n) * zeta * pressure;
      u.z() = -u.z();
      sum += u;
    }
    return sum;
  }

  std::vector<Source> sources_;
  double modulus_, nu_, base_;
};

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
  return std::filesystem::path(MBTFM_SOURCE_DIR) / "tests/data/reference/curved" / name;
}

inline CurvedCase curved_case(const std::string& name) {
  std::ifstream file(curved_folder(name) / "case.json");
  const nlohmann::json json = nlohmann::json::parse(file);
  const auto number = [&](const char* key) { return json.at(key).get<double>(); };
  const std::string kind = json.at("surface").get<std::string>();
  CurvedCase made{.name = name,
                  .height_um = {},
                  .base_um = number("base_z_um"),
                  .sources = {},
                  .youngs_modulus_kPa = number("youngs_modulus_kPa")};
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
