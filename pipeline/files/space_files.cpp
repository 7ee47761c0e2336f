#include "pipeline/files/space_files.h"

namespace mbtfm::files {

Table<SurfaceTraction> surface_traction_table() {
  using Row = SurfaceTraction;
  // a component of what is known as a whole, or not at all
  const auto sigma = [](const char* name, double Vec3::*axis) -> Columns<Row> {
    return {name,
            [axis](const Row& row) { return row.sigma_kPa ? std::optional((*row.sigma_kPa).*axis) : std::nullopt; },
            [axis](Row& row, const std::optional<double>& value) {
              if (!value) return;
              if (!row.sigma_kPa) row.sigma_kPa.emplace();
              (*row.sigma_kPa).*axis = *value;  // GCC 12 writes (a ? b : c).*axis into a copy
            },
            kResult};
  };
  return {.file = "traction_3d.csv",
          .columns = {{"x_um", x_of(&Row::position_um)},
                      {"y_um", y_of(&Row::position_um)},
                      {"z_um", z_of(&Row::position_um)},
                      {"tx_kPa", x_of(&Row::traction_kPa)},
                      {"ty_kPa", y_of(&Row::traction_kPa)},
                      {"tz_kPa", z_of(&Row::traction_kPa)},
                      sigma("sigma_tx_kPa", &Vec3::x),
                      sigma("sigma_ty_kPa", &Vec3::y),
                      sigma("sigma_tz_kPa", &Vec3::z),
                      {"resolution_um", &Row::resolution_um, kResult},
                      {"normal_kPa", &Row::normal_kPa, kResult},
                      {"tangential_kPa", &Row::tangential_kPa, kResult},
                      {"area_um2", &Row::area_um2, kResult},
                      {"ux_um", x_of(&Row::displacement_um), kResultMayLack},
                      {"uy_um", y_of(&Row::displacement_um), kResultMayLack},
                      {"uz_um", z_of(&Row::displacement_um), kResultMayLack}}};
}

Table<PartForce> part_force_table() {
  using Row = PartForce;
  return {.file = "traction_3d_adhesion_forces.csv",
          .columns = {{"adhesion_id", &Row::adhesion_id, kId},
                      {"x_um", x_of(&Row::position_um)},
                      {"y_um", y_of(&Row::position_um)},
                      {"z_um", z_of(&Row::position_um)},
                      {"area_um2", &Row::area_um2, kResult},
                      {"fx_nN", x_of(&Row::force_nN)},
                      {"fy_nN", y_of(&Row::force_nN)},
                      {"fz_nN", z_of(&Row::force_nN)},
                      {"sigma_fx_nN", x_of(&Row::sigma_nN), kResultMayLack},
                      {"sigma_fy_nN", y_of(&Row::sigma_nN), kResultMayLack},
                      {"sigma_fz_nN", z_of(&Row::sigma_nN), kResultMayLack},
                      {"force_nN", [](const Row& f) { return norm(f.force_nN); }, kResult},
                      {"sigma_nN", &Row::magnitude_sigma_nN, kResult},
                      {"angle_deg", &Row::angle_deg, kResultMayLack},
                      {"sigma_angle_deg", &Row::angle_sigma_deg, kResultMayLack}}};
}

}  // namespace mbtfm::files
