/// Meshes of bent squares: patches of the half plane, each cut along lines, joined where their nodes meet.
#pragma once

#include <functional>
#include <vector>

#include "continuum/solids/element.h"

namespace mbtfm::solids {

/// The unit square mapped onto a part of the half plane (r, z), so that it is not turned over.
struct Patch {
  std::function<Vec2(Vec2 unit)> place_um;
  std::vector<double> u_lines, v_lines;  ///< rising, from 0 to 1
  int part = 0;                          ///< which solid it is of
};

/// A patch between four curves that meet at its corners: each is called with 0 to 1 along u or v. Source: Gordon, Hall,
/// Int. J. Numer. Meth. Eng. 7 (1973) 461.
using Side = std::function<Vec2(double share)>;
std::function<Vec2(Vec2 unit)> between(Side low_v, Side high_v, Side low_u, Side high_u);
Side straight(Vec2 from_um, Vec2 to_um);

/// Lines from 0 to 1: n even ones; or n that lie closer and closer towards 0, each interval kCloser of the next.
std::vector<double> even_lines(int n);
std::vector<double> lines_towards_zero(int n);
std::vector<double> turned(const std::vector<double>& lines);  ///< closer towards 1 in place of 0

struct Mesh {
  Square square{2};
  std::vector<Vec2> position_um = {};  ///< by node: r, z
  std::vector<int> nodes = {};         ///< square.n_nodes() an element
  std::vector<int> part = {};          ///< by element
  struct Cut {
    int first = 0;  ///< element; those along u first
    std::vector<double> u_lines, v_lines;
  };
  std::vector<Cut> patches = {};

  int n_elements() const { return static_cast<int>(part.size()); }
  const int* nodes_of(int element) const { return &nodes[static_cast<std::size_t>(element) * square.n_nodes()]; }
  Nodes values_of(const std::vector<Vec2>& by_node, int element) const;
  Nodes positions_of(int element) const { return values_of(position_um, element); }
  /// A place of a patch, as an element and a place in it.
  struct Place {
    int element = 0;
    Vec2 unit;
  };
  Place place_in(int patch, Vec2 unit) const;
};

/// @throws InvalidData where a patch is bent so much that its lines meet at less than 3 degrees
Mesh make_mesh(const std::vector<Patch>& patches, int order);

}  // namespace mbtfm::solids
