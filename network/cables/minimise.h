/// The minimum of a set of cables' energy over the free vertices.
#pragma once

#include <vector>

#include "network/cables/cable_energy.h"
#include "network/cables/cables.h"
#include "pipeline/contract/report.h"
#include "pipeline/numerics/spring_matrix.h"

namespace mbtfm::cables {

/// Which vertices move, and where the cables' stiffness goes in the matrix over them.
struct FreeVertices {
  std::vector<int> unknown;       ///< by vertex: its block in the matrix, or −1 where it is held
  std::vector<int> pair;          ///< by cable: its pair of blocks, or −1 where an end is held
  numerics::SpringMatrix matrix;  ///< analysed

  void add(numerics::SpringMatrix& to, std::size_t cable_index, const Cable& cable,
           const numerics::SpringMatrix::Block& block) const {
    const int a = unknown[cable.vertex_a], b = unknown[cable.vertex_b];
    if (pair[cable_index] >= 0)
      to.add_spring(pair[cable_index], block);
    else if (a >= 0 || b >= 0)
      to.add_diagonal(std::max(a, b), block);
  }
};

struct MinimiseOptions {
  Contraction method = Contraction::newton;
  double eps_um = 0;              ///< of the length
  double edge_length_um = 0;      ///< what lengths compare with
  double force_nN = 0;            ///< what forces compare with
  double weakest = 1;             ///< the least pull over the greatest
  double force_tolerance_nN = 0;  ///< largest net force on a free vertex at the end
  bool is_polished = true;        ///< a step more, to rounding
  int max_iterations = 0;
};

enum class Start { cold, warm };

struct Minimum {
  std::vector<Vec2> positions_um;
  std::vector<Vec2> spans_um;  ///< by cable, x_b − x_a to the last digit
  Report report;               ///< last_change: the largest net force on a free vertex (nN)
};

/// Newton's method with line search on a path of ever less rounded energies; a warm start tries the exact energy first.
/// Conjugate gradients know no path: they are the thesis' method, there to compare with.
/// Each step lowers the energy (of the present rounding).
Minimum minimise(const FreeVertices& free, const std::vector<Cable>& cables, std::vector<Vec2> positions_um,
                 Start start, const MinimiseOptions& options);

}  // namespace mbtfm::cables
