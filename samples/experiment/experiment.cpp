#include "samples/experiment/experiment.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "network/cables/cables.h"
#include "network/mesh/mesh.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/numerics/memory.h"
#include "samples/drawing/random.h"
#include "substrate/choice/large_strain.h"
#include "substrate/compliance.h"
#include "substrate/greens/models.h"
#include "substrate/models.h"

namespace mbtfm::experiment {

namespace {

/// Far from the small numbers people give a reconstruction, so that the two never share a mesh.
constexpr std::uint64_t kFirstSimulationSeed = 0x73696d00;

/// So that the noise of beads beyond the field is not that of those in it.
constexpr std::uint64_t kBeyond = 0x62657900;

/// The simulation's network. The width of material that a cable represents is counted in cables of the reference mesh:
/// tension and stiffness by width are then those of the cell, whatever the mesh.
Network span(const Cell& cell, const drawing::ScenarioParameters& p) {
  mesh::NetworkParameters parameters = formulation(p.mechanics.simulation_network);
  parameters.edge_length_um = p.mechanics.simulation_edge_length_um;
  parameters.seed = kFirstSimulationSeed + p.seed;
  mesh::GeneratedNetwork generated = mesh::generate_network(cell, parameters);
  for (Link& link : generated.network.links)
    if (link.fibre_id == 0) link.share *= parameters.edge_length_um / kReferenceEdge_um;
  return std::move(generated.network);
}

std::vector<Tension> tensions_of(const drawing::DrawnCell& drawn, const drawing::TensionParameters& p) {
  std::vector<Tension> tensions(1 + drawn.cell.fibres.size());
  // surface tension of a triangular lattice of cables: sqrt(3) t / edge
  tensions.front().tension_nN = p.surface_tension_nN_per_um * kReferenceEdge_um / std::sqrt(3.0);
  for (std::size_t i = 0; i < drawn.cell.fibres.size(); ++i) {
    tensions[i + 1].fibre_id = drawn.cell.fibres[i].fibre_id;
    tensions[i + 1].tension_nN = drawn.tensions_nN[i];
  }
  return tensions;
}

/// Contract the network; the force of each adhesion on the substrate.
std::map<int, Vec2> forces_by_adhesion(const Network& network, const std::vector<Tension>& tensions) {
  const cables::CableNetwork cables(network);
  std::vector<double> by_group;
  for (const int id : cables.fibre_ids()) {
    const auto has_id = [&](const Tension& t) { return t.fibre_id == id; };
    by_group.push_back(std::ranges::find_if(tensions, has_id)->tension_nN);
  }
  const cables::Equilibrium equilibrium = cables.equilibrium(by_group);
  if (!equilibrium.report.converged) throw NotSolved(equilibrium.report);
  const VectorXd forces = cables.adhesion_forces_nN(by_group, equilibrium);
  std::map<int, Vec2> result;
  for (std::size_t i = 0; i < cables.adhesion_ids().size(); ++i)
    result[cables.adhesion_ids()[i]] = {forces[2 * i], forces[2 * i + 1]};
  return result;
}

std::vector<AdhesionForce> force_list(const Cell& cell, const std::map<int, Vec2>& forces) {
  std::set<int> connected;
  for (const Fibre& f : cell.fibres) {
    if (f.start_adhesion_id) connected.insert(*f.start_adhesion_id);
    if (f.end_adhesion_id) connected.insert(*f.end_adhesion_id);
  }
  std::vector<AdhesionForce> list;
  for (const Adhesion& a : cell.adhesions) {
    const auto found = forces.find(a.adhesion_id);
    list.push_back({.adhesion_id = a.adhesion_id,
                    .force_nN = found == forces.end() ? Vec2{} : found->second,
                    .sigma_nN = {},
                    .connected = connected.contains(a.adhesion_id),
                    .moment_nN_um = {}});
  }
  return list;
}

/// A drawn cell with what it pulls.
struct Pulling {
  Cell cell;
  Network network;
  std::vector<Tension> tensions;
  std::vector<AdhesionForce> forces;
};

Pulling contracted(drawing::DrawnCell drawn, const drawing::ScenarioParameters& p) {
  Pulling result;
  result.tensions = tensions_of(drawn, p.tension);
  result.cell = std::move(drawn.cell);
  result.network = span(result.cell, p);
  result.forces = force_list(result.cell, forces_by_adhesion(result.network, result.tensions));
  return result;
}

void move_by(Vec2 shift_um, Cell& cell) {
  for (Adhesion& a : cell.adhesions) a.position_um += shift_um;
  for (Fibre& f : cell.fibres)
    for (Vec2& point : f.points_um) point += shift_um;
  for (Vec2& point : cell.outline_um) point += shift_um;
  for (Polygon& hole : cell.holes_um)
    for (Vec2& point : hole) point += shift_um;
}

std::optional<Pulling> neighbour_of(const drawing::ScenarioParameters& p) {
  if (!p.neighbour_x_um && !p.neighbour_y_um) return std::nullopt;
  drawing::ScenarioParameters other = p;
  other.seed = p.seed + 1;
  Pulling result =
      contracted(drawing::draw_cell(p.cell, p.tension, drawing::field_um(p.microscope), other.seed), other);
  move_by({p.neighbour_x_um.value_or(0), p.neighbour_y_um.value_or(0)}, result.cell);
  return result;
}

DisplacementField displacement_of(const std::vector<const Pulling*>& cells, const std::vector<Vec2>& beads,
                                  const drawing::ScenarioParameters& p, int threads) {
  substrate::SubstrateParameters substrate_parameters;
  substrate_parameters.model = substrate::ModelKind::layer;
  const auto gel = greens::make_greens(p.gel, substrate_parameters, threads);
  std::vector<substrate::Ellipse> ellipses;
  std::vector<Vec2> forces;
  for (const Pulling* pulling : cells) {
    for (const Adhesion& a : pulling->cell.adhesions) ellipses.push_back(substrate::ellipse_of(a));
    for (const AdhesionForce& f : pulling->forces) forces.push_back(f.force_nN);
  }
  std::vector<Vec2> displacements = gel->displacements_um(beads, ellipses, forces);
  if (p.mechanics.simulation_material == MaterialLaw::neo_hooke) {
    constexpr double kElementsAcross = 2;  // finer than a fit's, as the network is
    const VectorXd at_adhesions = substrate::column_of(forces);
    const choice::LargeStrain large(p.gel, ellipses, beads, at_adhesions, threads, kElementsAcross);
    const std::vector<Vec2> change = substrate::vectors_of(large.about(at_adhesions).displacement_um);
    for (std::size_t i = 0; i < beads.size(); ++i) displacements[i] += change[i];
  }
  DisplacementField field;
  for (std::size_t i = 0; i < beads.size(); ++i)
    field.push_back({.position_um = beads[i], .displacement_um = displacements[i], .sigma_um = 0, .flag = {}});
  return field;
}

}  // namespace

DisplacementField with_noise(DisplacementField field, double noise_um, std::uint64_t seed) {
  drawing::Random random(seed, drawing::Stream::noise);
  for (Bead& bead : field) {
    const double x = random.normal();
    const double y = random.normal();
    bead.displacement_um += noise_um * Vec2{x, y};
    bead.sigma_um = noise_um;
  }
  return field;
}

namespace {

/// Random positions in a rectangle, no two nearer than the scenario's bead distance. @param stream  of random numbers
std::vector<Vec2> beads_in(const Extent& where, int n_beads, const drawing::ScenarioParameters& p,
                           std::uint64_t stream) {
  constexpr double kBytes = 300;  // of a bead: its place in the grid, its displacement, its spots in two images
  numerics::expect_room_for({.what = "the field of beads",
                             .count = static_cast<double>(n_beads),
                             .parts = "beads",
                             .bytes_each = kBytes,
                             .remedy = "choose fewer beads"});
  const Vec2 size_um = where.high_um - where.low_um;
  // cells of a grid so small that each holds one bead at most; a bead's neighbours lie within two cells
  const double cell_um = std::max(p.bead_distance_um / std::sqrt(2.0), 1e-3 * std::max(size_um.x, size_um.y));
  const int n_columns = static_cast<int>(size_um.x / cell_um) + 1, n_rows = static_cast<int>(size_um.y / cell_um) + 1;
  std::vector<std::vector<Vec2>> grid(static_cast<std::size_t>(n_columns) * n_rows);
  const int reach = static_cast<int>(std::ceil(p.bead_distance_um / cell_um));
  const auto is_free = [&](Vec2 bead, int column, int row) {
    for (int j = std::max(0, row - reach); j <= std::min(n_rows - 1, row + reach); ++j) {
      for (int i = std::max(0, column - reach); i <= std::min(n_columns - 1, column + reach); ++i) {
        for (const Vec2 other : grid[static_cast<std::size_t>(j) * n_columns + i])
          if (norm(other - bead) < p.bead_distance_um) return false;
      }
    }
    return true;
  };
  drawing::Random random(p.seed, drawing::Stream::beads, stream);
  std::vector<Vec2> beads;
  constexpr int kMaxMisses = 10000;  // in a row: beyond that less than 1e-4 of the field is free
  for (int misses = 0; static_cast<int>(beads.size()) < n_beads;) {
    const double x = random.uniform(0, size_um.x);
    const Vec2 bead{x, random.uniform(0, size_um.y)};
    const int column = static_cast<int>(bead.x / cell_um), row = static_cast<int>(bead.y / cell_um);
    if (is_free(bead, column, row)) {
      beads.push_back(where.low_um + bead);
      grid[static_cast<std::size_t>(row) * n_columns + column].push_back(bead);
      misses = 0;
    } else if (++misses > kMaxMisses) {
      throw UsageError("only " + std::to_string(beads.size()) + " of " + std::to_string(n_beads) + " beads fit at a " +
                       "bead_distance_um of " + std::to_string(p.bead_distance_um));
    }
  }
  return beads;
}

}  // namespace

std::vector<Vec2> place_beads(const drawing::ScenarioParameters& p) {
  const double field = drawing::field_um(p.microscope);
  return beads_in({{0, 0}, {field, field}}, drawing::n_beads(p), p, 0);
}

std::vector<Vec2> place_beads_beyond(const drawing::ScenarioParameters& p) {
  const double field = drawing::field_um(p.microscope);
  const Extent seen{{0, 0}, {field, field}};
  const auto carried = [&](Vec2 corner) { return drawing::moved_by_stage(corner, p); };
  const Extent relaxed = extent_of(std::vector<Vec2>{{0, 0}, {field, 0}, {0, field}, {field, field}}, carried);
  const double share = relaxed.area_um2() / seen.area_um2();
  std::vector<Vec2> beads = beads_in(relaxed, static_cast<int>(std::lround(share * drawing::n_beads(p))), p, 1);
  std::erase_if(beads, [&](Vec2 b) { return b.x > 0 && b.y > 0 && b.x < field && b.y < field; });
  return beads;
}

mesh::NetworkParameters formulation(drawing::TrueNetwork network) {
  using enum drawing::TrueNetwork;
  mesh::NetworkParameters p;
  if (network != second_neighbours) p.link_reach = mesh::LinkReach::neighbours;
  if (network == edges_centres) p.adhesion_anchor = mesh::AdhesionAnchor::centre;
  if (network == edges_rims) {
    p.adhesion_anchor = mesh::AdhesionAnchor::rim;
    p.rim_points = 12;
  }
  return p;
}

Experiment simulate(const drawing::ScenarioParameters& p, const Work& work) {
  work.tell(0, "drawing the cell");
  return simulate(drawing::draw_cell(p.cell, p.tension, drawing::field_um(p.microscope), p.seed), p, work);
}

Experiment simulate(drawing::DrawnCell drawn, const drawing::ScenarioParameters& p, const Work& work) {
  work.tell(0.1, "spanning the network and contracting it");
  Pulling first = contracted(std::move(drawn), p);
  std::optional<Pulling> second = neighbour_of(p);
  std::vector<const Pulling*> cells = {&first};
  if (second) cells.push_back(&*second);
  Experiment e;
  for (const AdhesionForce& f : first.forces) e.total_force_nN += norm(f.force_nN);
  work.tell(0.4, "deforming the gel");
  e.displacement = displacement_of(cells, place_beads(p), p, work.threads);
  for (const Bead& bead : e.displacement)
    e.largest_displacement_um = std::max(e.largest_displacement_um, norm(bead.displacement_um));
  e.noise_um = p.noise_um.value_or(p.noise * e.largest_displacement_um);
  e.measured = with_noise(e.displacement, e.noise_um, p.seed);
  const bool has_moved = p.drift_x_um != 0 || p.drift_y_um != 0 || p.turn_deg != 0;
  if (p.images && has_moved) {
    const std::vector<Vec2> beyond = place_beads_beyond(p);
    if (!beyond.empty())
      e.beyond = with_noise(displacement_of(cells, beyond, p, work.threads), e.noise_um, p.seed + kBeyond);
  }
  e.cell = std::move(first.cell), e.network = std::move(first.network);
  e.tensions = std::move(first.tensions), e.forces = std::move(first.forces);
  if (second) e.neighbour = std::move(second->cell);
  return e;
}

}  // namespace mbtfm::experiment
