/// Every kind of finding: its cause, in plain words, what to do, and the numbers by which the program sees it.
#include "pipeline/contract/findings_table.h"

#include <algorithm>
#include <iterator>

#include "pipeline/contract/kinds_of_findings.h"

namespace mbtfm {

namespace {

/// About images and beads.
std::vector<KindOfFinding> kinds_of_inputs() {
  using enum Symptom;
  using enum Severity;
  return {
      // any stage
      {"unusual-value",
       "A value is beyond what is usual.",
       "Check the value and its unit.",
       "",
       {{unusual_value, "any stage", caution, "{at}.", "values beyond what is usual", 0,
         "ranges and sources: docs/plausible.md"}}},
      {"assumed-input",
       "An input is missing and was assumed.",
       "Give it in cell.toml.",
       "",
       {{assumed_input, "any stage", note, "{at}", "inputs missing in cell.toml", 0, "forces depend on them"},
        {modulus_error_unknown, "fit", note,
         "gel.youngs_modulus_sigma_kPa is not given: an error of 10 % would change every force by 10 %.",
         "1 if not given", 0, "forces are proportional to the modulus"}}},
      {"lossy-image",
       "An image was compressed with loss.",
       "Use the microscope's own file.",
       "",
       {{lossy_image, "any stage", caution,
         "{at} is a lossy image (JPEG): its intensities and the positions of its beads are changed.", "JPEG images", 0,
         "JPEG drops detail that measurements need"}}},
      {"saturated",
       "An image is saturated.",
       "Record with less light or a shorter exposure: areas, positions and intensities of what is saturated are wrong.",
       "",
       {{saturated, "any stage", caution, "{at} is saturated: {%} of its pixels have its largest value.",
         "share of pixels at the largest value", 1e-3, "unsaturated images have one or two; adhesions cover 0.01"}}},
      {"pixel-size-unchecked",
       "No image states its pixel size.",
       "Compare it with the microscope's record and the camera's binning: 10 % of it are 20 % of every force.",
       "",
       {{pixel_size_unchecked, "any stage", note, "The given pixel size, {} um, cannot be checked: {at}.",
         "1 if no image states it", 0,
         "a caution if cell, adhesions and fibres are two standard deviations off the usual size"}}},
      {"scan-phase",
       "A scanner shifted every second row.",
       "Nothing for this cell: the shift was taken off. Correct the scanner's phase, or scan in one direction.",
       "",
       {{scan_phase, "any stage", note, "In {at} every second row was shifted by {} pixels.", "shift (pixels)", 0.1,
         "forces err by 6 % at 1 pixel, below 0.1 % at 0.1"}}},
      // segment
      {"adhesions-left-out",
       "Adhesions outside of the outline were left out.",
       "Check the outline in 1_segment/overlay.png: grey dashes show what was left out.",
       "",
       {{adhesions_left_out, "segment", note, "Outside of the cell and left out: {at}.",
         "adhesions and small bright things outside", 0, "only what is inside holds the network"}}},
      {"channel-shift",
       "The channels do not lie on each other.",
       "Nothing if the shift was allowed for. If it recurs, measure the shift between the filters with beads that "
       "shine in both.",
       "",
       {{actin_shift, "segment", note, "The actin image is shifted by {} against the adhesions; {at}.", "1 if shifted",
         0, "twice the log likelihood gain: 16.25 near no shift (chance: one cell of 370), 27 elsewhere"},
        {channel_shift, "fit", note, "The cell lies beside its place on the beads, by {}; {at}.",
         "largest of shift and turn over its standard error", 4, "chance: one cell of five thousand"}}},
      {"bleed-through",
       "The adhesion image shows actin.",
       "Look at the adhesion image: are the channels exchanged? Record them one after the other, subtract the actin "
       "image's share, or draw the adhesions (images.adhesion_rois).",
       "",
       {{adhesions_long, "segment", caution, "Adhesions are {} times as long as wide; 2 to 3 are usual.",
         "length over width, mean by area", 4, "adhesions in five kinds of images: 1.7 to 3.1; actin bundles: 6 to 8"},
        {bleed_through, "segment", caution, "The adhesion image shows the fibres with {%} of the adhesions' contrast.",
         "contrast of fibres over that of adhesions", 0.1,
         "real paxillin: 0.03; a tenth of the actin's light: 0.12, with 7 to 12 false adhesions of 170"}}},
      {"bright-actin",
       "Bright actin is in no fibre.",
       "Look at the dots in 1_segment/overlay.png. Draw what is missing (images.fibre_rois; begin with "
       "1_segment/RoiSet.zip).",
       "0 of 6 cells with fibres",
       {{bright_actin, "segment", caution, "Bright actin that is in no fibre: {} um.", "length (um)", 0,
         "lines of 3 um, 3 um off the edge, as bright as the middle fibre; 9 to 26 um without one fibre"}}},
      {"images-mismatch",
       "The images do not show the same cell.",
       "Check in 1_segment/overlay.png that all show the same cell, the same way up. Crop a neighbour away, or draw "
       "the adhesions (images.adhesion_rois) or the outline (images.outline_roi).",
       "0 of 19",
       {{adhesions_off_actin, "segment", caution,
         "{%} of the adhesions' area lies where the actin image shows no cell.",
         "share of a cell's adhesion area 1 um and more outside of the actin image's cells", 0.03,
         "right pairs: 0 to 0.013; another cell, upside down or half of it dim: 0.05 to 0.5"},
        {outline_off_actin, "segment", caution, "{%} of the given outline lies where the actin image shows no cell.",
         "share of the outline's area 1 um beyond the actin image's cells", 0.02,
         "right: 0.000; another cell: 0.005 to 0.16, nine of eleven above this"}}},
      {"outline-doubtful",
       "The outline and the adhesions do not fit together.",
       "Look at 1_segment/overlay.png. If the outline is wrong, draw it (images.outline_roi), or crop to where the "
       "light "
       "is even. If adhesions are missing, lower segment.adhesion_faintest or draw them (images.adhesion_rois).",
       "0 of 32",
       {{adhesions_off_outline, "segment", caution, "{%} of the adhesions' area lies outside of the outline.",
         "share of a cell's adhesion area 1 um and more outside", 0.03,
         "right outlines: 0 to 0.019; half of the cell dim: 0.07 to 0.5"},
        {outline_reaches_far, "segment", caution, "The outline reaches {} um beyond all adhesions.",
         "distance beyond the hull of the adhesions (um)", 8,
         "right outlines: 1.8 to 6.2; the edge of a disc of light, uneven light or padding: 10 to 50"}}},
      {"cells-touch",
       "The cell was cut off one that touches it.",
       "Check the cut in 1_segment/overlay.png. If both parts are one cell, set segment.outline_neck = 0; if the cut "
       "is misplaced, draw outline.roi. Forces between the cells are not included.",
       "",
       {{cells_touch, "segment", caution, "The outline was cut where it is only {} um wide, at {at} um.",
         "width of the neck (um)", 0, "narrower than segment.outline_neck of the narrower part"}}},
      {"adhesions-assumed",
       "No image shows the adhesions.",
       "Give an adhesion image (images.adhesion), a mask (images.adhesion_mask) or drawings (images.adhesion_rois); on "
       "an adhesive pattern set segment.adhesions = pattern. Read sums of forces over neighbours.",
       "",
       {{adhesions_assumed, "segment", caution, "Forces act on {} candidates for adhesions, {at}.", "candidates", 0,
         "candidates are where adhesions may be"}}},
      {"pattern-unsuitable",
       "The adhesive pattern is too fine, or as large as the cell.",
       "Too fine: leave segment.adhesions out, or lower segment.candidate_spacing_um. As large as the cell: if the "
       "mask shows the cell, take it as images.outline_mask; else read sums of forces over neighbours.",
       "",
       {{pattern_too_fine, "segment", caution, "A candidate adhesion has {} times the area of a part of the pattern.",
         "area of a candidate over a part's (median)", 1, "beyond it a candidate exceeds the part that holds it"},
        {pattern_as_cell, "segment", caution, "{%} of the cell's area lies on the pattern.", "share of the cell's area",
         0.9, "simulated total forces are then off by four standard errors"}}},
      {"fibre-ends-anchored",
       "Fibres end without an adhesion.",
       "Check the dashed circles in 1_segment/overlay.png. A missed adhesion: lower segment.adhesion_seed_noise, or "
       "draw it. An end that is not held: draw the fibre as dorsal or arc.",
       "",
       {{fibre_ends_anchored, "segment", note, "Fibre ends that reach no adhesion and are held by an anchor: {}.",
         "anchored ends", 0, "ventral and edge fibres are held at both ends, dorsal at one"}}},
      {"input-not-used",
       "Another input took precedence.",
       "Remove the input that you do not want.",
       "",
       {{input_not_used, "segment", note, "{at}", "inputs", 0,
         "[segment] counts more than drawings, these more than masks"}}},
      // track
      {"vectors-masked",
       "Another program masked vectors.",
       "Nothing: masked vectors are flagged in displacement.csv and not used.",
       "",
       {{vectors_masked, "track", note, "{%} of the vectors were masked by their program: {at}.",
         "share of masked vectors", 0, "no measurement repeats both components to the last digit"}}},
      {"nothing-moves",
       "The beads do not move.",
       "Check that both bead images belong to this cell, and that the cell was removed between them.",
       "",
       {{nothing_moves, "track", caution, "Nothing moves: {} beads by more than six standard errors.",
         "share of beads that do not move by six standard errors", 0.999,
         "at rest at most 6 beads in 10 000 move so; with 7 % of noise 16 and more"}}},
      {"pushes-outward",
       "The gel moves outward.",
       "Check whether stressed and relaxed images are exchanged, the sign of given tractions and the outline. If an "
       "interval includes zero, use its upper end.",
       "",
       {{moves_outward, "track", caution, "The gel is pushed outward: mean cosine {} to the direction from the centre.",
         "mean cosine", 0.3, "contracting cells: -0.7; layers of cells: 0"},
        {sheet_expands, "sheet", caution, "The sheet pushes outward: {at}.",
         "share of parts that expand; 1 if the mean tension is negative", 0,
         "cells pull inward; bad if the interval has no contraction"}}},
      {"field-smoothed",
       "The displacement is smoothed.",
       "Detail finer than the window is lost. Use smaller windows without a filter, or give sharp bead images. "
       "Tensions of a field that was smoothed elsewhere are wrong by more than their error bars.",
       "0 of 400",
       {{tracked_by_correlation, "track", note, "Windows of {} um were followed, {at}.", "1 if windows were followed",
         0, "windows flatten what is narrower"},
        {field_smoothed, "fit", caution, "The model leaves {} times less of the displacement {at}.",
         "misfit over that of a smoothed model", 2, "hundreds for fields smoothed over 4 um, 1.0 to 1.6 for others"}}},
      {"defocused",
       "The beads are out of focus.",
       "Focus both images on the same plane of beads; of a stack choose it by relaxed_z or stressed_z. Compare their "
       "size with your beads' diameter.",
       "",
       {{defocused, "track", caution, "Beads are {} times as large in the blurrier image, the {at} one.",
         "size of beads, blurrier over sharper image", 1.5,
         "errors are 1.0 to 1.1 times sigma up to 1.47, 1.2 to 1.7 times at 1.6"},
        {beads_wide, "track", note, "The beads look {} um wide; smaller beads are out of focus in both images.",
         "diameter of beads as wide in focus (um)", 0.7,
         "beads: 0.04 to 0.5 um, lens: 0.15 um or 1.2 pixels; a blur of 2 pixels costs 2 to 4 % of the force"}}},
      {"beads-not-round",
       "The beads' images are not round.",
       "Compare the images' width and height with the camera's: pixels that are not square make tensions wrong; "
       "astigmatism or coma do not.",
       "",
       {{beads_not_round, "track", note, "Beads look {} times as long as wide, along {at}.", "length over width", 1.08,
         "simulated: 1.00 to 1.01; pixels 10 % too low: 1.14; five real pairs: 1.06 to 1.26; a caution if alike in "
         "both images, along rows or columns"}}},
      {"pattern-repeats",
       "The beads' pattern repeats itself.",
       "Keep the stage still between the pictures, or use beads at random or further apart.",
       "",
       {{pattern_repeats, "track", caution, "The pattern of beads moved by {%} of its period; dots may be mistaken.",
         "largest motion over the period", 0.33,
         "from half of it the next dot is nearer; below, all dots found their partners"}}},
      {"beads-lost",
       "Beads were lost between the stacks.",
       "Record with less light, so that beads bleach less. See the flags in displacement_3d.csv: for `no partner` "
       "raise track.largest_displacement_um or lower track.detection_snr; for `ambiguous` use fewer beads.",
       "",
       {{beads_lost, "track", caution, "{%} of the beads were not followed: {at}.", "share of beads not followed", 0.2,
         "simulated stacks lose 2 of a hundred at most; strained parts lose theirs first"},
        {light_lost, "track", caution, "{%} of the light is missing in the dimmer stack.",
         "share of light that is missing", 0.5, "with half of it dim beads are lost in noise"}}},
      {"few-beads-at-rest",
       "Too few beads are at rest.",
       "Record a wider field or a deeper stack, so that part of the gel is at rest.",
       "",
       {{little_at_rest, "track", caution, "{%} of the beads do not move with the others, as those at rest do.",
         "share of beads that do not move alike", 0.6, "beyond two thirds the common motion is lost"}}},
      {"common-motion",
       "All beads share a motion.",
       "Nothing if it was taken off; if it recurs, look for a change of focus or temperature. Else follow other "
       "findings first, then look for stitched tiles, drift, another objective or an uneven gel, or set fit.region_um.",
       "0 of 400",
       {{slices_moved, "track", note, "The slices of one stack moved by {} um (rms) against the other's; {at}.",
         "square root of twice the log odds", 3, "chance makes 1; motion that changes slowly with depth is the gel's"},
        {common_motion, "fit", note, "All beads share a motion, {}; it was taken off{at}.",
         "largest of growth, shears and turn over its standard error", 3, "chance: one cell of a hundred"},
        {curved_motion, "fit", caution, "All beads share an uneven motion of {} nm, which was not taken off.",
         "chi squared of second and third degree, 14 degrees of freedom", 36.1,
         "chance and model error: one cell of a thousand"}}},
      {"noise-understated",
       "The beads scatter more than stated.",
       "The error bars take the larger error. Look for beads that overlap, are out of focus or moved while recorded; "
       "check sigma_um of another program.",
       "0 of 400",
       {{beads_scatter, "track", note, "Beads that lie together differ by {} times their errors, which were raised.",
         "difference of near beads over their errors", 1.5, "simulated errors hold to a seventh"},
        {noise_disagrees, "fit", caution, "{at} scatter {} times as much about the model as they state.",
         "scatter about the model over stated error", 1.3, "a third is more than chance and model explain"}}},
  };
}

}  // namespace

const std::vector<KindOfFinding>& kinds_of_findings() {
  static const std::vector<KindOfFinding> all = [] {
    std::vector<KindOfFinding> kinds = kinds_of_inputs();
    std::ranges::copy(kinds_of_results(), std::back_inserter(kinds));
    return kinds;
  }();
  return all;
}

}  // namespace mbtfm
