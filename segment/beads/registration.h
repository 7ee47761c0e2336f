/// Inside of the bead tracker: registration of the surroundings of a bead between two images.
#pragma once

#include "segment/beads/plane.h"

namespace mbtfm::beads {

/// A displacement and its gradient at a place: u(x) = u + G (x − place).
struct Motion {
  Vec2 u;
  double ux_x = 0, ux_y = 0, uy_x = 0, uy_y = 0;
  Vec2 at(Vec2 offset) const {
    return {u.x + ux_x * offset.x + ux_y * offset.y, u.y + uy_x * offset.x + uy_y * offset.y};
  }
};

/// Beyond the border the last pixel goes on.
float value_at(const Spline& spline, Vec2 place);

struct Window {
  double sigma = 4;          ///< px, of its Gaussian weight
  double gradient_sd = 0.2;  ///< how far the gradient may be from the expected one (prior standard deviation)
  double noise = 1;          ///< standard deviation of the difference of two pixels, to weigh the prior with
  int max_steps = 15;
  bool is_thinned = false;   ///< every other pixel, as on a chessboard: enough to find what is measured later
  double settled_px = 2e-3;  ///< the last step: a tenth of the best standard errors
  bool states_error = true;  ///< sigma_px is found
  int alike_px = 1;          ///< the residual is alike over so many px: what is there of it counts as one
};

/// Pictures of other beads that a registration takes away from both images: Gaussians of one width.
struct Others {
  struct Spot {
    Vec2 place;
    double height = 0;
  };
  std::vector<Spot> in_reference, in_target;
  double sigma = 1;  ///< px
};

struct Registered {
  Motion motion;           ///< at the bead
  double sigma_px = 0;     ///< standard error of a component of u
  double similarity = -1;  ///< weighted correlation of the two windows
  double gain = 0;         ///< of the target's light over the reference's
  double variance = 0;     ///< weighted, of the reference's window
  bool is_converged = false;
};

/// Find the motion that carries the surroundings of `place` in the reference to `target`, from a guess whose gradient
/// is also what is expected of the gradient.
///
/// Minimises Σ w (a target(x + u(x)) + b − reference(x))² + (G − G₀)² noise²/gradient_sd² over u, G, a, b by
/// inverse-compositional Gauss–Newton steps: slopes and normal matrix come from the reference and stay. Gain and
/// offset are projected out. The standard error is that of a weighted fit with the window's own residual:
/// H⁻¹ (Σ w² s sᵀ residual²) H⁻¹; where residuals are alike over some pixels, Σ w s residual of each square of that
/// side takes the place of a pixel's (Liang & Zeger, Biometrika 73:13, 1986). What has not converged is no further than
/// 50 px from the guess.
Registered registered(const SmoothImage& reference, const Spline& target, Vec2 place, const Motion& guess,
                      const Window& window, const Others& others = {});

}  // namespace mbtfm::beads
