// SPDX-License-Identifier: MIT
// The table [solid] of a case file: a rectangle or box clamped along one side.
#pragma once

#include "bridge/base/config.hpp"

#include <string>

namespace sluice::solid {

struct SolidParams {
  std::string program = "sluice-solid";
  int dimension = 2;
  Vec<2> corner{0, 0};     ///< [m] lower left corner
  double width = 0;        ///< [m] along x
  double height = 0;       ///< [m] along y
  double depth = 0;        ///< [m] along z; 0: one cell as deep as it is wide
  int elements_across = 1; ///< along x
  int elements_along = 1;  ///< along y
  int elements_deep = 1;   ///< along z, dimension 3
  std::string clamped_side = "upper";
  std::string element = "incompatible-modes";
  std::string material = "neo-hookean";
  double density = 0;             ///< [kg/m^3]
  double youngs_modulus = 0;      ///< [Pa]
  double poisson_ratio = 0;       ///< [1]
  double spectral_radius = 0.8;   ///< of generalised-alpha at infinite frequency
  double newton_tolerance = 1e-9; ///< residual relative to the largest force
  int newton_max_iterations = 25;

  template <class Reader> void describe(Reader &read) {
    read("program", program, "which program plays the solid")
        .check(program == "sluice-solid", "asks for another program than this, sluice-solid");
    describe_geometry(read);
    read("element", element, "incompatible-modes, q1 (locks) or q2")
        .one_of({"incompatible-modes", "q1", "q2"});
    read("material", material, "hyperelastic law").one_of({"neo-hookean", "st-venant-kirchhoff"});
    read.required("density_kg_m3", density, "mass per reference volume").positive();
    read.required("youngs_modulus_pa", youngs_modulus, "of small strains").positive();
    read.required("poisson_ratio", poisson_ratio, "of small strains")
        .check(poisson_ratio > -1 && poisson_ratio < 0.5, "must lie between -1 and 0.5");
    read("spectral_radius", spectral_radius, "of generalised-alpha at infinite frequency")
        .at_least(0)
        .at_most(1);
    read("newton_tolerance", newton_tolerance, "residual relative to the largest force")
        .positive()
        .at_most(1e-2);
    read("newton_max_iterations", newton_max_iterations, "before a step is given up").at_least(1);
  }

  /// Depth that is used: a key of 0 stands for one cell as deep as it is wide [m].
  double used_depth() const { return depth > 0 ? depth : width / elements_across * elements_deep; }

private:
  template <class Reader> void describe_geometry(Reader &read) {
    read("dimension", dimension, "2: plane strain; 3: hexahedra between two symmetry planes")
        .check(dimension == 2 || dimension == 3, "must be 2 or 3");
    read.required("corner_m", corner, "lower left corner");
    read.required("width_m", width, "extent along x").positive();
    read.required("height_m", height, "extent along y").positive();
    read("depth_m", depth, "extent along z, dimension 3; 0: as deep as a cell is wide").at_least(0);
    read.required("elements_across", elements_across, "cells along x").at_least(1);
    read.required("elements_along", elements_along, "cells along y").at_least(1);
    read("elements_deep", elements_deep, "cells along z, dimension 3").at_least(1);
    read("clamped_side", clamped_side, "the side held fixed")
        .one_of({"left", "right", "lower", "upper"});
  }
};

} // namespace sluice::solid
