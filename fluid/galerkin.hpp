// SPDX-License-Identifier: MIT
// The matrices of one coarsening step: smoothed prolongation P = (I - weight A) P0 with P0
// piecewise constant over aggregates, restriction R = P^T, and the coarse matrix R A P. Source: P.
// Vanek, J. Mandel, M. Brezina, Computing 56 (1996) 179.
//
// Since aggregates are cells, a row of P is stored as a small dense window of cells around its own
// (3 per direction), a row of A P as one of 5 and a row of R A P as one of 7. Sums over windows
// need no look-up of columns, which makes the product ten times as fast as one of general sparse
// matrices. Entries that couple cells which are not next to each other are added to the diagonal.
#pragma once

#include "fluid/aggregates.hpp"
#include "fluid/sparse_matrix.hpp"

#include <vector>

namespace sluice::fluid {

/// A matrix in slices, single precision.
struct SlicedFloats {
  SlicedPattern pattern;
  std::vector<float> value;
};

/// The prolongation P and with it the restriction P^T. Each row of P is a window of weights on the
/// 3^dim cells around the row's own, first direction fastest, filled up with zeros to `width`; they
/// are stored in the order of `member`, in which they are read.
struct Transfer {
  int width = 0;                         ///< 16 (plane) or 32
  std::vector<float> weight;             ///< [members, width]
  std::vector<int> neighbour;            ///< [aggregates, width] aggregate of each cell or -1
  std::vector<int> member_start, member; ///< rows of each aggregate
  std::vector<float> partial;            ///< [aggregates, width] P^T r by the rows of one aggregate
  std::vector<int> source;               ///< [aggregates, width] its share in others' partial or -1

  int aggregates() const { return static_cast<int>(member_start.size()) - 1; }
  /// x += P coarse
  void prolong(const std::vector<float> &coarse, std::vector<float> &x) const;
  /// coarse = diag(scale) P^T r
  void restrict(const std::vector<float> &r, const std::vector<float> &scale,
                std::vector<float> &coarse);
};

/// What one step of coarsening results in.
struct CoarseLevel {
  Transfer transfer;
  SlicedFloats off_diagonal; ///< of R A P divided by its diagonal
  std::vector<float> scale;  ///< 1 / diagonal of R A P; 0 for rows left out: enclosed pieces (the
                             ///< diagonal vanishes) and cancelled aggregates
  std::size_t entries = 0;   ///< of R A P
};

struct CoarseningParams {
  float prolongation_weight = 0.8f;
  float drop_tolerance = 0.01f; ///< smaller parts of the diagonal are added to it, keeping row sums
};

/// Builds coarse levels; keeps its memory between calls.
class GalerkinProduct {
public:
  /// `dim` 2 or 3: cells differ in the first `dim` coordinates only.
  void build(int dim, const UnitDiagonalView &matrix, const Aggregates &aggregates,
             const AggregateFinder &finder, const CoarseningParams &params, CoarseLevel &result);

private:
  template <int dim> class Windows;

  // Entries of one block of coarse rows, built by one thread.
  struct Block {
    std::vector<int> column, length;
    std::vector<float> value;
  };

  std::vector<std::int8_t>
      shift_;                  // [stored entries] between the cells of row and column, or a code
  std::vector<float> p_, a_p_; // [rows] windows
  std::array<Block, Blocks::max_count> block_;
  std::vector<int> row_start_; // of the coarse rows within their blocks
};

} // namespace sluice::fluid
