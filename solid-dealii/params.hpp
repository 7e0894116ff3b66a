// SPDX-License-Identifier: MIT
// The table [solid] of a case file, and its arrays [[solid.boundary]] and [[solid.probe]].
#pragma once

#include "bridge/base/config.hpp"
#include "solid-dealii/material.hpp"
#include "solid-dealii/viscosity.hpp"

#include <string>

namespace sluice::solid {

/// What holds or loads a named part of the boundary: one [[solid.boundary]].
struct BoundaryParams {
  std::string name;             ///< of the mesh, or a side of the box
  std::string kind = "free";    ///< clamped, symmetry, wetted or free
  std::vector<double> traction; ///< [Pa] per reference area, dead

  template <class Reader> void describe(Reader &read) {
    read.required("name", name, "named boundary of the mesh, or a side of the box");
    read("kind", kind, "clamped (all components), symmetry (normal one), wetted (interface), free")
        .one_of({"clamped", "symmetry", "wetted", "free"});
    read("traction_pa", traction, "force per reference area, without a partner");
  }
};

/// A material point whose motion is recorded: one [[solid.probe]].
struct ProbeParams {
  std::string name;
  std::vector<double> position; ///< [m] in the reference configuration

  template <class Reader> void describe(Reader &read) {
    read.required("name", name, "heads the columns of probes.csv");
    read.required("position_m", position, "reference position; the nearest node is taken");
  }
};

struct SolidParams {
  std::string program = "sluice-solid";
  int dimension = 2;
  std::string mesh;        ///< file, relative to the case file; empty: the box below
  Vec<2> corner{0, 0};     ///< [m] lower left corner
  double width = 0;        ///< [m] along x
  double height = 0;       ///< [m] along y
  double depth = 0;        ///< [m] along z; 0: one cell as deep as it is wide
  int elements_across = 1; ///< along x
  int elements_along = 1;  ///< along y
  int elements_deep = 1;   ///< along z, dimension 3
  std::string clamped_side = "upper";
  std::vector<BoundaryParams>
      boundaries; ///< none: clamped_side, all other sides in the plane wetted
  std::vector<ProbeParams> probes;
  std::string interface = "own"; ///< dimension of what the partner sees: "own" or "plane"
  std::string element = "automatic";
  std::string material = "neo-hookean";
  std::string plane = "strain";
  double density = 0;                        ///< [kg/m^3]
  std::vector<double> gravity;               ///< [m/s^2]
  double youngs_modulus = 0;                 ///< [Pa]
  double poisson_ratio = 0;                  ///< [1]
  double c10 = 0, c01 = 0, c20 = 0, c30 = 0; ///< [Pa]
  std::vector<double> ogden_mu;              ///< [Pa]
  std::vector<double> ogden_alpha;           ///< [1]
  Viscosity viscosity;
  double spectral_radius = 0.8;   ///< of generalised-alpha at infinite frequency
  int steps_per_window = 1;       ///< time steps in a coupling window
  int max_step_cuts = 4;          ///< how often a step that fails is halved
  double newton_tolerance = 1e-9; ///< residual relative to the largest force
  int newton_max_iterations = 25;
  double tangent_reuse = 0; ///< see NewtonSettings
  std::string linear_solver = "automatic";

  template <class Reader> void describe(Reader &read) {
    read("program", program, "which program plays the solid")
        .check(program == "sluice-solid", "asks for another program than this, sluice-solid");
    describe_geometry(read);
    read("element", element,
         "automatic (incompatible-modes, or q2-p1 for a split law with nu above 0.49), "
         "incompatible-modes, q1 (locks), q2, q3 or q2-p1")
        .one_of({"automatic", "incompatible-modes", "q1", "q2", "q3", "q2-p1"});
    describe_material(read);
    describe_numerics(read);
  }

  /// Depth that is used: a key of 0 stands for one cell as deep as it is wide [m].
  double used_depth() const { return depth > 0 ? depth : width / elements_across * elements_deep; }
  LawConstants constants() const {
    return {youngs_modulus, poisson_ratio, c10, c01, c20, c30, ogden_mu, ogden_alpha};
  }
  /// The element that is used: the material's choice unless the user made one.
  std::string used_element() const {
    if (element != "automatic")
      return element;
    const bool is_split = material == "neo-hookean-split" || material == "mooney-rivlin" ||
                          material == "yeoh" || material == "ogden";
    return is_split && poisson_ratio > 0.49 && plane == "strain" ? "q2-p1" : "incompatible-modes";
  }

private:
  template <class Reader> void describe_geometry(Reader &read) {
    read("dimension", dimension, "2: plane; 3: hexahedra")
        .check(dimension == 2 || dimension == 3, "must be 2 or 3");
    read("mesh", mesh, "file of quadrilaterals or hexahedra (.msh, .inp, .vtu); none: a box");
    read("interface", interface, "own, or plane: a column of hexahedra meets a plane partner")
        .one_of({"own", "plane"});
    if (!mesh.empty())
      return;
    read.required("corner_m", corner, "lower left corner");
    read.required("width_m", width, "extent along x").positive();
    read.required("height_m", height, "extent along y").positive();
    read("depth_m", depth, "extent along z, dimension 3; 0: as deep as a cell is wide").at_least(0);
    read.required("elements_across", elements_across, "cells along x").at_least(1);
    read.required("elements_along", elements_along, "cells along y").at_least(1);
    read("elements_deep", elements_deep, "cells along z, dimension 3").at_least(1);
    read("clamped_side", clamped_side, "the side held fixed, unless [[solid.boundary]] says more")
        .one_of({"left", "right", "lower", "upper"});
  }

  // Only the constants of the law that is chosen are keys: one of another law is an error.
  template <class Reader> void describe_material(Reader &read) {
    read("material", material, "elastic law")
        .one_of({"linear-elastic", "st-venant-kirchhoff", "neo-hookean", "neo-hookean-split",
                 "mooney-rivlin", "yeoh", "ogden"});
    read("plane", plane, "strain or stress, dimension 2").one_of({"strain", "stress"});
    read.required("density_kg_m3", density, "mass per reference volume").positive();
    read("gravity_m_s2", gravity, "body force per mass; none unless given");
    if (material == "mooney-rivlin" || material == "yeoh") {
      read.required("c10_pa", c10, "of I1 - 3");
      if (material == "mooney-rivlin")
        read("c01_pa", c01, "of I2 - 3");
      else {
        read("c20_pa", c20, "of (I1 - 3)^2");
        read("c30_pa", c30, "of (I1 - 3)^3");
      }
    } else if (material == "ogden") {
      read.required("ogden_mu_pa", ogden_mu, "moduli mu_p; sum of mu_p alpha_p / 2 is mu");
      read.required("ogden_alpha", ogden_alpha, "exponents alpha_p");
    } else
      read.required("youngs_modulus_pa", youngs_modulus, "of small strains").positive();
    read.required("poisson_ratio", poisson_ratio, "of small strains; sets the bulk modulus")
        .check(poisson_ratio > -1 && poisson_ratio < 0.5, "must lie between -1 and 0.5");
    read("mass_damping_per_s", viscosity.mass_rate, "Rayleigh's damping by mass").at_least(0);
    read("stiffness_damping_s", viscosity.stiffness_time,
         "Rayleigh's damping by stiffness, Kelvin-Voigt's relaxation time")
        .at_least(0);
    read("branch_ratio", viscosity.branch_ratio, "stiffness of a Maxwell branch over the law's")
        .at_least(0);
    read("branch_time_s", viscosity.branch_time, "relaxation time of the branch").positive();
  }

  template <class Reader> void describe_numerics(Reader &read) {
    read("spectral_radius", spectral_radius, "of generalised-alpha at infinite frequency")
        .at_least(0)
        .at_most(1);
    read("steps_per_window", steps_per_window, "time steps in a coupling window").at_least(1);
    read("max_step_cuts", max_step_cuts, "how often a step without a solution is halved")
        .at_least(0)
        .at_most(20);
    read("newton_tolerance", newton_tolerance, "residual relative to the largest force")
        .positive()
        .at_most(1e-2);
    read("newton_max_iterations", newton_max_iterations, "before a step is given up").at_least(1);
    read("tangent_reuse", tangent_reuse,
         "a factorised tangent is kept while the residual falls by this factor; 0: never")
        .at_least(0)
        .at_most(0.9);
    read("linear_solver", linear_solver,
         "automatic (by the number of unknowns), direct (UMFPACK) or cg (with algebraic multigrid)")
        .one_of({"automatic", "direct", "cg"});
  }
};

/// Reads [solid] with its boundaries and probes; checks what concerns more than one key.
SolidParams read_params(const Config &config);

} // namespace sluice::solid
