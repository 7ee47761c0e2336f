#include "pipeline/numerics/cholesky.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <variant>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/report.h"
#include "pipeline/files/hash.h"
#include "pipeline/numerics/dense_panel.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::numerics {
namespace {

template <class Real>
using Factor = BlockCholesky<3, Real>;

std::string shown_GB(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g GB", value);
  return text;
}

// columns solved at a time: wide enough for the caches, few enough that a block of 300 000 unknowns stays
// below 250 MB
constexpr int kBlockColumns = 96;

/// Factorise, or say why not.
template <class Real>
void fill(Factor<Real>& factor, const BlockMatrix<3>& matrix, const FactorOptions& options) {
  const double memory_limit_GB = options.memory_limit_GB;
  const double needed_GB =
      1e-9 * sizeof(Real) * factor.elimination().most_numbers(3) +
      8e-9 * (static_cast<double>(matrix.value.size()) + 3.0 * matrix.n * kBlockColumns * options.threads);
  if (needed_GB > memory_limit_GB) {
    // a factor grows at most as the power 4/3 of the unknowns (nested dissection of a cube)
    const auto fitting = static_cast<std::int64_t>(3 * matrix.n * std::pow(memory_limit_GB / needed_GB, 0.75));
    throw OutOfMemory("the substrate's " + std::to_string(3 * matrix.n) + " unknowns take " + shown_GB(needed_GB) +
                      " of memory, allowed are " + shown_GB(memory_limit_GB) + ", which a mesh of " +
                      std::to_string(fitting) +
                      " unknowns would fit: ask for a coarser one (displacement_tolerance, elements_across_adhesion), "
                      "allow more (memory_limit_GB), or take the model 'layer'");
  }
  if (!factor.factorise(matrix, {.threads = options.threads})) {
    throw NotSolved(Report{.reason = "the substrate's stiffness matrix is not positive definite to rounding: the "
                                     "Poisson ratio is too near 1/2"});
  }
}

template <class T>
std::string hash_of(const std::vector<T>& values) {
  return files::sha256({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
}

/// The file of one matrix' factor. Written under a name of its own and renamed, so that many may write at a time and
/// no one reads half a file; checked by a hash of its content when read.
class FactorFile {
 public:
  FactorFile(const std::filesystem::path& folder, const BlockMatrix<3>& matrix, const Elimination& elimination)
      : n_bytes_(9 * sizeof(double) * elimination.n_blocks()) {
    // the order of elimination, too: another version of METIS has another
    std::vector<int> first;
    for (const EliminationPanel& panel : elimination.panels) first.push_back(panel.first);
    const std::string key = hash_of(matrix.start) + hash_of(matrix.row) + hash_of(matrix.value) +
                            hash_of(elimination.place) + hash_of(first);
    file_ = folder / ("factor-" + files::sha256(key) + ".bin");
  }

  /// The factor, empty where there is none. @return a note for the record: used, absent or damaged
  std::string read(Eigen::VectorXd& factor) const {
    std::ifstream stream(file_, std::ios::binary);
    if (!stream) return "absent";
    std::ostringstream text;
    text << stream.rdbuf();
    const std::string bytes = std::move(text).str();
    constexpr std::size_t kHashLength = 64;  // of SHA-256, in hexadecimal
    const bool is_whole =
        bytes.size() == n_bytes_ + kHashLength &&
        std::string_view(bytes).substr(n_bytes_) == files::sha256(std::string_view(bytes).substr(0, n_bytes_));
    if (!is_whole) return "damaged, ignored: " + file_.string();
    factor.resize(static_cast<Eigen::Index>(n_bytes_ / sizeof(double)));
    std::memcpy(factor.data(), bytes.data(), n_bytes_);
    return "used";
  }

  /// @return a note: written, or why not; a factor that cannot be kept is no error
  std::string write(const Eigen::VectorXd& factor) const {
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

 private:
  std::filesystem::path file_;
  std::size_t n_bytes_;
};

void solve_block(const Factor<double>& factor, const std::vector<char>& is_needed, int width,
                 std::vector<double>& values) {
  factor.solve(values.data(), static_cast<std::size_t>(width), is_needed);
}

void solve_block(const Factor<float>& factor, const std::vector<char>& is_needed, int width,
                 std::vector<double>& values) {
  std::vector<float> rounded(values.begin(), values.end());
  factor.solve(rounded.data(), static_cast<std::size_t>(width), is_needed);
  std::copy(rounded.begin(), rounded.end(), values.begin());
}

}  // namespace

struct SparseCholesky::Impl {
  std::shared_ptr<const Elimination> elimination;
  std::variant<Factor<double>, Factor<float>> factor;
  int threads = 1;
  std::string cache_note;

  Impl(const BlockMatrix<3>& matrix, const FactorOptions& options, std::shared_ptr<const Elimination> given)
      : elimination(std::move(given)), factor(Factor<double>(elimination)), threads(options.threads) {
    if (options.precision == Precision::single_) {
      fill(factor.emplace<1>(elimination), matrix, options);
    } else if (options.cache_folder.empty()) {
      fill(std::get<0>(factor), matrix, options);
    } else {
      const FactorFile file(options.cache_folder, matrix, *elimination);
      cache_note = file.read(std::get<0>(factor).factor());
      if (std::get<0>(factor).factor().size() > 0) return;
      fill(std::get<0>(factor), matrix, options);
      cache_note += file.write(std::get<0>(factor).factor());
    }
  }
};

SparseCholesky::SparseCholesky(const BlockMatrix<3>& matrix, const FactorOptions& options)
    : SparseCholesky(matrix, options, std::make_shared<const Elimination>(matrix, Search::quick)) {}

SparseCholesky::SparseCholesky(const BlockMatrix<3>& matrix, const FactorOptions& options,
                               std::shared_ptr<const Elimination> elimination)
    : impl_(std::make_unique<Impl>(matrix, options, std::move(elimination))) {}

SparseCholesky::~SparseCholesky() = default;

double SparseCholesky::factor_GB() const {
  return (impl_->factor.index() == 1 ? 36e-9 : 72e-9) * static_cast<double>(impl_->elimination->n_blocks());
}

const std::string& SparseCholesky::cache_note() const { return impl_->cache_note; }

void SparseCholesky::solve(int n_columns, const std::vector<int>& needed, const Use& fill, const Use& take) const {
  const Elimination& e = *impl_->elimination;
  std::vector<char> is_column_needed(e.place.size(), 0), is_needed(e.panels.size(), 0);
  for (const int node : needed) is_column_needed[e.place[node]] = 1;
  for (std::size_t k = 0; k < e.panels.size(); ++k) {
    const auto* own = &is_column_needed[e.panels[k].first];
    if (std::find(own, own + e.panels[k].n_columns, 1) != own + e.panels[k].n_columns) is_needed[k] = 1;
    if (is_needed[k] && e.panels[k].parent >= 0) is_needed[e.panels[k].parent] = 1;
  }
  constexpr int kAtATime = kRightHandSides<float>;  // twice those of double
  const auto parts = [](int n, int of) { return (n + of - 1) / of; };
  const int n_groups = parts(n_columns, kAtATime), threads = std::max(1, impl_->threads);
  const int n_blocks = std::min(n_groups, parts(parts(n_columns, kBlockColumns), threads) * threads);
  parallel_for(n_blocks, threads, [&](int block) {
    const auto begin = [&](int b) { return kAtATime * static_cast<int>(std::int64_t{b} * n_groups / n_blocks); };
    const int first = begin(block), padded = begin(block + 1) - first, width = std::min(padded, n_columns - first);
    std::vector<double> values(3 * e.place.size() * padded, 0.0);
    for (int k = 0; k < width; ++k) fill(first + k, {&values[k], padded, e.place});
    std::visit([&](const auto& factor) { solve_block(factor, is_needed, padded, values); }, impl_->factor);
    for (int k = 0; k < width; ++k) take(first + k, {&values[k], padded, e.place});
  });
}

}  // namespace mbtfm::numerics
