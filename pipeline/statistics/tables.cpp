#include <fmt/format.h>

#include <cmath>
#include <map>

#include "pipeline/contract/csv.h"
#include "pipeline/statistics/rank_tests.h"
#include "pipeline/statistics/study_files.h"

namespace mbtfm::statistics {

std::string cells_csv(const Study& study) {
  CsvText csv({"cell", "n_adhesions", "n_fibres", "n_dorsal", "n_arc", "n_ventral", "cell_area_um2",
               "adhesion_area_um2", "total_force_nN", "network_force_nN", "fibre_force_nN", "network_tension_nN",
               "network_surface_tension_nN_per_um", "relative_l2", "expected_relative_l2", "noise_um", "n_meshes",
               "converged"});
  for (const StudyCell& c : study.cells) {
    std::map<FibreType, int> n_of;
    for (const Fibre& fibre : c.cell.fibres) ++n_of[fibre.type];
    double adhesion_area = 0;
    for (const Adhesion& adhesion : c.cell.adhesions) adhesion_area += adhesion.area_um2;
    std::optional<double> network_tension;
    for (const Tension& t : c.tensions) {
      if (t.fibre_id == 0) network_tension = t.tension_nN;
    }
    csv.add(c.name).add(static_cast<int>(c.cell.adhesions.size())).add(static_cast<int>(c.cell.fibres.size()));
    for (const FibreType type : kFibreTypes) csv.add(n_of[type]);
    csv.add(std::abs(signed_area_um2(c.cell.outline_um))).add(adhesion_area);
    csv.add(c.fit.total_force_nN).add(c.fit.network_force_nN).add(c.fit.fibre_force_nN).add(network_tension);
    csv.add(c.fit.network_surface_tension_nN_per_um).add(c.fit.relative_l2).add(c.fit.expected_relative_l2);
    csv.add(c.fit.noise_um).add(c.fit.n_meshes).add(c.fit.converged ? 1 : 0);
    csv.end_row();
  }
  return csv.str();
}

std::string adhesions_csv(const Study& study) {
  CsvText csv({"cell", "adhesion_id", "x_um", "y_um", "area_um2", "eccentricity", "fx_nN", "fy_nN", "force_nN",
               "traction_kPa", "sigma_nN", "connected"});
  for (const StudyCell& c : study.cells) {
    std::map<int, const Adhesion*> by_id;
    for (const Adhesion& adhesion : c.cell.adhesions) by_id[adhesion.adhesion_id] = &adhesion;
    for (const AdhesionForce& force : c.forces) {
      const Adhesion& a = *by_id.at(force.adhesion_id);
      csv.add(c.name).add(a.adhesion_id).add(a.position_um.x).add(a.position_um.y).add(a.area_um2).add(a.eccentricity);
      csv.add(force.force_nN.x).add(force.force_nN.y).add(norm(force.force_nN));
      csv.add(norm(force.force_nN) / a.area_um2).add(force.sigma_nN).add(force.connected ? 1 : 0);
      csv.end_row();
    }
  }
  return csv.str();
}

std::string fibres_csv(const Study& study) {
  CsvText csv({"cell", "fibre_id", "type", "length_um", "width_um", "confidence", "tension_nN", "low_nN", "high_nN",
               "identifiable"});
  for (const StudyCell& c : study.cells) {
    std::map<int, const Tension*> tension;
    for (const Tension& t : c.tensions) tension[t.fibre_id] = &t;
    for (const Fibre& fibre : c.cell.fibres) {
      const auto t = tension.find(fibre.fibre_id);
      if (t == tension.end()) continue;
      csv.add(c.name).add(fibre.fibre_id).add(name_of(fibre.type)).add(length_um(fibre.points_um)).add(fibre.width_um);
      csv.add(fibre.confidence).add(t->second->tension_nN).add(t->second->low_nN).add(t->second->high_nN);
      csv.add(t->second->identifiable ? 1 : 0);
      csv.end_row();
    }
  }
  return csv.str();
}

std::string types_csv(const Study& study, const StudyParameters& parameters) {
  CsvText csv({"cell", "type", "n_cells", "n_fibres", "mean_nN", "median_nN", "sd_nN",
               fmt::format("fraction_above_{:g}_nN", parameters.weak_tension_nN),
               fmt::format("fraction_above_{:g}_nN", parameters.strong_tension_nN)});
  for (const TypeSummary& s : summarise_types(study, parameters)) {
    csv.add(s.cell.empty() ? "all" : s.cell).add(name_of(s.type)).add(s.n_cells).add(s.n_fibres);
    csv.add(s.mean_nN).add(s.median_nN).add(s.sd_nN).add(s.fraction_above_weak).add(s.fraction_above_strong);
    csv.end_row();
  }
  return csv.str();
}

std::string tests_csv(const Study& study) {
  CsvText csv({"test", "unit", "group_a", "group_b", "n_a", "n_b", "statistic", "p", "p_holm", "effect"});
  for (const TypeTest& t : test_types(study)) {
    csv.add(t.test).add(t.unit == Unit::fibre ? "fibre" : "cell median").add(t.group_a).add(t.group_b);
    csv.add(t.n_a).add(t.group_b.empty() ? std::optional<int>() : std::optional<int>(t.n_b));
    csv.add(t.statistic).add(t.p_value).add(t.p_holm).add(t.effect);
    csv.end_row();
  }
  return csv.str();
}

}  // namespace mbtfm::statistics
