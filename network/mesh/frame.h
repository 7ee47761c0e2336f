/// What the mesh must contain: adhesions, fibres and outline as vertices and segments.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "network/mesh/mesh.h"
#include "network/mesh/outline.h"
#include "network/mesh/size_field.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"

namespace mbtfm::mesh {

/// Random numbers that are the same on every platform (the standard's distributions are not).
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  /// Evenly spread over [0, 1), from the upper 53 bits.
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

 private:
  std::mt19937_64 engine_;
};

struct FrameSegment {
  int vertex_a = 0;
  int vertex_b = 0;
  std::vector<int> fibre_ids;  ///< rising; several where fibres share the segment
  int outline_count = 0;       ///< how often the outline or a hole's rim runs along it: odd where it bounds the cell
};

struct Frame {
  SizeField size;
  std::vector<Vec2> points_um{};
  std::vector<int> adhesion_id{};      ///< of centres; 0: none
  std::vector<int> rim_adhesion_id{};  ///< of vertices on the rim of an adhesion; 0: none
  std::vector<int> ring{};             ///< of the boundary, on which a vertex may slide; -1: it may not
  std::vector<double> ring_s_um{};     ///< arc length there
  std::vector<FrameSegment> segments{};
  std::vector<int> clipped_fibre_ids{};
  std::vector<int> snapped_adhesion_ids{};
  std::vector<int> separated_adhesion_ids{};  ///< moved apart from one at the same place
  int n_shared_segments = 0;

  bool slides(int vertex) const { return ring[vertex] >= 0; }
};

/// That a vertex of an even triangular mesh has to itself.
double area_of_vertex_um2(double edge_um);
/// @throws OutOfMemory where a mesh of so many vertices takes more memory than there is
void expect_room_for_vertices(double count);
/// The same for those that the wanted edge lengths ask for inside the outline.
void expect_room_for_mesh(const SizeField& size, const Boundary& boundary);

/// @throws OutOfMemory, and InvalidData where an adhesion lies further than an edge length outside the cell, or all of
/// a fibre does
Frame build_frame(const Cell& cell, const Boundary& boundary, const NetworkParameters& parameters, Random& random);

}  // namespace mbtfm::mesh
