/// A study as a table, a picture and a page.
#pragma once

#include <filesystem>
#include <string>

#include "pipeline/cost/study.h"

namespace mbtfm::cost {

/// Indices of the measurements that no other one beats in both processor time and error, the quickest
/// first. Failed ones and ones that were not run are left out.
std::vector<int> front_of(const std::vector<Measurement>& measurements);

/// By how much another measurement beats this one: the largest share s such that one takes no more time and errs by s
/// less, or errs no more and takes s less. 0 on the front.
double distance_to_front(const std::vector<Measurement>& measurements, int index);

/// cost.csv, cost.svg and cost.md in this folder. @throws OutputError
void write_study(const std::filesystem::path& folder, const Study& study, const std::string& cell_name);

/// The part of docs/columns.md.
std::string pages_of_tables();

}  // namespace mbtfm::cost
