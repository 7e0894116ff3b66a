// SPDX-License-Identifier: MIT
// Sixteen numbers at a time: the width of a slice of a matrix and of the multigrid's windows. GCC
// 12 does not vectorise gathers by itself, hence an AVX-512 twin of each loop with an index in it;
// both add in the same order, though fused multiply-add may round differently.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#ifdef __AVX512F__
// GCC 12 takes the undefined lanes inside its own intrinsics for uninitialised variables (bug
// 105593).
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#include <immintrin.h>
#pragma GCC diagnostic pop
#endif

namespace sluice::fluid {

/// Sixteen numbers, one per row of a slice.
template <class Number> using Lanes = std::array<Number, 16>;

/// Sixteen floats to compute with.
using Floats = float __attribute__((vector_size(64)));

/// Sixteen integers to compute with.
using Ints = int __attribute__((vector_size(64)));

inline Floats load(const float *x) {
  Floats v;
  std::memcpy(&v, x, sizeof v);
  return v;
}
/// The lanes as bytes; they must be in [-128, 127].
inline void store_bytes(const Ints &v, std::int8_t *x) {
  using Bytes = std::int8_t __attribute__((vector_size(16)));
  const auto bytes = __builtin_convertvector(v, Bytes);
  std::memcpy(x, &bytes, sizeof bytes);
}
/// The lanes as 16-bit integers, cut off beyond.
inline void store_shorts(const Ints &v, std::int16_t *x) {
  using Shorts = std::int16_t __attribute__((vector_size(32)));
  const auto shorts = __builtin_convertvector(v, Shorts);
  std::memcpy(x, &shorts, sizeof shorts);
}
inline Ints load(const int *x) {
  Ints v;
  std::memcpy(&v, x, sizeof v);
  return v;
}
inline void store(const Floats &v, float *x) { std::memcpy(x, &v, sizeof v); }

/// lane l: sum over k < width of value[16 k + l] * x[column[16 k + l]].
template <class Number, class Value, class X>
Lanes<Number> gathered_sums(const Value *value, const int *column, int width, const X *x) {
  Lanes<Number> total{};
  for (int k = 0; k < width; ++k, value += 16, column += 16)
    for (int lane = 0; lane < 16; ++lane)
      total[lane] += Number(value[lane]) * Number(x[column[lane]]);
  return total;
}

/// lane l: x[index[l]], or zero where the index is negative.
inline Floats gathered(const int *index, const float *x) {
#ifdef __AVX512F__
  const __m512i at = _mm512_loadu_si512(index);
  const __mmask16 is_there = _mm512_cmpge_epi32_mask(at, _mm512_setzero_si512());
  return _mm512_mask_i32gather_ps(_mm512_setzero_ps(), is_there, at, x, 4);
#else
  Floats v;
  for (int l = 0; l < 16; ++l)
    v[l] = index[l] < 0 ? 0 : x[index[l]];
  return v;
#endif
}

/// lane l: x[index[l]].
inline Ints gathered(const int *index, const int *x) {
#ifdef __AVX512F__
  return (Ints)_mm512_i32gather_epi32(_mm512_loadu_si512(index), x, 4);
#else
  Ints v;
  for (int l = 0; l < 16; ++l)
    v[l] = x[index[l]];
  return v;
#endif
}

/// lane l: sum over k < width of value[16 k + l] * x[column[16 k + l]].
inline Floats near_sums(const std::int16_t *value, const std::int16_t *column, int width,
                        const float *x) {
#ifdef __AVX512F__
  const auto load_shorts = [](const std::int16_t *v) {
    return _mm512_cvtepi16_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i *>(v)));
  };
  __m512 total = _mm512_setzero_ps();
  for (int k = 0; k < width; ++k, value += 16, column += 16)
    total = _mm512_fmadd_ps(_mm512_cvtepi32_ps(load_shorts(value)),
                            _mm512_i32gather_ps(load_shorts(column), x, 4), total);
  return (Floats)total;
#else
  Floats total{};
  for (int k = 0; k < width; ++k, value += 16, column += 16)
    for (int l = 0; l < 16; ++l)
      total[l] += static_cast<float>(value[l]) * x[column[l]];
  return total;
#endif
}

/// lane l: lane index[l] of two vectors laid end to end.
inline Floats picked(const int *index, const Floats &first, const Floats &second) {
#ifdef __AVX512F__
  return _mm512_permutex2var_ps(first, _mm512_loadu_si512(index), second);
#else
  Floats v;
  for (int l = 0; l < 16; ++l)
    v[l] = index[l] < 16 ? first[index[l]] : second[index[l] - 16];
  return v;
#endif
}

/// Bit l tells whether |v[l]| > threshold.
inline unsigned larger_lanes(const Floats &v, float threshold) {
#ifdef __AVX512F__
  return _mm512_cmp_ps_mask(_mm512_abs_ps(v), _mm512_set1_ps(threshold), _CMP_GT_OQ);
#else
  unsigned bits = 0;
  for (int l = 0; l < 16; ++l)
    bits |= static_cast<unsigned>(v[l] > threshold || v[l] < -threshold) << l;
  return bits;
#endif
}

/// Sum of the lanes, by halves.
inline float sum_of(const Floats &lanes) {
#ifdef __AVX512F__
  return _mm512_reduce_add_ps(lanes);
#else
  Floats v = lanes;
  for (int half = 8; half > 0; half /= 2)
    for (int l = 0; l < half; ++l)
      v[l] += v[l + half];
  return v[0];
#endif
}

#ifdef __AVX512F__

template <>
inline Lanes<float> gathered_sums<float>(const float *value, const int *column, int width,
                                         const float *x) {
  __m512 total = _mm512_setzero_ps();
  for (int k = 0; k < width; ++k, value += 16, column += 16) {
    const __m512 operand = _mm512_i32gather_ps(_mm512_loadu_si512(column), x, 4);
    total = _mm512_fmadd_ps(_mm512_loadu_ps(value), operand, total);
  }
  Lanes<float> lanes;
  _mm512_storeu_ps(lanes.data(), total);
  return lanes;
}

template <>
inline Lanes<double> gathered_sums<double>(const double *value, const int *column, int width,
                                           const float *x) {
  __m512d low = _mm512_setzero_pd(), high = _mm512_setzero_pd();
  for (int k = 0; k < width; ++k, value += 16, column += 16) {
    const __m512 operand = _mm512_i32gather_ps(_mm512_loadu_si512(column), x, 4);
    const __m512 swapped = _mm512_shuffle_f32x4(operand, operand, 0b01001110);
    low = _mm512_fmadd_pd(_mm512_loadu_pd(value), _mm512_cvtps_pd(_mm512_castps512_ps256(operand)),
                          low);
    high = _mm512_fmadd_pd(_mm512_loadu_pd(value + 8),
                           _mm512_cvtps_pd(_mm512_castps512_ps256(swapped)), high);
  }
  Lanes<double> lanes;
  _mm512_storeu_pd(lanes.data(), low);
  _mm512_storeu_pd(lanes.data() + 8, high);
  return lanes;
}

template <>
inline Lanes<double> gathered_sums<double>(const double *value, const int *column, int width,
                                           const double *x) {
  __m512d low = _mm512_setzero_pd(), high = _mm512_setzero_pd();
  for (int k = 0; k < width; ++k, value += 16, column += 16) {
    const __m256i first = _mm256_loadu_si256(reinterpret_cast<const __m256i *>(column));
    const __m256i second = _mm256_loadu_si256(reinterpret_cast<const __m256i *>(column + 8));
    low = _mm512_fmadd_pd(_mm512_loadu_pd(value), _mm512_i32gather_pd(first, x, 8), low);
    high = _mm512_fmadd_pd(_mm512_loadu_pd(value + 8), _mm512_i32gather_pd(second, x, 8), high);
  }
  Lanes<double> lanes;
  _mm512_storeu_pd(lanes.data(), low);
  _mm512_storeu_pd(lanes.data() + 8, high);
  return lanes;
}

#endif

} // namespace sluice::fluid
