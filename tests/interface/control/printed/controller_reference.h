// SPDX-License-Identifier: BSD-3-Clause
//
// The algorithm of printed controllers (interface/control/printed/algorithm) once more, in C++ with full matrices and any
// scalar: their results in double are equal, bit for bit.
//
//   Reference<double> mpc(parts, functions, constants);
//   mpc.step(x, t, 2);                           // mpc.z: (N + 1) rows of (x, u)
#pragma once

#include <algorithm>
#include <functional>
#include <vector>

#include <dyntape/interface/control/printed/controller_functions.h>
#include "reference_side.h"

namespace dyntape::test {

template <class T>
class Reference {
 public:
  using Row = std::vector<T>;
  using Matrix = std::vector<Row>;
  using Side = ReferenceSide<T>;
  // Values, and the full Jacobian if asked for.
  using Evaluate = std::function<void(const Row& z, const Row& p, Row& y, Matrix* jacobian)>;
  struct Functions {
    Evaluate stage_value, stage_first, end_value, end_first;
  };

  Reference(const ControllerParts& parts, Functions functions, const ReferenceConstants<T>& constants)
      : parts_(parts),
        f_(std::move(functions)),
        k_(constants),
        n_(int(parts.times.size()) - 1),
        n_x_(parts.problem.n_x()),
        n_z_(n_x_ + parts.problem.n_u()) {
    for (int k = 0; k <= n_; ++k) {
      z.emplace_back();
      for (int i = 0; i < n_z_; ++i) z.back().push_back(T(parts.guess[std::size_t(k * n_z_ + i)]));
      const Eigen::VectorXd at = controller_parameters(parts.problem, parts.times[std::size_t(k)]);
      p_.emplace_back(at.begin(), at.end());
    }
    side_.assign(std::size_t(n_), std::vector<Side>(parts.stage.sides.size()));
    end_side_.assign(parts.end.sides.size(), Side());
    for (double nominal : parts.nominal) inverse_.push_back(T(1 / nominal));
    products_ =
        std::size_t(n_) * (2 * parts.stage.sides.size() - parts.stage.hard) + 2 * parts.end.sides.size();
  }

  // 0: solved, 1: the budget ended, 2: not finite.
  int step(const Row& x, T t, int budget) {
    iterations = interior_steps = 0;
    if (has_plan_ && t > begin_) shift(t);
    std::copy(x.begin(), x.end(), z[0].begin());
    begin_ = t;
    gap_price_ = T(1);
    Merit now = measure(T(0));
    for (int i = 0; i < k_.iterations && i < budget; ++i) {
      if (!linearise()) return 2;
      const bool is_solved = quadratic_program();
      const T change = change_of_plan();
      if (!is_finite(change)) return 2;
      const T part = line_search(now);
      ++iterations;
      if (part == T(0)) return 2;
      has_plan_ = true;
      if (is_solved && change <= k_.tolerance) return 0;
    }
    return 1;
  }

  Matrix z;
  std::vector<Matrix> gain;
  int iterations = 0, interior_steps = 0;

 private:
  struct Merit {
    T cost = T(0), excess = T(0), gap = T(0);
  };
  struct Quadratic {
    Matrix a, d, h, q;  // dynamics, rows, Hessian, and after elimination
    Row c, g, pc, k;
    Matrix factor;
  };

  bool is_soft(std::size_t j, bool at_end) const { return at_end || j >= parts_.stage.hard; }
  const PointFunctions& point(int k) const { return k == n_ ? parts_.end : parts_.stage; }
  std::vector<Side>& sides(int k) { return k == n_ ? end_side_ : side_[std::size_t(k)]; }
  const std::vector<Side>& sides(int k) const { return k == n_ ? end_side_ : side_[std::size_t(k)]; }
  int entries(int k) const { return k == n_ ? n_x_ : n_z_; }

  // The sides of a point with their values at a change of z.
  template <class Visit>
  void for_sides(Visit visit) {
    for (int k = 0; k <= n_; ++k) {
      const Row value = quantities(k, new_[std::size_t(k)]);
      const auto& about = point(k).sides;
      for (std::size_t j = 0; j < about.size(); ++j) {
        Side& s = sides(k)[j];
        visit(s, s.b + T(about[j].factor) * value[about[j].entry], is_soft(j, k == n_));
      }
    }
  }

  Row quantities(int k, const Row& dz) const {
    Row value(dz.begin(), dz.begin() + entries(k));
    for (const Row& d : q_[std::size_t(k)].d) {
      T sum = T(0);
      for (int i = 0; i < entries(k); ++i) sum += d[std::size_t(i)] * dz[std::size_t(i)];
      value.push_back(sum);
    }
    return value;
  }

  bool linearise() {
    q_.assign(std::size_t(n_ + 1), {});
    dz_.assign(std::size_t(n_ + 1), Row(std::size_t(n_z_), T(0)));
    new_ = dz_;
    T sum = T(0);
    for (int k = 0; k <= n_; ++k) {
      Quadratic& q = q_[std::size_t(k)];
      const bool at_end = k == n_;
      const PointFunctions& f = point(k);
      const std::size_t states = at_end ? 0 : std::size_t(n_x_), n = std::size_t(entries(k));
      Row y;
      Matrix j;
      (at_end ? f_.end_first : f_.stage_first)(
          Row(z[std::size_t(k)].begin(), z[std::size_t(k)].begin() + long(n)), p_[std::size_t(k)], y, &j);
      for (std::size_t i = 0; i < states; ++i)
        q.c.push_back(y[i] - z[std::size_t(k + 1)][i]), sum += q.c.back();
      q.a.assign(j.begin(), j.begin() + long(states));
      q.d.assign(j.begin() + long(states), j.begin() + long(states + f.rows));
      for (const Matrix* m : {&q.a, &q.d}) {
        for (const Row& row : *m) {
          for (T v : row) sum += v;
        }
      }
      q.h.assign(n, Row(n, T(0))), q.g.assign(n, T(0));
      const std::size_t first = states + f.rows, plain = first + f.squares, last = j.size();
      for (std::size_t r = first; r < plain; ++r) {
        for (std::size_t i = 0; i < n; ++i) q.g[i] += j[r][i] * y[r];
      }
      if (f.has_plain) {
        for (std::size_t i = 0; i < n; ++i) q.g[i] += j[plain][i];
      }
      for (std::size_t r = first; r < last; ++r) {
        if (f.has_plain && r == plain) continue;
        for (std::size_t i = 0; i < n; ++i) {
          for (std::size_t e = 0; e <= i; ++e) q.h[i][e] += j[r][i] * j[r][e];
        }
      }
      for (std::size_t i = 0; i < n; ++i)
        q.h[i][i] += k_.damping * (inverse_[i] * inverse_[i]), sum += q.g[i];
      for (std::size_t e = 0; e < f.sides.size(); ++e) {
        const std::size_t entry = f.sides[e].entry;
        const T value = entry < n ? z[std::size_t(k)][entry] : y[states + entry - n];
        const T bound = T(f.sides[e].bound);
        sides(k)[e].begin(k_, T(f.sides[e].factor) * (value - bound), mu_, is_soft(e, at_end));
      }
    }
    return is_finite(sum);
  }

  // Hessian with the weights of the sides, lower triangle.
  Matrix weighted(int k) {
    const Quadratic& q = q_[std::size_t(k)];
    const auto& about = point(k).sides;
    const std::size_t n = std::size_t(entries(k));
    Row w(n + q.d.size(), T(0));
    for (std::size_t j = 0; j < about.size(); ++j) {
      Side& s = sides(k)[j];
      T inverse = s.t / s.l;
      if (is_soft(j, k == n_)) inverse += s.s / s.n + k_.give;
      s.w = T(1) / inverse, s.aim_t = s.aim_s = T(0);
      w[about[j].entry] += T(about[j].factor) * T(about[j].factor) * s.w;
    }
    Matrix h = q.h;
    for (std::size_t i = 0; i < n; ++i) h[i][i] += w[i];
    for (std::size_t r = 0; r < q.d.size(); ++r) {
      for (std::size_t i = 0; i < n; ++i) {
        const T v = w[n + r] * q.d[r][i];
        for (std::size_t j = 0; j <= i; ++j) h[i][j] += v * q.d[r][j];
      }
    }
    return h;
  }

  void factorise() {
    const auto n_x = std::size_t(n_x_), n_z = std::size_t(n_z_), n_u = n_z - n_x;
    Matrix p = weighted(n_);
    mirror(p);
    gain.resize(std::size_t(n_));
    for (int k = n_ - 1; k >= 0; --k) {
      Quadratic& s = q_[std::size_t(k)];
      s.pc.assign(n_x, T(0));
      for (std::size_t a = 0; a < n_x; ++a) {
        for (std::size_t b = 0; b < n_x; ++b) s.pc[a] += p[a][b] * s.c[b];
      }
      Matrix q = weighted(k), m(n_x, Row(n_z, T(0)));
      for (std::size_t r = 0; r < n_x; ++r) {
        for (std::size_t i = 0; i < n_x; ++i) {
          for (std::size_t j = 0; j < n_z; ++j) m[r][j] += p[r][i] * s.a[i][j];
        }
      }
      for (std::size_t i = 0; i < n_x; ++i) {
        for (std::size_t a = 0; a < n_z; ++a) {
          for (std::size_t b = 0; b <= a; ++b) q[a][b] += s.a[i][a] * m[i][b];
        }
      }
      s.factor.assign(n_u, Row(n_u, T(0)));
      for (std::size_t b = 0; b < n_u; ++b) {
        s.factor[b][b] = T(1) / larger(q[n_x + b][n_x + b], k_.least_pivot);
        for (std::size_t a = b + 1; a < n_u; ++a) {
          const T l = s.factor[a][b] = q[n_x + a][n_x + b] * s.factor[b][b];
          for (std::size_t j = 0; j < n_x; ++j) q[n_x + a][j] -= l * q[n_x + b][j];
          for (std::size_t e = b + 1; e <= a; ++e) q[n_x + a][n_x + e] -= l * q[n_x + e][n_x + b];
        }
      }
      Matrix& g = gain[std::size_t(k)];
      g.assign(n_u, Row(n_x, T(0)));
      for (std::size_t b = n_u; b-- > 0;) {
        for (std::size_t j = 0; j < n_x; ++j) g[b][j] = -(s.factor[b][b] * q[n_x + b][j]);
        for (std::size_t a = b + 1; a < n_u; ++a) {
          for (std::size_t j = 0; j < n_x; ++j) g[b][j] -= s.factor[a][b] * g[a][j];
        }
      }
      p.assign(n_x, Row(n_x, T(0)));
      for (std::size_t i = 0; i < n_x; ++i) {
        for (std::size_t j = 0; j <= i; ++j) p[i][j] = q[i][j];
        for (std::size_t b = 0; b < n_u; ++b) {
          const T y = q[n_x + b][i] * s.factor[b][b];
          for (std::size_t j = 0; j <= i; ++j) p[i][j] -= y * q[n_x + b][j];
        }
      }
      mirror(p);
    }
  }

  static void mirror(Matrix& p) {
    for (std::size_t i = 0; i < p.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) p[j][i] = p[i][j];
    }
  }

  // Gradient less the pull of the sides.
  Row pulled(int k) {
    const Quadratic& q = q_[std::size_t(k)];
    const auto& about = point(k).sides;
    const std::size_t n = std::size_t(entries(k));
    Row pull(n + q.d.size(), T(0)), r(n);
    for (std::size_t j = 0; j < about.size(); ++j) {
      const Side& s = sides(k)[j];
      pull[about[j].entry] += T(about[j].factor) * (s.l - s.w * (s.b + s.aim_s - s.aim_t));
    }
    for (std::size_t i = 0; i < n; ++i) r[i] = q.g[i] - pull[i];
    for (std::size_t e = 0; e < q.d.size(); ++e) {
      for (std::size_t i = 0; i < n; ++i) r[i] -= q.d[e][i] * pull[n + e];
    }
    return r;
  }

  void solve() {
    const auto n_x = std::size_t(n_x_), n_z = std::size_t(n_z_), n_u = n_z - n_x;
    Row p = pulled(n_);
    for (int k = n_ - 1; k >= 0; --k) {
      Quadratic& s = q_[std::size_t(k)];
      Row q = pulled(k);
      for (std::size_t a = 0; a < n_x; ++a) p[a] += s.pc[a];
      for (std::size_t i = 0; i < n_x; ++i) {
        for (std::size_t j = 0; j < n_z; ++j) q[j] += s.a[i][j] * p[i];
      }
      s.k.assign(n_u, T(0));
      for (std::size_t a = 0; a < n_u; ++a) {
        T y = q[n_x + a];
        for (std::size_t b = 0; b < a; ++b) y -= s.factor[a][b] * s.k[b];
        s.k[a] = y;
      }
      for (std::size_t b = n_u; b-- > 0;) {
        T y = -(s.factor[b][b] * s.k[b]);
        for (std::size_t a = b + 1; a < n_u; ++a) y -= s.factor[a][b] * s.k[a];
        s.k[b] = y;
      }
      for (std::size_t a = 0; a < n_x; ++a) p[a] = q[a];
      for (std::size_t b = 0; b < n_u; ++b) {
        for (std::size_t a = 0; a < n_x; ++a) p[a] += gain[std::size_t(k)][b][a] * q[n_x + b];
      }
    }
    new_.assign(std::size_t(n_ + 1), Row(n_z, T(0)));
    for (std::size_t k = 0; k < std::size_t(n_); ++k) {
      for (std::size_t b = 0; b < n_u; ++b) {
        T u = q_[k].k[b];
        for (std::size_t a = 0; a < n_x; ++a) u += gain[k][b][a] * new_[k][a];
        new_[k][n_x + b] = u;
      }
      for (std::size_t a = 0; a < n_x; ++a) {
        T next = q_[k].c[a];
        for (std::size_t j = 0; j < n_z; ++j) next += q_[k].a[a][j] * new_[k][j];
        new_[k + 1][a] = next;
      }
    }
  }

  struct Barrier {
    T part = T(1), first = T(0), second = T(0), moved = T(0);
  };

  Barrier changes(T mean) {
    Barrier b;
    const T most = T(1) - smaller(larger(mean, k_.mu_end), T(0.01));
    for_sides([&](Side& s, T v, bool soft) {
      s.change(v, soft);
      b.part = Side::part_of(most, b.part, s.t, s.d.t), b.part = Side::part_of(most, b.part, s.l, s.d.l);
      b.first += s.t * s.d.l + s.l * s.d.t, b.second += s.d.t * s.d.l;
      if (!soft) return;
      b.moved = larger(b.moved, size(s.d.l));
      b.part = Side::part_of(most, b.part, s.s, s.d.s), b.part = Side::part_of(most, b.part, s.n, -s.d.l);
      b.first += s.n * s.d.s - s.s * s.d.l, b.second -= s.d.s * s.d.l;
    });
    return b;
  }

  T moves(T part) {
    T sum = T(0);
    for_sides([&](Side& s, T, bool soft) {
      s.t += part * s.d.t, s.l += part * s.d.l;
      T product = s.t * s.l;
      if (soft) s.n -= part * s.d.l, s.s += part * s.d.s, product += s.s * s.n;
      sum += product;
    });
    return sum * one_over_products();
  }
  T one_over_products() const { return T(products_ > 0 ? 1 / double(products_) : 0); }

  void begin_cold() {
    for (int k = 0; k <= n_; ++k) {
      dz_[std::size_t(k)].assign(std::size_t(n_z_), T(0));
      for (std::size_t j = 0; j < sides(k).size(); ++j) {
        Side& s = sides(k)[j];
        s.begin(k_, s.b, k_.mu_cold, is_soft(j, k == n_)), s.d = {};
      }
    }
  }

  bool quadratic_program() {
    T left = T(1), mean = moves(T(0)), gap = T(0);
    bool is_warm = mu_ < k_.mu_cold, is_blocked = false;
    for (int i = 0; i < k_.interior_steps; ++i) {
      if (is_blocked) {
        begin_cold();
        left = T(1), mean = moves(T(0)), gap = T(0), is_warm = is_blocked = false;
        continue;
      }
      factorise();
      solve();
      Barrier b = changes(mean);
      T ratio = mean + b.part * (b.first + b.part * b.second) * one_over_products();
      ratio = ratio / larger(mean, k_.mu_end);
      const T mu = larger(ratio * ratio * ratio * mean, k_.mu_end);
      for_sides([&](Side& s, T, bool soft) {
        s.aim_t = (mu - s.d.t * s.d.l) / s.l;
        if (soft) s.aim_s = (mu + s.d.s * s.d.l) / s.n;
      });
      solve();
      b = changes(mean);
      mean = moves(b.part);
      for (int k = 0; k <= n_; ++k) {
        for (std::size_t e = 0; e < std::size_t(entries(k)); ++e) {
          T& v = dz_[std::size_t(k)][e];
          v += b.part * (new_[std::size_t(k)][e] - v);
        }
      }
      left = (T(1) - b.part) * left;
      gap = (T(1) - b.part) * gap + b.part * (k_.give * b.moved);
      ++interior_steps;
      is_blocked = is_warm && b.part < k_.shortest;
      if (left > k_.left || gap > T(0.1 * double(k_.tolerance)) || mean > T(2) * k_.mu_end) continue;
      mu_ = k_.mu_warm;
      return true;
    }
    mu_ = k_.mu_cold;
    return false;
  }

  Merit measure(T part) const {
    Merit m;
    Matrix at = z;
    for (int k = 0; k <= n_; ++k) {
      for (std::size_t i = 0; i < std::size_t(entries(k)) && !dz_.empty(); ++i)
        at[std::size_t(k)][i] = z[std::size_t(k)][i] + part * dz_[std::size_t(k)][i];
    }
    for (int k = 0; k <= n_; ++k) {
      const bool at_end = k == n_;
      const std::size_t states = at_end ? 0 : std::size_t(n_x_), n = std::size_t(entries(k)),
                        rows = point(k).rows;
      const Row here(at[std::size_t(k)].begin(), at[std::size_t(k)].begin() + long(n));
      Row y;
      (at_end ? f_.end_value : f_.stage_value)(here, p_[std::size_t(k)], y, nullptr);
      m.cost += y[states + rows];
      for (std::size_t i = 0; i < states; ++i) m.gap += inverse_[i] * size(y[i] - at[std::size_t(k + 1)][i]);
      const auto& about = point(k).sides;
      for (std::size_t j = at_end ? 0 : point(k).hard; j < about.size(); ++j) {
        const T v = about[j].entry < n ? here[about[j].entry] : y[states + about[j].entry - n];
        m.excess += excess(T(about[j].factor) * (v - T(about[j].bound)));
      }
    }
    return m;
  }

  T expected() {
    T sum = T(0), more = T(0);
    for (int k = 0; k <= n_; ++k) {
      const Quadratic& q = q_[std::size_t(k)];
      const Row& dz = dz_[std::size_t(k)];
      for (std::size_t i = 0; i < q.g.size(); ++i) {
        T row = T(0);
        for (std::size_t j = 0; j < i; ++j) row += q.h[i][j] * dz[j];
        row += T(0.5) * q.h[i][i] * dz[i];
        sum += (row + q.g[i]) * dz[i];
      }
      const Row value = quantities(k, dz);
      const auto& about = point(k).sides;
      for (std::size_t j = k == n_ ? 0 : point(k).hard; j < about.size(); ++j) {
        const T b = sides(k)[j].b;
        more += excess(b + T(about[j].factor) * value[about[j].entry]) - excess(b);
      }
    }
    return sum + k_.price * more;
  }

  T line_search(Merit& now) {
    const T e = expected();
    const T precision = T(double(k_.mu_end) * double(products_));
    if (e - precision > T(0.5) * gap_price_ * now.gap)
      gap_price_ = smaller(T(2) * e / larger(now.gap, k_.small), k_.largest_price);
    const T before = now.cost + k_.price * now.excess + gap_price_ * now.gap, fall = e - gap_price_ * now.gap;
    T best = T(0), part = T(1), least = T(0);
    Merit at_best = now;
    for (int i = 0; i < k_.trials; ++i, part = T(0.5) * part) {
      const Merit m = measure(part);
      const T merit = m.cost + k_.price * m.excess + gap_price_ * m.gap;
      if (!is_finite(merit) || (best != T(0) && !(merit < least))) continue;
      best = part, least = merit, at_best = m;
      if (merit <= before + T(1e-4) * part * fall + (precision + k_.rounding * size(before))) break;
    }
    now = at_best;
    for (int k = 0; k <= n_; ++k) {
      for (std::size_t i = 0; i < std::size_t(entries(k)); ++i)
        z[std::size_t(k)][i] += best * dz_[std::size_t(k)][i];
    }
    return best;
  }

  T change_of_plan() const {
    T most = T(0);
    for (int k = 0; k <= n_; ++k) {
      for (std::size_t i = 0; i < std::size_t(entries(k)); ++i)
        most = larger(most, inverse_[i] * size(dz_[std::size_t(k)][i]));
    }
    return most;
  }

  void shift(T t) {
    const T moved = smaller(larger((t - begin_) * T(1 / parts_.step), T(0)), T(n_));
    const int whole = int(moved);
    const T rest = moved - T(whole);
    const Matrix before = z;
    const auto sides_before = side_;
    const auto at = [&](int k, int most) -> const Row& { return before[std::size_t(std::min(k, most))]; };
    for (int k = 0; k < n_; ++k) {
      const int from = std::min(k + whole, n_), u = std::min(from, n_ - 1);
      for (std::size_t i = 0; i < std::size_t(n_z_); ++i) {
        const int most = i < std::size_t(n_x_) ? n_ : n_ - 1;
        const T a = at(from, most)[i];
        z[std::size_t(k)][i] = a + rest * (at(std::min(from + 1, n_), most)[i] - a);
      }
      const int side = rest > T(0.5) && u + 1 < n_ ? u + 1 : u;
      for (std::size_t j = 0; j < parts_.stage.sides.size(); ++j)
        side_[std::size_t(k)][j].l = sides_before[std::size_t(side)][j].l;
    }
  }

  const ControllerParts& parts_;
  Functions f_;
  ReferenceConstants<T> k_;
  int n_, n_x_, n_z_;
  Matrix p_, dz_, new_;
  Row inverse_;
  std::vector<Quadratic> q_;
  std::vector<std::vector<Side>> side_;
  std::vector<Side> end_side_;
  std::size_t products_ = 0;
  T gap_price_ = T(1), mu_ = k_.mu_cold, begin_ = T(0);
  bool has_plan_ = false;
};

}  // namespace dyntape::test
