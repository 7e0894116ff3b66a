// SPDX-License-Identifier: MIT
#include "bridge/base/config.hpp"

#include <gtest/gtest.h>

namespace sluice {
namespace {

struct Water {
  double spacing = 0;
  double density = 1000;
  std::string scheme = "implicit";
  int windows = 3;
  Vec<2> gravity{0, -9.81};
  std::vector<Vec<2>> wall;
  template <class Reader> void describe(Reader &read) {
    read.required("spacing_m", spacing, "distance between points").positive();
    read("density_kg_m3", density, "mass per volume").positive();
    read("scheme", scheme, "coupling scheme").one_of({"implicit", "explicit"});
    read("windows", windows, "windows reused").at_least(0);
    read("gravity_m_s2", gravity, "gravity");
    read("wall_m", wall, "polyline");
  }
};

std::string error_of(std::string_view text, std::vector<std::string> overrides = {}) {
  try {
    Config::parse(text, "case.toml", overrides).read<Water>("fluid");
  } catch (const UserError &error) {
    return error.what();
  }
  return "";
}

bool contains(const std::string &text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

TEST(Config, reads_values_and_keeps_defaults) {
  const auto config =
      Config::parse("[fluid]\nspacing_m = 0.002\nwall_m = [[0, 1], [2, 3.5]]\n", "c");
  const auto water = config.read<Water>("fluid");
  EXPECT_EQ(water.spacing, 0.002);
  EXPECT_EQ(water.density, 1000);
  ASSERT_EQ(water.wall.size(), 2u);
  EXPECT_EQ(water.wall[1], Vec<2>(2, 3.5));
}

TEST(Config, an_override_replaces_one_value) {
  const std::vector<std::string> overrides{"fluid.spacing_m=1e-3", "fluid.scheme=explicit"};
  const auto config =
      Config::parse("[fluid]\nspacing_m = 0.002\ndensity_kg_m3 = 900\n", "c", overrides);
  const auto water = config.read<Water>("fluid");
  EXPECT_EQ(water.spacing, 1e-3);
  EXPECT_EQ(water.density, 900);
  EXPECT_EQ(water.scheme, "explicit");
}

TEST(Config, a_misspelt_key_names_place_and_nearest_key) {
  const auto error = error_of("[fluid]\nspacing_m = 0.002\ndensty_kg_m3 = 900\n");
  EXPECT_TRUE(contains(error, "case.toml:3:")) << error;
  EXPECT_TRUE(contains(error, "did you mean 'density_kg_m3'")) << error;
}

TEST(Config, another_unit_in_the_key_is_an_unknown_key) {
  EXPECT_TRUE(
      contains(error_of("[fluid]\nspacing_mm = 2\nspacing_m = 1\n"), "did you mean 'spacing_m'"));
}

TEST(Config, a_missing_key_is_named) {
  EXPECT_TRUE(
      contains(error_of("[fluid]\ndensity_kg_m3 = 900\n"), "required key 'spacing_m' is missing"));
}

TEST(Config, a_misspelt_required_key_is_named_and_not_only_missed) {
  const auto error = error_of("[fluid]\nwindows = 1\nspacin_m = 0.002\n");
  EXPECT_TRUE(contains(error, "case.toml:3:")) << error;
  EXPECT_TRUE(contains(error, "unknown key 'spacin_m'")) << error;
  EXPECT_TRUE(contains(error, "did you mean 'spacing_m'")) << error;
}

TEST(Config, a_missing_key_is_named_before_a_condition_that_rests_on_it) {
  struct Steps {
    double end = 0, step = 0;
    void describe(TableReader &read) {
      read.required("end", end, "last instant");
      read("step", step, "length").check(step <= end, "must not exceed the end");
    }
  };
  try {
    Config::parse("[case]\nstep = 1\n", "case.toml").read<Steps>("case");
    FAIL() << "accepted";
  } catch (const UserError &error) {
    EXPECT_TRUE(contains(error.what(), "'end' is missing")) << error.what();
  }
}

TEST(Config, a_whole_number_that_an_int_does_not_hold_is_refused) {
  for (const auto *number : {"4294967297", "-2147483649", "9223372036854775807"}) {
    const auto error = error_of(fmt::format("[fluid]\nspacing_m = 1\nwindows = {}\n", number));
    EXPECT_TRUE(contains(error, "case.toml:3:")) << error;
    EXPECT_TRUE(contains(error, "between -2147483648 and 2147483647")) << error;
  }
}

TEST(Config, a_reader_of_some_keys_leaves_the_others_alone) {
  struct Spacing {
    double spacing = 0;
    void describe(TableReader &read) { read.required("spacing_m", spacing, "distance"); }
  };
  const auto config = Config::parse("[fluid]\nspacing_m = 2\nx = 1\n[[fluid.wall]]\n"
                                    "spacing_m = 3\ny = 1\n",
                                    "c");
  EXPECT_EQ(config.peek<Spacing>("fluid").spacing, 2);
  EXPECT_EQ(config.peek_all<Spacing>("fluid.wall").at(0).spacing, 3);
}

TEST(Config, a_wrong_type_is_refused_with_its_place) {
  const auto error = error_of("[fluid]\nspacing_m = \"2 mm\"\n");
  EXPECT_TRUE(contains(error, "case.toml:2:13")) << error;
  EXPECT_TRUE(contains(error, "needs a number")) << error;
  EXPECT_TRUE(contains(error_of("[fluid]\nspacing_m = nan\n"), "needs a number"));
}

TEST(Config, ranges_and_choices_are_checked) {
  EXPECT_TRUE(contains(error_of("[fluid]\nspacing_m = -1\n"), "must be greater than zero"));
  EXPECT_TRUE(contains(error_of("[fluid]\nspacing_m = 1\nscheme = \"explict\"\n"),
                       "did you mean 'explicit'"));
}

TEST(Config, a_syntax_error_and_an_unknown_table_name_their_line) {
  EXPECT_TRUE(contains(error_of("[fluid]\nspacing_m = = 2\n"), "case.toml:2:"));
  const auto config = Config::parse("[fluid]\nspacing_m = 1\n[flud]\nx = 1\n", "case.toml");
  try {
    config.allow_tables({"fluid", "solid"});
    FAIL() << "an unknown table was accepted";
  } catch (const UserError &error) {
    EXPECT_TRUE(contains(error.what(), "did you mean [fluid]")) << error.what();
    EXPECT_TRUE(contains(error.what(), "case.toml:3:")) << error.what();
  }
}

TEST(Config, a_malformed_override_is_refused) {
  EXPECT_TRUE(contains(error_of("[fluid]\n", {"spacing"}), "expected TABLE.KEY=VALUE"));
}

TEST(Config, the_canonical_text_does_not_depend_on_the_order_in_the_file) {
  const auto a = Config::parse("[b]\ny = 1\nx = 2\n[a]\nz = 3\n", "c").canonical_text();
  const auto b = Config::parse("[a]\nz = 3\n[b]\nx = 2\ny = 1\n", "d").canonical_text();
  EXPECT_EQ(a, b);
}

TEST(Config, the_canonical_text_leaves_a_secret_out) {
  const auto config = Config::parse("[bridge]\ntoken = \"sesame\"\nscheme = 1\n", "c");
  EXPECT_EQ(config.canonical_text("bridge.token"), "bridge.scheme = 1\n");
}

} // namespace
} // namespace sluice
