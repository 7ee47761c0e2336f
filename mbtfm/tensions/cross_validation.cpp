#include "mbtfm/tensions/cross_validation.h"

#include <random>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::tensions {

namespace {

FibreType exchanged(FibreType type) {
  if (type == FibreType::dorsal) return FibreType::ventral;
  return type == FibreType::ventral ? FibreType::dorsal : type;
}

}  // namespace

CrossValidation cross_validate(const TensionProblem& problem, const LinearData& data, const Trial& around,
                               const std::vector<FibreType>& types, const TypeTensions& tensions, int n_draws,
                               std::uint64_t seed, int threads) {
  MBTFM_ASSERT(static_cast<int>(types.size()) + 1 == problem.n_tensions());
  CrossValidation result;
  result.own.resize(static_cast<std::size_t>(n_draws));
  result.exchanged = result.own;
  numerics::parallel_for(2 * n_draws, threads, [&](int k) {
    const bool is_exchanged = k >= n_draws;
    const auto draw = static_cast<std::size_t>(is_exchanged ? k - n_draws : k);
    // the same numbers for both, so that they differ by the types alone
    std::mt19937_64 random(seed + 1000003 * (draw + 1));
    VectorXd drawn = around.tensions_nN;
    for (std::size_t i = 0; i < types.size(); ++i) {
      const std::vector<double>& choice = tensions.at(is_exchanged ? exchanged(types[i]) : types[i]);
      drawn[static_cast<Index>(i) + 1] = choice[random() % choice.size()];
    }
    (is_exchanged ? result.exchanged : result.own)[draw] =
        relative_l2(data, problem.evaluate(drawn, &around).forces_nN);
  });
  return result;
}

}  // namespace mbtfm::tensions
