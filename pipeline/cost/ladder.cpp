/// The knobs that trade accuracy for time, and the rungs of each.
#include <algorithm>
#include <map>
#include <set>

#include "pipeline/contract/numbers.h"
#include "pipeline/cost/accuracy.h"
#include "pipeline/cost/study.h"

namespace mbtfm::cost {

namespace {

/// The rungs of a knob that is one parameter.
void add(std::vector<Rung>& rungs, const std::string& table, const std::string& key,
         const std::vector<std::string>& values, const std::vector<runner::Setting>& with = {}) {
  for (const std::string& value : values) {
    std::vector<runner::Setting> settings = with;
    settings.push_back({table, key, value});
    rungs.push_back({.knob = key, .value = value, .settings = settings});
  }
}

/// The refined finite elements and the methods of the thesis: each takes ten times as long as all the rest of a run.
void add_slow(std::vector<Rung>& rungs) {
  const std::vector<runner::Setting> refined = {{"substrate", "model", "refined"},
                                                {"substrate", "displacement_tolerance", "0"}};
  add(rungs, "substrate", "elements_across_adhesion", {"1", "1.4", "2"}, refined);
  rungs.push_back({.knob = "model", .value = "refined", .settings = {{"substrate", "model", "refined"}}});
  for (const char* evaluations : {"100", "1000"}) {
    add(rungs, "fit", "method", {"plain-cg", "blockwise-cg"}, {{"fit", "max_evaluations", evaluations}});
    for (Rung* rung : {&rungs[rungs.size() - 2], &rungs[rungs.size() - 1]})
      rung->value += std::string(", ") + evaluations + " equilibria";
  }
  add(rungs, "fit", "gradients", {"finite-difference"},
      {{"fit", "method", "blockwise-cg"}, {"fit", "max_evaluations", "1000"}});
  add(rungs, "fit", "bootstrap", {"1000"});
  add(rungs, "fit", "n_meshes", {"64"});
}

}  // namespace

bool needs_images(const Rung& rung) {
  static const std::set<std::string> kOfImages = {"segment", "track"};
  return std::ranges::any_of(rung.settings,
                             [](const runner::Setting& setting) { return kOfImages.contains(setting.table); });
}

std::vector<Rung> ladder(Extent extent) {
  // The costly ones come last: where time runs out, they are what lacks.
  std::vector<Rung> rungs = {{.knob = kAsItIs, .value = ""}};
  const auto add_preset = [&](const char* name) {
    rungs.push_back({.knob = kPreset, .value = name, .settings = preset_named(name).settings});
  };
  add_preset("fast");
  for (const char* binning : {"4", "3", "2"}) {
    rungs.push_back({.knob = "image_scale",
                     .value = std::string("1/") + binning,
                     .settings = {{"segment", "binning", binning}, {"track", "binning", binning}}});
  }
  add(rungs, "fit", "n_meshes", {"1", "4", "8"});
  add(rungs, "network", "edge_length_um", {"3", "2"});
  add(rungs, "substrate", "model", {"half-space", "layer", "split"});
  for (const double share : {0.125, 0.25, 0.5})
    rungs.push_back({.knob = "beads", .value = shortest(share), .bead_share = share});
  add(rungs, "fit", "surface_lines", {"40", "160"});
  add(rungs, "fit", "tolerance", {"0.1", "0.01", "0.0001"});
  add(rungs, "cables", "smoothing", {"0.01", "0.001", "1e-07"});
  add(rungs, "cables", "force_tolerance", {"0.001", "1e-05", "1e-12"});
  add(rungs, "effects", "robust_loss", {"on", "off"});
  add(rungs, "effects", "cable_elasticity", {"off"});
  const std::vector<runner::Setting> split = {{"substrate", "model", "split"}};
  add(rungs, "substrate", "cells_per_thickness", {"1", "3"}, split);
  add(rungs, "substrate", "margin_thicknesses", {"2", "8"}, split);
  rungs.push_back({.knob = "threads", .value = "1", .threads = 1});
  add(rungs, "network", "edge_length_um", {"1.2", "1"});
  add(rungs, "fit", "n_meshes", {"16", "32"});
  add(rungs, "fit", "bootstrap", {"100"});
  add_preset("high");
  if (extent == Extent::whole) add_slow(rungs);
  return rungs;
}

std::vector<Rung> ladder_in_space(Extent extent, double spacing_um) {
  std::vector<Rung> rungs = {{.knob = kAsItIs, .value = ""}};
  const auto add_preset = [&](const char* name) {
    rungs.push_back({.knob = kPreset, .value = name, .settings = preset_named(name).in_space});
  };
  const auto add_spacing = [&](double share) {
    rungs.push_back({.knob = "spacing_um",
                     .value = brief(share * spacing_um),
                     .settings = {{"traction", "spacing_um", shortest(share * spacing_um)}}});
  };
  add_preset("fast");
  for (const double share : {2.0, 1.6, 1.25}) add_spacing(share);
  add(rungs, "substrate", "growth", {"16", "8"});
  add(rungs, "substrate", "displacement_tolerance", {"0.1", "0.05"});
  add(rungs, "traction", "method", {"tikhonov", "group-l1"});
  add(rungs, "traction", "refine", {"resolved"});
  add(rungs, "traction", "loss", {"mixture", "huber"});
  add(rungs, "traction", "lambda_by", {"gcv", "evidence"});
  for (const double share : {0.125, 0.25, 0.5})
    rungs.push_back({.knob = "beads", .value = shortest(share), .bead_share = share});
  add(rungs, "traction", "with_axial", {"false"});
  add(rungs, "effects", "common_motion", {"off"});
  add(rungs, "substrate", "margin_thicknesses", {"2", "8"});
  rungs.push_back({.knob = "threads", .value = "1", .threads = 1});
  add_spacing(0.8);
  add(rungs, "substrate", "displacement_tolerance", {"0.005"});
  add_preset("high");
  if (extent == Extent::whole) {
    add(rungs, "traction", "method", {"adjoint", "green", "direct"});
    add(rungs, "substrate", "material", {"neo-hooke"});
  }
  return rungs;
}

std::vector<std::string> groups_of(CellKind kind) {
  if (has_fibres(kind)) return {"network and meshes", "gel", "equilibrium and fit", "data, presets, threads"};
  return {"tractions", "gel", "method", "data, presets, threads"};
}

std::string group_of(const std::string& knob, CellKind kind) {
  static const std::map<std::string, std::set<std::string>> kKnobs = {
      {"gel",
       {"model", "cells_per_thickness", "elements_across_adhesion", "margin_thicknesses", "displacement_tolerance",
        "growth", "material", "surface_lines"}},
      {"network and meshes", {"n_meshes", "edge_length_um"}},
      {"tractions", {"spacing_um", "refine"}},
      {"data, presets, threads",
       {"beads", "with_axial", "image_scale", "robust_loss", "preset", "threads", "bootstrap"}}};
  for (const auto& [group, knobs] : kKnobs)
    if (knobs.contains(knob)) return group;
  return has_fibres(kind) ? "equilibrium and fit" : "method";
}

}  // namespace mbtfm::cost
