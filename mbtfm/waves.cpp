#include "mbtfm/waves.h"

#include <fftw3.h>

#include <mutex>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/parallel.h"

namespace mbtfm::inverse {

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

WaveTransform::WaveTransform(int n_columns, int n_rows, int threads)
    : n_columns_(n_columns),
      n_rows_(n_rows),
      threads_(threads),
      weights_(n_waves()),
      plans_(std::make_unique<Plans>()) {
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

void WaveTransform::forward(const NodeField& field, WaveField& waves) const {
  MBTFM_ASSERT(field.x.size() == static_cast<Eigen::Index>(n_columns_) * n_rows_ && field.y.size() == field.x.size() &&
               waves.x.size() == n_waves() && waves.y.size() == n_waves());
  parallel_for(2, threads_, [&](int component) {
    const Eigen::ArrayXd& from = component == 0 ? field.x : field.y;
    // planned with FFTW_PRESERVE_INPUT
    fftw_execute_dft_r2c(plans_->forward, const_cast<double*>(from.data()),
                         values_of(component == 0 ? waves.x : waves.y));
  });
}

void WaveTransform::backward(WaveField& waves, NodeField& field) const {
  MBTFM_ASSERT(field.x.size() == static_cast<Eigen::Index>(n_columns_) * n_rows_ && field.y.size() == field.x.size() &&
               waves.x.size() == n_waves() && waves.y.size() == n_waves());
  const double scale = 1 / (static_cast<double>(n_columns_) * n_rows_);
  parallel_for(2, threads_, [&](int component) {
    Eigen::ArrayXd& to = component == 0 ? field.x : field.y;
    fftw_execute_dft_c2r(plans_->backward, values_of(component == 0 ? waves.x : waves.y), to.data());
    to *= scale;
  });
}

WaveField WaveTransform::forward(const NodeField& field) const {
  WaveField waves = no_waves();
  forward(field, waves);
  return waves;
}

NodeField WaveTransform::backward(WaveField waves) const {
  NodeField field = no_field();
  backward(waves, field);
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

int quick_size(int at_least) {
  for (int n = std::max(1, at_least);; ++n) {
    int rest = n;
    for (const int factor : {2, 3, 5}) {
      while (rest % factor == 0) rest /= factor;
    }
    if (rest == 1 && n % 64 != 0) return n;
  }
}

}  // namespace mbtfm::inverse
