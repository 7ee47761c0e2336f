/// What `half-space` and `layer` share: columns from a function of the load and the point.
#pragma once

#include <chrono>
#include <mutex>
#include <optional>

#include "pipeline/numerics/parallel.h"
#include "substrate/compliance.h"
#include "substrate/greens/half_space.h"
#include "substrate/greens/inside.h"
#include "substrate/greens/wave.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm::greens {

inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Fill the matrix column pair by column pair: field_of(load) has the compliance at a point.
template <class Load, class FieldOf>
Eigen::MatrixXd compliance_by_columns(const std::vector<Vec2>& points_um, const std::vector<Load>& loads, int threads,
                                      const FieldOf& field_of) {
  Eigen::MatrixXd matrix(2 * points_um.size(), 2 * loads.size());
  numerics::parallel_for(static_cast<int>(loads.size()), threads, [&](int j) {
    const auto field = field_of(loads[j]);
    double* along_x = matrix.col(2 * j).data();
    double* along_y = matrix.col(2 * j + 1).data();
    for (std::size_t i = 0; i < points_um.size(); ++i) {
      const Sym2 g = field.compliance_um_per_nN(points_um[i]);
      along_x[2 * i] = g.xx;
      along_x[2 * i + 1] = g.xy;
      along_y[2 * i] = g.xy;
      along_y[2 * i + 1] = g.yy;
    }
  });
  return matrix;
}

/// A gel whose answers are closed forms: to ellipses, squares and waves, at the surface.
class GreensModel : public substrate::Substrate {
 public:
  GreensModel(const Gel& gel, const substrate::SubstrateParameters& parameters,
              const substrate::Capabilities& capabilities, int threads)
      : Substrate(parameters, capabilities), gel_(gel), threads_(threads) {}
  substrate::LazyResponse response(const substrate::Loads& loads,
                                   const substrate::Observations& observations) const final;

 protected:
  virtual Eigen::MatrixXd by_ellipses(const std::vector<Vec2>& points_um,
                                      const std::vector<substrate::Ellipse>& ellipses) const = 0;
  /// By 1 kPa on a square, at an offset from its centre.
  virtual Sym2 by_square_um_per_kPa(double side_um, Vec2 offset_um) const = 0;
  virtual WaveCompliance by_wave(double wave_number_per_um) const = 0;
  virtual std::vector<double> into_the_gel_um(const std::vector<Vec2>& points_um,
                                              const std::vector<substrate::Ellipse>& ellipses,
                                              const std::vector<Vec2>& forces_nN) const = 0;
  /// The deepest point, um; none: there is no base.
  virtual std::optional<double> base_um() const = 0;
  Gel gel_;
  int threads_;

 private:
  substrate::LazyResponse in_space(const substrate::Loads& loads, const substrate::Observations& observations) const;
  Eigen::MatrixXd by_squares(const std::vector<Vec2>& points_um, const std::vector<substrate::Square>& squares) const;
  Eigen::MatrixXd by_waves(const std::vector<Vec2>& points_um, const std::vector<substrate::Wave>& waves) const;
  Eigen::MatrixXd into_the_gel(const std::vector<Vec2>& points_um, const std::vector<substrate::Ellipse>& ellipses,
                               const Eigen::MatrixXd& forces_nN) const;
  mutable std::once_flag inside_once_;
  mutable std::optional<LayerInside> inside_;  ///< its table takes a fraction of a second
};

}  // namespace mbtfm::greens
