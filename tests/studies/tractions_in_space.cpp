/// How exact tractions in space are, on scenes whose truth is exact: tractions_in_space ROWS FOLDER SCENE...
/// The bars beside the numbers are those of an independent dense inversion (docs/developers/tractions_in_space.md).
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <iostream>
#include <map>
#include <string>

#include "mbtfm/spatial/reconstruction.h"
#include "mbtfm/tractions/fttc.h"
#include "mbtfm/tractions/recurrences.h"
#include "substrate/surface/beads.h"
#include "tests/support/traction_scene.h"

namespace {

using namespace mbtfm;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using spatial::BeadLoss;
using test::ForceErrors;
using test::TractionScene;
using tractions::LambdaCriterion;

constexpr int kThreads = 2;

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

struct Setting {
  substrate::SubstrateParameters gel = {};
  std::optional<double> spacing_um = {};
  std::shared_ptr<const HeightMap> surface = nullptr;  ///< unset: the scene's
  bool has_patches = false;
};

struct Known {
  const TractionScene& scene;
  spatial::Problem problem;
  MatrixXd areas_um2;

  Known(const TractionScene& of, const Setting& s) : scene(of), problem(problem_of(of, s)) {
    areas_um2 = patch_areas_um2(scene, problem);
  }
  static spatial::Problem problem_of(const TractionScene& scene, const Setting& s) {
    Gel gel = scene.gel;
    if (s.surface) gel.surface = s.surface;
    const spatial::SpatialInputs inputs{scene.observed(0.02), gel, scene.adhesions(), {}};
    spatial::Meshing meshing{.spacing_um = s.spacing_um, .has_patches = s.has_patches};
    const double begin = seconds();
    spatial::Problem made = make_problem(inputs, {}, meshing, s.gel, kThreads);
    write_all(made, file);
    const std::map<std::string, std::function<void(const TractionScene&)>> kRows = {
        {"noise", study_noise},     {"losses", study_losses},
        {"patches", study_patches}, {"recurrences", study_recurrences},
        {"meshes", study_meshes},   {"fttc", study_fttc},
        {"surface", study_surface}, {"thesis", study_thesis},
        {"scan", study_scan}};

  }  // namespace

  int main(int argc, char** argv) {
    if (argc < 4 || !kRows.contains(argv[1])) {
      std::cerr << "usage: tractions_in_space ROWS FOLDER SCENE...\nROWS:";
      for (const auto& [name, study] : kRows) std::cerr << ' ' << name;
      std::cerr << '\n';
      return 2;
    }
    for (int k = 3; k < argc; ++k) kRows.at(argv[1])(test::traction_scene(std::filesystem::path(argv[2]) / argv[k]));
  }
