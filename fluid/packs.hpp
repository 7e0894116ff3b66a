// SPDX-License-Identifier: MIT
// Eight points at a time: numbers of neighbouring points side by side in a vector register, for
// kernels that do the same to every point. GCC 12 does not vectorise gathers and roots of such
// numbers by itself, hence an AVX-512 twin of those; both compute the same.
#pragma once

#include "bridge/base/vec.hpp"
#include "fluid/lanes.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace sluice::fluid {

inline constexpr int pack_size = 8;

/// One number of each of eight points.
using Pack = double __attribute__((vector_size(64)));
/// All bits of a lane set where something holds.
using PackMask = std::int64_t __attribute__((vector_size(64)));
template <int dim> using PackVec = std::array<Pack, dim>;

inline Pack load(const double *x) {
  Pack v;
  std::memcpy(&v, x, sizeof v);
  return v;
}
inline void store(const Pack &v, double *x) { std::memcpy(x, &v, sizeof v); }

/// One bit per lane.
inline unsigned bits_of(const PackMask &mask) {
#ifdef __AVX512DQ__
  return _mm512_movepi64_mask((__m512i)mask);
#else
  unsigned bits = 0;
  for (int l = 0; l < pack_size; ++l)
    bits |= static_cast<unsigned>(mask[l] != 0) << l;
  return bits;
#endif
}

inline Pack square_root(const Pack &x) {
#ifdef __AVX512F__
  return _mm512_maskz_sqrt_pd(0xff, x);
#else
  Pack root;
  for (int l = 0; l < pack_size; ++l)
    root[l] = std::sqrt(x[l]);
  return root;
#endif
}
inline double square_root(double x) { return std::sqrt(x); }

#ifdef __AVX512F__
inline Pack gathered_by(const __m256i &index, const double *x) {
  return _mm512_mask_i32gather_pd(_mm512_setzero_pd(), 0xff, index, x, 8);
}
#endif

/// lane l: x[index[l]].
inline Pack gathered(const int *index, const double *x) {
#ifdef __AVX512F__
  return gathered_by(_mm256_loadu_si256(reinterpret_cast<const __m256i *>(index)), x);
#else
  Pack v;
  for (int l = 0; l < pack_size; ++l)
    v[l] = x[index[l]];
  return v;
#endif
}

/// Lane l of number c: entry c, in the order of storage, of the small matrix x[index[l]].
template <class Matrix>
std::array<Pack, Matrix::SizeAtCompileTime> gathered(const int *index, const Matrix *x) {
  constexpr int size = Matrix::SizeAtCompileTime;
  static_assert(sizeof(Matrix) == size * sizeof(double));
  std::array<Pack, size> v;
#ifdef __AVX512F__
  const __m256i at = _mm256_loadu_si256(reinterpret_cast<const __m256i *>(index));
  const __m256i first = _mm256_mullo_epi32(at, _mm256_set1_epi32(size));
  for (int c = 0; c < size; ++c)
    v[c] = gathered_by(first, x->data() + c);
#else
  for (int l = 0; l < pack_size; ++l)
    for (int c = 0; c < size; ++c)
      v[c][l] = x[index[l]].data()[c];
#endif
  return v;
}

/// The first `count` lanes into x[0], x[1], ...
inline void scatter(const Pack &v, int count, double *x) {
  for (int l = 0; l < count; ++l)
    x[l] = v[l];
}
template <class Matrix>
void scatter(const std::array<Pack, Matrix::SizeAtCompileTime> &v, int count, Matrix *x) {
  alignas(64) double lanes[Matrix::SizeAtCompileTime][pack_size];
  std::memcpy(lanes, v.data(), sizeof lanes);
  for (int l = 0; l < count; ++l)
    for (int c = 0; c < Matrix::SizeAtCompileTime; ++c)
      x[l].data()[c] = lanes[c][l];
}

/// Writes first + l for the lanes l whose bit is set, up to eight numbers in all; returns how many
/// of them count.
inline int append_lanes(unsigned lanes, int first, int *list) {
#ifdef __AVX512VL__
  const __m256i number =
      _mm256_add_epi32(_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7), _mm256_set1_epi32(first));
  _mm256_storeu_si256(reinterpret_cast<__m256i *>(list),
                      _mm256_maskz_compress_epi32(static_cast<__mmask8>(lanes), number));
  return std::popcount(lanes);
#else
  int count = 0;
  for (int l = 0; l < pack_size; ++l) {
    list[count] = first + l;
    count += lanes >> l & 1;
  }
  return count;
#endif
}

/// Where flag[index[l]] == value; flags are 32 bits wide.
template <class Flag> PackMask gathered_equal(const int *index, const Flag *flag, Flag value) {
  static_assert(sizeof(Flag) == 4);
#ifdef __AVX512F__
  const __m256i at = _mm256_loadu_si256(reinterpret_cast<const __m256i *>(index));
  const __m256i v = _mm256_mask_i32gather_epi32(
      _mm256_setzero_si256(), reinterpret_cast<const int *>(flag), at, _mm256_set1_epi32(-1), 4);
  const __m256i equal = _mm256_cmpeq_epi32(v, _mm256_set1_epi32(static_cast<int>(value)));
  return (PackMask)_mm512_cvtepi32_epi64(equal);
#else
  PackMask mask;
  for (int l = 0; l < pack_size; ++l)
    mask[l] = flag[index[l]] == value ? -1 : 0;
  return mask;
#endif
}

} // namespace sluice::fluid
