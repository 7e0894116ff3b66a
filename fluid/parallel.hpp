// SPDX-License-Identifier: MIT
// Threads, and nothing else about threads anywhere else: the only file with OpenMP in it. Index
// ranges are cut into blocks that depend on the length alone, never on the number of threads, and
// partial sums are added in the order of the blocks, so one thread and two give the same bits.
#pragma once

#include <algorithm>
#include <array>

#ifdef _OPENMP
#include <omp.h>
#endif

namespace sluice::fluid {

/// The half-open range of indices [begin, end).
struct IndexRange {
  int begin = 0, end = 0;
  int size() const { return end - begin; }
};

/// A range cut into at most `max_count` blocks of equal length, each a multiple of `granularity`
/// indices, so that a block boundary never divides a vector register.
class Blocks {
public:
  static constexpr int max_count = 64, granularity = 16, smallest = 64;

  explicit Blocks(int n) : n_(n), length_(std::max(smallest, rounded_up(n / max_count + 1))) {}
  int count() const { return (n_ + length_ - 1) / length_; }
  IndexRange operator[](int b) const { return {b * length_, std::min(n_, (b + 1) * length_)}; }
  /// The block that holds index i.
  int of(int i) const { return i / length_; }

private:
  static int rounded_up(int n) { return (n + granularity - 1) / granularity * granularity; }
  int n_, length_;
};

/// Number of threads that the calling thread's loops use from here on.
inline void set_number_of_threads([[maybe_unused]] int n) {
#ifdef _OPENMP
  omp_set_num_threads(n);
#endif
}

inline int number_of_threads() {
#ifdef _OPENMP
  return omp_get_max_threads();
#else
  return 1;
#endif
}

/// Calls body(b) for b in [0, n), each b once, in parallel if `worthwhile`.
template <class Body> void for_each_task(int n, bool worthwhile, Body &&body) {
#ifdef _OPENMP
#pragma omp parallel for schedule(static) if (worthwhile)
#endif
  for (int b = 0; b < n; ++b)
    body(b);
  (void)worthwhile;
}

/// How much a loop does per index: some nanoseconds, or some hundred. A loop runs on one thread if
/// waking another would take longer than the work, and far longer where cores are shared.
enum class Work { light, heavy };

inline bool is_worth_threads(int n, Work work) { return n > (work == Work::light ? 8192 : 1024); }

/// Calls body(range, b) for each block of [0, n).
template <class Body> void for_each_block(int n, Body &&body, Work work = Work::heavy) {
  const Blocks blocks(n);
  for_each_task(blocks.count(), is_worth_threads(n, work), [&](int b) { body(blocks[b], b); });
}

/// Calls body(i) for i in [0, n), in any order and in parallel; body writes only what belongs to i.
template <class Body> void for_each_index(int n, Body &&body, Work work = Work::heavy) {
  for_each_block(
      n,
      [&](IndexRange range, int) {
        for (int i = range.begin; i < range.end; ++i)
          body(i);
      },
      work);
}

/// for_each_index under the name that the physics uses: once per point of the fluid.
template <class Body> void for_each_point(int n, Body &&body) { for_each_index(n, body); }

/// `K` sums over [0, n) at once: body(range) returns the sums over one block. Same bits for any
/// number of threads.
template <int K, class Body>
std::array<double, K> block_sums(int n, Body &&body, Work work = Work::light) {
  std::array<std::array<double, K>, Blocks::max_count> partial;
  for_each_block(
      n, [&](IndexRange range, int b) { partial[b] = body(range); }, work);
  std::array<double, K> total{};
  for (int b = 0; b < Blocks(n).count(); ++b)
    for (int k = 0; k < K; ++k)
      total[k] += partial[b][k];
  return total;
}

/// Sum of term(i) over i in [0, n); same bits for any number of threads.
template <class Term> double sum(int n, Term &&term, Work work = Work::light) {
  return block_sums<1>(
      n,
      [&](IndexRange range) {
        double part = 0;
        for (int i = range.begin; i < range.end; ++i)
          part += term(i);
        return std::array<double, 1>{part};
      },
      work)[0];
}

} // namespace sluice::fluid
