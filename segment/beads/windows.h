/// Inside of the bead tracker: windows of the picture's texture in place of single beads.
#pragma once

#include <optional>
#include <vector>

#include "segment/beads/coarse_field.h"
#include "segment/beads/measure.h"
#include "segment/beads/scene.h"

namespace mbtfm::beads {

/// An image whose light counts, whatever it shows.
struct Texture {
  Plane plane;               ///< of the width of its spots alone
  double spot_sigma_px = 0;  ///< from the autocorrelation
};

/// Wider light, as of beads deep in the gel, moves otherwise or not at all; narrower light is noise.
/// @throws NotFollowed for `which` image where it shows nothing but noise
Texture texture_of(const images::Image& image, double spot_sigma_px, const char* which);

/// Gaussian sigmas (px) of windows to try, each larger by the square root of two: from a window of some ten spots to
/// one that leaves a lattice of 6 x 6 in the shorter side. Empty where the picture is smaller than that.
std::vector<double> window_sigmas(const Texture& texture);

/// Correlation of two windows that chance does not reach. For unrelated pictures of spots of sigma p it has the
/// variance (1/4 pi s²) integral rho² = p²/2s², rho = exp(−r²/4p²): a window of sigma s holds so few independent spots.
double least_similarity(const Texture& texture, double window_sigma);

/// Windows on a square lattice in the place of beads.
///
/// The errors of two windows are correlated as their weights overlap, exp(−d²/4s²) for Gaussians of sigma s. At the
/// spacing d = 3 s that is 0.11 for the nearest four and 0.01 for those across. So the fit, which takes displacements
/// for independent, states standard errors of what many windows say together that are a sixth too small at most.
struct Windows {
  GridField lattice;
  Scene scene;
  int stride = 1;    ///< of the lattice, to windows that do not overlap
  double apart = 3;  ///< so far, in window sigmas
};
/// @param spacing_px  of a lattice whose windows may overlap; 0: three window sigmas
Windows windows_on(const Texture& relaxed, const Texture& stressed, double window_sigma, int threads,
                   double spacing_px = 0);

/// Displacement of each good window and its standard error.
///
///   sigma² = c sigma_registration² + b²,   b = s²/2 (u_xx + u_yy)
///
/// b is what a Gaussian window takes off a curved field, from second differences on the lattice. c compares the
/// registrations' variances with what the lattice shows: the mask (1 −2 1)ᵀ(1 −2 1) over 3 x 3 windows is blind to
/// polynomials up to x² and y² (Immerkaer, CVIU 64:300, 1996), so what it leaves is error, in the half of the picture
/// where the field changes least. Nothing where too few windows are good.
std::optional<Pooling> calibrated(const Windows& windows, const std::vector<Track>& tracks);

}  // namespace mbtfm::beads
