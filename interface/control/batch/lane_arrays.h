// SPDX-License-Identifier: BSD-3-Clause
//
// The data of differential dynamic programming for many problems of one structure, more problems than lanes.  Each
// problem has a slot; a slot stores stage after stage, a stage entry after entry.  Work runs in lanes on any set of
// slots.
//
//   LaneArrays<8> a(setup, 24);
//   a.at(a.z, slot, k)[i]                                    // state or control i of node k
//   LanePlaces<8> places = a.places({3, 17});                // slot and stage of each lane
//   a.go_to(places, k), a.gather(a.z, places, packs);        // packs[i]: entry i of all lanes
//   a.scatter(packs, places, a.z);                           // writes the lanes in use back
//   for (const NonZero& at : a.columns[j]) J[at.number];     // d x'[at.at] / d z[j] of a step
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include <dyntape/autodiff/scalars/pack.h>
#include <dyntape/interface/control/batch/lane_setup.h>
#include <dyntape/interface/control/solve/ddp_work.h>

namespace dyntape {

// A non-zero of the Jacobian: the place of its number, and its row or column.
struct NonZero {
  int number, at;
};
using NonZeros = std::vector<std::vector<NonZero>>;

inline namespace DYNTAPE_VECTORS {

// Numbers that a slot has once, or at every stage: their offset in the slot's data, or in the stage's data.
struct SlotNumbers {
  int first = 0, size = 0;
  bool is_of_stages = true;
};

// The places where the lanes work.  Unused lanes read the place of another lane and store nothing.
template <int W>
struct LanePlaces {
  int slot[W] = {}, stage[W] = {};
  bool is_used[W] = {};
  double *of_slot[W] = {}, *of_stage[W] = {};  // the data there

  Mask<W> used() const {
    Pack<double, W> ones(0);
    for (int l = 0; l < W; ++l) ones.set(l, is_used[l]);
    return ones == Pack<double, W>(1);
  }
};

// Transposes W packs of W lanes: entry i of pack l becomes entry l of pack i, by exchanges of off-diagonal blocks of
// half the size in each round.
template <int W>
class Transposed {
 public:
  using Vector = typename Pack<double, W>::Vector;

  static void apply(Vector (&rows)[W]) { exchange<W / 2>(rows); }

 private:
  template <int S, std::size_t... j>
  static void exchange(Vector& a, Vector& b, std::index_sequence<j...>) {
    const Vector low = __builtin_shufflevector(a, b, (j & S ? W + j - S : j)...);
    b = __builtin_shufflevector(a, b, (j & S ? W + j : j + S)...);
    a = low;
  }
  template <int S>
  static void exchange(Vector (&rows)[W]) {
#pragma GCC unroll 8
    for (int i = 0; i < W; ++i)
      if (!(i & S)) exchange<S>(rows[i], rows[i + S], std::make_index_sequence<W>());
    if constexpr (S > 1) exchange<S / 2>(rows);
  }
};

template <int W>
struct LaneArrays {
  using P = Pack<double, W>;
  using M = Mask<W>;
  using Packs = std::vector<P>;

  LaneArrays(const LaneSetup& all, int count)
      : setup(all),
        slots(count),
        N(all.intervals),
        n(all.n_x),
        m(all.n_u),
        z_size(n + m),
        p_size(int(all.step.n_p())),
        y_size(int(all.step.n_y())),
        J_size(int(all.step.jacobian_pattern().nnz())),
        H_size(all.is_exact ? int(all.step.hessian_pattern().nnz()) : 0),
        is_limited((all.lower.array().abs() < HUGE_VAL).any() || (all.upper.array().abs() < HUGE_VAL).any()),
        states(std::size_t(count)) {
    order_nonzeros();
    x_end = once(n), p_end = once(int(all.end.n_p()));
    J_end = once(int(all.end.jacobian_pattern().nnz())), H_end = once(int(all.end.hessian_pattern().nnz()));
    z = of_stages(z_size), p = of_stages(p_size), J = of_stages(J_size), H = of_stages(H_size);
    K = of_stages(m * n), k = of_stages(m), gap = of_stages(n);
    slope = of_stages(n), adjoint = of_stages(n), used = of_stages(1);
    const bool has_secants = !all.is_exact;
    S = of_stages(has_secants ? z_size * (z_size + 1) / 2 : 0),
    before_z = of_stages(has_secants ? z_size : 0);
    numbers_.assign(std::size_t(slots) * std::size_t(slot_size() / W), P(0));
  }
  LaneArrays(const LaneArrays&) = delete;

  double* of_slot(int slot) {
    return reinterpret_cast<double*>(numbers_.data()) + std::ptrdiff_t(slot) * slot_size();
  }
  double* at(const SlotNumbers& what, int slot, int stage = 0) {
    return of_slot(slot) + (what.is_of_stages ? of_all_ + stage * of_stage_ : 0) + what.first;
  }
  const double* at(const SlotNumbers& what, int slot, int stage = 0) const {
    return const_cast<LaneArrays*>(this)->at(what, slot, stage);
  }
  void fill(const SlotNumbers& what, int slot, double value) {
    for (int stage = 0; stage <= N; ++stage) std::fill_n(at(what, slot, stage), what.size, value);
  }

  LanePlaces<W> places(const std::vector<int>& chosen) {
    LanePlaces<W> result;
    for (int l = 0; l < W; ++l) {
      result.is_used[l] = std::size_t(l) < chosen.size();
      go_to(result, l, chosen.empty() ? 0 : chosen[result.is_used[l] ? std::size_t(l) : 0], 0);
    }
    return result;
  }
  void go_to(LanePlaces<W>& places, int lane, int slot, int stage) {
    places.slot[lane] = slot, places.stage[lane] = stage;
    places.of_slot[lane] = of_slot(slot);
    places.of_stage[lane] = of_slot(slot) + of_all_ + stage * of_stage_;
  }
  // All lanes.
  void go_to(LanePlaces<W>& places, int stage) const {
    for (int l = 0; l < W; ++l) {
      places.stage[l] = stage;
      places.of_stage[l] = places.of_slot[l] + of_all_ + stage * of_stage_;
    }
  }

  // W entries of W lanes at a time, if a register has W lanes.
  void gather(const SlotNumbers& what, const LanePlaces<W>& places, P* to) const {
    double* const* const from = what.is_of_stages ? places.of_stage : places.of_slot;
    for (int first = 0; first < what.size; first += W) {
      const int count = std::min(W, what.size - first);
      if constexpr (8 * W <= DYNTAPE_REGISTER) {
        typename P::Vector rows[W];
#pragma GCC unroll 8
        for (int l = 0; l < W; ++l) std::memcpy(&rows[l], from[l] + what.first + first, sizeof rows[l]);
        Transposed<W>::apply(rows);
#pragma GCC unroll 8
        for (int i = 0; i < W; ++i)
          if (i < count) to[first + i] = P(rows[i]);  // a loop that counts would be one of bytes in memory
      } else {
        double* const lanes = reinterpret_cast<double*>(to + first);
        for (int l = 0; l < W; ++l)
          for (int i = 0; i < count; ++i) lanes[i * W + l] = from[l][what.first + first + i];
      }
    }
  }
  void scatter(const P* from, const LanePlaces<W>& places, const SlotNumbers& what) const {
    double* const* const to = what.is_of_stages ? places.of_stage : places.of_slot;
    for (int first = 0; first < what.size; first += W) {
      const int count = std::min(W, what.size - first);
      if constexpr (8 * W <= DYNTAPE_REGISTER) {
        typename P::Vector rows[W] = {};
#pragma GCC unroll 8
        for (int i = 0; i < W; ++i)
          if (i < count) rows[i] = from[first + i].vector();
        Transposed<W>::apply(rows);
#pragma GCC unroll 8
        for (int l = 0; l < W; ++l)
          if (places.is_used[l]) std::memcpy(to[l] + what.first + first, &rows[l], sizeof rows[l]);
      } else {
        const double* const lanes = reinterpret_cast<const double*>(from + first);
        for (int l = 0; l < W; ++l)
          for (int i = 0; places.is_used[l] && i < count; ++i)
            to[l][what.first + first + i] = lanes[i * W + l];
      }
    }
  }

  static Packs room(int count) { return Packs(std::size_t(count), P(0)); }

  // to += 2 R^T R s, of the residuals of a step.
  void add_curvature(const P* J_of_step, const Packs& s, Packs& to) const {
    for (const auto& residual : residuals) {
      P sum(0);
      for (const NonZero& at : residual) sum += J_of_step[at.number] * s[std::size_t(at.at)];
      sum *= P(2);
      for (const NonZero& at : residual) to[std::size_t(at.at)] += sum * J_of_step[at.number];
    }
  }

  static P dot(const Packs& a, const Packs& b) {
    P sum(0);
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
  }

  LaneSetup setup;
  int slots, N, n, m, z_size, p_size, y_size, J_size, H_size;
  bool is_limited;
  std::vector<DdpState> states;
  NonZeros columns, residuals;  // of (A | B) by columns, with their rows; of the residuals by rows
  std::vector<NonZero> gradient;

  SlotNumbers x_end, p_end, J_end, H_end;                   // of each slot
  SlotNumbers z, p, J, H, K, k, gap, slope, adjoint, used;  // of its stages
  SlotNumbers S, before_z;                                  // of secants (lane_secants.h)

 private:
  // Each begins at an address that a register can load.
  static int padded(int size) { return (size + W - 1) / W * W; }
  SlotNumbers once(int size) {
    const int first = of_all_;
    of_all_ += padded(size);
    return {first, size, false};
  }
  SlotNumbers of_stages(int size) {
    const int first = of_stage_;
    of_stage_ += padded(size);
    return {first, size, true};
  }
  int slot_size() const { return of_all_ + (N + 1) * of_stage_; }

  void order_nonzeros() {
    columns.resize(std::size_t(z_size)), residuals.resize(std::size_t(y_size - n - 1));
    const Pattern& at = setup.step.jacobian_pattern();
    for (std::size_t i = 0; i < at.nnz(); ++i) {
      const int row = int(at.row[i]), col = int(at.col[i]), number = int(i);
      if (row < n)
        columns[std::size_t(col)].push_back({number, row});
      else if (row == n)
        gradient.push_back({number, col});
      else
        residuals[std::size_t(row - n - 1)].push_back({number, col});
    }
  }

  int of_all_ = 0, of_stage_ = 0;  // numbers of a slot once, and of each of its stages
  Packs numbers_;                  // slot after slot: what it has once, then stage after stage
};

// The data in lanes for work on a whole motion: step after step, in the order of the functions' arguments.
template <int W>
struct LaneMotion {
  using Packs = std::vector<Pack<double, W>>;

  explicit LaneMotion(const LaneArrays<W>& a)
      : z(a.room(a.N * a.z_size)),
        p(a.room(a.N * a.p_size)),
        y(a.room(a.N * a.y_size)),
        J(a.room(a.N * a.J_size)),
        adjoint(a.room((a.N + 1) * a.n)),
        x_end(a.room(a.n)),
        p_end(a.room(int(a.setup.end.n_p()))),
        J_end(a.room(a.J_end.size)),
        H_end(a.room(a.H_end.size)) {}

  Packs z, p, y, J, adjoint, x_end, p_end, J_end, H_end;
};

}  // namespace DYNTAPE_VECTORS
}  // namespace dyntape
