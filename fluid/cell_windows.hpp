// SPDX-License-Identifier: MIT
// Dense windows of grid cells around a given one, in which the Galerkin product adds up its rows:
// 3 cells per direction for P, 5 for A P, 7 for R A P. Cells next to a given one are numbered by
// `shift`, 0 .. 3^dim - 1, the first direction fastest.
//
// Windows of P and A P are both laid out with rows of 5 cells, 32 places to the plane, so that
// moving the first into the second is adding an offset. Places that are not used hold zero: those
// behind one window are also those in front of the next, so that a window can be read moved.
#pragma once

#include "fluid/aggregates.hpp"
#include "fluid/lanes.hpp"

namespace sluice::fluid {

template <int dim> struct CellWindows {
  static constexpr int lanes = 16;
  static constexpr int shifts = dim == 2 ? 9 : 27;
  static constexpr int centre = shifts / 2;
  static constexpr int planes = dim == 2 ? 1 : 5;        // of a window of A P
  static constexpr int plane = 32, coarse_plane = 64;    // places: 25 and 49 used
  static constexpr int size = planes * plane;            // of a window of P or A P
  static constexpr int coarse_planes = dim == 2 ? 1 : 7; // of a window of R A P
  static constexpr int coarse_size = coarse_planes * coarse_plane;
  static constexpr int coarse_centre = coarse_planes / 2 * coarse_plane + 24;
  static constexpr int width = dim == 2 ? 16 : 32; // of the 3^dim weights kept for the transfers

  // In place of a shift: a column in no aggregate, and one whose cell is not next to the row's, for
  // which the row's own is taken.
  static constexpr std::int8_t nowhere = shifts, elsewhere = centre;

  using Window = std::array<Floats, size / lanes>;
  using CoarseWindow = std::array<Floats, coarse_size / lanes>;

  template <class W> static float at(const W &window, int w) {
    return window[w / lanes][w % lanes];
  }
  template <class W> static void put(W &window, int w, float value) {
    window[w / lanes][w % lanes] = value;
  }

  /// Place of the cell `shift` in a window of P, and what a window of P moves by to stand around
  /// that cell in a window of A P.
  static int offset(int shift) { return offset_of_shift[shift]; }

  /// The step from the middle cell to the cell `shift`.
  static constexpr Cell step_of_shift(int shift) {
    return {shift % 3 - 1, shift / 3 % 3 - 1, dim == 3 ? shift / 9 - 1 : 0};
  }

  /// The step from the middle of a window of R A P to a place that is used.
  static Cell step_of_coarse_place(int place) {
    const int in_plane = place % coarse_plane;
    return {in_plane % 7 - 3, in_plane / 7 - 3, place / coarse_plane - coarse_planes / 2};
  }

  /// Adds the window of A P of the cell `shift` to a window of R A P.
  static void add_moved(const Window &window, int shift, CoarseWindow &total) {
    for (int z = 0; z < planes; ++z)
      for (int part = 0; part < coarse_plane / lanes; ++part)
        total[(shift / 9 + z) * (coarse_plane / lanes) + part] +=
            picked(&source[shift % 9][part * lanes], window[2 * z], window[2 * z + 1]);
  }

  /// Shifts from the cells of sixteen rows to those of sixteen columns.
  static Ints shifts_between(const Ints &from, const Ints &to) {
    const Ints x = (to - from + 1) & 1023;
    const Ints y = ((to >> 10) - (from >> 10) + 1) & 1023;
    const Ints z = dim == 3 ? ((to >> 20) - (from >> 20) + 1) & 1023 : Ints{};
    const Ints shift = (x <= 2) & (y <= 2) & (z <= 2) ? x + 3 * y + 9 * z : Ints{} + elsewhere;
    return (to & no_cell) != 0 ? Ints{} + nowhere : shift;
  }

private:
  static constexpr auto offsets() {
    std::array<int, shifts> at{};
    for (int s = 0; s < shifts; ++s)
      at[s] = s % 3 + 5 * (s / 3 % 3) + plane * (s / 9);
    return at;
  }
  static constexpr auto offset_of_shift = offsets();

  // By shift within a plane and place of R A P: the place of A P that lands there, or one of zero.
  static constexpr auto sources() {
    std::array<std::array<int, coarse_plane>, 9> from{};
    for (int s = 0; s < 9; ++s)
      for (int w = 0; w < coarse_plane; ++w) {
        const int x = w % 7 - s % 3, y = w / 7 - s / 3;
        from[s][w] = x >= 0 && x < 5 && y >= 0 && y < 5 ? x + 5 * y : plane - 1;
      }
    return from;
  }
  static constexpr auto source = sources();
};

} // namespace sluice::fluid
