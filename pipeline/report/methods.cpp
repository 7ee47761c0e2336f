#include "pipeline/report/methods.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "pipeline/contract/polyline.h"
#include "pipeline/report/page.h"

namespace mbtfm::report {

namespace {

std::string of_the_gel(const Gel& gel) {
  return fmt::format(
      "The gel was taken as an elastic layer on a rigid base (Young’s modulus {} kPa, Poisson’s ratio {}, thickness {} "
      "µm).",
      charts::readable(gel.youngs_modulus_kPa), charts::readable(gel.poisson_ratio),
      charts::readable(gel.thickness_um));
}

/// Beads in the area that they cover.
std::string of_the_beads(const CellResults& results) {
  DisplacementField used = results.displacement;
  std::erase_if(used, [](const Bead& bead) { return !bead.flag.empty(); });
  const double density = beads_per_um2(used);
  std::string text = fmt::format("Displacements were known at {} beads", used.size());
  if (density > 0) text += fmt::format(" ({} per µm²)", charts::readable(density));
  return text +
         fmt::format(", with a noise of {} nm for each component.", charts::readable(1000 * results.fit.noise_um));
}

std::string of_the_fit(const CellResults& results) {
  const FitSummary& fit = results.fit;
  const bool is_ensemble = fit.n_meshes > 1;
  return fmt::format(
      "A network of {} contractile cables with {} stress fibres in it, held at {} adhesions, was fitted to them: {} "
      "tensions, by least squares with tensions of zero or more and without regularisation. {}Intervals are 95 % "
      "intervals from the noise of the beads{}. The fit left {} of the displacement (relative L2; the noise alone "
      "would leave {}).",
      results.network.links.size(), results.cell.fibres.size(), results.cell.adhesions.size(), results.tensions.size(),
      is_ensemble ? fmt::format("Tensions are means over {} independent meshes. ", fit.n_meshes) : "",
      is_ensemble ? " and the spread between the meshes" : "", charts::readable(fit.relative_l2),
      charts::readable(fit.expected_relative_l2));
}

std::string effects_that_are_on(const Provenance& provenance) {
  std::string list;
  std::set<std::string> named;  // stages share effects
  for (const EffectLine& effect : provenance.effects)
    if (effect.is_on && named.insert(effect.name).second) list += (list.empty() ? "" : ", ") + effect.name;
  return list.empty() ? "" : " Effects that were computed: " + list + ".";
}

}  // namespace

std::string methods_paragraph(const CellResults& results, const Provenance& provenance) {
  const std::string text =
      "Forces were found by model-based traction force microscopy (Soiné et al., PLoS Comput. Biol. 11:e1004076, 2015) "
      "with the program mbtfm" +
      (provenance.version.empty() ? "" : " " + provenance.version) + ". " + of_the_gel(results.gel) + " " +
      of_the_beads(results) + " " + of_the_fit(results) + effects_that_are_on(provenance);
  return "<p class=\"cite\">" + html_escaped(text) + "</p>\n";
}

}  // namespace mbtfm::report
