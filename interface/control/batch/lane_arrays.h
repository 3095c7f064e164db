// SPDX-License-Identifier: BSD-3-Clause
//
// What differential dynamic programming keeps of W problems of one structure, number by number in packs of lanes: stage after stage,
// and of a stage entry after entry.
//
//   LaneArrays<8> a(setup);
//   a.z[k * a.z_size + i]                                    // state or control i of node k
//   for (const NonZero& at : a.columns[j]) a.J[k * a.J_size + at.number];     // d x'[at.at] / d z[j] of step k
#pragma once

#include <cmath>
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

template <int W>
struct LaneArrays {
  using P = Pack<double, W>;
  using M = Mask<W>;
  using Packs = std::vector<P>;

  explicit LaneArrays(const LaneSetup& all)
      : setup(all),
        N(all.intervals),
        n(all.n_x),
        m(all.n_u),
        z_size(n + m),
        p_size(int(all.step.n_p())),
        y_size(int(all.step.n_y())),
        J_size(int(all.step.jacobian_pattern().nnz())),
        H_size(all.is_exact ? int(all.step.hessian_pattern().nnz()) : 0),
        is_limited((all.lower.array().abs() < HUGE_VAL).any() || (all.upper.array().abs() < HUGE_VAL).any()),
        states(W) {
    order_nonzeros();
    z = next_z = room(N * z_size), x_end = next_end = room(n);
    p = room(N * p_size), p_end = room(int(all.end.n_p()));
    y = room(N * y_size), J = J_before = room(N * J_size), H = room(N * H_size);
    J_end = room(int(all.end.jacobian_pattern().nnz())), H_end = room(int(all.end.hessian_pattern().nnz()));
    K = room(N * m * n), k = room(N * m), gap = room(N * n);
    slope = adjoint = room((N + 1) * n);
  }

  static Packs room(int count) { return Packs(std::size_t(count), P(0)); }

  static M mask_of(const std::vector<bool>& chosen) {
    P ones(0);
    for (int l = 0; l < W; ++l) ones.set(l, chosen[std::size_t(l)]);
    return ones == P(1);
  }

  // to += 2 R^T R s of the residuals of a step.
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
  int N, n, m, z_size, p_size, y_size, J_size, H_size;
  bool is_limited;
  std::vector<DdpState> states;
  NonZeros columns, residuals;  // of (A | B) by columns, with their rows; of the residuals by rows
  std::vector<NonZero> gradient;

  Packs z, x_end, next_z, next_end;  // the motion, and its trials
  Packs p, p_end, y, J, J_before, H;
  Packs K, k, gap, slope, adjoint;
  Packs J_end, H_end;
  P cost_end;

 private:
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
};

}  // namespace DYNTAPE_VECTORS
}  // namespace dyntape
