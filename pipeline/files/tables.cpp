#include "pipeline/files/tables.h"

#include <map>
#include <numbers>

#include "pipeline/contract/errors.h"

namespace mbtfm::files {

namespace {

constexpr double kDegree_rad = std::numbers::pi / 180;  // angles are degrees only where a person reads them

constexpr ColumnOptions kPositive = {.range = {.low = 0, .excludes_low = true}};
constexpr ColumnOptions kShare = {.range = {.low = 0, .high = 1}};
constexpr ColumnOptions kShareMayLack = {.range = {.low = 0, .high = 1}, .may_lack = true};

}  // namespace

Table<Adhesion> adhesion_table() {
  return {.file = "1_segment/adhesions.csv",
          .row = "each adhesion",
          .columns = {{"adhesion_id", "label, from the segmentation to the statistics", &Adhesion::adhesion_id, kId},
                      {"x_um", "its centre", x_of(&Adhesion::position_um)},
                      {"y_um", "its centre; y points down", y_of(&Adhesion::position_um)},
                      {"area_um2", "area of what was segmented, and of the ellipse", &Adhesion::area_um2, kPositive},
                      {"major_axis_um", "full axis of the ellipse of equal second moments, scaled to the area",
                       &Adhesion::major_axis_um, kPositive},
                      {"minor_axis_um", "the other full axis", &Adhesion::minor_axis_um, kPositive},
                      {"angle_deg", "of the major axis, from +x towards +y",
                       [](const Adhesion& a) { return a.angle_rad / kDegree_rad; },
                       [](Adhesion& a, double angle_deg) { a.angle_rad = angle_deg * kDegree_rad; }},
                      {"eccentricity", "of the ellipse; 0: a disc", &Adhesion::eccentricity, kShare},
                      {"mean_intensity", "height above the local background", &Adhesion::mean_intensity},
                      {"origin",
                       "where it comes from: found in the image or a mask, drawn by hand, put where a fibre must be "
                       "held, or put where an adhesion may be",
                       &Adhesion::origin, kMayLack},
                      {"edge_distance_um", "from the centre to the outline or a hole of the cell",
                       &Adhesion::edge_distance_um, kMayLack},
                      {"probability", "chance that it is an adhesion, no vesicle or haze; empty: not from an image",
                       &Adhesion::probability, kShareMayLack}},
          .label = "adhesion"};
}

Table<Fibre> fibre_table() {
  return {.file = "1_segment/fibres.csv",
          .row = "each fibre",
          .columns = {{"fibre_id", "label, from the segmentation to the statistics", &Fibre::fibre_id, kId},
                      {"type",
                       "one end on an adhesion (dorsal), none (arc), both (ventral), or both along a free piece of the "
                       "outline (edge)",
                       &Fibre::type},
                      {"length_um", "along its line", [](const Fibre& f) { return length_um(f.points_um); }},
                      {"width_um", "across its line", &Fibre::width_um, kPositive},
                      {"start_adhesion_id", "adhesion that holds its first point", &Fibre::start_adhesion_id, kId},
                      {"end_adhesion_id", "adhesion that holds its last point", &Fibre::end_adhesion_id, kId},
                      {"mean_intensity", "along its line", &Fibre::mean_intensity},
                      {"confidence", "chance that it is a fibre and not a chain of the meshwork", &Fibre::confidence,
                       kShare},
                      {"type_confidence", "chance that its type is right", &Fibre::type_confidence, kShareMayLack},
                      {"type_reason", "why it has its type, end by end", &Fibre::type_reason, kMayLack}},
          .label = "fibre"};
}

Table<FibrePoint> fibre_point_table() {
  return {.file = "1_segment/fibre_points.csv",
          .row = "each point of a fibre's line, in order",
          .columns = {{"fibre_id", "the fibre", &FibrePoint::fibre_id, kId},
                      {"point", "counts from 0", &FibrePoint::point, {.range = {.low = 0}}},
                      {"x_um", "the point", x_of(&FibrePoint::position_um)},
                      {"y_um", "the point", y_of(&FibrePoint::position_um)}}};
}

Table<OutlinePoint> outline_table() {
  return {.file = "1_segment/outline.csv",
          .row = "each corner of the cell's outline and of its holes, in order",
          .columns = {{"x_um", "the corner", x_of(&OutlinePoint::position_um)},
                      {"y_um", "the corner", y_of(&OutlinePoint::position_um)},
                      {"ring",
                       "0: the outer ring; 1, 2, …: gaps in the cell",
                       &OutlinePoint::ring,
                       {.range = {.low = 0}, .may_lack = true}},
                      {"is_cut", "from here to the next corner the outline runs along the image's border",
                       &OutlinePoint::is_cut, kMayLack}}};
}

Table<Vec2> point_table() {
  return {.file = "points.csv",
          .row = "each point at which `mbtfm-substrate --points` finds the displacement",
          .columns = {{"x_um", "the point", &Vec2::x}, {"y_um", "the point", &Vec2::y}}};
}

Table<Bead> displacement_table() {
  return {
      .file = "2_track/displacement.csv",
      .row = "each bead",
      .columns = {
          {"x_um", "its place at rest, in the frame of the cell's images", x_of(&Bead::position_um)},
          {"y_um", "its place at rest, in the frame of the cell's images", y_of(&Bead::position_um)},
          {"ux_um", "its displacement: stressed less relaxed", x_of(&Bead::displacement_um)},
          {"uy_um", "its displacement: stressed less relaxed", y_of(&Bead::displacement_um)},
          {"sigma_um", "standard error of each component", &Bead::sigma_um, {.range = {.low = 0}, .may_lack = true}},
          {"flag", "why it must not be used; empty: good", &Bead::flag, kMayLack}}};
}

Table<BeadInSpace> displacement_in_space_table() {
  using B = BeadInSpace;
  constexpr ColumnOptions kError{.range = {.low = 0}, .may_lack = true};
  return {.file = "displacement_3d.csv",
          .row = "each bead or point in the volume of a gel",
          .columns = {{"x_um", "its place in the relaxed state", x_of(&B::position_um)},
                      {"y_um", "its place in the relaxed state", y_of(&B::position_um)},
                      {"z_um", "its place, into the gel; a flat surface lies at 0", z_of(&B::position_um)},
                      {"ux_um", "its displacement: stressed less relaxed", x_of(&B::displacement_um)},
                      {"uy_um", "its displacement: stressed less relaxed", y_of(&B::displacement_um)},
                      {"uz_um", "its displacement into the gel", z_of(&B::displacement_um)},
                      {"sigma_um", "standard error along x and along y", &B::sigma_um, kError},
                      {"sigma_z_um", "standard error along z", &B::sigma_z_um, kError},
                      {"flag", "why it must not be used; empty: good", &B::flag, kMayLack}}};
}

std::vector<FibreTension> with_types(const std::vector<Tension>& tensions, const std::vector<Fibre>& fibres) {
  std::map<int, std::optional<FibreType>> type_of;
  for (const Fibre& f : fibres) type_of[f.fibre_id] = f.type;
  std::vector<FibreTension> rows;
  for (const Tension& t : tensions) rows.push_back({.tension = t, .type = type_of[t.fibre_id]});
  return rows;
}

Table<FibreTension> tension_table() {
  const Columns<Tension> tension = {
      {"fibre_id", "label of the fibre; 0: the actin network", &Tension::fibre_id, {.range = {.low = 0}}},
      {"tension_nN", "its tension", &Tension::tension_nN, {.range = {.low = 0}, .digits = kForPeople}},
      {"low_nN", "lower end of the 95 % interval", &Tension::low_nN, kResultMayLack},
      {"high_nN", "upper end of the 95 % interval; empty: there is none", &Tension::high_nN, kResultMayLack},
      {"sigma_nN", "standard error; the interval knows more, as a tension is never below 0", &Tension::sigma_nN,
       kResultMayLack},
      {"identifiable", "the data distinguish it from any tension that occurs in the cell", &Tension::identifiable,
       kMayLack}};
  return {.file = "4_fit/tensions.csv",
          .row = "the actin network and each fibre",
          .columns = {columns_of(&FibreTension::tension, tension.only({"fibre_id"})),
                      {"type", "of the fibre (network, dorsal, arc, ventral, edge)",
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
  const Columns<AdhesionForce> force = {
      {"adhesion_id", "label of the adhesion", &AdhesionForce::adhesion_id, kId},
      {"fx_nN", "force of the cell on the gel", x_of(&AdhesionForce::force_nN)},
      {"fy_nN", "force of the cell on the gel", y_of(&AdhesionForce::force_nN)},
      {"force_nN", "its magnitude", [](const AdhesionForce& f) { return norm(f.force_nN); }, kResult},
      {"sigma_nN", "standard error of the magnitude, and of each component", &AdhesionForce::sigma_nN, kResultMayLack},
      {"force_low_nN", "lower end of the magnitude's 95 % interval", &AdhesionForce::low_nN, kResultMayLack},
      {"force_high_nN", "upper end of the magnitude's 95 % interval", &AdhesionForce::high_nN, kResultMayLack},
      {"connected", "a fibre ends on the adhesion", &AdhesionForce::connected, kMayLack},
      {"moment_nN_um", "torque about the adhesion's centre, from +x towards +y", &AdhesionForce::moment_nN_um,
       kMayLack}};
  using Row = ForceOnAdhesion;
  const auto of_force = [&](const std::vector<std::string>& names) {
    return columns_of(&Row::force, force.only(names));
  };
  return {.file = "4_fit/adhesion_forces.csv",
          .row = "each adhesion",
          .columns = {of_force({"adhesion_id"}),
                      columns_of(adhesion_of, adhesion_table().columns.only({"x_um", "y_um", "area_um2"})),
                      of_force({"fx_nN", "fy_nN", "force_nN"}),
                      {"traction_kPa", "the force over the area that the adhesion represents",
                       [](const Row& row) { return norm(row.force.force_nN) / area_stood_for_um2(*row.adhesion); },
                       kResult},
                      of_force({"sigma_nN", "force_low_nN", "force_high_nN", "connected", "moment_nN_um"})},
          .label = "adhesion"};
}

Table<Reaction> reaction_table() {
  return {.file = "reactions.csv",
          .row = "each vertex that is held (`mbtfm-contract`)",
          .columns = {{"vertex", "of the network, from 0", &Reaction::vertex},
                      {"fx_nN", "force of the network on the gel", x_of(&Reaction::force_nN)},
                      {"fy_nN", "force of the network on the gel", y_of(&Reaction::force_nN)}}};
}

Table<MissingFibre> missing_fibre_table() {
  return {.file = "4_fit/missing_fibres.csv",
          .row = "each fibre that was not segmented and that the beads call for (`mbtfm-add-fibres` adds them)",
          .columns = {
              {"start_adhesion_id", "adhesion at one end", &MissingFibre::start_adhesion_id, kId},
              {"end_adhesion_id", "adhesion at the other end", &MissingFibre::end_adhesion_id, kId},
              {"tension_nN", "its tension", &MissingFibre::tension_nN, kResultMayLack},
              {"chi_squared_gain", "how much less misfit it leaves, in units of the noise",
               &MissingFibre::chi_squared_gain, kResultMayLack},
              {"sigma_nN", "standard error of the tension", [](const MissingFibre& f) { return sigma_nN(f); }, kResult},
              {"beside_fibre_id",
               "the segmented fibre whose ends lie beside these adhesions, where they should be; empty: none",
               &MissingFibre::beside_fibre_id, kResultMayLack}}};
}

Table<MissingAdhesion> missing_adhesion_table() {
  using Row = MissingAdhesion;
  return {.file = "4_fit/missing_adhesions.csv",
          .row = "each place away from all adhesions where the beads call for a force",
          .columns = {{"x_um", "the place", x_of(&Row::position_um), kResult},
                      {"y_um", "the place", y_of(&Row::position_um), kResult},
                      {"fx_nN", "force of the cell on the gel", x_of(&Row::force_nN), kResult},
                      {"fy_nN", "force of the cell on the gel", y_of(&Row::force_nN), kResult},
                      {"chi_squared_gain", "how much less misfit it leaves", &Row::chi_squared_gain, kResultMayLack}}};
}

Table<ImagePlace> image_place_table() {
  return {.file = "1_segment/images.csv",
          .row = "the picture `images.jpg`",
          .columns = {{"x_um", "its left edge", x_of(&ImagePlace::low_um)},
                      {"y_um", "its upper edge", y_of(&ImagePlace::low_um)},
                      {"width_um", "its width", x_of(&ImagePlace::size_um)},
                      {"height_um", "its height", y_of(&ImagePlace::size_um)}}};
}

Table<FrameRow> frame_table() {
  return {
      .file = "2_track/frames.csv",
      .row = "each frame of a time series",
      .columns = {{"frame", "counts from 1", &FrameRow::frame, kId},
                  {"image", "its name", &FrameRow::image, kMayLack},
                  {"n_tracked", "beads that were found", &FrameRow::n_tracked, kMayLack},
                  {"drift_x_um", "common motion, taken off", &FrameRow::drift_x_um, kResultMayLack},
                  {"drift_y_um", "common motion, taken off", &FrameRow::drift_y_um, kResultMayLack},
                  {"turn_deg", "common turn, taken off", &FrameRow::turn_deg, kResultMayLack},
                  {"noise_um", "standard error of a component far from the cell", &FrameRow::noise_um, kResultMayLack},
                  {"largest_displacement_um", "of the beads", &FrameRow::largest_displacement_um, kResultMayLack},
                  {"refused", "why it has no displacements; empty: it has", &FrameRow::refused}}};
}

std::string pages_of_cell_tables() {
  return page_of(adhesion_table()) + page_of(fibre_table()) + page_of(fibre_point_table()) + page_of(outline_table()) +
         page_of(image_place_table()) + page_of(displacement_table()) + page_of(frame_table()) +
         page_of(tension_table()) + page_of(adhesion_force_table()) + page_of(missing_fibre_table()) +
         page_of(missing_adhesion_table()) + page_of(point_table()) + page_of(displacement_in_space_table()) +
         page_of(reaction_table());
}

}  // namespace mbtfm::files
