// SPDX-License-Identifier: MIT
#include "bridge/calculix/box_deck.hpp"

#include <fmt/format.h>

#include <array>
#include <iterator>
#include <vector>

namespace sluice::calculix {
namespace {

/// A node's place in the lattice, from 0.
using Place = std::array<int, 3>;

class BoxText {
public:
  explicit BoxText(const BoxParams &box)
      : box_(box), cells_{box.elements_across, box.elements_along, box.elements_deep} {}

  std::string text() {
    add("** box {} m x {} m x {} m of {} x {} x {} elements\n", box_.width, box_.height,
        box_.used_depth(), cells_[0], cells_[1], cells_[2]);
    add_nodes();
    add_elements();
    add_set("CLAMPED", [&](const Place &p) { return p[across()] == clamped_end(); });
    add_set("PLANES", [&](const Place &p) { return p[2] == 0 || p[2] == cells_[2]; });
    add_set(box_interface_set, [&](const Place &p) { return is_wetted(p); });
    add_set(box_probe_set, [&](const Place &p) { return is_at_tip(p); });
    add_material();
    add_step();
    return std::move(text_);
  }

private:
  template <class... Args> void add(fmt::format_string<Args...> format, Args &&...args) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
  }

  template <class Action> void for_each_place(Action &&action) const {
    for (int k = 0; k <= cells_[2]; ++k)
      for (int j = 0; j <= cells_[1]; ++j)
        for (int i = 0; i <= cells_[0]; ++i)
          action(Place{i, j, k});
  }

  int number(const Place &p) const {
    return 1 + p[0] + (cells_[0] + 1) * (p[1] + (cells_[1] + 1) * p[2]);
  }

  void add_nodes() {
    add("*NODE\n");
    for_each_place([&](const Place &p) {
      add("{}, {:.13e}, {:.13e}, {:.13e}\n", number(p),
          box_.corner.x() + box_.width * p[0] / cells_[0],
          box_.corner.y() + box_.height * p[1] / cells_[1], box_.used_depth() * p[2] / cells_[2]);
    });
  }

  void add_elements() {
    add("*ELEMENT, TYPE={}, ELSET=BODY\n", box_.element == "q1" ? "C3D8" : "C3D8I");
    int element = 0;
    for_each_place([&](const Place &p) {
      const auto [i, j, k] = p;
      if (i == cells_[0] || j == cells_[1] || k == cells_[2])
        return;
      add("{}", ++element);
      for (const int z : {k, k + 1})
        for (const auto &[x, y] : {std::pair(i, j), {i + 1, j}, {i + 1, j + 1}, {i, j + 1}})
          add(", {}", number({x, y, z}));
      add("\n");
    });
  }

  template <class Condition> void add_set(const char *name, Condition &&condition) {
    add("*NSET, NSET={}\n", name);
    for_each_place([&](const Place &p) {
      if (condition(p))
        add("{}\n", number(p));
    });
  }

  // The axis across which the clamped side lies, and its end there.
  std::size_t across() const {
    return box_.clamped_side == "left" || box_.clamped_side == "right" ? 0 : 1;
  }
  int clamped_end() const {
    return box_.clamped_side == "left" || box_.clamped_side == "lower" ? 0 : cells_[across()];
  }
  bool is_wetted(const Place &p) const {
    const std::size_t along = 1 - across();
    return p[along] == 0 || p[along] == cells_[along] ||
           p[across()] == cells_[across()] - clamped_end();
  }
  // One place where there is one in the middle, else the two beside it.
  bool is_at_tip(const Place &p) const {
    const std::size_t along = 1 - across();
    return p[across()] == cells_[across()] - clamped_end() &&
           (p[along] == cells_[along] / 2 || p[along] == (cells_[along] + 1) / 2);
  }

  void add_material() {
    add("*MATERIAL, NAME=RUBBER\n*ELASTIC\n{}, {}\n*DENSITY\n{}\n", box_.youngs_modulus,
        box_.poisson_ratio, box_.density);
    add("*SOLID SECTION, ELSET=BODY, MATERIAL=RUBBER\n");
    add("*BOUNDARY\nCLAMPED, 1, 3\nPLANES, 3, 3\n");
  }

  void add_step() {
    const double alpha = (box_.spectral_radius - 1) / (box_.spectral_radius + 1);
    add("*STEP, NLGEOM\n*DYNAMIC, DIRECT, ALPHA={:.12f}\n*END STEP\n", alpha);
  }

  BoxParams box_;
  std::array<int, 3> cells_;
  std::string text_;
};

} // namespace

std::string box_deck(const BoxParams &box) { return BoxText(box).text(); }

} // namespace sluice::calculix
