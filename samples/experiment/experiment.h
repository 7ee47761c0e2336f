/// A whole synthetic experiment: a cell, the forces it exerts, how the gel gives way, and what is measured of it.
#pragma once

#include <optional>
#include <vector>

#include "network/mesh/mesh.h"
#include "pipeline/contract/beads.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/contract/network.h"
#include "pipeline/contract/results.h"
#include "pipeline/contract/work.h"
#include "samples/drawing/draw.h"
#include "samples/drawing/scenario.h"

namespace mbtfm::experiment {

struct Experiment {
  Cell cell;
  std::optional<Cell> neighbour;      ///< that pulls at the same gel; what else is here is of the first cell alone
  Network network;                    ///< the simulation's own; its shares refer to a mesh of kReferenceEdge_um
  std::vector<Tension> tensions;      ///< front(): the actin network, for a mesh of kReferenceEdge_um
  std::vector<AdhesionForce> forces;  ///< by adhesion, in rising label
  DisplacementField displacement;     ///< true, at the bead positions
  DisplacementField measured;         ///< with noise
  DisplacementField beyond;           ///< the same of beads that the relaxed picture alone shows, as the stage moved
  double noise_um = 0;                ///< standard deviation of a component
  double largest_displacement_um = 0;
  double total_force_nN = 0;  ///< sum of the adhesions' force magnitudes
};

/// The mesh to which the network's tension is referred: a reconstruction with this edge length finds it as it is.
inline constexpr double kReferenceEdge_um = 1.5;

/// Draw, contract, deform, measure. The network is the simulation's own: other edge length, other seed than any
/// reconstruction's.
/// @throws UsageError where the scenario leaves no room, NotSolved where the cables find no equilibrium
Experiment simulate(const drawing::ScenarioParameters& parameters, const Work& work = {});

/// The same of a cell that is given, with its tensions.
Experiment simulate(drawing::DrawnCell drawn, const drawing::ScenarioParameters& parameters, const Work& work = {});

/// How a network of this kind is made: all but its mesh.
mesh::NetworkParameters formulation(drawing::TrueNetwork network);

/// Gaussian noise on each component, of the seed's own stream.
DisplacementField with_noise(DisplacementField field, double noise_um, std::uint64_t seed);

/// Random positions on the field, no two nearer than the scenario's bead distance.
/// @throws UsageError where they do not fit
std::vector<Vec2> place_beads(const drawing::ScenarioParameters& parameters);

/// The same beyond the field, as far as the relaxed picture reaches.
std::vector<Vec2> place_beads_beyond(const drawing::ScenarioParameters& parameters);

}  // namespace mbtfm::experiment
