// SPDX-License-Identifier: MIT
// From a node set to the bridge's mesh, and loads and motion between the two.
#include "bridge/calculix/box_deck.hpp"
#include "bridge/calculix/interface.hpp"
#include "gate_box.hpp"
#include "tests/unit/bridge/support.hpp"

#include <Eigen/Geometry>

#include <numeric>

namespace sluice::calculix {
namespace {

using bridge::contains;
using bridge::error_of;

Interface gate_surface(int across, int deep, int dim) {
  BoxParams box = gate_box("q1");
  box.elements_across = across;
  box.elements_deep = deep;
  box.depth = 0.02;
  return interface_of(parse_deck(box_deck(box), "box.inp"), box_interface_set, dim);
}

// Perpendicular that the motion of the nodes leaves: twice the enclosed area by the shoelace rule.
double twice_area(const bridge::InterfaceMesh &mesh) {
  double sum = 0;
  for (std::size_t f = 0; f < mesh.n_faces(); ++f) {
    const auto a = mesh.position(static_cast<std::size_t>(mesh.faces[2 * f]));
    const auto b = mesh.position(static_cast<std::size_t>(mesh.faces[2 * f + 1]));
    sum += a[0] * b[1] - b[0] * a[1];
  }
  return sum;
}

// One element across, the clamped end's face is in the set too: the outline is closed.
TEST(Interface, the_outline_of_a_slab_has_the_fluid_on_its_left) {
  for (const int deep : {1, 3}) {
    const Interface surface = gate_surface(1, deep, 2);
    EXPECT_EQ(surface.mesh.n_nodes(), 2u * 29) << "front and back are one";
    EXPECT_EQ(surface.mesh.n_faces(), 2u * 28 + 2);
    EXPECT_NEAR(twice_area(surface.mesh), -2 * 0.005 * 0.079, 1e-15) << "clockwise";
    EXPECT_NEAR(surface.depth, 0.02, 1e-15);
  }
  EXPECT_EQ(gate_surface(4, 1, 2).mesh.n_faces(), 2u * 28 + 4) << "none at the clamp";
}

TEST(Interface, faces_of_a_body_in_space_point_outwards) {
  const Interface surface = gate_surface(2, 2, 3);
  EXPECT_EQ(surface.mesh.nodes_per_face, 4);
  Vec<3> sum = Vec<3>::Zero(); // of area vectors: the open clamped end is what is missing
  for (std::size_t f = 0; f < surface.mesh.n_faces(); ++f) {
    const auto x = [&](std::size_t k) {
      const auto p = surface.mesh.position(static_cast<std::size_t>(surface.mesh.faces[4 * f + k]));
      return Vec<3>(p[0], p[1], p[2]);
    };
    sum += 0.5 * (x(2) - x(0)).cross(x(3) - x(1));
  }
  // Front, back and lower end; the planes z = constant have inner nodes that are not in the set.
  EXPECT_NEAR(sum.x(), 0, 1e-16);
  EXPECT_NEAR(sum.y(), -0.005 * 0.02, 1e-16);
}

TEST(Interface, forces_and_work_are_the_same_on_both_sides) {
  for (const auto &[deep, dim] : {std::pair(1, 2), {3, 2}, {2, 3}}) {
    const Interface surface = gate_surface(1, deep, dim);
    const auto forces = bridge::random_values(surface.mesh.positions.size(), 1);
    const std::vector<NodalForce> loads = surface.scatter(forces);
    const auto motion = bridge::random_values(3 * 4 * 29 * static_cast<std::size_t>(deep + 1), 2);
    const NodeField field =
        Eigen::Map<const NodeField>(motion.data(), 3, static_cast<Eigen::Index>(motion.size() / 3));
    double work = 0, scale = 0;
    for (const auto &[node, force] : loads) {
      work += force.dot(field.col(node - 1));
      scale += force.norm();
    }
    const auto gathered = surface.gather(field);
    const double bridge_work =
        std::inner_product(forces.begin(), forces.end(), gathered.begin(), 0.0);
    EXPECT_NEAR(work / surface.depth, bridge_work, 1e-14 * scale / surface.depth);
    const auto collected = surface.collect(loads);
    for (std::size_t k = 0; k < forces.size(); ++k)
      EXPECT_NEAR(collected[k], forces[k], 1e-15);
  }
}

TEST(Interface, a_constant_traction_over_the_depth_loads_inner_nodes_twice_as_much) {
  const Interface surface = gate_surface(1, 2, 2);
  ASSERT_EQ(surface.shares[0].size(), 3u);
  EXPECT_NEAR(surface.shares[0][0].weight, 0.25, 1e-14);
  EXPECT_NEAR(surface.shares[0][1].weight, 0.5, 1e-14);
}

TEST(Interface, a_set_that_makes_no_surface_is_refused_with_the_node) {
  const std::string box = box_deck(gate_box("q1"));
  const auto refusal = [&](const std::string &set, int dim) {
    const std::string text = "*NSET, NSET=MINE\n" + set + "\n" + box.substr(box.find("*STEP"));
    const Deck deck = parse_deck(box.substr(0, box.find("*STEP")) + text, "gate.inp");
    return error_of([&] { interface_of(deck, "MINE", dim); });
  };
  EXPECT_TRUE(contains(refusal("1, 3", 2), "node 1 of set MINE")) << "the front plane's edge only";
  EXPECT_TRUE(contains(refusal("1, 2, 3, 4", 2), "no extent along z")) << "a face in the plane";
  EXPECT_EQ(refusal("1, 2, 3, 4", 3), "");
  EXPECT_TRUE(contains(refusal("1, 3, 59, 61, 58", 2), "node 58"));
}

TEST(Interface, triangles_and_quadrilaterals_become_triangles) {
  const Deck deck = parse_deck("*NODE, NSET=ALL\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,1,0,1\n"
                               "6,0,1,1\n7,0,0,2\n*ELEMENT, TYPE=C3D6\n1,1,2,3,4,5,6\n"
                               "*ELEMENT, TYPE=C3D4\n2,4,5,6,7\n*STEP\n*DYNAMIC\n*END STEP\n",
                               "house.inp");
  const Interface surface = interface_of(deck, "ALL", 3);
  EXPECT_EQ(surface.mesh.nodes_per_face, 3);
  EXPECT_EQ(surface.mesh.n_faces(), 1u + 3 * 2 + 3) << "not the one between the two elements";
  EXPECT_NO_THROW(check_mesh(surface.mesh, "solid"));
}

} // namespace
} // namespace sluice::calculix
