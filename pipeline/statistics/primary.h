/// The one comparison that a study was made for: each condition against the reference, by one test that was chosen
/// before anybody looked.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/statistics/comparisons.h"

namespace mbtfm::statistics {

/// A condition against the reference.
struct PrimaryDifference {
  std::string condition;
  Contrast difference;   ///< of the means, condition − reference, in the measure's unit
  double p_holm = 1;     ///< corrected for all conditions that are compared with the reference
  int cells = 0;         ///< of the condition
  int cells_before = 0;  ///< of the reference
  int replicates = 0;    ///< that have both; 0: the test goes by cells
};

struct Primary {
  std::string measure;  ///< "tension of ventral fibres", "total force of cells"
  std::string unit;
  std::string cells = "cells";  ///< what they are called: "sheets"
  std::string reference;
  std::string test;  ///< in words, with its source
  std::vector<PrimaryDifference> differences = {};
  /// Mean of the reference: of the model, or of the replicates' means.
  double reference_mean = 0;
  std::string obstacle = {};  ///< why nothing is compared; empty: something is
};

/// "tension of ventral fibres under drug: 1.9 nN less than under control [95 % CI …], …"
std::string sentence_of(const Primary& primary, const PrimaryDifference& difference);

/// Without replicates the test is that of the mixed model (random effects of the cell, known errors). With replicates
/// the cells of one day are no more independent than the fibres of one cell: the means of the replicates are compared,
/// in pairs (Student's t of their differences). Source: Lord, Velle, Mullins, Fritz-Laylin, J. Cell Biol. 219 (2020)
/// e202001064.
/// @param name  of what is compared  @param sample  that has it, with its model and its comparisons
Primary primary_of(const Study& study, const std::string& name, const Sample& sample, int kind,
                   const std::optional<SampleModel>& model, const std::vector<Comparison>& comparisons);

}  // namespace mbtfm::statistics
