/// Numbers that a cell, its gel and its images can have: one table with sources (plausible.toml), asked of the inputs
/// before a stage runs and of its results. docs/plausible.md is written from the table.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/range.h"
#include "pipeline/contract/results.h"
#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::stage {

/// What is known of one quantity. Beyond `usual` a value is doubted, beyond `possible` it is refused.
struct PlausibleQuantity {
  const char* id;        ///< the parameter or figure, with its unit
  const char* quantity;  ///< in words
  Range usual, possible;
  const char* source;  ///< of both ranges
  const char* remedy;
};
const std::vector<PlausibleQuantity>& plausible_quantities();

enum class DoubtLevel {
  caution,  ///< unusual
  refused   ///< cannot be
};

struct Doubt {
  std::string id, quantity;
  double value = 0;
  double limit = 0;  ///< that it is beyond
  std::string source, remedy;
  DoubtLevel level = DoubtLevel::caution;
};

/// None where the value is usual. @param id  of the table
std::optional<Doubt> doubt_about(std::string_view id, double value);
/// "the Young's modulus of the gel is 300 kPa, above 100: unusual"
std::string sentence_of(const Doubt& doubt);
/// @param where  the file or parameter, for the message. @throws InputError where it is refused and not in `allowed`
void require_possible(const Doubt& doubt, const std::vector<std::string>& allowed, const std::string& where);

/// The table [checks] of cell.toml.
struct CheckParameters {
  std::string allow;  ///< nothing: what cannot be is a slip
};
void declare(ParameterList& list, CheckParameters& parameters);
/// Its names. @throws UsageError where one is none of the table's
std::vector<std::string> allowed_quantities(const CheckParameters& parameters);

/// Doubts about the list's numbers. @throws InputError as require_possible()
std::vector<Doubt> doubts_about(const ParameterList& list, const std::vector<std::string>& allowed);
/// Whether the list has a number of the table.
bool has_plausible_quantity(const ParameterList& list);

/// The pixel size that is used and an image's own calibration, both of unbinned pixels or both of binned ones: a doubt
/// from 1 % on, refused from 20 % on.
std::optional<Doubt> doubt_about_pixel_size(double used_um, double of_file_um);

// What errors leave sure of forces: a small adhesion's may be noise.

/// Adhesions of this traction (kPa) or more carry half of the force that is there at least: forces less two standard
/// errors, over areas. A single adhesion drawn too small does not change it. @param forces  by adhesion
double traction_of_half_the_force_kPa(const std::vector<AdhesionForce>& forces, const std::vector<Adhesion>& adhesions);
struct Load {
  double traction_kPa = 0, force_nN = 0;  ///< magnitudes
};
/// The same of any pieces of the ground; 0 of none.
double traction_of_half_the_force_kPa(std::vector<Load> loads);
/// The largest of the lower limits (nN) of the fibres' tensions; of a tension without one, itself.
double surest_fibre_tension_nN(const std::vector<Tension>& tensions);

/// A physical input that nobody gave, and what was taken instead.
struct AssumedInput {
  std::string id, quantity;
  std::string value;   ///< taken, with its unit
  std::string effect;  ///< of an error in it, in a sentence
};
/// Of the list's parameters.
std::vector<AssumedInput> assumed_inputs(const ParameterList& list);
/// The beads' noise where their file has none.
AssumedInput assumed_noise(double sigma_um);
/// "thickness_um: 60 um (assumed: thickness of the gel was not given)"
std::string sentence_of(const AssumedInput& input);

/// docs/plausible.md
std::string plausible_page();

}  // namespace mbtfm::stage
