// SPDX-License-Identifier: MIT
// Sums the elements: internal force, condensed tangent and mass on the free unknowns.
//
// Fixed components (zero, or held at the value given in the displacement) are left out of the
// matrices by numbering only the free ones. Work arrays and the place of every element entry in the
// sparse matrix are made once.
//
// On several ranks the matrices are those of the cells here; sums, norms and forces are the body's.
#pragma once

#include "solid-dealii/discretisation.hpp"
#include "solid-dealii/linear_solver.hpp"

#include <Eigen/Sparse>

#include <vector>

namespace sluice::solid {

using SparseMatrix = Eigen::SparseMatrix<double>;

template <int dim> class Assembly {
public:
  /// `fixed` has one entry per displacement component. `density` [kg/m^3].
  Assembly(const Discretisation<dim> &discretisation, Material material, double density,
           const std::vector<bool> &fixed);

  int n_free() const { return n_free_; }
  /// Free unknowns of the body on all ranks.
  long n_free_of_all() const { return static_cast<long>(unknowns_.count(n_free_)); }
  /// The entries of a vector over all components that belong to free ones, and back.
  Eigen::VectorXd restrict_to_free(const Eigen::VectorXd &all) const;
  void add_to_free(Eigen::VectorXd &all, double factor, const Eigen::VectorXd &free) const;

  /// Euclidean norm of the free entries of a vector over all components.
  double norm_of_free(const Eigen::VectorXd &all) const {
    return unknowns_.norm(restrict_to_free(all));
  }

  /// Translations and small rotations of the whole body.
  RigidMotions rigid_motions() const;

  /// Consistent mass [kg] of the free unknowns; same sparsity as the tangent.
  const SparseMatrix &mass() const { return mass_; }
  /// Consistent mass applied to a vector over all components, fixed ones included.
  Eigen::VectorXd mass_times(const Eigen::VectorXd &all) const;

  /// Linearises the internal force at (displacement, modes). Returns the smallest det F; when that
  /// is not positive the sweep stops and the results below are not valid.
  double linearise(const Eigen::VectorXd &displacement, const Eigen::VectorXd &modes,
                   const Overstress<dim> &overstress = {});
  const SparseMatrix &tangent() const { return tangent_; } ///< [N/m], modes condensed
  const Eigen::VectorXd &condensed_force() const {
    return condensed_force_;
  } ///< [N], all components
  /// Euclidean norm of the forces on the modes [N]; zero in equilibrium.
  double mode_residual() const { return mode_residual_; }
  /// Change of the modes that belongs to a change of all displacement components, by the last
  /// linearisation.
  Eigen::VectorXd mode_increment(const Eigen::VectorXd &displacement_increment) const;

  /// Internal force [N] on all components at given modes, nothing condensed. Needs det F > 0.
  Eigen::VectorXd internal_force(const Eigen::VectorXd &displacement, const Eigen::VectorXd &modes,
                                 const Overstress<dim> &overstress = {}) const;
  /// Second Piola-Kirchhoff stress [Pa] at every point of what relaxes (relaxing_stress).
  Eigen::VectorXd relaxing_stresses(const Eigen::VectorXd &displacement,
                                    const Eigen::VectorXd &modes) const;
  /// Smallest det F over all points.
  double smallest_det(const Eigen::VectorXd &displacement, const Eigen::VectorXd &modes) const;
  /// Strain energy of every cell [J] (2-D: per metre of depth).
  Eigen::VectorXd energy_of_cells(const Eigen::VectorXd &displacement,
                                  const Eigen::VectorXd &modes) const;
  /// [J]
  double strain_energy(const Eigen::VectorXd &displacement, const Eigen::VectorXd &modes) const;
  /// Mean Cauchy stress [Pa] of every cell with its out-of-plane part: xx yy zz xy (xz yz), one
  /// column per cell.
  Eigen::MatrixXd mean_stress(const Eigen::VectorXd &displacement,
                              const Eigen::VectorXd &modes) const;
  /// Force [N] that round-off alone makes where a stiffness k and c times the mass act on
  /// `displacement`: below it no residual means anything.
  double round_off_force(double k, double c, const Eigen::VectorXd &displacement) const;

  const Discretisation<dim> &discretisation() const { return discretisation_; }
  const Material &material() const { return material_; }

private:
  void number_unknowns(const std::vector<bool> &fixed);
  void build_pattern();
  void build_mass(double density);
  void clear();
  template <int nodes, int modes>
  double sweep(const Eigen::VectorXd &displacement, const Eigen::VectorXd &modes_in,
               const Overstress<dim> &overstress);
  template <class Action>
  void for_each_volume_field(const Eigen::VectorXd &displacement, Action &&action) const;
  template <int nodes, int modes> void scatter(int cell, const Condensed<dim, nodes, modes> &c);

  const Discretisation<dim> &discretisation_;
  Material material_;
  int n_free_ = 0;
  std::vector<int> unknown_of_; // free unknown of a component, -1 where fixed
  SharedEntries unknowns_;
  std::vector<int> place_;        // of an element entry in the matrix values, -1 where fixed
  std::vector<double> cell_mass_; // [cell][node][node], one component
  SparseMatrix mass_, tangent_;
  Eigen::VectorXd condensed_force_;
  std::vector<double> recovery_; // per cell, see Condensed
  double mode_residual_ = 0;
  double stiffest_ = 0; // [N/m] largest diagonal entry of an element before condensation
  double stiffest_at_rest_ = 0;
};

} // namespace sluice::solid
