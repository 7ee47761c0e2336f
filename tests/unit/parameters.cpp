#include "pipeline/stage/parameters.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/range.h"
#include "pipeline/files/text.h"
#include "pipeline/files/toml.h"
#include "pipeline/stage/suggest.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm {
namespace {

enum class Method { fast, exact };
constexpr auto words(Method) { return std::array{"fast", "exact"}; }

struct Example {
  double length_um = 1.5;
  std::optional<double> pixel_size_um;
  int count = 3;
  std::optional<int> page;
  bool is_on = false;
  Method method = Method::fast;
  std::optional<Method> other;
  std::uint64_t seed = 1;
};

void declare(stage::ParameterList& list, Example& e) {
  list.table("");
  list.add("pixel_size_um", e.pixel_size_um, Range::positive(), "pixel size (um)");
  list.table("network");
  list.add("length_um", e.length_um, Range::positive(), "length (um)");
  list.add("count", e.count, Range::between(1, 10), "how many");
  list.add("page", e.page, {.low = 1}, "which page");
  list.add("is_on", e.is_on, "whether");
  list.add("method", e.method, "which way");
  list.add("other", e.other, "which other way");
  list.add("seed", e.seed, "seed");
}

std::string message_of(std::string_view toml) {
  Example e;
  stage::ParameterList list;
  declare(list, e);
  const auto error = test::caught<InputError>([&] { stage::read_toml(list, toml, "cell.toml"); });
  return error ? std::string(error->what()) + " | " + error->hint : "read";
}

TEST(Parameters, values_are_read_from_their_table) {
  Example e;
  stage::ParameterList list;
  declare(list, e);
  stage::read_toml(list, "pixel_size_um = 0.1\n[network]\nlength_um = 2\nmethod = 'exact'\nis_on = true\nseed = 7\n",
                   "t");
  EXPECT_EQ(e.pixel_size_um, 0.1);
  EXPECT_EQ(e.length_um, 2);
  EXPECT_EQ(e.method, Method::exact);
  EXPECT_TRUE(e.is_on);
  EXPECT_EQ(e.seed, 7u);
  EXPECT_FALSE(e.page);
  stage::read_toml(list, "[network]\npage = 4\n", "t");
  EXPECT_EQ(e.page, 4);
  EXPECT_EQ(e.count, 3) << "what is not given keeps its default";
}

TEST(Parameters, a_length_in_nanometres_is_recognised) {
  struct {
    double edge_length_um = 1.5, stiffness_nN = 1, ratio = 1;
  } e;
  stage::ParameterList list;
  list.table("network");
  list.add("edge_length_um", e.edge_length_um, Range::mesh_um(), "mean cable length (um)");
  list.add("stiffness_nN", e.stiffness_nN, Range::force_nN(), "stiffness (nN)");
  list.add("ratio", e.ratio, Range::between(0, 1), "a ratio");
  const auto hint_on = [&](const std::string& line) {
    const auto error = test::caught<InputError>([&] { stage::read_toml(list, "[network]\n" + line, "cell.toml"); });
    return error ? error->hint : std::string("read");
  };
  EXPECT_EQ(hint_on("edge_length_um = 1500\n"), "the unit is um: 1500 nm is 1.5 um (mean cable length (um))");
  EXPECT_EQ(hint_on("stiffness_nN = 5e7\n"), "the unit is nN: 5e+07 pN is 50000 nN (stiffness (nN))");
  EXPECT_EQ(hint_on("edge_length_um = 1e-300\n"), "mean cable length (um)") << "no unit makes that a length";
  EXPECT_EQ(hint_on("edge_length_um = 1e9\n"), "mean cable length (um)");
  EXPECT_EQ(hint_on("ratio = 500\n"), "a ratio") << "has no unit";
  EXPECT_EQ(hint_on("edge_length_um = 1.5\n"), "read");
  const UsageError error =
      test::thrown<UsageError>([&] { stage::set_from_text(stage::parameter_named(list, "edge_length_um"), "1500"); });
  EXPECT_TRUE(has_words(error.what(), "1500 nm is 1.5 um"));
}

TEST(Parameters, text_that_is_no_toml_is_an_input_error_with_its_line_whatever_it_is) {
  // The first two end toml++ 3.3 by an assertion where it was not built with NDEBUG; the others reach what it declares
  // unreachable.
  EXPECT_EQ(message_of("[[# a\n"), "cell.toml: expected TOML, found brackets, quotes or keys that make none | ");
  EXPECT_EQ(message_of("\xEF\xBB\xBF=pk9\n").find("cell.toml:1: expected TOML, found "), 0u);
  EXPECT_EQ(message_of("\n\u00B5m = 1\n").find("cell.toml:2: expected TOML, found "), 0u);
  EXPECT_EQ(message_of("\n\xCE\x94\n").find("cell.toml:2: expected TOML, found "), 0u);
  const std::string hint = " | save the file as plain text in UTF-8";
  EXPECT_EQ(message_of(std::string_view("a = 1\nb\0 = 2\n", 13)),
            "cell.toml:2: expected TOML, a text in UTF-8, found the control character \\x00" + hint);
  EXPECT_EQ(message_of("# caf\xE9\n"), "cell.toml:1: expected TOML, a text in UTF-8, found the byte \\xE9" + hint);
  EXPECT_EQ(message_of("# caf\xC3\xA9 \r\n\t\n"), "read");
}

TEST(Parameters, an_unknown_key_names_the_line_and_the_nearest_known_one) {
  EXPECT_EQ(message_of("[network]\n\nlenght_um = 2\n"),
            "cell.toml:3: expected a known key of [network], found 'lenght_um' | did you mean 'length_um'?");
  EXPECT_EQ(message_of("[netwrk]\na = 2\n"),
            "cell.toml:1: expected a known table, found [netwrk] | did you mean 'network'?");
  EXPECT_EQ(
      message_of("pixelsize_um = 2\n"),
      "cell.toml:1: expected a known key above the first table, found 'pixelsize_um' | did you mean 'pixel_size_um'?");
}

TEST(Parameters, a_key_in_the_wrong_table_is_sent_where_it_belongs_and_one_that_is_like_none_is_not_guessed) {
  EXPECT_EQ(message_of("[network]\nradius_um = 2\n"),
            "cell.toml:2: expected a known key of [network], found 'radius_um' | it belongs under [gel]");
  EXPECT_EQ(message_of("[network]\nfibres = false\n"),
            "cell.toml:2: expected a known key of [network], found 'fibres' | did you mean 'stress_fibres'? It is in "
            "[effects]");
  EXPECT_EQ(message_of("[network]\nwhatever = 2\n"),
            "cell.toml:2: expected a known key of [network], found 'whatever' | there are length_um, count, page, "
            "is_on, method, other, seed");
}

TEST(Parameters, a_deleted_key_is_not_taken_for_a_misspelt_one) {
  EXPECT_EQ(message_of("[network]\nseeds = 'jittered'\n"),
            "cell.toml:2: expected a known key of [network], found 'seeds' | this version computes as its default did "
            "and has no such key: take the line out (CHANGELOG.md)");
}

TEST(Parameters, keys_of_other_stages_are_left_to_them) { EXPECT_EQ(message_of("[fit]\nwhatever = 2\n"), "read"); }

TEST(Parameters, a_repeated_key_a_wrong_type_and_a_value_out_of_range_are_refused) {
  EXPECT_TRUE(has_words(message_of("[network]\ncount = 2\ncount = 3\n"), "cell.toml:3"));
  EXPECT_TRUE(has_words(message_of("[network]\npage = 0\n"), "expected an integer >= 1, found '0'"));
  EXPECT_TRUE(has_words(message_of("[network]\npage = 1.5\n"), "expected an integer >= 1, found '1.5'"));
  EXPECT_TRUE(has_words(message_of("[network]\ncount = 'two'\n"), "expected an integer >= 1 and <= 10, found 'two'"));
  EXPECT_TRUE(has_words(message_of("[network]\nlength_um = -2\n"), "expected a number > 0, found '-2'"));
  EXPECT_TRUE(has_words(message_of("[network]\nlength_um = nan\n"), "expected a number > 0"));
  EXPECT_TRUE(has_words(message_of("[network]\nmethod = 'slow'\n"), "expected one of fast, exact, found 'slow'"));
  EXPECT_TRUE(has_words(message_of("[network]\ncount = [1, 2]\n"), "array"));
}

TEST(Parameters, a_choice_knows_its_words_and_names_the_one_that_was_meant) {
  EXPECT_EQ(
      message_of("[network]\nmethod = 'exakt'\n"),
      "cell.toml:2: [network] method: expected one of fast, exact, found 'exakt' | did you mean 'exact'? (which way)");
  EXPECT_EQ(message_of("[network]\nmethod = 'slow'\n"),
            "cell.toml:2: [network] method: expected one of fast, exact, found 'slow' | which way");
  Example e;
  stage::ParameterList list;
  declare(list, e);
  stage::Parameter& other = stage::parameter_named(list, "other");
  EXPECT_EQ(stage::to_text(other), "auto") << "unset";
  stage::set_from_text(other, "exact");
  EXPECT_EQ(e.other, Method::exact);
  EXPECT_EQ(stage::to_text(other), "exact");
  stage::set_from_text(other, "auto");
  EXPECT_FALSE(e.other);
  EXPECT_THROW(stage::set_from_text(other, "fas"), UsageError);
  EXPECT_TRUE(has_words(stage::to_markdown(list), "| one of auto, fast, exact | which other way |"));
}

TEST(Parameters, a_choice_may_be_restricted_to_some_words_of_its_type) {
  Switch way = Switch::off;
  stage::ParameterList list;
  list.table("network");
  list.add("way", way, "which way", {Switch::automatic, Switch::off});
  stage::Parameter& parameter = stage::parameter_named(list, "way");
  EXPECT_EQ(parameter.default_value, "off");
  EXPECT_THROW(stage::set_from_text(parameter, "on"), UsageError);
  stage::set_from_text(parameter, "auto");
  EXPECT_EQ(way, Switch::automatic);
}

TEST(Parameters, a_key_of_very_many_parts_is_refused_before_it_is_taken_apart) {
  constexpr int kParts = 200000;  // took down 8 MB of stack
  std::string key = "a";
  for (int i = 1; i < kParts; ++i) key += ".a";
  for (const std::string& text : {key + " = 1\n", "\n[" + key + "]\n", "x = {" + key + " = 1}\n"})
    EXPECT_TRUE(has_words(message_of(text), "dots on a line"));
}

TEST(Parameters, a_gel_needs_its_modulus_and_a_poisson_ratio_below_one_half) {
  Gel gel;
  stage::ParameterList list;
  declare(list, gel);
  EXPECT_THROW(stage::check_complete(list), UsageError);
  EXPECT_THROW(stage::read_toml(list, "[gel]\nyoungs_modulus_kPa = -8\n", "t"), InputError);
  EXPECT_THROW(stage::read_toml(list, "[gel]\npoisson_ratio = 0.51\n", "t"), InputError);
  stage::read_toml(list, "[gel]\nyoungs_modulus_kPa = 8.4\npoisson_ratio = 0.4999\n", "t");
  EXPECT_NO_THROW(stage::check_complete(list));
}

TEST(Parameters, a_shear_modulus_gives_youngs_modulus_whatever_the_order_and_not_both_are_taken) {
  const auto read = [](const std::string& text, const char* flag_of_ratio) {
    Gel gel;
    stage::ParameterList list;
    declare(list, gel);
    stage::read_toml(list, text, "t");
    if (*flag_of_ratio != 0) set_from_text(stage::parameter_named(list, "poisson_ratio"), flag_of_ratio);
    list.derive_all();
    stage::check_complete(list);
    EXPECT_FALSE(has_words(stage::to_toml(list, {"gel"}), "youngs")) << "what is derived is not given";
    return gel.youngs_modulus_kPa;
  };
  // E = 2 (1 + nu) G
  EXPECT_DOUBLE_EQ(read("[gel]\nshear_modulus_kPa = 2.8\npoisson_ratio = 0.5\n", ""), 8.4);
  EXPECT_DOUBLE_EQ(read("[gel]\npoisson_ratio = 0.25\nshear_modulus_kPa = 4\n", ""), 10);
  EXPECT_DOUBLE_EQ(read("[gel]\nshear_modulus_kPa = 4\n", "0.25"), 10) << "a flag comes after cell.toml";
  EXPECT_THROW(read("[gel]\nshear_modulus_kPa = 4\nyoungs_modulus_kPa = 12\n", ""), UsageError);
}

TEST(Parameters, a_cell_takes_what_it_leaves_out_from_the_nearest_study_above_it) {
  const TemporaryFolder folder;
  const fs::path cell = folder / "study/day 1/cell/cell.toml", study = folder / "study/study.toml";
  fs::create_directories(cell.parent_path());
  files::write_text(folder / "study.toml", "pixel_size_um = 9\n[gel]\nthickness_um = 9\n");  // not the nearest
  const auto read = [&](const std::string& of_cell, const std::string& of_study) {
    files::write_text(cell, of_cell);
    files::write_text(study, of_study);
    Gel gel;
    double pixel_size_um = 0;
    stage::ParameterList list;
    list.table("");
    list.add("pixel_size_um", pixel_size_um, Range::pixel_um(), "side");
    declare(list, gel);
    stage::read_toml(list, cell);
    return std::pair(gel, pixel_size_um);
  };
  const std::string shared =
      "pixel_size_um = 0.2\n[gel]\nyoungs_modulus_kPa = 8\nthickness_um = 70\n[fit]\nn_meshes = 3\n";
  const auto [gel, pixel_size_um] = read("[gel]\nthickness_um = 50\n", shared);
  EXPECT_EQ(pixel_size_um, 0.2);
  EXPECT_EQ(gel.youngs_modulus_kPa, 8);
  EXPECT_EQ(gel.thickness_um, 50) << "the cell's own counts";
  const files::SharedSettings taken = files::shared_settings(cell);
  EXPECT_TRUE(fs::equivalent(taken.file, study));
  EXPECT_EQ(taken.keys, (std::vector<std::string>{"fit.n_meshes", "gel.youngs_modulus_kPa", "pixel_size_um"}));
  EXPECT_NEAR(read("[gel]\nshear_modulus_kPa = 2\n", shared).first.youngs_modulus_kPa, 2 * 1.49 * 2, 1e-12)
      << "either modulus is the gel's stiffness";
  const auto error = test::thrown<InputError>([&] { read("", "[gel]\nyoungs_modulus = 8\n"); });
  EXPECT_EQ(error.where, study.string() + ":2");
  EXPECT_TRUE(has_words(error.hint, "youngs_modulus_kPa"));
}

TEST(Parameters, flags_in_a_text_become_keys_where_only_cell_toml_is_written) {
  Example e;
  stage::ParameterList list;
  declare(list, e);
  const auto worded = [&](const std::string& text) {
    return stage::in_keys(list, {{"adhesion-mask", "adhesion_mask"}}, text);
  };
  EXPECT_EQ(worded("--length_um: expected a number"), "length_um in [network]: expected a number");
  EXPECT_EQ(worded("try --method exact, or --count 7."),
            "try method = \"exact\" in [network], or count = 7 in [network].");
  EXPECT_EQ(worded("(set --method if known)"), "(set method in [network] if known)");
  EXPECT_EQ(worded("give it in cell.toml or as --pixel_size_um (pixel size)"), "give it in cell.toml (pixel size)");
  EXPECT_EQ(worded("network.method = \"fast\" in cell.toml, or --method 'fast' for the first"),
            "network.method = \"fast\" in cell.toml for the first");
  EXPECT_EQ(worded("count = 1 in cell.toml, or --count 1 --page 2: from 1"), "count = 1 in cell.toml: from 1");
  EXPECT_EQ(worded("--pixel_size_um is missing; no --adhesion-mask"),
            "pixel_size_um in cell.toml is missing; no adhesion_mask in [images]");
  for (const char* text : {"no flag", "mbtfm-network --count 7 --out x does it", "run it with --explain", "a -- b"})
    EXPECT_EQ(worded(text), text);
}

TEST(Parameters, what_other_programs_and_countries_write_is_answered_with_how_to_write_it) {
  const auto hint = [](const std::string& text) {
    stage::ParameterList list;
    const auto error = test::caught<InputError>([&] { stage::read_toml(list, text, "cell.toml"); });
    return error ? error->hint : std::string("read");
  };
  EXPECT_EQ(hint("[gel]\nthickness_um = 8,4\n"), "decimals follow a point: 8.4");
  EXPECT_EQ(hint("[gel]\nthickness_um = 8.\n"), "a digit follows the point: 8.0");
  EXPECT_EQ(hint("[gel]\nthickness_um = 8.4 kPa\n"), "the number alone, without a unit: 8.4");
  EXPECT_EQ(hint("[gel]\nthickness_um = 60um\n"), "the number alone, without a unit: 60");
  EXPECT_TRUE(has_words(hint("[images]\nactin = “actin.tif”\n"), "straight quotes"));
  EXPECT_TRUE(has_words(hint("[images]\nactin = \"D:\\images\\cell 1\\actin.tif\"\n"), "write folders with /"));
  EXPECT_TRUE(has_words(hint("[images]\nactin = actin.tif\n"), "needs quotes"));
  EXPECT_EQ(hint("pixel_size_um = .1\n"), "a digit goes before the point: 0.1");
  EXPECT_TRUE(has_words(hint("pixel_size_um: 0.1\n"), "an equals sign"));
  EXPECT_TRUE(has_words(hint("[gel\nthickness_um = 60\n"), "brackets: [gel]"));
  EXPECT_TRUE(has_words(hint("[gel]\nradius_um = 9\n[gel]\nthickness_um = 60\n"), "below the first"));
  EXPECT_TRUE(has_words(hint("{\\rtf1 pixel_size_um = 0.1}"), "plain text"));
  EXPECT_EQ(hint("poisson_ratio = 0.49\n"), "it belongs under [gel]");
}

}  // namespace
}  // namespace mbtfm
