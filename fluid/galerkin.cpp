// SPDX-License-Identifier: MIT
#include "fluid/galerkin.hpp"

#include "fluid/cell_windows.hpp"

#include <bit>
#include <cmath>

namespace sluice::fluid {
namespace {

// Below this part of what it is summed from, a diagonal is rounding error.
constexpr float vanishing = 1e-5f;
// A coarse row whose off-diagonal magnitudes exceed its diagonal this many times belongs to an
// aggregate that smoothing has all but cancelled, such as a single row at the free surface; healthy
// rows stay below 4. Without it a correction there is left to the smoother.
constexpr float degenerate = 8;

// Each aggregate first collects the values in its window; a row then adds what it weighs of them.
template <int parts>
void prolong_windows(const Transfer &t, const std::vector<float> &coarse, std::vector<float> &x) {
  for_each_index(t.aggregates(), [&](int a) {
    std::array<Floats, parts> around;
    for (int part = 0; part < parts; ++part)
      around[part] = gathered(&t.neighbour[(a * parts + part) * 16], coarse.data());
    for (int m = t.member_start[a]; m < t.member_start[a + 1]; ++m) {
      const float *weight = &t.weight[static_cast<std::size_t>(m) * t.width];
      Floats total = load(weight) * around[0];
      for (int part = 1; part < parts; ++part)
        total += load(weight + 16 * part) * around[part];
      x[t.member[m]] += sum_of(total);
    }
  });
}

// The reverse: each aggregate adds up the windows of its rows, then every aggregate takes its share
// from those around it.
template <int parts>
void restrict_windows(Transfer &t, const std::vector<float> &r, const std::vector<float> &scale,
                      std::vector<float> &coarse) {
  for_each_index(t.aggregates(), [&](int a) {
    std::array<Floats, parts> total{};
    for (int m = t.member_start[a]; m < t.member_start[a + 1]; ++m)
      for (int part = 0; part < parts; ++part)
        total[part] +=
            r[t.member[m]] * load(&t.weight[static_cast<std::size_t>(m) * t.width + 16 * part]);
    for (int part = 0; part < parts; ++part)
      store(total[part], &t.partial[(static_cast<std::size_t>(a) * parts + part) * 16]);
  });
  for_each_index(t.aggregates(), [&](int a) {
    Floats total = gathered(&t.source[a * t.width], t.partial.data());
    for (int part = 1; part < parts; ++part)
      total += gathered(&t.source[a * t.width + 16 * part], t.partial.data());
    coarse[a] = sum_of(total) * scale[a];
  });
}

} // namespace

void Transfer::prolong(const std::vector<float> &coarse, std::vector<float> &x) const {
  if (width == 16)
    prolong_windows<1>(*this, coarse, x);
  else
    prolong_windows<2>(*this, coarse, x);
}

void Transfer::restrict(const std::vector<float> &r, const std::vector<float> &scale,
                        std::vector<float> &coarse) {
  if (width == 16)
    restrict_windows<1>(*this, r, scale, coarse);
  else
    restrict_windows<2>(*this, r, scale, coarse);
}

template <int dim> class GalerkinProduct::Windows : CellWindows<dim> {
public:
  Windows(GalerkinProduct &memory, const UnitDiagonalView &matrix, const Aggregates &aggregates,
          const AggregateFinder &finder, const CoarseningParams &params, CoarseLevel &result)
      : m_(memory), matrix_(matrix), aggregates_(aggregates), finder_(finder), params_(params),
        result_(result), transfer_(result.transfer) {}

  void build() {
    find_neighbours();
    compute_p();
    compute_a_p();
    compute_coarse();
    slice_coarse();
  }

private:
  using Base = CellWindows<dim>;
  using Base::centre, Base::lanes, Base::shifts, Base::size, Base::width;
  using typename Base::CoarseWindow, typename Base::Window;
  static constexpr int parts = size / lanes;

  // Memory is shared by levels of all sizes and never shrinks: growing again would clear it.
  template <class T> static void make_room(std::vector<T> &values, std::size_t n) {
    if (values.size() < n)
      values.resize(n);
  }

  float *p(int i) { return &m_.p_[(static_cast<std::size_t>(i) + 1) * size]; }
  float *a_p(int i) { return &m_.a_p_[static_cast<std::size_t>(i) * size]; }
  float *weight(int m) { return &transfer_.weight[static_cast<std::size_t>(m) * width]; }
  int neighbour(int a, int shift) const { return transfer_.neighbour[a * width + shift]; }

  void find_neighbours() {
    transfer_.width = width;
    transfer_.member_start.assign(aggregates_.member_start.begin(), aggregates_.member_start.end());
    transfer_.member.assign(aggregates_.member.begin(), aggregates_.member.end());
    transfer_.partial.resize(static_cast<std::size_t>(aggregates_.count()) * width);
    transfer_.source.resize(static_cast<std::size_t>(aggregates_.count()) * width);
    transfer_.neighbour.resize(static_cast<std::size_t>(aggregates_.count()) * width);
    for_each_index(aggregates_.count(), [&](int a) {
      for (int s = 0; s < width; ++s) {
        const int next =
            s < shifts ? finder_.aggregate_in(moved(aggregates_.cell[a], Base::step_of_shift(s)))
                       : -1;
        transfer_.neighbour[a * width + s] = next;
        transfer_.source[a * width + s] = next < 0 ? -1 : next * width + shifts - 1 - s;
      }
    });
  }

  // body(column, shift, value) for the entries of a row that lead to an aggregate.
  template <class Body> void for_each_shifted(int i, Body &&body) const {
    const SlicedPattern &pattern = matrix_.pattern;
    const std::size_t first = pattern.place(i, 0);
    const std::size_t last = first + static_cast<std::size_t>(pattern.width(i)) * pattern.lanes;
    for (std::size_t at = first; at < last; at += pattern.lanes)
      if (m_.shift_[at] != Base::nowhere)
        body(pattern.column[at], m_.shift_[at], matrix_.off_diagonal[at]);
  }

  void compute_p() {
    make_room(m_.shift_, matrix_.pattern.stored());
    transfer_.weight.resize(aggregates_.member.size() * width);
    make_room(m_.p_, (static_cast<std::size_t>(matrix_.rows()) + 1) * size);
    std::fill_n(m_.p_.begin(), size, 0.0f);
    for_each_block(matrix_.rows(), [&](IndexRange range, int) {
      for (int first = range.begin; first < range.end; first += lanes)
        compute_p_of_slice(first / lanes);
    });
  }

  // Sixteen rows at a time, so that no sum waits for the one before it.
  void compute_p_of_slice(int slice) {
    const SlicedPattern &pattern = matrix_.pattern;
    const int first = slice * lanes, count = std::min(lanes, matrix_.rows() - first);
    Ints from;
    for (int lane = 0; lane < lanes; ++lane)
      from[lane] = aggregates_.key_of_row[first + std::min(lane, count - 1)];
    std::array<Floats, shifts> sum{};
    const std::size_t begin = pattern.place(first, 0);
    const std::size_t end = begin + static_cast<std::size_t>(pattern.width(first)) * lanes;
    for (std::size_t at = begin; at < end; at += lanes) {
      const Ints shift =
          Base::shifts_between(from, gathered(&pattern.column[at], aggregates_.key_of_row.data()));
      store_bytes(shift, &m_.shift_[at]);
      const Floats value = load(&matrix_.off_diagonal[at]);
      for (int s = 0; s < shifts; ++s)
        sum[s] += shift == s ? value : Floats{};
    }
    for (int lane = 0; lane < count; ++lane)
      store_p(first + lane, [&](int shift) { return sum[shift][lane]; });
  }

  template <class Sum> void store_p(int i, Sum &&sum) {
    std::array<Floats, width / lanes> window{};
    Window spread{};
    const int place = aggregates_.place_of_row[i];
    if (place >= 0) {
      const float w = bounded_weight(params_.prolongation_weight, matrix_.off_diagonal_sum[i]);
      for (int s = 0; s < shifts; ++s)
        Base::put(window, s, (s == centre) - w * ((s == centre) + sum(s)));
      for (int s = 0; s < shifts; ++s)
        Base::put(spread, Base::offset(s), Base::at(window, s));
      for (int part = 0; part < width / lanes; ++part)
        store(window[part], weight(place) + part * lanes);
    }
    for (int part = 0; part < parts; ++part)
      store(spread[part], p(i) + part * lanes);
  }

  void compute_a_p() {
    make_room(m_.a_p_, static_cast<std::size_t>(matrix_.rows()) * size);
    for_each_index(matrix_.rows(), [&](int i) {
      if (aggregates_.of_row[i] >= 0)
        compute_a_p(i);
    });
  }

  void compute_a_p(int i) {
    Window total;
    for (int part = 0; part < parts; ++part)
      total[part] = load(p(i) - Base::offset(centre) + part * lanes);
    for_each_shifted(i, [&](int j, int shift, float value) {
      const float *row = p(j) - Base::offset(shift);
      for (int part = 0; part < parts; ++part)
        total[part] += value * load(row + part * lanes);
    });
    for (int part = 0; part < parts; ++part)
      store(total[part], a_p(i) + part * lanes);
  }

  static void set(SlicedFloats &matrix, int i, int k, int column, float value) {
    const std::size_t at = matrix.pattern.place(i, k);
    matrix.pattern.column[at] = column;
    matrix.value[at] = value;
  }

  void compute_coarse() {
    const int n = aggregates_.count();
    result_.scale.resize(n);
    m_.row_start_.resize(n);
    for_each_block(n, [&](IndexRange range, int b) {
      Block &block = m_.block_[b];
      block.column.clear();
      block.value.clear();
      block.length.clear();
      for (int a = range.begin; a < range.end; ++a)
        compute_coarse_row(a, block);
    });
  }

  void compute_coarse_row(int a, Block &block) {
    CoarseWindow window{};
    float weight_sum = 0;
    for (int s = 0; s < shifts; ++s)
      if (neighbour(a, s) >= 0)
        add_members(neighbour(a, s), s, window, weight_sum);
    m_.row_start_[a] = static_cast<int>(block.column.size());
    const float lumped = keep_large(a, window, block);
    block.length.push_back(static_cast<int>(block.column.size()) - m_.row_start_[a]);
    const float diagonal = Base::at(window, Base::coarse_centre) + lumped;
    float off_diagonal = 0;
    for (std::size_t k = m_.row_start_[a]; k < block.value.size(); ++k)
      off_diagonal += std::abs(block.value[k]);
    const bool is_sound = diagonal > vanishing * weight_sum && off_diagonal < degenerate * diagonal;
    result_.scale[a] = is_sound ? 1 / diagonal : 0;
  }

  // Moves the large off-diagonal entries of a row into the block; returns the sum of the others.
  float keep_large(int a, const CoarseWindow &window, Block &block) const {
    const float threshold =
        params_.drop_tolerance * std::abs(Base::at(window, Base::coarse_centre));
    const Cell &cell = aggregates_.cell[a];
    Floats small{};
    float homeless = 0; // moved there by an entry that reached too far
    for (int part = 0; part < Base::coarse_size / lanes; ++part) {
      const Floats v = window[part];
      small += (v > threshold) | (v < -threshold) ? Floats{} : v;
      for (unsigned bits = larger_lanes(v, threshold); bits != 0; bits &= bits - 1) {
        const int w = part * lanes + std::countr_zero(bits);
        const int column = finder_.aggregate_in(moved(cell, Base::step_of_coarse_place(w)));
        if (column < 0)
          homeless += Base::at(window, w);
        else if (column != a) {
          block.column.push_back(column);
          block.value.push_back(Base::at(window, w));
        }
      }
    }
    return sum_of(small) + homeless;
  }

  // Adds the rows of A P in the cell `shift` of an aggregate, each times its entry of R.
  void add_members(int from, int shift, CoarseWindow &window, float &weight_sum) {
    Window total{};
    for (int m = aggregates_.member_start[from]; m < aggregates_.member_start[from + 1]; ++m) {
      const float r = weight(m)[shifts - 1 - shift];
      const float *row = a_p(aggregates_.member[m]);
      weight_sum += std::abs(r);
      for (int part = 0; part < parts; ++part)
        total[part] += r * load(row + part * lanes);
    }
    Base::add_moved(total, shift, window);
  }

  void slice_coarse() {
    const int n = aggregates_.count();
    auto &[pattern, value] = result_.off_diagonal;
    const Blocks blocks(n);
    const auto length = [&](int a) {
      const int b = blocks.of(a);
      return m_.block_[b].length[a - blocks[b].begin];
    };
    pattern.lay_out(n, length);
    value.resize(pattern.stored());
    result_.entries = n;
    for (int b = 0; b < blocks.count(); ++b)
      result_.entries += m_.block_[b].column.size();
    for_each_index(pattern.slices() * pattern.lanes, [&](int a) {
      const int entries = a < n ? length(a) : 0;
      for (int k = 0; k < pattern.width(a); ++k) {
        const Block &block = m_.block_[blocks.of(std::min(a, n - 1))];
        if (k < entries)
          set(result_.off_diagonal, a, k, block.column[m_.row_start_[a] + k],
              block.value[m_.row_start_[a] + k] * result_.scale[a]);
        else
          set(result_.off_diagonal, a, k, std::min(a, n - 1), 0);
      }
    });
  }

  GalerkinProduct &m_;
  const UnitDiagonalView &matrix_;
  const Aggregates &aggregates_;
  const AggregateFinder &finder_;
  const CoarseningParams &params_;
  CoarseLevel &result_;
  Transfer &transfer_;
};

void GalerkinProduct::build(int dim, const UnitDiagonalView &matrix, const Aggregates &aggregates,
                            const AggregateFinder &finder, const CoarseningParams &params,
                            CoarseLevel &result) {
  if (dim == 2)
    Windows<2>(*this, matrix, aggregates, finder, params, result).build();
  else
    Windows<3>(*this, matrix, aggregates, finder, params, result).build();
}

} // namespace sluice::fluid
