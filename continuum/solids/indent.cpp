#include "continuum/solids/indent.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/report.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::solids {
namespace {

/// A mesh's fineness with what all meshes of it share.
struct Resolution {
  Fineness fineness;
  std::shared_ptr<const Unknowns> unknowns;
};

SectionMesh mesh_of(const Setting& setting, double height_um, const Fineness& fineness) {
  return section_mesh({setting.volume_um3, height_um}, setting.slab, fineness);
}

Resolution resolution(const Setting& setting, double height_um, const Fineness& fineness) {
  return {fineness, std::make_shared<const Unknowns>(unknowns_of(mesh_of(setting, height_um, fineness)))};
}

Fineness coarser(Fineness fineness) {
  fineness.order -= 1;
  fineness.towards_rim -= 1;
  return fineness;
}

/// By part.
std::vector<Solid> solids_of(const Setting& setting, const Case& of) {
  const Solid gel = {.youngs_modulus_kPa = of.modulus_ratio * setting.cell.youngs_modulus_kPa,
                     .poisson_ratio = setting.gel_poisson_ratio};
  return {gel, setting.cell};
}

Deformed deformed_of(const Setting& setting, const Case& of, const SectionMesh& mesh, const Resolution& at) {
  return solve({mesh.mesh, at.unknowns, solids_of(setting, of)}, setting.strain);
}

/// A value, and the place where it is.
struct Largest {
  double at = 0, value = 0;
};

/// Top of the parabola through three points, and its value there.
Largest top_of(const std::array<Largest, 3>& p) {
  const double left = (p[1].value - p[0].value) / (p[1].at - p[0].at);
  const double right = (p[2].value - p[1].value) / (p[2].at - p[1].at);
  const double bend = (right - left) / (p[2].at - p[0].at);
  const double at = 0.5 * (p[0].at + p[1].at) - left / (2 * bend);
  return {at, p[0].value + (at - p[0].at) * (left + bend * (at - p[1].at))};
}

/// The largest value of a function along the lines of a row of elements. A parabola finds what lies between the
/// places that are looked at.
template <class F>
Largest largest_along(const std::vector<double>& lines, const F& value) {
  constexpr int kLooks = 8;  // an element: more than its polynomial has tops
  std::vector<Largest> looked;
  for (std::size_t k = 1; k < lines.size(); ++k) {
    for (int look = looked.empty() ? 0 : 1; look <= kLooks; ++look) {
      const double at = lines[k - 1] + (lines[k] - lines[k - 1]) * look / kLooks;
      looked.push_back({at, value(at)});
    }
  }
  const auto best = std::ranges::max_element(looked, {}, &Largest::value);
  if (best == looked.begin() || best + 1 == looked.end()) return *best;
  const double at = top_of({*(best - 1), *best, *(best + 1)}).at, there = value(at);
  return there > best->value ? Largest{at, there} : *best;
}

/// Along rays from the axis, each cut by the mesh at these distances (of the round cell's half plane).
struct Rays {
  std::vector<double> r_lines_um;
  int n = 1;
};

/// What lies in the planes of the depths. @param down_um  by ray, distance along it and depth
template <class Down>
Reading read_planes(const Rays& rays, const std::vector<double>& depths_um, const Down& down_um) {
  Reading reading;
  const auto largest = [&](double depth, double sign) {
    Largest of_all{0, -HUGE_VAL};
    for (int ray = 0; ray < rays.n; ++ray) {
      const Largest along = largest_along(rays.r_lines_um, [&](double r) { return sign * down_um(ray, r, depth); });
      if (along.value > of_all.value) of_all = along;
    }
    return of_all;
  };
  for (const double depth : depths_um) reading.depth_um.push_back(largest(depth, 1).value);
  reading.lift_um = std::max(0.0, largest(0, -1).value);
  return reading;
}

/// Of a mesh in the half plane or in space.
template <class Mesh, class Displacement>
void read_sizes(const Mesh& mesh, const std::vector<Displacement>& u, Reading& reading) {
  const std::size_t per_element = mesh.nodes.size() / mesh.part.size();
  for (std::size_t k = 0; k < mesh.nodes.size(); ++k) {
    const double size = norm(u[mesh.nodes[k]]);
    reading.largest_u_um = std::max(reading.largest_u_um, size);
    if (mesh.part[k / per_element] == kGel) reading.largest_u_gel_um = std::max(reading.largest_u_gel_um, size);
  }
}

std::vector<double> r_lines_um(const SectionMesh& mesh) {
  std::vector<double> lines = mesh.mesh->patches[kSlabPatch].u_lines;
  for (double& line : lines) line *= mesh.slab.radius_um;
  return lines;
}

Reading read(const Deformed& deformed, const SectionMesh& mesh, const std::vector<double>& depths_um) {
  Reading reading = read_planes({r_lines_um(mesh)}, depths_um, [&](int, double r, double depth) {
    return deformed.displacement_um_at(mesh.in_gel(r, depth)).y;
  });
  read_sizes(*mesh.mesh, deformed.displacement_um, reading);
  reading.top_down_um = deformed.displacement_um_at(mesh.top_of_cell()).y;
  return reading;
}

Reading read(const RevolvedBody& body, const std::vector<double>& depths_um) {
  constexpr int kLooks = 8;  // rays a sector: 4 degrees and less, between which a top is missed by 1e-3 of what varies
  const SectionMesh& plane = body.mesh.half_plane;
  const Rays rays{r_lines_um(plane), kLooks * body.mesh.sectors.n()};
  Reading reading = read_planes(rays, depths_um, [&](int ray, double r, double depth) {
    return body.displacement_um_at(plane.in_gel(r, depth), ray / kLooks, static_cast<double>(ray % kLooks) / kLooks).z;
  });
  read_sizes(body.mesh, body.displacement_um, reading);
  reading.top_down_um = body.displacement_um_at(plane.top_of_cell(), 0, 0).z;
  return reading;
}

double difference_um(const Reading& a, const Reading& b) {
  double largest =
      std::max({std::abs(a.lift_um - b.lift_um), std::abs(a.largest_u_um - b.largest_u_um),
                std::abs(a.largest_u_gel_um - b.largest_u_gel_um), std::abs(a.top_down_um - b.top_down_um)});
  for (std::size_t k = 0; k < a.depth_um.size(); ++k)
    largest = std::max(largest, std::abs(a.depth_um[k] - b.depth_um[k]));
  return largest;
}

Vec2 along_axis(Vec2 force) { return {0, force.y}; }
Vec3 along_axis(Vec3 force) { return force; }  // sideways they need not cancel by themselves
double depth_of(Vec2 place) { return place.y; }
double depth_of(Vec3 place) { return place.z; }

/// Net force of the cell on the gel, over the sum of the nodes' forces.
template <class Vector>
double imbalance_of(const std::vector<Vector>& positions_um, const std::vector<Vector>& forces_nN) {
  Vector net;
  double sum = 0;
  for (std::size_t k = 0; k < forces_nN.size(); ++k) {
    constexpr double kInterface = 1e-9;
    if (std::abs(depth_of(positions_um[k])) > kInterface) continue;
    net += along_axis(forces_nN[k]);
    sum += norm(forces_nN[k]);
  }
  return sum > 0 ? norm(net) / sum : 0;
}

struct Resolutions {
  Resolution fine, coarse;
  Resolutions(const Setting& setting, double height_um)
      : fine(resolution(setting, height_um, setting.fineness)),
        coarse(resolution(setting, height_um, coarser(setting.fineness))) {}
};

Indentation solve_case(const Setting& setting, const Case& of, const Resolutions& at) {
  const Section section{setting.volume_um3, of.height_um};
  Indentation result{
      .of = of, .contact_radius_um = section.contact_radius_um(), .contact_area_um2 = section.contact_area_um2()};
  const SectionMesh fine_mesh = mesh_of(setting, of.height_um, at.fine.fineness);
  const Deformed fine = deformed_of(setting, of, fine_mesh, at.fine);
  result.reading = read(fine, fine_mesh, setting.depths_um);
  result.energy_fJ = fine.energy_fJ;
  result.iterations = fine.iterations;
  result.imbalance = imbalance_of(fine_mesh.mesh->position_um, fine.forces_nN(kCell));
  const SectionMesh coarse_mesh = mesh_of(setting, of.height_um, at.coarse.fineness);
  result.coarse = read(deformed_of(setting, of, coarse_mesh, at.coarse), coarse_mesh, setting.depths_um);
  result.error_um = difference_um(result.reading, result.coarse);
  return result;
}

/// @throws InvalidData; what is not solved is reported
Indentation tried_case(const Setting& setting, const Case& of, const Resolutions& at) {
  try {
    return solve_case(setting, of, at);
  } catch (const NotSolved& error) {
    const Section section{setting.volume_um3, of.height_um};
    return {.of = of,
            .contact_radius_um = section.contact_radius_um(),
            .contact_area_um2 = section.contact_area_um2(),
            .failure = error.report->reason};
  }
}

/// By rising height.
using ByHeight = std::map<double, Indentation>;

/// The best height and its neighbours, of the fine mesh or the coarse one.
std::optional<std::array<Largest, 3>> around_best(const ByHeight& solved, std::size_t depth, Reading Indentation::*of) {
  const auto value = [&](const auto& entry) {
    return entry.second.failure ? -std::numeric_limits<double>::infinity() : (entry.second.*of).depth_um[depth];
  };
  const auto best =
      std::max_element(solved.begin(), solved.end(), [&](const auto& a, const auto& b) { return value(a) < value(b); });
  if (solved.size() < 3 || best == solved.begin() || std::next(best) == solved.end()) return std::nullopt;
  for (const auto& of_three : {std::prev(best), best, std::next(best)})
    if (of_three->second.failure) return std::nullopt;
  const auto point = [&](auto entry) { return Largest{entry->first, value(*entry)}; };
  return std::array{point(std::prev(best)), point(best), point(std::next(best))};
}

std::optional<Optimum> optimum_of(const Setting& setting, ByHeight solved, double ratio, std::size_t depth,
                                  const Resolutions& at) {
  constexpr int kMostSolutions = 6;
  constexpr double kStays = 2e-3;  // of the height
  auto around = around_best(solved, depth, &Indentation::reading);
  if (!around) return std::nullopt;
  Largest top = top_of(*around);
  double moved = 0;
  for (int k = 0; k < kMostSolutions; ++k) {
    // no nearer to a height that is solved than a parabola can use
    const double nearest = std::ranges::min(*around, {}, [&](const Largest& p) { return std::abs(p.at - top.at); }).at;
    if (k > 0 && std::abs(nearest - top.at) < kStays * top.at) break;
    const double height = std::abs(nearest - top.at) < kStays * top.at ? top.at + 4 * kStays * top.at : top.at;
    solved[height] = tried_case(setting, {height, ratio}, at);
    around = around_best(solved, depth, &Indentation::reading);
    if (!around) return std::nullopt;
    const Largest next = top_of(*around);
    moved = std::abs(next.at - top.at);
    top = next;
    if (moved < kStays * top.at) break;
  }
  const auto coarse = around_best(solved, depth, &Indentation::coarse);
  const double mesh = coarse ? std::abs(top_of(*coarse).at - top.at) : moved;
  return Optimum{.modulus_ratio = ratio,
                 .read_at_um = setting.depths_um[depth],
                 .height_um = top.at,
                 .depth_um = top.value,
                 .contact_area_um2 = Section{setting.volume_um3, top.at}.contact_area_um2(),
                 .height_error_um = moved + mesh};
}

}  // namespace

Indentation indentation(const Setting& setting, const Case& of) {
  return solve_case(setting, of, Resolutions(setting, of.height_um));
}

OutlinedIndentation indentation(const Setting& setting, const Case& of, const Contact& contact, int threads) {
  const Sectors sectors = sectors_of(contact, setting.fineness.order);
  const auto solved_with = [&](const Fineness& fineness) {
    RevolvedMesh mesh = revolved_mesh(contact, sectors, of.height_um, setting.slab, fineness);
    for (const double depth : setting.depths_um)
      mesh.half_plane.in_gel(0, depth);  // refused before the work, not after
    return solved(std::move(mesh), solids_of(setting, of), threads);
  };
  OutlinedIndentation result{
      .of = {.of = of, .contact_radius_um = contact.equal_radius_um(), .contact_area_um2 = contact.area_um2()},
      .deformed = solved_with(setting.fineness)};
  const RevolvedBody& fine = result.deformed;
  result.of.reading = read(fine, setting.depths_um);
  result.of.coarse = read(solved_with(coarser(setting.fineness)), setting.depths_um);
  result.of.error_um = difference_um(result.of.reading, result.of.coarse);
  result.of.energy_fJ = fine.energy_fJ;
  result.of.imbalance = imbalance_of(fine.mesh.position_um, fine.forces_nN(kCell));
  return result;
}

std::vector<Indentation> indentations(const Setting& setting, const std::vector<Case>& cases, int threads,
                                      const Progress& progress) {
  std::vector<Indentation> solved(cases.size());
  if (cases.empty()) return solved;
  const Resolutions at(setting, cases.front().height_um);
  const int n = static_cast<int>(cases.size()), n_rounds = std::max(1, n / (8 * threads));
  for (int round = 0; round < n_rounds; ++round) {
    const int begin = n * round / n_rounds, end = n * (round + 1) / n_rounds;
    numerics::parallel_for(end - begin, threads,
                           [&](int k) { solved[begin + k] = tried_case(setting, cases[begin + k], at); });
    if (progress) progress(static_cast<double>(end) / n, "cells on gels");
  }
  return solved;
}

Deformed deformed_section(const Setting& setting, const Case& of) {
  const Resolution at = resolution(setting, of.height_um, setting.fineness);
  return deformed_of(setting, of, mesh_of(setting, of.height_um, setting.fineness), at);
}

std::vector<Optimum> optima(const Setting& setting, const std::vector<Indentation>& solved, int threads) {
  std::map<double, ByHeight> by_ratio;
  for (const Indentation& one : solved) by_ratio[one.of.modulus_ratio][one.of.height_um] = one;
  std::vector<double> ratios;
  for (const auto& [ratio, heights] : by_ratio) ratios.push_back(ratio);
  if (solved.empty()) return {};
  const Resolutions at(setting, solved.front().of.height_um);
  const std::size_t n_depths = setting.depths_um.size();
  std::vector<std::optional<Optimum>> found(ratios.size() * n_depths);
  numerics::parallel_for(static_cast<int>(found.size()), threads, [&](int k) {
    const double ratio = ratios[k / n_depths];
    found[k] = optimum_of(setting, by_ratio.at(ratio), ratio, k % n_depths, at);
  });
  std::vector<Optimum> optima;
  for (const auto& one : found)
    if (one) optima.push_back(*one);
  return optima;
}

}  // namespace mbtfm::solids
