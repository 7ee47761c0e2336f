/// What tables say of the cells of a study: review.csv, and which cell a row is of.
#pragma once

#include "pipeline/files/csv.h"
#include "pipeline/statistics/study.h"

namespace mbtfm::statistics {

/// The cell that a row of a table names: by its whole name, or by that of its own folder if no other has the same.
/// @throws InputError
std::size_t index_of_cell(const std::vector<std::string>& names, const files::CsvTable& table, int row);

/// By cell; nothing is said of any if there is no review.csv. @throws InputError if it is malformed or names no cell
std::vector<Review> reviews_of(const Path& study, const std::vector<std::string>& names,
                               const std::vector<Path>& folders);
/// Empty: the cell enters.
std::string reason_to_exclude(const Review& review);
/// The fibres that it leaves out are no fibres: they leave cell, tensions and directions. What the fit says of the
/// whole cell stays.
void take_review(const Review& review, StudyCell& cell, std::vector<std::string>& warnings);

}  // namespace mbtfm::statistics
