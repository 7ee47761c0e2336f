#include "pipeline/numerics/factor_file.h"

#include <unistd.h>

#include <cstring>
#include <fstream>
#include <sstream>

#include "pipeline/files/hash.h"

namespace mbtfm::numerics {
namespace {

constexpr std::size_t kHashLength = 64;  // of SHA-256, in hexadecimal

template <class T>
std::string hash_of(const std::vector<T>& values) {
  return files::sha256({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
}

}  // namespace

FactorFile::FactorFile(const std::filesystem::path& folder, const BlockMatrix<3>& matrix,
                       const Elimination& elimination)
    : n_bytes_(9 * sizeof(double) * elimination.n_blocks()) {
  // the order of elimination, too: another version of METIS has another
  std::vector<int> first;
  for (const EliminationPanel& panel : elimination.panels) first.push_back(panel.first);
  const std::string key =
      hash_of(matrix.start) + hash_of(matrix.row) + hash_of(matrix.value) + hash_of(elimination.place) + hash_of(first);
  file_ = folder / ("factor-" + files::sha256(key) + ".bin");
}

std::string FactorFile::read(Eigen::VectorXd& factor) const {
  std::ifstream stream(file_, std::ios::binary);
  if (!stream) return "absent";
  std::ostringstream text;
  text << stream.rdbuf();
  const std::string bytes = std::move(text).str();
  const bool is_whole =
      bytes.size() == n_bytes_ + kHashLength &&
      std::string_view(bytes).substr(n_bytes_) == files::sha256(std::string_view(bytes).substr(0, n_bytes_));
  if (!is_whole) return "damaged, ignored: " + file_.string();
  factor.resize(static_cast<Eigen::Index>(n_bytes_ / sizeof(double)));
  std::memcpy(factor.data(), bytes.data(), n_bytes_);
  return "used";
}

std::string FactorFile::write(const Eigen::VectorXd& factor) const {
  const std::string_view numbers(reinterpret_cast<const char*>(factor.data()), n_bytes_);
  std::error_code error;
  std::filesystem::create_directories(file_.parent_path(), error);
  std::string temporary = file_.string() + ".XXXXXX";
  const int descriptor = mkstemp(temporary.data());
  if (descriptor < 0) return "; not written: " + file_.string();
  close(descriptor);
  std::ofstream stream(temporary, std::ios::binary);
  stream << numbers << files::sha256(numbers);
  stream.close();
  if (stream) std::filesystem::rename(temporary, file_, error);
  if (stream && !error) return "; written";
  std::filesystem::remove(temporary, error);
  return "; not written: " + file_.string();
}

}  // namespace mbtfm::numerics
