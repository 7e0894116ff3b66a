// SPDX-License-Identifier: MIT
// Multigrid preconditioner by smoothed aggregation over grid cells (see galerkin.hpp): V-cycle with
// one damped Jacobi step before and after the coarse correction, single precision throughout.
// Jacobi and not Gauss-Seidel: its steps are products that vectorise and do not depend on the
// threads.
#pragma once

#include "fluid/bicgstab.hpp"
#include "fluid/compact_matrix.hpp"
#include "fluid/galerkin.hpp"

namespace sluice::fluid {

class Multigrid : public Preconditioner {
public:
  struct Params {
    double smoothing_weight = 0.85;   ///< of the Jacobi steps
    double prolongation_weight = 0.8; ///< of the Jacobi step that smooths the prolongation
    double drop_tolerance = 0.01;     ///< coarse entries below this part of the diagonal are lumped
    int coarsening = 3;               ///< cells per direction that make a cell of the next level
    int coarsest_size = 64;           ///< unknowns that are solved directly

    template <class Reader> void describe(Reader &read) {
      read("smoothing_weight", smoothing_weight, "weight of the Jacobi steps");
      read("prolongation_weight", prolongation_weight, "weight of the prolongation's Jacobi step");
      read("drop_tolerance", drop_tolerance,
           "coarse entries lumped below this part of the diagonal");
      read("coarsening", coarsening, "cells per direction that make a cell of the next level");
      read("coarsest_size", coarsest_size, "unknowns that are solved directly");
    }
  };

  Multigrid() = default;
  explicit Multigrid(const Params &params) : params_(params) {}

  /// The whole hierarchy. `cells[i]` is the grid cell of point i; cells a little smaller than the
  /// radius of the stencils are best (2 spacings for a radius of 2.1). Keeps a reference to
  /// `matrix`.
  void build(const ScaledMatrix &matrix, std::span<const Cell> cells);
  /// After the matrix has changed a little, rows still standing for the same points: coarse levels
  /// are kept, the finest one is the new matrix. Iterations stay the same until points have moved
  /// by about a tenth of a spacing against each other.
  void update(const ScaledMatrix &matrix);
  /// One V-cycle from zero.
  void apply(std::span<const double> r, std::span<float> z) override;

  int levels() const { return n_levels_; }
  int rows(int level) const { return level_[level].rows; }
  /// Entries of all levels over those of the finest.
  double operator_complexity() const;
  /// Transfers from `level` and the matrix of the next, for tests.
  const CoarseLevel &coarsening(int level) const { return level_[level].coarser; }

private:
  struct Level {
    int rows = 0;
    std::vector<Cell> cell;              // [rows]
    std::vector<float> off_diagonal_sum; // [rows] of magnitudes
    std::vector<float> weight;           // [rows] of the Jacobi step, 1 for isolated rows
    std::vector<float> b, x, r;
    CompactMatrix compact;
    bool is_compact = false;
    CoarseLevel coarser;
  };

  UnitDiagonalView view(int level) const;
  void start_level(int level);
  void coarsen(int level);
  void invert_coarsest();
  void shift_constants(int n);
  void eliminate(int pivot, int n);
  void cycle(int level, std::span<float> x);
  template <class Body>
  void for_each_product(int level, const std::vector<float> &x, Body &&body) const;
  void solve_coarsest(std::span<float> x) const;
  void restrict_residual(int level);
  void smooth(int level, std::span<float> x) const;

  Params params_;
  const ScaledMatrix *matrix_ = nullptr;
  int dim_ = 2;
  std::vector<Level> level_;
  int n_levels_ = 0;
  std::vector<float> inverse_; // [n, n] of the coarsest level; empty if it is not solved directly
  std::vector<double> work_;
  AggregateFinder finder_;
  Aggregates aggregates_;
  GalerkinProduct product_;
};

} // namespace sluice::fluid
