#include "pipeline/files/tables.h"

#include <map>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "pipeline/files/space_files.h"

namespace mbtfm::files {

namespace {

constexpr double kDegree_rad = std::numbers::pi / 180;  // angles are degrees only where a person reads them

constexpr ColumnOptions kPositive = {.range = {.low = 0, .excludes_low = true}};
constexpr ColumnOptions kShare = {.range = {.low = 0, .high = 1}};
constexpr ColumnOptions kShareMayLack = {.range = {.low = 0, .high = 1}, .may_lack = true};

}  // namespace

Table<Adhesion> adhesion_table() {
  return {.file = "1_segment/adhesions.csv",
          .columns = {{"adhesion_id", &Adhesion::adhesion_id, kId},
                      {"x_um", x_of(&Adhesion::position_um)},
                      {"y_um", y_of(&Adhesion::position_um)},
                      {"area_um2", &Adhesion::area_um2, kPositive},
                      {"major_axis_um", &Adhesion::major_axis_um, kPositive},
                      {"minor_axis_um", &Adhesion::minor_axis_um, kPositive},
                      {"angle_deg", [](const Adhesion& a) { return a.angle_rad / kDegree_rad; },
                       [](Adhesion& a, double angle_deg) { a.angle_rad = angle_deg * kDegree_rad; }},
                      {"eccentricity", &Adhesion::eccentricity, kShare},
                      {"mean_intensity", &Adhesion::mean_intensity},
                      {"origin", &Adhesion::origin, kMayLack},
                      {"edge_distance_um", &Adhesion::edge_distance_um, kMayLack},
                      {"probability", &Adhesion::probability, kShareMayLack}},
          .label = "adhesion"};
}

Table<Fibre> fibre_table() {
  return {.file = "1_segment/fibres.csv",
          .columns = {{"fibre_id", &Fibre::fibre_id, kId},
                      {"type", &Fibre::type},
                      {"length_um", [](const Fibre& f) { return length_um(f.points_um); }},
                      {"width_um", &Fibre::width_um, kPositive},
                      {"start_adhesion_id", &Fibre::start_adhesion_id, kId},
                      {"end_adhesion_id", &Fibre::end_adhesion_id, kId},
                      {"mean_intensity", &Fibre::mean_intensity},
                      {"confidence", &Fibre::confidence, kShare},
                      {"type_confidence", &Fibre::type_confidence, kShareMayLack},
                      {"type_reason", &Fibre::type_reason, kMayLack}},
          .label = "fibre"};
}

Table<FibrePoint> fibre_point_table() {
  return {.file = "1_segment/fibre_points.csv",
          .columns = {{"fibre_id", &FibrePoint::fibre_id, kId},
                      {"point", &FibrePoint::point, {.range = {.low = 0}}},
                      {"x_um", x_of(&FibrePoint::position_um)},
                      {"y_um", y_of(&FibrePoint::position_um)}}};
}

Table<OutlinePoint> outline_table() {
  return {.file = "1_segment/outline.csv",
          .columns = {{"x_um", x_of(&OutlinePoint::position_um)},
                      {"y_um", y_of(&OutlinePoint::position_um)},
                      {"ring", &OutlinePoint::ring, {.range = {.low = 0}, .may_lack = true}},
                      {"is_cut", &OutlinePoint::is_cut, kMayLack}}};
}

Table<Vec2> point_table() { return {.file = "points.csv", .columns = {{"x_um", &Vec2::x}, {"y_um", &Vec2::y}}}; }

Table<Bead> displacement_table() {
  return {.file = "2_track/displacement.csv",
          .columns = {{"x_um", x_of(&Bead::position_um)},
                      {"y_um", y_of(&Bead::position_um)},
                      {"ux_um", x_of(&Bead::displacement_um)},
                      {"uy_um", y_of(&Bead::displacement_um)},
                      {"sigma_um", &Bead::sigma_um, {.range = {.low = 0}, .may_lack = true}},
                      {"flag", &Bead::flag, kMayLack}}};
}

Table<BeadInSpace> displacement_in_space_table() {
  using B = BeadInSpace;
  constexpr ColumnOptions kError{.range = {.low = 0}, .may_lack = true};
  return {.file = "displacement_3d.csv",
          .columns = {{"x_um", x_of(&B::position_um)},
                      {"y_um", y_of(&B::position_um)},
                      {"z_um", z_of(&B::position_um)},
                      {"ux_um", x_of(&B::displacement_um)},
                      {"uy_um", y_of(&B::displacement_um)},
                      {"uz_um", z_of(&B::displacement_um)},
                      {"sigma_um", &B::sigma_um, kError},
                      {"sigma_z_um", &B::sigma_z_um, kError},
                      {"flag", &B::flag, kMayLack}}};
}

std::vector<FibreTension> with_types(const std::vector<Tension>& tensions, const std::vector<Fibre>& fibres) {
  std::map<int, std::optional<FibreType>> type_of;
  for (const Fibre& f : fibres) type_of[f.fibre_id] = f.type;
  std::vector<FibreTension> rows;
  for (const Tension& t : tensions) rows.push_back({.tension = t, .type = type_of[t.fibre_id]});
  return rows;
}

Table<FibreTension> tension_table() {
  const Columns<Tension> tension = {{"fibre_id", &Tension::fibre_id, {.range = {.low = 0}}},
                                    {"tension_nN", &Tension::tension_nN, {.range = {.low = 0}, .digits = kForPeople}},
                                    {"low_nN", &Tension::low_nN, kResultMayLack},
                                    {"high_nN", &Tension::high_nN, kResultMayLack},
                                    {"sigma_nN", &Tension::sigma_nN, kResultMayLack},
                                    {"identifiable", &Tension::identifiable, kMayLack}};
  return {.file = "4_fit/tensions.csv",
          .columns = {columns_of(&FibreTension::tension, tension.only({"fibre_id"})),
                      {"type",
                       [](const FibreTension& t) -> std::string {
                         if (t.type) return name_of(*t.type);
                         return t.tension.fibre_id == 0 ? "network" : "";
                       }},
                      columns_of(&FibreTension::tension, tension.without({"fibre_id"}))},
          .label = "fibre"};
}

std::vector<ForceOnAdhesion> forces_on(const std::vector<Adhesion>& adhesions,
                                       const std::vector<AdhesionForce>& forces) {
  std::map<int, const Adhesion*> by_id;
  for (const Adhesion& a : adhesions) by_id[a.adhesion_id] = &a;
  std::vector<ForceOnAdhesion> rows;
  for (const AdhesionForce& force : forces) {
    MBTFM_ASSERT(by_id.contains(force.adhesion_id));
    rows.push_back({force, by_id[force.adhesion_id]});
  }
  return rows;
}

Table<ForceOnAdhesion> adhesion_force_table() {
  const Columns<AdhesionForce> force = {{"adhesion_id", &AdhesionForce::adhesion_id, kId},
                                        {"fx_nN", x_of(&AdhesionForce::force_nN)},
                                        {"fy_nN", y_of(&AdhesionForce::force_nN)},
                                        {"force_nN", [](const AdhesionForce& f) { return norm(f.force_nN); }, kResult},
                                        {"sigma_nN", &AdhesionForce::sigma_nN, kResultMayLack},
                                        {"force_low_nN", &AdhesionForce::low_nN, kResultMayLack},
                                        {"force_high_nN", &AdhesionForce::high_nN, kResultMayLack},
                                        {"connected", &AdhesionForce::connected, kMayLack},
                                        {"moment_nN_um", &AdhesionForce::moment_nN_um, kMayLack}};
  using Row = ForceOnAdhesion;
  const auto of_force = [&](const std::vector<std::string>& names) {
    return columns_of(&Row::force, force.only(names));
  };
  return {.file = "4_fit/adhesion_forces.csv",
          .columns = {of_force({"adhesion_id"}),
                      columns_of(adhesion_of, adhesion_table().columns.only({"x_um", "y_um", "area_um2"})),
                      of_force({"fx_nN", "fy_nN", "force_nN"}),
                      {"traction_kPa",
                       [](const Row& row) { return norm(row.force.force_nN) / area_stood_for_um2(*row.adhesion); },
                       kResult},
                      of_force({"sigma_nN", "force_low_nN", "force_high_nN", "connected", "moment_nN_um"})},
          .label = "adhesion"};
}

Table<Reaction> reaction_table() {
  return {
      .file = "reactions.csv",
      .columns = {
          {"vertex", &Reaction::vertex}, {"fx_nN", x_of(&Reaction::force_nN)}, {"fy_nN", y_of(&Reaction::force_nN)}}};
}

Table<MissingFibre> missing_fibre_table() {
  return {.file = "4_fit/missing_fibres.csv",
          .columns = {{"start_adhesion_id", &MissingFibre::start_adhesion_id, kId},
                      {"end_adhesion_id", &MissingFibre::end_adhesion_id, kId},
                      {"tension_nN", &MissingFibre::tension_nN, kResultMayLack},
                      {"chi_squared_gain", &MissingFibre::chi_squared_gain, kResultMayLack},
                      {"sigma_nN", [](const MissingFibre& f) { return sigma_nN(f); }, kResult},
                      {"beside_fibre_id", &MissingFibre::beside_fibre_id, kResultMayLack}}};
}

Table<MissingAdhesion> missing_adhesion_table() {
  using Row = MissingAdhesion;
  return {.file = "4_fit/missing_adhesions.csv",
          .columns = {{"x_um", x_of(&Row::position_um), kResult},
                      {"y_um", y_of(&Row::position_um), kResult},
                      {"fx_nN", x_of(&Row::force_nN), kResult},
                      {"fy_nN", y_of(&Row::force_nN), kResult},
                      {"chi_squared_gain", &Row::chi_squared_gain, kResultMayLack}}};
}

Table<ImagePlace> image_place_table() {
  return {.file = "1_segment/images.csv",
          .columns = {{"x_um", x_of(&ImagePlace::low_um)},
                      {"y_um", y_of(&ImagePlace::low_um)},
                      {"width_um", x_of(&ImagePlace::size_um)},
                      {"height_um", y_of(&ImagePlace::size_um)}}};
}

Table<FrameRow> frame_table() {
  return {.file = "2_track/frames.csv",
          .columns = {{"frame", &FrameRow::frame, kId},
                      {"image", &FrameRow::image, kMayLack},
                      {"n_tracked", &FrameRow::n_tracked, kMayLack},
                      {"drift_x_um", &FrameRow::drift_x_um, kResultMayLack},
                      {"drift_y_um", &FrameRow::drift_y_um, kResultMayLack},
                      {"turn_deg", &FrameRow::turn_deg, kResultMayLack},
                      {"noise_um", &FrameRow::noise_um, kResultMayLack},
                      {"largest_displacement_um", &FrameRow::largest_displacement_um, kResultMayLack},
                      {"refused", &FrameRow::refused}}};
}

std::string pages_of_cell_tables() {
  return page_of(adhesion_table()) + page_of(fibre_table()) + page_of(fibre_point_table()) + page_of(outline_table()) +
         page_of(image_place_table()) + page_of(displacement_table()) + page_of(frame_table()) +
         page_of(tension_table()) + page_of(adhesion_force_table()) + page_of(missing_fibre_table()) +
         page_of(missing_adhesion_table()) + page_of(point_table()) + page_of(displacement_in_space_table()) +
         page_of(surface_traction_table()) + page_of(part_force_table()) + page_of(reaction_table());
}

}  // namespace mbtfm::files
