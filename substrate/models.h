/// A model of the gel as a row of a table. Each is in its own file (docs/extending.md).
#pragma once

#include <memory>
#include <vector>

#include "substrate/compliance.h"

namespace mbtfm::substrate {

struct Model {
  ModelKind kind;
  Capabilities can;
  std::unique_ptr<Substrate> (*make)(const Gel& gel, const SubstrateParameters& parameters, int threads);
  /// The parameters with which its own error stays below a tolerance; null: it has none.
  SubstrateParameters (*within)(SubstrateParameters parameters, double tolerance) = nullptr;
  /// Whether it can follow what the parameters say of the gel; null: always.
  bool (*follows)(const Gel& gel, const SubstrateParameters& parameters) = nullptr;
};

template <class Kind>
std::unique_ptr<Substrate> make_model(const Gel& gel, const SubstrateParameters& parameters, int threads) {
  return std::make_unique<Kind>(gel, parameters, threads);
}

/// @throws UsageError where the table has no such model or it takes no incompressible gel, InvalidData as check(gel)
std::unique_ptr<Substrate> make_from(const std::vector<Model>& table, const Gel& gel,
                                     const SubstrateParameters& parameters, int threads);

/// @throws InvalidData where a force is not finite or their number is not that of the ellipses
void check_forces(const std::vector<Ellipse>& ellipses, const std::vector<Vec2>& forces_nN);

/// Forces or displacements x, y as a column, and back.
VectorXd column_of(const std::vector<Vec2>& vectors);
std::vector<Vec2> vectors_of(const VectorXd& column);

/// Whether the displacement along z is wanted, too.
bool asks_for_vertical(const SubstrateParameters& parameters);

/// From the scene to the block's sides: the gel's own, or so far that they do not matter.
double margin_um(const Gel& gel, const SubstrateParameters& parameters);

}  // namespace mbtfm::substrate
