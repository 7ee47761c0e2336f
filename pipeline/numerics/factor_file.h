/// Factors kept on disk: one file each, called by the hash of its matrix.
#pragma once

#include <filesystem>
#include <string>

#include "pipeline/numerics/block_cholesky.h"

namespace mbtfm::numerics {

/// The file of one matrix' factor. Written under a name of its own and renamed, so that many may write at a time and
/// no one reads half a file; checked by a hash of its content when read.
class FactorFile {
 public:
  FactorFile(const std::filesystem::path& folder, const BlockMatrix<3>& matrix, const Elimination& elimination);
  /// The factor, empty where there is none. @return a note for the record: used, absent or damaged
  std::string read(Eigen::VectorXd& factor) const;
  /// @return a note: written, or why not; a factor that cannot be kept is no error
  std::string write(const Eigen::VectorXd& factor) const;

 private:
  std::filesystem::path file_;
  std::size_t n_bytes_;
};

}  // namespace mbtfm::numerics
