#include "pipeline/stage/plausible.h"
#include "pipeline/contract/errors.h"
#include "pipeline/stage/parameters.h"
#include "tests/support/test.h"

namespace mbtfm {
namespace {

std::vector<stage::Doubt> doubts_about_gel(Gel gel, const std::string& allow = "") {
  stage::ParameterList list;
  declare(list, gel);
  return stage::doubts_about(list, stage::allowed_quantities({.allow = allow}));
}

TEST(Plausible, every_quantity_has_a_source_a_remedy_and_a_usual_range_within_the_possible_one) {
  for (const stage::PlausibleQuantity& q : stage::plausible_quantities()) {
    EXPECT_FALSE(std::string(q.source).empty() || std::string(q.remedy).empty()) << q.id;
    EXPECT_LT(q.usual.low, q.usual.high) << q.id;
    EXPECT_TRUE(is_inside(q.possible, q.usual.low) && is_inside(q.possible, q.usual.high)) << q.id;
    EXPECT_FALSE(stage::doubt_about(q.id, 0.5 * (q.usual.low + q.usual.high))) << q.id;
  }
}

TEST(Plausible, what_published_experiments_used_and_found_is_not_doubted) {
  // Soine et al. 2015: U2OS on polyacrylamide; Balaban et al. 2001; MDCK on PDMS of 15 kPa, 0.64 um a pixel
  for (const auto& [id, value] : std::initializer_list<std::pair<const char*, double>>{{"youngs_modulus_kPa", 8.4},
                                                                                       {"youngs_modulus_kPa", 15},
                                                                                       {"youngs_modulus_kPa", 49},
                                                                                       {"poisson_ratio", 0.49},
                                                                                       {"poisson_ratio", 0.5},
                                                                                       {"thickness_um", 37},
                                                                                       {"thickness_um", 300},
                                                                                       {"pixel_size_um", 0.64},
                                                                                       {"pixel_size_um", 0.02025},
                                                                                       {"adhesion_area_um2", 0.46},
                                                                                       {"bead_sigma_um", 0.098},
                                                                                       {"bead_sigma_um", 0.8},
                                                                                       {"total_force_nN", 204},
                                                                                       {"total_force_nN", 920},
                                                                                       {"fibre_tension_nN", 103},
                                                                                       {"traction_kPa", 5.5}})
    EXPECT_FALSE(stage::doubt_about(id, value)) << id << " = " << value;
}

TEST(Plausible, a_modulus_in_pascal_is_refused_and_the_unit_named) {
  const InputError error = test::thrown<InputError>([] { doubts_about_gel({.youngs_modulus_kPa = 8400}); });
  EXPECT_EQ(error.where, "[gel] youngs_modulus_kPa");
  EXPECT_EQ(error.expected, "a number >= 0.01 and <= 1000 kPa");
  EXPECT_TRUE(has_words(error.hint, "the unit is kPa: 8400 Pa is 8.4 kPa"));
  EXPECT_TRUE(has_words(error.hint, "Discher")) << "the source";
  EXPECT_TRUE(has_words(error.hint, "allow = [\"youngs_modulus_kPa\"]"));
  const InputError small = test::thrown<InputError>([] { doubts_about_gel({.youngs_modulus_kPa = 0.0084}); });
  EXPECT_TRUE(has_words(small.hint, "0.0084 MPa is 8.4 kPa"));
}

TEST(Plausible, what_is_allowed_is_doubted_and_no_longer_refused) {
  const std::vector<stage::Doubt> doubts = doubts_about_gel({.youngs_modulus_kPa = 8400}, "youngs_modulus_kPa");
  ASSERT_EQ(doubts.size(), 1u);
  EXPECT_EQ(doubts.front().level, stage::DoubtLevel::refused);
  EXPECT_EQ(doubts.front().value, 8400);
  EXPECT_EQ(doubts.front().limit, 1000);
  EXPECT_NE(test::thrown<InputError>([] { doubts_about_gel({.youngs_modulus_kPa = 8400}, "thickness_um"); }).where, "")
      << "what is allowed is one quantity, not all";
  EXPECT_THROW(stage::allowed_quantities({.allow = "youngs_modulus"}), UsageError);
  EXPECT_EQ(stage::allowed_quantities({.allow = "traction_kPa, total_force_nN"}),
            (std::vector<std::string>{"traction_kPa", "total_force_nN"}));
}

TEST(Plausible, an_unusual_value_is_a_caution_that_says_what_is_usual) {
  const std::vector<stage::Doubt> doubts =
      doubts_about_gel({.youngs_modulus_kPa = 300, .poisson_ratio = 0.2, .thickness_um = 5});
  ASSERT_EQ(doubts.size(), 3u);
  for (const stage::Doubt& doubt : doubts) EXPECT_EQ(doubt.level, stage::DoubtLevel::caution) << doubt.id;
  EXPECT_EQ(stage::sentence_of(doubts.front()), "the Young's modulus of the gel is 300 kPa, above 100: unusual");
}

TEST(Plausible, names_to_allow_may_stand_in_an_array) {
  stage::CheckParameters checks;
  stage::ParameterList list;
  declare(list, checks);
  stage::read_toml(list, "[checks]\nallow = [\"pixel_size_um\", \"traction_kPa\"]\n", "cell.toml");
  EXPECT_EQ(stage::allowed_quantities(checks), (std::vector<std::string>{"pixel_size_um", "traction_kPa"}));
  EXPECT_THROW(stage::read_toml(list, "[checks]\nallow = [1, 2]\n", "cell.toml"), InputError);
}

TEST(Plausible, a_pixel_size_is_doubted_from_one_per_cent_off_the_images_own_and_refused_from_a_fifth) {
  EXPECT_FALSE(stage::doubt_about_pixel_size(0.1, 0.1));
  EXPECT_FALSE(stage::doubt_about_pixel_size(0.1009, 0.1));
  EXPECT_EQ(stage::doubt_about_pixel_size(0.102, 0.1)->level, stage::DoubtLevel::caution);
  EXPECT_EQ(stage::doubt_about_pixel_size(0.1, 0.102)->level, stage::DoubtLevel::caution);
  EXPECT_EQ(stage::doubt_about_pixel_size(0.119, 0.1)->level, stage::DoubtLevel::caution);
  EXPECT_EQ(stage::doubt_about_pixel_size(0.121, 0.1)->level, stage::DoubtLevel::refused);
  EXPECT_EQ(stage::sentence_of(*stage::doubt_about_pixel_size(0.1, 0.108)),
            "the pixel size is 0.1 um, but 0.108 um by the image's own calibration: both cannot be right");
  EXPECT_EQ(stage::sentence_of(*stage::doubt_about_pixel_size(15, 14)),  // unusual, too
            "the pixel size is 15 um, but 14 um by the image's own calibration: both cannot be right");
  const stage::Doubt halved = *stage::doubt_about_pixel_size(0.1, 0.2);
  EXPECT_EQ(halved.level, stage::DoubtLevel::refused);
  EXPECT_TRUE(has_words(halved.remedy, "binning"));
  EXPECT_NO_THROW(stage::require_possible(halved, {"pixel_size_um"}, "actin.tif"));
  const InputError error = test::thrown<InputError>([&] { stage::require_possible(halved, {}, "actin.tif"); });
  EXPECT_EQ(error.where, "actin.tif");
  EXPECT_EQ(error.expected, "about 0.2 um, the image's own calibration");
  EXPECT_EQ(error.found, "0.1 um");
}

TEST(Plausible, inputs_that_nobody_gave_are_listed_as_assumed) {
  Gel gel;
  stage::ParameterList list;
  declare(list, gel);
  stage::read_toml(list, "[gel]\nyoungs_modulus_kPa = 8.4\n", "cell.toml");
  const std::vector<stage::AssumedInput> both = stage::assumed_inputs(list);
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(stage::sentence_of(both[1]), "thickness_um = 60 um (assumed: the thickness of the gel was not given)");
  stage::read_toml(list, "[gel]\nthickness_um = 60\npoisson_ratio = 0.49\n", "cell.toml");
  EXPECT_TRUE(stage::assumed_inputs(list).empty()) << "given is given, also where it is the default";
}

TEST(Plausible, one_adhesion_that_was_drawn_too_small_makes_no_traction_unusual) {
  std::vector<Adhesion> adhesions(4, {.adhesion_id = 1, .area_um2 = 1});
  adhesions[2].area_um2 = 0.01;
  std::vector<AdhesionForce> forces;
  for (const double force_nN : {3., 4., 2., 5.})
    forces.push_back({.adhesion_id = 1, .force_nN = {force_nN, 0}, .connected = false});
  EXPECT_DOUBLE_EQ(stage::traction_of_half_the_force_kPa(forces, adhesions), 5) << "200 kPa on a seventh of the force";
  EXPECT_DOUBLE_EQ(stage::traction_of_half_the_force_kPa({}, {}), 0);
}

TEST(Plausible, a_traction_or_a_tension_counts_as_far_as_its_error_leaves_it_sure) {
  const std::vector<Adhesion> adhesions(2, {.adhesion_id = 1, .area_um2 = 0.1});
  std::vector<AdhesionForce> forces(2);
  forces[0] = {.adhesion_id = 1, .force_nN = {3, 4}, .sigma_nN = 2.5, .connected = false};  // 50 kPa, all of it noise
  forces[1] = {.adhesion_id = 2, .force_nN = {0, 1}, .sigma_nN = 0.25, .connected = false};
  EXPECT_DOUBLE_EQ(stage::traction_of_half_the_force_kPa(forces, adhesions), 5);
  const std::vector<Tension> tensions = {{.fibre_id = 0, .tension_nN = 99},  // the network's is no fibre's
                                         {.fibre_id = 1, .tension_nN = 50, .low_nN = 2, .high_nN = 98},
                                         {.fibre_id = 2, .tension_nN = 7}};
  EXPECT_EQ(stage::surest_fibre_tension_nN(tensions), 7);
}

}  // namespace
}  // namespace mbtfm
