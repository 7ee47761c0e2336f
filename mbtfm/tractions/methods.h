/// All methods that find tractions without a network, and where those of flat surfaces are.
#pragma once

#include <array>

namespace mbtfm::tractions {

struct TractionInputs;
struct TractionParameters;
struct Reconstruction;

enum class TractionMethod {
  // beads of a flat surface, displaced along it
  fttc,
  sparse,
  trpf,
  bem,
  adhesion_forces,
  // beads in space: mbtfm/spatial
  tikhonov,   ///< one lambda for all
  group_l1,   ///< zero in most places
  patches,    ///< a force on each adhesion, and a weak background
  adjoint,    ///< the equations of tikhonov, by its adjoint
  direct,     ///< the displacement measured is imposed on the surface
  green,      ///< even tractions on facets
  thesis_cg,  ///< the minimum of tikhonov, by the thesis' minimiser
};
constexpr auto words(TractionMethod) {
  return std::array{"fttc",     "sparse",  "trpf",    "bem",    "adhesion-forces", "tikhonov",
                    "group-l1", "patches", "adjoint", "direct", "green",           "thesis-cg"};
}

using FlatMethod = Reconstruction(const TractionInputs& inputs, const TractionParameters& parameters, int threads);
FlatMethod reconstruct_fttc;
/// Group L1, its weight by generalised cross-validation.
FlatMethod reconstruct_sparse;
/// A force at the centre of each adhesion, with a Tikhonov penalty.
FlatMethod reconstruct_point_forces;
/// Tractions on square elements that cover the cell, with a Tikhonov penalty.
FlatMethod reconstruct_elements;
/// One force for each adhesion, spread evenly over its ellipse; no regularisation.
FlatMethod reconstruct_adhesion_forces;

struct NamedFlatMethod {
  TractionMethod method;
  FlatMethod* reconstruct;
};
inline constexpr NamedFlatMethod kFlatMethods[] = {{TractionMethod::fttc, reconstruct_fttc},
                                                   {TractionMethod::sparse, reconstruct_sparse},
                                                   {TractionMethod::trpf, reconstruct_point_forces},
                                                   {TractionMethod::bem, reconstruct_elements},
                                                   {TractionMethod::adhesion_forces, reconstruct_adhesion_forces}};
/// None where the method takes beads in space.
constexpr FlatMethod* flat_method(TractionMethod method) {
  for (const NamedFlatMethod& flat : kFlatMethods)
    if (flat.method == method) return flat.reconstruct;
  return nullptr;
}

}  // namespace mbtfm::tractions
