// SPDX-License-Identifier: MIT
// The table [solid] of a case file with program = "sluice-calculix": a model of the user's own, or
// a rectangle or box clamped along one side with the keys that sluice-solid has for it.
#pragma once

#include "bridge/base/config.hpp"

#include <string>

namespace sluice::calculix {

struct BoxParams {
  Vec<2> corner{0, 0};     ///< [m] lower left corner
  double width = 0;        ///< [m] along x
  double height = 0;       ///< [m] along y
  double depth = 0;        ///< [m] along z; 0: one cell as deep as it is wide
  int elements_across = 1; ///< along x
  int elements_along = 1;  ///< along y
  int elements_deep = 1;   ///< along z
  std::string clamped_side = "upper";
  std::string element = "incompatible-modes";
  std::string material = "st-venant-kirchhoff";
  double density = 0;           ///< [kg/m^3]
  double youngs_modulus = 0;    ///< [Pa]
  double poisson_ratio = 0;     ///< [1]
  double spectral_radius = 0.8; ///< of the HHT method at infinite frequency

  template <class Reader> void describe(Reader &read) {
    read.required("corner_m", corner, "lower left corner");
    read.required("width_m", width, "extent along x").positive();
    read.required("height_m", height, "extent along y").positive();
    read("depth_m", depth, "extent along z; 0: as deep as a cell is wide").at_least(0);
    read.required("elements_across", elements_across, "cells along x").at_least(1);
    read.required("elements_along", elements_along, "cells along y").at_least(1);
    read("elements_deep", elements_deep, "cells along z").at_least(1);
    read("clamped_side", clamped_side, "the side held fixed")
        .one_of({"left", "right", "lower", "upper"});
    read("element", element, "incompatible-modes (C3D8I) or q1 (C3D8, locks)")
        .one_of({"incompatible-modes", "q1"});
    read("material", material, "the law of *ELASTIC at finite strain")
        .check(material == "st-venant-kirchhoff",
               "is no law of the box: ccx's *ELASTIC at finite strain is st-venant-kirchhoff; give "
               "other laws in a model of your own (solid.input)");
    read.required("density_kg_m3", density, "mass per reference volume").positive();
    read.required("youngs_modulus_pa", youngs_modulus, "of small strains").positive();
    read.required("poisson_ratio", poisson_ratio, "of small strains")
        .check(poisson_ratio > -1 && poisson_ratio < 0.5, "must lie between -1 and 0.5");
    read("spectral_radius", spectral_radius, "of the HHT method at infinite frequency")
        .at_least(0.5)
        .at_most(1);
  }

  /// Depth that is used: a key of 0 stands for cells as deep as they are wide [m].
  double used_depth() const { return depth > 0 ? depth : width / elements_across * elements_deep; }
};

struct CalculixParams {
  std::string program;
  std::string ccx = "ccx";
  int threads = 1;
  int dimension = 2;
  std::string input;         ///< .inp, relative to the case file; "": the box
  std::string interface_set; ///< with `input`
  std::string probe_set;     ///< with `input`; "": no tip.csv
  BoxParams box;             ///< without `input`

  template <class Reader> void describe(Reader &read) {
    read.required("program", program, "which program plays the solid")
        .check(program == "sluice-calculix", "asks for another program than this, sluice-calculix");
    read("ccx", ccx, "CalculiX: a name on PATH, or a path");
    read("threads", threads, "of ccx; more than one pays from some ten thousand unknowns on")
        .at_least(1);
    read("dimension", dimension, "2: a slab along z in a plane case; 3")
        .check(dimension == 2 || dimension == 3, "must be 2 or 3");
    read("input", input, "the model (.inp), relative to the case file; none: the box");
    if (input.empty())
      return box.describe(read);
    read.required("interface_set", interface_set, "node set of the wetted surface");
    read("probe_set", probe_set, "node set whose mean motion is written to tip.csv");
  }
};

} // namespace sluice::calculix
