#include "pipeline/contract/kinds_of_findings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm {

const std::vector<KindOfFinding>& kinds_of_findings() {
  using enum FindingKind;
  using enum Severity;
  static const std::vector<KindOfFinding> kinds = {
      {unusual_value, "unusual-value", "any stage", caution, "values beyond what is usual", 0,
       "each value has its range and its source: docs/plausible.md", "Check the value and its unit."},
      {assumed_input, "assumed-input", "any stage", note, "physical inputs that cell.toml does not give", 0,
       "forces depend on them, and they were not measured", "Give them in cell.toml."},
      {lossy_image, "lossy-image", "any stage", caution, "images that are JPEG files", 0,
       "JPEG drops detail that the eye does not see but measurements need", "Use the microscope's own file."},
      {saturated, "saturated", "any stage", caution, "share of the pixels that have the image's largest value", 1e-3,
       "in an image that is not saturated one or two pixels have it; adhesions cover 0.01 of an image",
       "Areas, positions and intensities of what is saturated are wrong. Record with less light or a shorter "
       "exposure."},
      {pixel_size_unchecked, "pixel-size-unchecked", "any stage", note, "1 if no image states its pixel size", 0,
       "all lengths are proportional to it, and all forces to its square; a caution if cell, adhesions and fibres "
       "together are two standard deviations larger or smaller than those of other cells",
       "Compare it with the microscope's own record, and with the binning of the camera: 10 % of it are 20 % of every "
       "force. Keep the TIFF files that the microscope writes: most state it."},
      {scan_phase, "scan-phase", "any stage", note, "shift of every second row against the others (pixels)", 0.1,
       "the error of a force grows with its square: 6 % at 1 pixel, less than 0.1 % at 0.1",
       "Nothing: it was taken off. Correct the phase of the scanner before the next recording, or scan in one "
       "direction only."},
      {adhesions_left_out, "adhesions-left-out", "segment", note,
       "adhesions and small bright things that were found outside of the cell", 0,
       "only what lies in the outline can hold the network",
       "Check the outline in 1_segment/overlay.png: grey dashes show what was left out."},
      {adhesions_long, "adhesions-long", "segment", caution, "length over width of the adhesions, mean weighed by area",
       4,
       "adhesion images of five kinds of cell and microscope have 1.7 to 3.1, actin bundles taken for adhesions 6 to 8",
       "Look at the adhesion image: it shows actin where its signal bleeds through or the two channels are exchanged."},
      {bright_actin, "bright-actin", "segment", caution, "length of bright actin that is in no fibre (um)", 0,
       "lines as bright as the cell's middle fibre, 3 um and longer, 3 um and more from the edge: none in six "
       "simulated cells with fibres, in two of three without, and in four of six real ones; 9 to 26 um if one fibre is "
       "taken out",
       "Look at the dots in 1_segment/overlay.png. Draw what is missing by hand (images.fibre_rois; begin with "
       "1_segment/RoiSet.zip)."},
      {bleed_through, "bleed-through", "segment", caution,
       "contrast of the fibres in the adhesion image, over that of the adhesions", 0.1,
       "two simulated cells have 0.00 and a real paxillin image 0.03; a tenth of the actin's light makes it 0.12, with "
       "7 to 12 adhesions of 170 that are none, a fifth 0.25, with 70",
       "Look at the adhesion image: fibres that it shows are taken for adhesions. Record with other filters or one "
       "channel after the other, subtract the actin image's share, or draw the adhesions by hand "
       "(images.adhesion_rois)."},
      {adhesions_off_actin, "adhesions-off-actin", "segment", caution,
       "share of the adhesions of a cell, by area, that lie more than 1 um outside of all cells in the actin image, or "
       "without it in the adhesion image",
       0.03,
       "in 36 simulated cells, 13 real ones with adhesions alone and one with both it is 0 to 0.019; it is 0.05 to "
       "0.36 "
       "if the adhesion image is that of another cell, or upside down, and 0.07 to 0.50 if half of the actin has a "
       "fifth of its light or less",
       "Look at 1_segment/overlay.png: is the outline right, and do both images show the same cell, the same way up? "
       "Draw the outline (images.outline_roi), or the adhesions if some are a neighbour's (images.adhesion_rois)."},
      {outline_doubtful, "outline-doubtful", "segment", caution,
       "distance that the outline reaches beyond the hull of its adhesions (um)", 8,
       "eighteen simulated and fourteen real cells reach 1.8 to 5.1 um; the edge of a disc of light, of uneven light "
       "or of "
       "padding, taken for a cell's, 10 to 50",
       "Look at 1_segment/overlay.png: is it the cell's edge? Else draw it (images.outline_roi), or crop the images to "
       "where the light is even."},
      {outline_off_actin, "outline-off-actin", "segment", caution,
       "share of a given outline's area that lies more than 1 um beyond the cells of the actin image", 0.02,
       "the outlines of five simulated cells and of a real doublet have 0.000; those of another cell 0.005 to 0.16, "
       "nine of eleven above this threshold",
       "Look at 1_segment/overlay.png: is it the outline of this cell, at its place and the same way up? If the cell "
       "is too dim there for the program, the outline may still be right."},
      {cells_touch, "cells-touch", "segment", caution,
       "width of the neck at which the cell was cut off another one that touches it (um)", 0,
       "the outline is cut where it is narrower than segment.outline_neck of the narrower part's width",
       "Look at 1_segment/overlay.png: is the cell cut where it ends? If both parts are one cell, set outline_neck = 0 "
       "in [segment]. If the cut is at a wrong place, draw outline.roi. What cells pull at each other is not in the "
       "forces."},
      {actin_shift, "actin-shift", "segment", note, "1 if the actin image is shifted against the adhesion image", 0,
       "twice the gain in log likelihood is above 16.25 near no shift, which chance makes in one cell of 370, and "
       "above 27 elsewhere",
       "Nothing if the fibres were moved. If it recurs, measure the shift between the filters with beads that shine in "
       "both."},
      {adhesions_assumed, "adhesions-assumed", "segment", caution, "candidates for adhesions, which no image shows", 0,
       "forces act where adhesions are; candidates are where they may be",
       "Give an adhesion image (images.adhesion; paxillin.tif if nothing is said), a mask of the adhesions "
       "(images.adhesion_mask) or draw them by hand (images.adhesion_rois). On an adhesive pattern set "
       "segment.adhesions = pattern, with the pattern as images.adhesion_mask. Read sums of forces over neighbours, "
       "not single ones."},
      {pattern_too_fine, "pattern-too-fine", "segment", caution,
       "area of a candidate for an adhesion over that of the pattern's parts beneath the cell (median)", 1,
       "a candidate then reaches beyond the part that holds it, and the force that is found for it is wrong",
       "Leave segment.adhesions out: each part of the mask is then an adhesion. Or lower "
       "segment.candidate_spacing_um."},
      {pattern_as_cell, "pattern-as-cell", "segment", caution, "share of the cell's area that lies on the pattern", 0.9,
       "such a pattern says no more of the adhesions than the outline does; in simulated cells total forces are then "
       "off by four of their standard errors",
       "If the mask shows the cell, it is no pattern: take it as images.outline_mask, and give an adhesion image. If "
       "the pattern is as large as the cell, read sums of forces over neighbours, not single ones."},
      {fibre_ends_anchored, "fibre-ends-anchored", "segment", note,
       "ends of fibres that reach no adhesion and are held by an anchor", 0,
       "ventral and edge fibres are held at both ends, dorsal ones at one; fibres that span the cell are usually "
       "ventral",
       "Check these ends in 1_segment/overlay.png (dashed circles). An adhesion that was missed: lower "
       "segment.adhesion_seed_noise, or draw it. A fibre that is not held there: draw it and name it dorsal or arc."},
      {input_not_used, "input-not-used", "segment", note, "inputs that were not used because another one counts more",
       0, "a selection drawn by hand counts more than a mask, and a choice in [segment] counts more than both",
       "Remove the input that you do not want."},
      {vectors_masked, "vectors-masked", "track", note, "share of the vectors of a table that their program masked", 0,
       "no measurement repeats both components to the last digit in many places",
       "None, where that program masked them. They are flagged in displacement.csv and not used."},
      {nothing_moves, "nothing-moves", "track", caution, "share of the beads that do not move by six standard errors",
       0.999,
       "of simulated pairs at rest at most 6 beads in 10 000 move by that much; of cells whose noise is 7 % of the "
       "largest displacement 16 and more",
       "Check that the two bead images belong to this cell, and that the cell was removed between them."},
      {moves_outward, "moves-outward", "track", caution,
       "mean cosine between a bead's displacement and the direction away from the centre", 0.3,
       "a contracting cell has -0.7 or so, a layer of cells about 0",
       "Check whether the stressed and the relaxed image are exchanged."},
      {tracked_by_correlation, "tracked-by-correlation", "track", note,
       "1 if windows of the images were followed in place of single beads", 0,
       "a window shows what its beads do on average: what is narrower than the window is flattened",
       "Nothing, if the window is smaller than what you look for. Brighter, sharper or fewer beads give a finer "
       "field."},
      {defocused, "defocused", "track", caution, "size of the beads in the blurrier image over that in the sharper one",
       1.5,
       "of simulated pairs the errors are 1.0 to 1.1 times sigma up to a ratio of 1.47, and 1.2 to 1.7 times at 1.6",
       "Focus both images on the same plane of beads. Of a stack, choose the plane with relaxed_z or stressed_z."},
      {beads_wide, "beads-wide", "track", note,
       "diameter of beads that look as wide as these if they are in focus (um)", 0.7,
       "beads for this purpose have 0.04 to 0.5 um; a spot of the lens is taken for 0.15 um wide (aperture 0.75), or "
       "1.2 pixels; a blur of 2 pixels in both images costs 2 to 4 % of the force",
       "Compare it with the diameter of your beads. If they are smaller, focus both images on the plane of the beads."},
      {beads_not_round, "beads-not-round", "track", note, "length over width of the beads' images", 1.08,
       "beads of simulated images have 1.00 to 1.01, of images that are 10 % too low 1.14; of five real pairs 1.06 to "
       "1.26, as no lens is perfect. It is a caution if both images have the same, along rows or columns: none of "
       "these five",
       "Compare the images' width and height with the camera's: pixels that are not square, as of an image that was "
       "resized by different factors, make tensions wrong. If it is the lens (astigmatism, coma), displacements stay "
       "right."},
      {pattern_repeats, "pattern-repeats", "track", caution,
       "largest motion, of the stage or of the gel, over the distance after which the beads repeat themselves", 0.33,
       "from half of it on the next dot is nearer than a dot's own place; for less, all dots found their partners",
       "Keep the stage still between the pictures, or use beads at random, or dots further apart."},
      {beads_lost, "beads-lost", "track", caution, "share of the beads in space that were not followed", 0.2,
       "of simulated stacks of 5 000 and 20 000 beads 2 of a hundred and fewer are lost; if many are, those of the "
       "strained parts are lost first",
       "Look at the flags in displacement_3d.csv. `no partner`: a larger track.largest_displacement_um, a lower "
       "track.detection_snr, or stacks that show the same depth. `ambiguous`: fewer beads."},
      {little_at_rest, "little-at-rest", "track", caution, "share of the beads that do not move with the others", 0.6,
       "the common motion is found from the beads at rest; beyond two thirds that move they cannot be found any more",
       "Record a wider field or a deeper stack, so that part of the gel is at rest."},
      {slices_moved, "slices-moved", "track", note,
       "how surely the slices of one stack moved against the other's: square root of twice the logarithm of the odds",
       3,
       "chance alone makes it 1; a mean motion that changes slowly with depth and is no larger than the field's own "
       "scatter there counts as the gel's",
       "Nothing if it was taken off (track.slice_drift); slices.csv has it. If it recurs, let the stage settle."},
      {beads_scatter, "beads-scatter", "track", note,
       "how far beads in space that lie together differ, over their standard errors", 1.5,
       "the standard errors of simulated pictures hold to a seventh; what is beyond comes from pictures that are not "
       "those of beads, or from strains that change from bead to bead",
       "Nothing: the standard errors hold it. Look for clumps of beads and for motion while a stack was recorded."},
      {light_lost, "light-lost", "track", caution, "share of the light that is missing in the dimmer stack", 0.5,
       "beads are distinguished by their light, too; with half of it the dim ones are lost in the noise",
       "Record with less light, so that beads bleach less between the stacks."},
      {common_motion, "common-motion", "fit", note,
       "largest of growth, shears and turn of the whole field, over its standard error", 3,
       "chance alone takes one of the four beyond 3 standard errors in one cell of a hundred",
       "Nothing for this cell: the motion was taken off, and the error bars hold its error. If it recurs, look for a "
       "change of focus or of temperature between the bead images."},
      {curved_motion, "curved-motion", "fit", caution,
       "chi squared of displacements of second and third degree in x and y, 14 degrees of freedom", 36.1,
       "noise and the error of the model exceed it in one cell of a thousand",
       "Follow the other findings first: a missing adhesion or another cell bends the field, too. Otherwise look for "
       "stitched tiles, a drift during the scan, another lens or an uneven gel. Record the bead images in one piece, "
       "or leave far beads out with fit.region_um."},
      {channel_shift, "channel-shift", "fit", note,
       "largest of shift and turn of the cell against the beads, over its standard error", 4,
       "chance alone takes one of three beyond 4 standard errors in one cell of five thousand",
       "Nothing for this cell: the shift was taken into account, and the error bars hold its error. If it recurs, "
       "measure the shift between the filters with beads that shine in both."},
      {explains_little, "explains-little", "fit", bad,
       "share of what the beads do beyond their noise that the model does not explain, less three standard errors", 0.4,
       "another cell's beads, mirrored or transposed ones leave 0.5 and more, other networks than the model's 0.2",
       "Check that all images show the same cell the same way round: no pair of another cell, none mirrored, rows and "
       "columns as they are, no channels exchanged. Disregard the results."},
      {read_otherwise, "read-otherwise", "fit", bad,
       "what the model leaves of the displacement as it is, over what it leaves if the displacement is read in another "
       "way",
       1.5,
       "it is 1.9 to 13 in simulated cells with images mirrored or transposed, components exchanged or places in "
       "pixels; 1.0 if there is another reason, as adhesions of another cell",
       "Correct the images or the table in the way that is named, and run again. Disregard these results."},
      {field_smoothed, "field-smoothed", "fit", caution,
       "what the model leaves of the displacement, over what it leaves if it is smoothed like the displacement", 2,
       "it is some hundred for fields smoothed over 4 um, and 1.0 to 1.6 for all that were not",
       "Take a displacement field that was not smoothed: smaller windows, no filter. Or give the two bead images, "
       "which this program tracks itself. Tensions of a smoothed field are wrong by more than their error bars."},
      {unexplained_displacement, "unexplained-displacement", "fit", caution,
       "squares of the displacement that no forces at the adhesions explain, over those of the beads' noise", 1.25,
       "more than an eighth beyond the noise is no chance, and the forces at the adhesions are free to follow the "
       "beads",
       "Look at the map of what is left: arrows at one place want an adhesion, arrows everywhere another gel or a "
       "common motion of the beads."},
      {strain_beyond_linear, "strain-beyond-linear", "fit", caution,
       "predicted part of the displacement that small-strain elasticity leaves out", 0.05,
       "forces are then off by about as much, which is more than the error of a good fit",
       "If the gel is rubber-like (polyacrylamide, silicone), set substrate.material = \"neo-hooke\" in cell.toml. "
       "Check the pixel size, and that no adhesion is drawn too small: the strain does not depend on the modulus."},
      {noise_unknown, "noise-unknown", "fit", caution, "beads whose noise is not known", 0,
       "without the noise one cannot tell whether the model fits",
       "Give sigma_um in displacement.csv, or beads that lie fit.far_distance_um and more beside the cell."},
      {noise_disagrees, "noise-disagrees", "fit", caution,
       "scatter of the beads far from the cell about the model, over their stated standard error", 1.3,
       "the error bars take the larger of both: a third more than stated is more than chance and model explain",
       "Look for beads that are out of focus or overlap. Of a displacement field of another program, check sigma_um."},
      {beads_disagree_by_region, "beads-disagree", "fit", caution,
       "largest chi squared per degree of freedom in a region of the image", 3,
       "noise alone does not reach 2 over the 30 beads that a region has at least",
       "Look at the region in the map of what is left: a bead picture out of focus, another cell, or a fibre or an "
       "adhesion that was not segmented."},
      {telling_beads_scatter, "telling-beads-scatter", "fit", note,
       "squares that the forces leave of the beads on which the tensions rest, over those of noise, less three "
       "standard errors",
       1.2, "nine sound cells have 0.8 to 1.1; the intervals follow the number whatever it is",
       "Look at the beads beside adhesions in the map of what is left. If their arrows point in all directions, beads "
       "were matched wrongly: smaller pixels or fewer beads help. If they point the same way, the adhesion there is "
       "not where the force is, or has another shape."},
      {adhesions_without_beads, "adhesions-without-beads", "fit", caution,
       "adhesions whose nearest bead is three distances between beads away, or further", 0,
       "of beads scattered at random, one such gap in 10^12 adhesions is chance: the beads do not show this part of "
       "the cell",
       "Check that the bead images (or the displacement) show the whole cell at the same place and with the same pixel "
       "size as its other images: neither cropped nor binned by themselves. Disregard the forces of these adhesions."},
      {cell_cut, "cell-cut", "fit", note, "1 if the image's border cuts the cell", 0,
       "the total force is that of the adhesions in view, and what passes through the cut balances it",
       "Record the whole cell if you can. A note if forces beyond the cut are allowed for; a caution if "
       "effects.beyond_cut = off: distrust then the fibres and adhesions near the cut, and the force through it."},
      {neighbour_pulls, "neighbour-pulls", "fit", note,
       "other cells in the image, and sides of its border beyond which forces act", 0,
       "a cell at twice its own distance moves beads by a tenth of what it moves beneath itself; a side is named if "
       "chance would name one in 10 000 cells",
       "Nothing if their forces were allowed for; beads beside them are left out. If effects.beyond_cut = off, forces "
       "of this cell are wrong: they take over what the other pulls. Choose cells that are alone if you can."},
      {missing_fibre, "missing-fibre", "fit", caution, "fibres between adhesions that the beads call for (24 at most)",
       0, "a pair of adhesions is named if chance would name one in one cell of a hundred, all pairs tried",
       "Look for the fibre in the actin image between these adhesions (dashed in the map). If it is there, add it: "
       "mbtfm-add-fibres --rois 1_segment/RoiSet.zip --missing 4_fit/missing_fibres.csv --out fibres.zip in the cell's "
       "folder, then mbtfm run."},
      {missing_adhesion, "missing-adhesion", "fit", caution, "forces that the beads call for away from all adhesions",
       0, "a place is named if chance would name one in one cell of a hundred, all places tried",
       "Look at these places in the adhesion image (4_fit/missing_adhesions.csv; dashed circles in the map). If an "
       "adhesion is there, lower segment.adhesion_seed_noise or segment.adhesion_smallest_um2, or draw it by hand."},
      {fibre_without_tension, "fibre-without-tension", "fit", caution, "segmented fibres that are not in the network",
       0, "each of them may carry force", "Run the network stage again: network.vtu is of another segmentation."},
      {not_identifiable, "not-identifiable", "fit", bad, "fibre tensions that these beads do not determine", 0,
       "such a tension can take any value without the beads noticing",
       "Disregard these tensions (hollow marks; identifiable = FALSE). More beads near these fibres would help."},
      {network_not_identifiable, "network-not-identifiable", "fit", bad,
       "1 if the tension of the actin network is not determined", 0,
       "then the network's share of the force and its surface tension are not known either",
       "Disregard the tension and the force of the network."},
      {wide_interval, "wide-interval", "fit", note,
       "tensions whose 95 % interval is wider than twice the tension itself", 0,
       "of such a tension little more is known than that it is small", "Read the interval, not the value."},
      {tension_at_zero, "tension-at-zero", "fit", note, "tensions that are zero, the least allowed", 0,
       "fibres do not push: zero is where a fit of a weak fibre ends",
       "Read the upper end of the interval as a limit."},
      {single_mesh, "single-mesh", "fit", caution, "1 if one mesh was fitted", 0,
       "the choice of the mesh is usually a larger error than the noise of the beads, and one mesh cannot show it",
       "Use fit.n_meshes = 2 or more."},
      {forces_out_of_balance, "forces-out-of-balance", "fit", bad,
       "length of the sum of the adhesion forces and of the force through a cut, over the sum of the lengths of the "
       "adhesion forces",
       1e-6, "equilibria are solved to 1e-9 of the largest tension at some thousand vertices",
       "This is a fault of the program: please report it with the cell."},
      {torques_out_of_balance, "torques-out-of-balance", "fit", bad,
       "sum of the torques about the centre, over the sum of their magnitudes", 1e-6,
       "equilibria are solved to 1e-9 of the largest tension at some thousand vertices",
       "This is a fault of the program: please report it with the cell."},
      {off_the_surface, "off-the-surface", "surface", caution,
       "share of the beads that lie above the gel's surface, or of the points that lie off it", 0.01,
       "a few beads lie on every gel and in the cell; more of them are another surface, or an error of z larger than "
       "stated",
       "Look at the crosses in the picture beside surface.vtp. Take out beads that are not in the gel, or state a "
       "larger error of z."},
      {surface_repaired, "surface-repaired", "surface", note,
       "share of the vertices in holes that were filled, and of triangles that were turned over", 0,
       "holes up to surface.largest_hole_um are filled by the plate that bends least",
       "Nothing if the holes are small beside the cell's adhesions. Else measure the surface again."},
      {surface_level, "surface-level", "surface", caution,
       "distance of the beads, n^(-1/3), over the difference between the surface's highest and lowest z", 4,
       "below a quarter of the beads' distance, a flat gel and the end of the imaged volume look alike",
       "Check that the stack begins above the gel, where there are no beads, and that z_points is right. A gel that is "
       "flat needs no surface.vtp."},
      {surface_off_zero, "surface-off-zero", "substrate", caution,
       "distance from z = 0 to the nearest height of the surface, over the gel's thickness", 0.01,
       "the thickness counts from z = 0, which should be a level of the surface: else the gel is thicker or thinner by "
       "as much",
       "Make surface.vtp with surface.zero_at = mean, or let gel.thickness_um be the z of the base in surface.vtp."},
      {beads_off_the_gel, "beads-off-the-gel", "traction", caution,
       "share of the beads above the gel's surface or below its base, which are left out", 0.01,
       "a few beads lie on every gel and in the cell; more of them are another surface, or heights that do not start "
       "where its z = 0 is",
       "Check that beads and surface.vtp have one origin and z into the gel, and gel.thickness_um."},
      {beads_far, "beads-far", "traction", caution,
       "distance from the surface to the nearest bead, median, over the distance between the beads", 2,
       "forces closer together than the beads are deep look like one: no lattice and no lambda brings them back",
       "Image beads nearer to the surface, and do not trust detail finer than resolution_um."},
      {beads_tell_little, "beads-tell-little", "traction", caution,
       "24 over the effective number of unknowns that the beads determine", 1,
       "the force and its couple on four adhesions are 24 numbers: with fewer, a map of tractions is mostly smoothing",
       "Use more beads, or beads with less noise. The finding itself says how many beads would do."},
      {misfit_in_space, "misfit-in-space", "traction", caution,
       "misfit of the beads over what their stated errors leave, per datum", 1.5,
       "with the errors right it is 1 to a few per cent; the error bars are widened by its root",
       "Check sigma_um and sigma_z_um, the surface and the region in which tractions are looked for."},
      {patches_do_not_fit, "patches-do-not-fit", "traction", caution,
       "how far what forces on the patches alone leave looks like tractions beside them, in standard deviations of "
       "chance",
       4,
       "if patches are all there is, chance makes more in one cell of 30 000; what lies beside the patches then pulls "
       "at their forces, and the standard errors without a background do not contain it",
       "Use the forces with the background (traction.background above 0), and look for adhesions that are missing in "
       "adhesions.csv."},
      {tractions_out_of_balance, "tractions-out-of-balance", "traction", caution,
       "squared net force and net moment over their joint covariance (chi-squared of six numbers)", 22.5,
       "a cell at rest pulls as much one way as the other; chance exceeds this once in a thousand cells. The standard "
       "errors contain the error of the gel's model",
       "Check that the whole cell lies above the beads: forces beyond them are missing in the sum. Look for a cell "
       "beside it, or for a support that holds the cell."},
      {z_reversed, "z-reversed", "traction", caution,
       "by how much chi-squared of the fit falls if all displacements along z have the opposite sign", 10,
       "ten are odds of 150 to one; with the right sign it rises by some hundreds",
       "Check z_points in cell.toml, and the sign of uz_um in displacement_3d.csv: it is positive out of the gel."},
      {beads_stray, "beads-stray", "traction", caution,
       "share of the beads that are further off than noise has them, if the loss is l2", 0.005,
       "of Gaussian noise five standard errors of three components are one in a hundred thousand",
       "Set traction.loss = mixture, and compare with biweight."},
      {loss_decides, "loss-decides", "traction", caution,
       "difference of the total forces by this loss and by l2, over their joint standard error", 1,
       "both are of the same beads, so that chance alone makes 0.2 of it (biweight, huber) to 0.4 (l1); beyond 1 the "
       "loss moves the answer by more than the errors say",
       "Beads near strong forces may look astray, and beads that are astray make forces that are not there. If a run "
       "with l2 has no finding beads-stray, take l2. If it has, look at the beads that differ from their neighbours. "
       "More beads near the surface decide it."},
      {lambda_runs_away, "lambda-runs-away", "traction", caution, "lambda by evidence over lambda by risk", 2,
       "in sound simulated scenes it is 0.1 to 1.4; of 60 to 100 beads of which some are astray, or of stacks of which "
       "one grew, it is tens to thousands: then the tractions follow errors of the beads, not forces",
       "Use more beads: with 500 it never happened. Set traction.loss = mixture if beads may be astray. Check surface, "
       "gel and sigma_um, and whether one stack grew against the other (another focus or temperature): the misfit is "
       "not the beads' noise. The tractions are those with lambda by evidence, and may be smoothed too much. To choose "
       "yourself, set traction.lambda_by or traction.lambda_um_per_kPa."},
      {modulus_error_unknown, "modulus-error-unknown", "fit", note, "1 if gel.youngs_modulus_sigma_kPa is not given", 0,
       "all forces are proportional to the modulus: 10 % of it are 10 % of every force",
       "Give gel.youngs_modulus_sigma_kPa; the error budget then has a line for it."},
      {contraction_beyond_linear, "contraction-beyond-linear", "indent", caution,
       "contraction of the cell if nothing held it, (1 - 2 nu) stress / Young's modulus", 0.05,
       "beyond it large strains change the depth by more than the best stated errors",
       "Compare with indent.strain = large."},
      {cases_not_solved, "cases-not-solved", "indent", caution, "cases of the sweep without an equilibrium", 0,
       "the map has a hole there, and no best height is given beside it",
       "Read the reasons in indent.csv. Lower cell.contraction_kPa: beyond some contraction the body buckles or an "
       "element is turned inside out. Or leave these heights and ratios out of indent.sweep."},
      {registration_ambiguous, "registration-ambiguous", "mean", caution,
       "cells that lie on the reference in more than one way", 0,
       "the second-best way fits within the error of the best: which side of such a cell is which was decided by "
       "chance",
       "If the shape is symmetric, set mean.symmetry to its group: the mean is then the same for all ways. If it is "
       "not, give outlines with more detail, or register by images (mean.register_by = images)."},
      {cells_left_out, "cells-left-out", "mean", caution, "cells that are not in the mean", 0,
       "a mean over those that fit is a mean over a selection", "registration.csv has the reason for each."},
      {few_cells, "few-cells", "mean", caution, "five over the number of cells", 1,
       "the standard error of four and fewer cells is itself off by 40 % and more", "Take more cells."},
      {sheet_thick, "sheet-thick", "sheet", caution, "thickness of the sheet over its half width", 0.02,
       "a solid disc bonded to a gel moves 2 to 4 % more than the sheet at 0.02, 5.5 to 8 % at 0.04",
       "Take a sheet for colonies and spread cells only; for a round cell use mbtfm-indent."},
      {sheet_strain, "sheet-strain", "sheet", caution,
       "contraction of the sheet if nothing held it, s (1 - nu) / (E h), if small strains are computed", 0.05,
       "on springs large strains change the displacement by 0.8 % at 0.05 and by 5 % at 0.15",
       "Set sheet.strain = large, without a line tension. In a fit, run mbtfm-sheet with what was found and strain = "
       "large: the fit's contraction is off by about as much as the displacement changes."},
      {sheet_coarse, "sheet-coarse", "sheet", caution, "estimated relative error of the tensions, by the mesh", 0.05,
       "the estimate is the difference between the triangles' own tensions and smooth ones; those written are better",
       "Set a smaller sheet.mesh_um."},
      {sheet_not_identifiable, "sheet-not-identifiable", "sheet", caution,
       "1 if the beads set no limit to a side of the sheet's stiffness, or a contraction that varies by 20 % moves it "
       "by a factor of e",
       0,
       "a sheet much stiffer than its gel moves it by contraction over stiffness alone, a soft one by its contraction; "
       "an edge that pulls more than the middle looks like a softer sheet",
       "Read what is limited: contraction_over_stiffness of a stiff sheet, contraction_nN_per_um of a soft one. If the "
       "stiffness is known, give sheet.youngs_modulus_kPa. With fit_parts = field the beads limit the variation, too."},
      {sheet_unexplained, "sheet-unexplained", "sheet", caution,
       "standard deviations by which the residuals exceed noise and stated errors: in size (chi² per degree of "
       "freedom, 0.2 aside), or in the correlation between near beads (0.05 aside), whichever is more",
       3,
       "chance exceeds 3 in one of 740 fits for each of the two; what a sheet leaves out is smooth, and shows in the "
       "correlation long before it shows in the size",
       "Compare the models in sheet_models.csv. If stress fibres pull, give them (run.bundles, or mbtfm-sheet "
       "--bundles). If the edge pulls more than the rest, set fit_line_tension or fit_parts. If the sheet adheres in "
       "places only, give these (images.adhesion_mask, or mbtfm-sheet --adhesive). Check the gel and the outline."},
      {sheet_expands, "sheet-expands", "sheet", caution,
       "share of the sheet's parts whose best contraction is below zero, or whose 95 % interval holds no contraction; "
       "1 if given tractions have a negative mean tension",
       0,
       "cells pull their ground inward; one that pushes it outward is exchanged images, another cell or a wrong "
       "outline",
       "Check which image is stressed and which relaxed, the sign of given tractions (they are those on the gel), the "
       "outline, and what pulls beside it. If the interval holds zero, the beads tell no contraction: use its upper "
       "end."},
      {sheet_at_bound, "sheet-at-bound", "sheet", caution,
       "1 if the best stiffness is the softest or the stiffest that is looked at", 0,
       "the misfit falls up to the end of the range: the value is the range's end, not what the beads tell",
       "Read sheet_fit.csv for what is limited. If the stiffness is known, give sheet.youngs_modulus_kPa."},
      {sheet_cut, "sheet-cut", "sheet", caution,
       "relative difference of the mean tension between a sheet clamped where the image cuts it and one held across "
       "the cut only",
       0, "nothing is known of the sheet beyond the image's border, and each assumption has other tensions near it",
       "Take the tensions far from the cut (cut_reach_um in sheet.json), or images that show the whole colony."},
      {tractions_off_balance, "tractions-off-balance", "sheet", caution,
       "net force over the sum of forces, or net torque over its largest possible, whichever is more", 0.05,
       "a colony that nothing else touches pulls with no net force; what is there is noise, or a neighbour's pull",
       "It was taken off evenly over the area. Check that the area holds the whole colony and no part of another."},
      {tractions_outside, "tractions-outside", "sheet", note,
       "share of the sum of forces that acts outside of the area", 0,
       "a sheet with a free edge cannot carry what acts beyond it",
       "Give a larger area (--area): smoothed tractions spill over the edge."},
  };
  return kinds;
}

const KindOfFinding& properties_of(FindingKind kind) {
  const auto& kinds = kinds_of_findings();
  const auto found = std::ranges::find(kinds, kind, &KindOfFinding::kind);
  MBTFM_ASSERT(found != kinds.end());
  return *found;
}

bool is_open(const Finding& finding) { return finding.severity != Severity::note; }

bool spoils_cell(const Finding& finding) {
  constexpr std::array kMarked = {FindingKind::not_identifiable, FindingKind::network_not_identifiable};
  return finding.severity == Severity::bad &&
         std::ranges::none_of(kMarked, [&](FindingKind kind) { return finding.id == properties_of(kind).id; });
}

const Finding* worst_of(const std::vector<Finding>& findings) {
  const auto at = std::ranges::find_if(findings, spoils_cell), open = std::ranges::find_if(findings, is_open);
  return at != findings.end() ? &*at : open != findings.end() ? &*open : nullptr;
}

bool has_open(const std::vector<Finding>& findings) { return std::ranges::any_of(findings, is_open); }

std::optional<Finding> noticed(FindingKind kind, double number, const std::string& text, Severity severity) {
  const KindOfFinding& k = properties_of(kind);
  if (number <= k.threshold) return std::nullopt;
  return Finding{.id = k.id,
                 .severity = severity,
                 .text = text,
                 .number = std::isfinite(number) ? std::optional(number) : std::nullopt,
                 .threshold = k.threshold,
                 .number_is = k.number,
                 .reason = k.reason,
                 .remedy = k.remedy};
}

std::optional<Finding> noticed(FindingKind kind, double number, const std::string& text) {
  return noticed(kind, number, text, properties_of(kind).severity);
}

std::string line_of(const Finding& finding) {
  return std::string(name_of(finding.severity)) + " (" + finding.id + "): " + finding.text +
         (is_open(finding) ? " " + finding.remedy : "");
}

std::string open_ids(const std::vector<Finding>& findings) {
  std::set<std::string> seen;
  std::string ids;
  for (const Finding& finding : findings)
    if (is_open(finding) && seen.insert(finding.id).second) ids += (ids.empty() ? "" : "; ") + finding.id;
  return ids;
}

namespace {

/// How many of 400 sound simulated cells had it open: tests/alarm_rates.py FOLDER 1001 1400. Segmentation and
/// displacement were given, so that only the fit was asked.
std::string on_sound_cells(const KindOfFinding& k) {
  if (k.stage != std::string_view("fit") || k.severity == Severity::note) return "";
  switch (k.kind) {
    case FindingKind::strain_beyond_linear:
      return "- On 400 sound cells: 84, of which 79 are crowded (`dense`): adhesions there pull with 3 to 8 times the "
             "shear modulus.\n";
    case FindingKind::missing_fibre:
      return "- On 400 sound cells: 11.\n";
    case FindingKind::not_identifiable:
    case FindingKind::network_not_identifiable:
      return "- On 400 sound cells: 2.\n";
    default:
      return "- On 400 sound cells: 0.\n";
  }
}

}  // namespace

std::string findings_page() {
  std::string page =
      "# Findings\n\nThe program reports what it notices about the images, the beads and its own answer. Each finding "
      "has an identity, a\nnumber, a threshold and a remedy. A finding appears on the terminal, in the report, in "
      "`run.json`, in `run.log`, in\nthe column `findings` of `batch_all.csv` and in `statistics/findings.csv`.\n\n- "
      "**note**: worth knowing; the results hold.\n- **caution**: the results may be off by more than their error bars "
      "say.\n- **bad**: do not use what the finding names.\n\nA caution or a bad finding is *open*. The report shows a "
      "green tick only if no finding is open. *On 400 sound cells*: so many simulated cells with a right segmentation "
      "had it open.\n";
  for (const char* stage : {"any stage", "segment", "track", "network", "fit", "surface", "substrate", "traction",
                            "sheet", "indent", "mean"}) {
    bool has_title = false;
    for (const KindOfFinding& k : kinds_of_findings()) {
      if (std::string(stage) != k.stage) continue;
      if (!has_title) page += "\n## " + std::string(stage) + "\n";
      has_title = true;
      page += "\n### `" + std::string(k.id) + "` (" + name_of(k.severity) + ")\n\n- Number: " + k.number +
              "; threshold " + brief(k.threshold) + ".\n- Why this threshold: " + k.reason + ".\n" + on_sound_cells(k) +
              "- What to do: " + k.remedy + "\n";
    }
  }
  return page;
}

}  // namespace mbtfm
