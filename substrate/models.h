/// The models: each in its own file, listed once in a table.
#pragma once

#include <memory>
#include <vector>

#include "substrate/compliance.h"

namespace mbtfm::substrate {

struct Model {
  ModelKind kind;
  std::unique_ptr<Substrate> (*make)(const Gel& gel, const SubstrateParameters& parameters, int threads);
  bool takes_incompressible = false;  ///< Poisson's ratio 0.5: where no bulk modulus, which is infinite then, stands
};

/// @throws UsageError where the table has no such model or it takes no incompressible gel, InvalidData as check(gel)
std::unique_ptr<Substrate> make_from(const std::vector<Model>& table, const Gel& gel,
                                     const SubstrateParameters& parameters, int threads);

/// @throws InvalidData where a force is not finite or their number is not that of the ellipses
void check_forces(const std::vector<Ellipse>& ellipses, const std::vector<Vec2>& forces_nN);

/// Whether the displacement along z is wanted, too.
bool asks_for_vertical(const SubstrateParameters& parameters);

/// From the scene to the block's sides: the gel's own, or so far that they do not matter.
double margin_um(const Gel& gel, const SubstrateParameters& parameters);

}  // namespace mbtfm::substrate
