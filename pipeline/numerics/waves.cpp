#include "pipeline/numerics/waves.h"

#include <fftw3.h>

#include <array>
#include <mutex>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::numerics {

namespace {

/// FFTW's planner, alone of its functions, must not run twice at a time.
std::mutex& planner() {
  static std::mutex mutex;
  return mutex;
}

fftw_complex* values_of(Eigen::ArrayXcd& waves) { return reinterpret_cast<fftw_complex*>(waves.data()); }

}  // namespace

struct WaveTransform::Plans {
  fftw_plan forward = nullptr, backward = nullptr;
};

WaveTransform::WaveTransform(int n_columns, int n_rows)
    : n_columns_(n_columns), n_rows_(n_rows), weights_(n_waves()), plans_(std::make_unique<Plans>()) {
  const double once = 1 / (static_cast<double>(n_columns) * n_rows);
  for (int j = 0; j < n_rows; ++j) {
    for (int i = 0; i < n_half(); ++i) {
      const bool is_own_mirror = i == 0 || 2 * i == n_columns;
      weights_[i + static_cast<Eigen::Index>(n_half()) * j] = is_own_mirror ? once : 2 * once;
    }
  }
  Eigen::ArrayXd nodes(static_cast<Eigen::Index>(n_columns) * n_rows);
  Eigen::ArrayXcd waves(n_waves());
  const std::lock_guard lock(planner());
  plans_->forward =
      fftw_plan_dft_r2c_2d(n_rows, n_columns, nodes.data(), values_of(waves), FFTW_ESTIMATE | FFTW_PRESERVE_INPUT);
  plans_->backward = fftw_plan_dft_c2r_2d(n_rows, n_columns, values_of(waves), nodes.data(), FFTW_ESTIMATE);
}

WaveTransform::~WaveTransform() {
  const std::lock_guard lock(planner());
  fftw_destroy_plan(plans_->forward);
  fftw_destroy_plan(plans_->backward);
}

WaveField WaveTransform::no_waves() const {
  return {Eigen::ArrayXcd::Zero(n_waves()), Eigen::ArrayXcd::Zero(n_waves())};
}

NodeField WaveTransform::no_field() const {
  const Eigen::Index n_nodes = static_cast<Eigen::Index>(n_columns_) * n_rows_;
  return {Eigen::ArrayXd::Zero(n_nodes), Eigen::ArrayXd::Zero(n_nodes)};
}

void WaveTransform::forward(const NodeField& field, WaveField& waves, int threads) const {
  MBTFM_ASSERT(field.x.size() == static_cast<Eigen::Index>(n_columns_) * n_rows_ && field.y.size() == field.x.size() &&
               waves.x.size() == n_waves() && waves.y.size() == n_waves());
  parallel_for(2, threads, [&](int component) {
    const Eigen::ArrayXd& from = component == 0 ? field.x : field.y;
    // planned with FFTW_PRESERVE_INPUT
    fftw_execute_dft_r2c(plans_->forward, const_cast<double*>(from.data()),
                         values_of(component == 0 ? waves.x : waves.y));
  });
}

void WaveTransform::backward(WaveField& waves, NodeField& field, int threads) const {
  MBTFM_ASSERT(field.x.size() == static_cast<Eigen::Index>(n_columns_) * n_rows_ && field.y.size() == field.x.size() &&
               waves.x.size() == n_waves() && waves.y.size() == n_waves());
  const double scale = 1 / (static_cast<double>(n_columns_) * n_rows_);
  parallel_for(2, threads, [&](int component) {
    Eigen::ArrayXd& to = component == 0 ? field.x : field.y;
    fftw_execute_dft_c2r(plans_->backward, values_of(component == 0 ? waves.x : waves.y), to.data());
    to *= scale;
  });
}

WaveField WaveTransform::forward(const NodeField& field, int threads) const {
  WaveField waves = no_waves();
  forward(field, waves, threads);
  return waves;
}

NodeField WaveTransform::backward(WaveField waves, int threads) const {
  NodeField field = no_field();
  backward(waves, field, threads);
  return field;
}

double WaveTransform::dot(const WaveField& a, const WaveField& b) const {
  double sum = 0;
  for (Eigen::Index k = 0; k < weights_.size(); ++k) {
    sum += weights_[k] * (a.x[k].real() * b.x[k].real() + a.x[k].imag() * b.x[k].imag() +
                          a.y[k].real() * b.y[k].real() + a.y[k].imag() * b.y[k].imag());
  }
  return sum;
}

Eigen::Array2d sum_over_parts(Eigen::Index n_waves, int threads,
                              const std::function<Eigen::Array2d(Eigen::Index begin, Eigen::Index end)>& body) {
  constexpr int kParts = 4;  // as many threads as serve: beyond, memory is the limit
  std::array<Eigen::Array2d, kParts> sums;
  parallel_for(kParts, threads,
               [&](int part) { sums[part] = body(n_waves * part / kParts, n_waves * (part + 1) / kParts); });
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

int quick_size(int at_least) {
  for (int n = std::max(1, at_least);; ++n) {
    int rest = n;
    for (const int factor : {2, 3, 5}) {
      while (rest % factor == 0) rest /= factor;
    }
    if (rest == 1 && n % 64 != 0) return n;
  }
}

}  // namespace mbtfm::numerics
