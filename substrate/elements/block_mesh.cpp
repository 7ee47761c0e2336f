#include "substrate/elements/block_mesh.h"

#include <dlfcn.h>

#include <algorithm>
#include <cfenv>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <stdexcept>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/memory.h"
#include "substrate/elements/mesh_maker.h"

namespace mbtfm::elements {

namespace {

/// deal.II and the 150 libraries that it needs take 0.25 s of each start: they are loaded where a mesh is made, not
/// with the program. The path follows from the program's, as sanitizers hide the run path from dlopen.
MakeMesh* load_mesh_maker() {
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe");
  const std::filesystem::path file = program.parent_path().parent_path() / "lib/mbtfm" / kMeshMakerFile;
  if (!std::filesystem::exists(file)) {
    throw UsageError(
        "this installation has no finite elements: the substrate models 'split', 'refined' and 'curved', and the "
        "effects that need them, are missing. Take 'half-space' or 'layer', install Debian's package mbtfm-mesh, or "
        "build with MBTFM_WITH_DEALII=ON (expected " +
        file.string() + ")");
  }
  std::fenv_t environment;
  std::feholdexcept(&environment);  // the libraries' own initialisation is not ours to trap
  void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  std::fesetenv(&environment);
  void* function = library != nullptr ? dlsym(library, "mbtfm_make_mesh") : nullptr;
  if (function != nullptr) return reinterpret_cast<MakeMesh*>(function);
  const std::string why = dlerror();
  const bool wants_memory = why.find("failed to map segment") != why.npos || why.find("allocate memory") != why.npos;
  if (wants_memory) {
    throw OutOfMemory("there is no room to load the library that makes finite element meshes (" + why +
                      "): allow more memory, or take the model 'layer'");
  }
  throw InputError(
      file.string(), "the library that makes finite element meshes", why,
      "install the program again, with lib/ beside bin/; the models 'half-space' and 'layer' do without it");
}

/// Of the box of a level that holds a point.
BoxKey key_of(const GridLines& lines, int level, const std::array<double, 3>& point) {
  BoxKey key = {static_cast<std::uint32_t>(level)};
  const std::array line_of = {&lines.x_um, &lines.y_um, &lines.z_um};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<double>& line = *line_of[axis];
    const auto above = std::upper_bound(line.begin() + 1, line.end() - 1, point[axis]);
    const double low = *(above - 1), n = std::ldexp(1, level);
    const double within = std::clamp(std::floor((point[axis] - low) / (*above - low) * n), 0.0, n - 1);
    key[axis + 1] = static_cast<std::uint32_t>(static_cast<double>(above - line.begin() - 1) * n + within);
  }
  return key;
}

}  // namespace

BlockMesh make_block_mesh(const GridLines& lines, const std::function<bool(const Box&)>& is_too_large,
                          std::int64_t most_cells, int threads) {
  static MakeMesh* const make = load_mesh_maker();
  BlockMesh mesh;
  mesh.lines = lines;
  {
    // one at a time: deal.II has one limit of threads for all, and no lock on it
    static std::mutex in_use;
    const std::lock_guard lock(in_use);
    try {
      make(mesh, is_too_large, most_cells, threads);
    } catch (const std::length_error&) {
      throw OutOfMemory("the substrate's mesh has more than " + std::to_string(most_cells) +
                        " elements; one of at most half as many would fit the memory allowed: "
                        "ask for a coarser one (displacement_tolerance, elements_across_adhesion), allow more "
                        "(memory_limit_GB), or take the model 'layer'");
    }
  }
  for (std::size_t cell = 0; cell < mesh.cells.size(); ++cell) {
    const auto& [low, size] = mesh.cells[cell];
    MBTFM_ASSERT(mesh.cell_levels[cell] < kMostLevels);
    const std::array middle = {low[0] + 0.5 * size[0], low[1] + 0.5 * size[1], low[2] + 0.5 * size[2]};
    mesh.cell_at[key_of(lines, mesh.cell_levels[cell], middle)] = static_cast<int>(cell);
  }
  return mesh;
}

std::vector<double> even_lines(double low, double high, double margin_um, double step_um) {
  const double length = high - low + 2 * margin_um;
  const int n = std::max(1, static_cast<int>(std::ceil(length / step_um - 1e-9)));
  std::vector<double> values;
  for (int k = 0; k <= n; ++k) values.push_back(0.5 * (low + high) + (static_cast<double>(k) / n - 0.5) * length);
  return values;
}

int cell_holding(const BlockMesh& mesh, const std::array<double, 3>& point_um) {
  const auto is_within = [](const std::vector<double>& line, double x) {
    return x >= line.front() && x <= line.back();
  };
  if (!is_within(mesh.lines.x_um, point_um[0]) || !is_within(mesh.lines.y_um, point_um[1])) return -1;
  for (int level = 0; level < kMostLevels; ++level) {
    const auto found = mesh.cell_at.find(key_of(mesh.lines, level, point_um));
    if (found != mesh.cell_at.end()) return found->second;
  }
  throw InternalError("no cell of the block holds a point of it");
}

std::string BlockMesh::extent() const {
  const auto range = [](const std::vector<double>& line) { return brief(line.front()) + " to " + brief(line.back()); };
  return "x " + range(lines.x_um) + ", y " + range(lines.y_um) + " um";
}

double allowed_GB(double memory_limit_GB) {
  if (memory_limit_GB > 0) return memory_limit_GB;
  return 0.8e-9 * numerics::memory_bytes();
}

}  // namespace mbtfm::elements
