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

std::size_t n_values(const Supernodes& s, int k) {
  return 9 * static_cast<std::size_t>(s.n_rows(k)) * static_cast<std::size_t>(s.n_columns(k));
}

std::size_t n_bytes(const Supernodes& s) {
  std::size_t n = 0;
  for (int k = 0; k < s.count(); ++k) n += sizeof(double) * n_values(s, k);
  return n;
}

}  // namespace

FactorFile::FactorFile(const std::filesystem::path& folder, const BlockMatrix& matrix, const Supernodes& supernodes)
    : supernodes_(supernodes) {
  // the order of elimination, too: another version of METIS has another
  const std::string key = hash_of(matrix.start) + hash_of(matrix.row) + hash_of(matrix.value) +
                          hash_of(supernodes.place) + hash_of(supernodes.first) + hash_of(supernodes.row);
  file_ = folder / ("factor-" + files::sha256(key) + ".bin");
}

CachedFactor FactorFile::read() const {
  std::ifstream stream(file_, std::ios::binary);
  if (!stream) return {.panels = {}, .note = "absent"};
  std::ostringstream text;
  text << stream.rdbuf();
  const std::string bytes = std::move(text).str();
  const std::size_t n = n_bytes(supernodes_);
  const bool is_whole = bytes.size() == n + kHashLength &&
                        std::string_view(bytes).substr(n) == files::sha256(std::string_view(bytes).substr(0, n));
  if (!is_whole) return {.panels = {}, .note = "damaged, ignored: " + file_.string()};
  Panels<double> panels(supernodes_.count());
  const char* from = bytes.data();
  for (int k = 0; k < supernodes_.count(); ++k) {
    const std::size_t size = sizeof(double) * n_values(supernodes_, k);
    panels[k] = std::make_unique_for_overwrite<double[]>(n_values(supernodes_, k));
    std::memcpy(panels[k].get(), from, size);
    from += size;
  }
  return {.panels = std::move(panels), .note = "used"};
}

std::string FactorFile::write(const Panels<double>& panels) const {
  std::string bytes;
  bytes.reserve(n_bytes(supernodes_) + kHashLength);
  for (int k = 0; k < supernodes_.count(); ++k) {
    bytes.append(reinterpret_cast<const char*>(panels[k].get()), sizeof(double) * n_values(supernodes_, k));
  }
  bytes += files::sha256(bytes);
  std::error_code error;
  std::filesystem::create_directories(file_.parent_path(), error);
  std::string temporary = file_.string() + ".XXXXXX";
  const int descriptor = mkstemp(temporary.data());
  if (descriptor < 0) return "; not written: " + file_.string();
  close(descriptor);
  std::ofstream stream(temporary, std::ios::binary);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  if (stream) std::filesystem::rename(temporary, file_, error);
  if (stream && !error) return "; written";
  std::filesystem::remove(temporary, error);
  return "; not written: " + file_.string();
}

}  // namespace mbtfm::numerics
