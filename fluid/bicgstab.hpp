// SPDX-License-Identifier: MIT
// BiCGSTAB for the row-scaled system D^-1 A x = D^-1 b, D = diag(A), preconditioned from the right.
// Source: H. A. van der Vorst, SIAM J. Sci. Stat. Comput. 13 (1992) 631. Vectors of the iteration
// are double; the preconditioner returns float, and since its result enters both the solution and
// the residual, what it rounds away costs no accuracy.
#pragma once

#include "fluid/sparse_matrix.hpp"

#include <span>
#include <vector>

namespace sluice::fluid {

/// An approximate inverse of D^-1 A, D = diag(A).
class Preconditioner {
public:
  virtual ~Preconditioner() = default;
  /// z = approximate solution of D^-1 A z = r. Not const: it works in its own memory.
  virtual void apply(std::span<const double> r, std::span<float> z) = 0;
};

/// What is known about vectors that the matrix maps to zero.
enum class NullSpace {
  none,     ///< the matrix is regular
  constants ///< rows sum to zero everywhere (an enclosed fluid): the solution of zero mean is
            ///< sought
};

struct SolveOptions {
  double relative_tolerance = 1e-6; ///< of the norm of D^-1 b
  double absolute_tolerance = 0;    ///< on the root mean square of D^-1 (b - A x) [unit of x]
  int max_iterations = 200;
  NullSpace null_space = NullSpace::none;
};

struct SolveResult {
  int iterations = 0;     ///< each applies the preconditioner at most twice
  double residual = 0;    ///< root mean square of D^-1 (b - A x) [unit of x], computed from x
  bool converged = false; ///< residual <= max(relative * rms(D^-1 b), absolute)
  /// NullSpace::constants only: lambda of A x + lambda 1 = b, the part of b that no x can match.
  double multiplier = 0;
};

/// Vectors of one solve, kept between solves.
struct KrylovMemory {
  std::vector<double> r, r_shadow, p, v, t;
  std::vector<float> p_hat, r_hat;
  void resize(int n);
};

/// Solves A x = b from the guess in x. On return x is finite if it was on entry; if the result is
/// not converged, x is the last iterate, or the guess where b is not finite.
SolveResult bicgstab(const ScaledMatrix &matrix, std::span<const double> b, std::span<double> x,
                     Preconditioner &preconditioner, const SolveOptions &options,
                     KrylovMemory &memory);

} // namespace sluice::fluid
