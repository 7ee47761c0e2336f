#include <nlohmann/json.hpp>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/files.h"
#include "pipeline/contract/json.h"

namespace mbtfm {

namespace {

/// The one list of the members, for reader and writer.
template <class Summary, class Visit>
void for_each_member(Summary& s, const Visit& visit) {
  visit("relative_l2", s.relative_l2);
  visit("expected_relative_l2", s.expected_relative_l2);
  visit("noise_um", s.noise_um);
  visit("total_force_nN", s.total_force_nN);
  visit("network_force_nN", s.network_force_nN);
  visit("fibre_force_nN", s.fibre_force_nN);
  visit("network_surface_tension_nN_per_um", s.network_surface_tension_nN_per_um);
  visit("n_meshes", s.n_meshes);
  visit("iterations", s.iterations);
  visit("converged", s.converged);
}

}  // namespace

FitSummary read_fit_summary(const Path& file) {
  FitSummary summary;
  try {
    const auto json = nlohmann::ordered_json::parse(read_text(file));
    for_each_member(summary, [&](const char* name, auto& member) { json.at(name).get_to(member); });
    for (const auto& [name, value] : json.items()) {
      bool is_named = false;
      for_each_member(summary, [&](const char* known, auto&) { is_named = is_named || name == known; });
      if (!is_named && value.is_primitive() && !value.is_null()) summary.more.emplace_back(name, value_of(value));
    }
  } catch (const nlohmann::json::exception& error) {
    throw InputError(file.string(), "a fit summary as mbtfm-fit writes it", error.what());
  }
  return summary;
}

void write_fit_summary(const Path& file, const FitSummary& summary) {
  nlohmann::ordered_json json;
  for_each_member(summary, [&](const char* name, const auto& member) { json[name] = member; });
  for (const auto& [name, value] : summary.more) json[name] = json_of(value);
  write_text(file, json.dump(2) + "\n");
}

void write_figures(const Path& file, const Figures& figures) { write_text(file, json_of(figures).dump(2) + "\n"); }

}  // namespace mbtfm
