// SPDX-License-Identifier: MIT
// Reading input files: sets in all their spellings, includes, and what is refused and why.
#include "bridge/calculix/box_deck.hpp"
#include "bridge/calculix/deck.hpp"
#include "tests/unit/bridge/support.hpp"

#include <fstream>

namespace sluice::calculix {
namespace {

using bridge::contains;
using bridge::error_of;

// A bar of two hexahedra along x; nodes 1 to 12, four per plane x = constant.
constexpr const char *nodes = R"(** a comment
*Node, nset=Everything
1, 0, 0, 0
2, 0, 1, 0
3, 0, 1, 1
4, 0, 0, 1
5, 1.0, 0, 0
6, 1d0, 1, 0
7, 1, 1, 1
8, +1E0, , 1
9, 2, 0, 0
10, 2, 1, 0
11, 2, 1, 1
12, 2, 0, 1
)";
constexpr const char *elements = R"(*ELEMENT, TYPE=C3D8, ELSET=BAR
1, 1, 2, 3, 4,
   5, 6, 7, 8
2, 5, 6, 7, 8, 9, 10, 11, 12
)";
constexpr const char *step = "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n1e-3, 1e-3\n*END STEP\n";

Deck bar(const std::string &model = "", const std::string &end = step) {
  return parse_deck(std::string(nodes) + elements + model + end, "bar.inp");
}
std::string refusal(const std::string &model, const std::string &end = step) {
  return error_of([&] { bar(model, end); });
}

TEST(Deck, nodes_and_elements_are_read_in_every_spelling) {
  const Deck deck = bar();
  ASSERT_EQ(deck.nodes.size(), 12u);
  EXPECT_EQ(deck.nodes.at(6), Vec<3>(1, 1, 0)) << "d as the exponent's letter";
  EXPECT_EQ(deck.nodes.at(8), Vec<3>(1, 0, 1)) << "an empty field is zero, a sign may lead";
  ASSERT_EQ(deck.elements.size(), 2u);
  EXPECT_EQ(deck.elements[0].nodes, (std::vector<int>{1, 2, 3, 4, 5, 6, 7, 8})) << "over two lines";
}

TEST(Deck, node_sets_are_read_in_every_spelling) {
  const Deck deck = bar("*NSET, NSET=list\n1, 2,\n3\n*NSET,\nNSET=Range, GENERATE\n5, 9, 2\n"
                        "*nset,nset=BOTH\nlist, RANGE, 12, 1, 99\n*NSET,NSET=LIST\n4\n");
  EXPECT_EQ(deck.node_set("everything").size(), 12u) << "from *NODE";
  EXPECT_EQ(deck.node_set("LIST"), (std::vector<int>{1, 2, 3, 4})) << "a second card adds";
  EXPECT_EQ(deck.node_set("range"), (std::vector<int>{5, 7, 9}));
  EXPECT_EQ(deck.node_set("both"), (std::vector<int>{1, 2, 3, 5, 7, 9, 12}))
      << "sets and numbers, each node once, as the sets were when they were named; no node 99";
}

TEST(Deck, a_set_that_is_not_there_is_named_with_the_ones_that_are) {
  const Deck deck = bar("*NSET, NSET=WETTED\n1, 2, 3, 4\n");
  const std::string message = error_of([&] { deck.node_set("weted"); });
  for (const char *part : {"bar.inp", "'weted'", "did you mean 'WETTED'", "EVERYTHING"})
    EXPECT_TRUE(contains(message, part)) << message;
}

TEST(Deck, included_files_become_part_of_the_model) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "Mesh.inp") << nodes << "*INCLUDE, INPUT=sub/bar.inp\n";
  std::filesystem::create_directory(folder.path() / "sub");
  std::ofstream(folder.path() / "sub/bar.inp") << elements;
  std::ofstream(folder.path() / "main.inp") << "*include, input=Mesh.inp\n" << step;
  const Deck deck = read_deck(folder.path() / "main.inp");
  EXPECT_EQ(deck.elements.size(), 2u);
  for (const Line &line : deck.model)
    EXPECT_FALSE(is_card(line.text, "*INCLUDE"));
  std::ofstream(folder.path() / "sub/bar.inp") << "*INCLUDE, INPUT=Mesh.inp\n";
  EXPECT_TRUE(contains(error_of([&] { read_deck(folder.path() / "main.inp"); }), "itself"));
  std::filesystem::remove(folder.path() / "sub/bar.inp");
  EXPECT_TRUE(
      contains(error_of([&] { read_deck(folder.path() / "main.inp"); }), "sub/bar.inp: cannot be"));
}

TEST(Deck, what_cannot_be_coupled_is_refused_with_its_line) {
  EXPECT_TRUE(contains(refusal("*RESTART, READ\n"), "bar.inp:19: *RESTART"));
  EXPECT_TRUE(contains(refusal("*TRANSFORM, TYPE=C, NSET=EVERYTHING\n0,0,0,0,0,1\n"),
                       "bar.inp:19: *TRANSFORM"));
  EXPECT_TRUE(contains(refusal("*NODE, SYSTEM=C\n13, 1, 90, 0\n"), "bar.inp:19: SYSTEM=C"));
  EXPECT_TRUE(contains(refusal("", ""), "no *STEP"));
  EXPECT_TRUE(contains(refusal("", "*STEP\n*STATIC\n*END STEP\n"), "bar.inp:19: the step is not"));
  EXPECT_TRUE(contains(refusal("", "*STEP\n*DYNAMIC\n"), "no *END STEP"));
  EXPECT_TRUE(contains(refusal("", std::string(step) + step), "bar.inp:23: '*STEP, NLGEOM'"));
  EXPECT_TRUE(contains(refusal("*ELEMENT, TYPE=C3D8\n3, 9, 10, 11, 12, 13, 14, 15, 16\n"),
                       "names node 13"));
  EXPECT_TRUE(contains(refusal("*ELEMENT, TYPE=C3D8\n3, 9, 10, 11, 12\n"), "bar.inp:20"));
  EXPECT_TRUE(contains(refusal("*NSET, NSET=A\n1, two\n"), "bar.inp:20: 'two' is not an integer"));
}

// What is printed for the box is an input file like a user's own.
TEST(BoxDeck, sets_hold_the_nodes_that_they_are_named_for) {
  BoxParams box;
  box.corner = {0.1, 0};
  box.width = 0.005;
  box.height = 0.079;
  box.elements_across = 2;
  box.elements_along = 4;
  box.youngs_modulus = 12e6;
  box.poisson_ratio = 0.4;
  box.density = 1100;
  const Deck deck = parse_deck(box_deck(box), "box.inp");
  EXPECT_EQ(deck.nodes.size(), 3u * 5 * 2);
  EXPECT_EQ(deck.elements.size(), 8u);
  EXPECT_EQ(deck.elements[0].type, "C3D8I");
  for (const int node : deck.node_set("CLAMPED"))
    EXPECT_NEAR(deck.nodes.at(node).y(), 0.079, 1e-15);
  EXPECT_EQ(deck.node_set("PLANES").size(), deck.nodes.size());
  EXPECT_EQ(deck.node_set(box_interface_set).size(), 2u * (2 * 5 + 1)) << "no middle of the clamp";
  ASSERT_EQ(deck.node_set(box_probe_set).size(), 2u);
  EXPECT_NEAR(deck.nodes.at(deck.node_set(box_probe_set)[0]).x(), 0.1025, 1e-15);
  box.elements_across = 1;
  box.element = "q1";
  const Deck thin = parse_deck(box_deck(box), "box.inp");
  EXPECT_EQ(thin.node_set(box_probe_set).size(), 4u) << "both corners: their mean is the middle";
  EXPECT_EQ(thin.elements[0].type, "C3D8");
  EXPECT_TRUE(contains(thin.step[1].text, "ALPHA=-0.111111")) << "(0.8 - 1)/(0.8 + 1)";
}

} // namespace
} // namespace sluice::calculix
