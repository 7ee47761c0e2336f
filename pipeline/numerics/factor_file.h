/// Factors kept on disk: one file each, called by the hash of its matrix.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "pipeline/numerics/fronts.h"

namespace mbtfm::numerics {

struct CachedFactor {
  std::optional<Panels<double>> panels;
  std::string note;  ///< for the record: found, absent or damaged
};

/// The file of one matrix' factor. Written under a name of its own and renamed, so that many may write at a time and
/// no one reads half a file; checked by a hash of its content when read.
class FactorFile {
 public:
  FactorFile(const std::filesystem::path& folder, const BlockMatrix& matrix, const Supernodes& supernodes);
  CachedFactor read() const;
  /// @return a note: written, or why not; a factor that cannot be kept is no error
  std::string write(const Panels<double>& panels) const;

 private:
  std::filesystem::path file_;
  const Supernodes& supernodes_;
};

}  // namespace mbtfm::numerics
