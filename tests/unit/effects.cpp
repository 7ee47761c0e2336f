/// The switches of the effects: how they are read, decided, recorded, and whose result depends on which.
#include "pipeline/stage/effects.h"

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/files/text.h"
#include "pipeline/runner/record.h"
#include "pipeline/stage/parameters.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm {
namespace {

stage::EffectSwitches read(std::string_view toml, const std::vector<std::string>& names) {
  stage::EffectSwitches switches;
  stage::ParameterList list;
  declare(list, switches, names);
  stage::read_toml(list, toml, "cell.toml");
  return switches;
}

TEST(Effects, a_stage_reads_its_own_switches_and_leaves_the_others_to_their_stages) {
  const std::string toml = "[effects]\nfinite_sides = 'off'\ndrift_affine = 'on'\neffect_tolerance = 0.05\n";
  const stage::EffectSwitches fit = read(toml, {"finite_sides", "effect_tolerance"});
  EXPECT_EQ(fit.finite_sides, Switch::off);
  EXPECT_EQ(fit.drift_affine, Switch::automatic);
  EXPECT_EQ(fit.effect_tolerance, 0.05);
  EXPECT_EQ(read(toml, {"drift_affine"}).drift_affine, Switch::on);
}

TEST(Effects, a_misspelt_switch_is_refused_by_every_stage) {
  const InputError error = test::thrown<InputError>([&] { read("[effects]\nfinite_side = 'on'\n", {"drift_affine"}); });
  EXPECT_TRUE(has_words(error.hint, "'finite_sides'"));
  EXPECT_THROW(read("[effects]\nfinite_sides = 'yes'\n", {"finite_sides"}), InputError);
}

TEST(Effects, are_read_back_by_their_names) {
  for (const EffectKind kind : values_of<EffectKind>()) EXPECT_EQ(named<EffectKind>(name_of(kind)), kind);
  EXPECT_EQ(name_of(EffectKind::time_coupling), std::string("time coupling")) << "a word for each kind, in its order";
}

TEST(Effects, auto_follows_the_number_and_a_switch_overrules_it) {
  for (const double number : {0.02, 0.01, 0.0}) {
    EXPECT_EQ(stage::decided(EffectKind::finite_sides, Switch::automatic, number, 0.01, "they change").is_on,
              number > 0.01);
    EXPECT_TRUE(stage::decided(EffectKind::finite_sides, Switch::on, number, 0.01, "they change").is_on);
    EXPECT_FALSE(stage::decided(EffectKind::finite_sides, Switch::off, number, 0.01, "they change").is_on);
  }
  EXPECT_EQ(stage::line_of(
                stage::decided(EffectKind::finite_sides, Switch::automatic, 0.02, 0.01, "they change the field by")),
            "finite sides: on (auto): they change the field by 0.02, above 0.01");
}

TEST(Effects, a_switch_makes_anew_the_stages_that_have_it_and_no_other) {
  const test::TemporaryFolder folder;
  const auto settings = [&](const std::string& toml) {
    files::write_text(folder / "cell.toml", toml);
    return runner::read_settings(folder / "cell.toml", runner::stages());
  };
  const auto changed = [&](const std::string& toml) {
    const auto before = settings("[gel]\nyoungs_modulus_kPa = 8\n");
    const auto after = settings("[gel]\nyoungs_modulus_kPa = 8\n" + toml);
    std::string names;
    for (const runner::Stage& stage : runner::stages())
      if (before.at(stage.name) != after.at(stage.name)) names += stage.name + " ";
    return names;
  };
  EXPECT_EQ(changed("[effects]\ndrift_affine = 'off'\n"), "track ");
  EXPECT_EQ(changed("[effects]\nstress_fibres = 'off'\n"), "network fit ");
  EXPECT_EQ(changed("[effects]\nrobust_loss = 'off'\n"), "fit ");
}

}  // namespace
}  // namespace mbtfm
