// SPDX-License-Identifier: BSD-3-Clause
//
// The factorisation; riccati_sweeps.cpp has the solves.  Matrices are small, so contiguous data matter: all work is
// sums of columns, and rows of the problem are stored as columns.
#include <dyntape/interface/control/riccati/riccati_kkt.h>

#include <cmath>
#include <numeric>

#include <dyntape/interface/control/riccati/columns.h>

namespace dyntape {

using namespace columns;

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Relative to its largest entry: a smaller remainder of a row means that the row is dependent.  A pivot p for a link
// gives a cost-to-go of 1 / p^2; below this limit no digit of the free variables would remain.  Minimum-time
// problems have such pivots at the optimum, where multipliers of the last rows cancel.  Rows of the stage itself
// come first, so that their remainder is zero.
constexpr double kDependentLink = 1e-7, kDependent = 1e-11;
constexpr double kMuch = 0.01;   // the same: large enough as a pivot
constexpr double kFlat = 1e-14;  // relative to its entry: remainder of a variable without own curvature
constexpr Index kSmall = 16;     // variables of a stage: below, zeros are not worth a test

// A buffer of `count` doubles, uninitialised.
double* room(std::vector<double>& numbers, Index count) {
  if (Index(numbers.size()) < count) numbers.resize(std::size_t(count));
  return numbers.data();
}
double* zeros(std::vector<double>& numbers, Index count) {
  double* const first = room(numbers, count);
  std::fill(first, first + count, 0.0);
  return first;
}
// Entries after the rows are zero.
void resize(MatrixXd& matrix, Index rows, Index columns) {
  if (matrix.rows() != rows || matrix.cols() != columns) matrix.setZero(rows, columns);
}

}  // namespace

RiccatiKkt::RiccatiKkt(const std::vector<StageSizes>& sizes, bool puts_in_links)
    : stages_(sizes.size()),
      factors_(sizes.size()),
      first_variable_{0},
      first_row_{0},
      puts_in_links_(puts_in_links) {
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    const Index n = sizes[k].variables, links = sizes[k].links;
    const Index next = k + 1 < sizes.size() ? sizes[k + 1].links : 0;
    stages_[k] = {MatrixXd::Zero(n, n), MatrixXd::Zero(next, n), Rows::Zero(sizes[k].rows, n),
                  Rows::Zero(links, n)};
    first_variable_.push_back(first_variable_.back() + n);
    first_row_.push_back(first_row_.back() + links + sizes[k].rows);
  }
  find_structure(true);
}

void RiccatiKkt::take_structure() { find_structure(false); }

// Links that determine one variable each, as in explicit steps, are eliminated first if no row of the stage may need
// that variable.
void RiccatiKkt::find_structure(bool all) {
  for (std::size_t k = 0; k < stages(); ++k) {
    const Stage& s = stages_[k];
    factors_[k].matrices.find(s, all);
    std::vector<Single>& singles = factors_[k].singles;
    singles.clear();
    if (all || (s.G.rows() > 0 && !puts_in_links_)) continue;
    std::vector<bool> is_taken(std::size_t(s.D.cols()), false);
    for (Index r = 0; r < s.D.rows(); ++r) {
      Index count = 0, at = 0;
      for (Index i = 0; i < s.D.cols(); ++i) {
        if (s.D(r, i) != 0) ++count, at = i;
      }
      if (count != 1 || is_taken[std::size_t(at)]) continue;
      is_taken[std::size_t(at)] = true;
      singles.push_back({r, at});
    }
  }
}

void RiccatiKkt::Matrices::find(const Stage& s, bool all) {
  const Index n = s.H.cols(), links = s.C.rows();
  touched.clear(), H.clear(), C.clear(), C_begin.assign(1, 0);
  for (Index j = 0; j < n && !all; ++j) {
    for (Index i = 0; i < n; ++i) {
      if (i == j || s.H(i, j) != 0) H.push_back({std::uint32_t(i), std::uint32_t(j), 0});
    }
    for (Index i = 0; i < links; ++i) {
      if (s.C(i, j) != 0) C.push_back({std::uint32_t(i), std::uint32_t(j), 0});
    }
    if (C.size() > C_begin.back()) touched.push_back(j), C_begin.push_back(C.size());
  }
  are_columns = all || n <= kSmall || 3 * Index(H.size() + C.size()) > n * (n + links);
  if (!are_columns) return;
  touched.resize(std::size_t(n));
  std::iota(touched.begin(), touched.end(), Index(0));
}

void RiccatiKkt::Matrices::take(const Stage& s, double shift) {
  const Index n = s.H.cols(), links = s.C.rows();
  if (!are_columns) {
    for (Entry& e : H) e.value = s.H(e.row, e.column) + (e.row == e.column ? shift : 0);
    for (Entry& e : C) e.value = s.C(e.row, e.column);
    return;
  }
  const Index of_z = padded(n), of_link = padded(links);
  resize(H_columns, of_z, n), resize(C_columns, of_link, n), resize(Ct, of_z, links);
  for (Index j = 0; j < n; ++j) {
    const double* const of_H = s.H.data() + j * n;
    double* const column = H_columns.data() + j * of_z;
    for (Index i = 0; i < n; ++i) column[i] = of_H[i];
    column[j] += shift;
    const double* const of_C = s.C.data() + j * links;
    double* const to = C_columns.data() + j * of_link;
    double* const row = Ct.data() + j;
    for (Index i = 0; i < links; ++i) to[i] = row[i * of_z] = of_C[i];
  }
}

// The order of rows and variables, and the rows: of single links, of the stage itself, of other links.
void RiccatiKkt::arrange(std::size_t k, double elastic) {
  const Stage& s = stages_[k];
  Factor& f = factors_[k];
  const Index n = s.H.cols(), links = s.D.rows(), rows = links + s.G.rows();
  const Index all = n + (elastic > 0 ? rows : 0), pad = padded(all);
  std::vector<Index>& is_said = work_.place;
  is_said.assign(std::size_t(all), 0);
  f.row.clear(), f.col.clear();
  for (const Single& single : f.singles) {
    if (elastic > 0 || s.D(single.link, single.variable) == 0) continue;
    f.row.push_back(single.link), f.col.push_back(single.variable);
    is_said[std::size_t(single.variable)] = 1;
  }
  const Index carried = f.carried = Index(f.row.size());
  for (Index r = links; r < rows; ++r) f.row.push_back(r);
  for (Index r = 0, of_single = 0; r < links; ++r) {
    if (of_single < carried && f.row[std::size_t(of_single)] == r)
      ++of_single;
    else
      f.row.push_back(r);
  }
  for (Index i = 0; i < all; ++i) {
    if (!is_said[std::size_t(i)]) f.col.push_back(i);
  }
  f.pivots.resize(carried);
  for (Index i = 0; i < carried; ++i) f.pivots[i] = -1 / s.D(f.row[std::size_t(i)], f.col[std::size_t(i)]);

  bool keep_order = true;  // of variables
  for (Index i = 0; i < carried; ++i) keep_order &= f.col[std::size_t(i)] == i;
  resize(f.M, pad, rows - carried);
  work_.sizes.resize(rows - carried);
  for (Index c = 0; c < rows - carried; ++c) {
    const Index row = f.row[std::size_t(carried + c)];
    const double* const from = row < links ? s.D.data() + row * n : s.G.data() + (row - links) * n;
    double* const to = f.M.data() + c * pad;
    if (keep_order)
      std::copy(from, from + n, to);
    else
      for (Index i = 0; i < n; ++i) to[i] = from[f.col[std::size_t(i)]];
    std::fill(to + n, to + pad, 0.0);
    if (elastic > 0) to[n + c] = 1;
    work_.sizes[c] = padded_largest(to, pad);
    for (Index i = 0; i < carried; ++i) to[i] *= -f.pivots[i];
  }
}

// Each row is solved for the free variable with the largest coefficient; the previous stage's variables are links.
// Rows nearly eliminated by earlier pivots come last (cancellation); rows that vanish are linearly dependent and are
// dropped.
void RiccatiKkt::eliminate_rows(Factor& f, Index links) {
  MatrixXd& M = f.M;
  VectorXd& sizes = work_.sizes;
  const Index pad = M.rows(), all = Index(f.col.size()), carried = f.carried;
  const Index count = M.cols(), own = Index(f.row.size()) - links,
              most_steps = std::min(count, all - carried);
  f.rank = carried;
  for (Index step = 0; step < most_steps; ++step) {
    const Index at_step = carried + step;
    Index pivot = at_step, chosen = -1;
    double most = kDependent;
    const auto look_at = [&](Index c) {
      const double* const row = M.data() + c * pad;
      // Entries before the step in its block of columns are ignored.
      const Index first = (at_step + kPad - 1) / kPad * kPad;
      double largest = first < pad ? padded_largest(row + first, pad - first) : 0;
      for (Index i = at_step; i < std::min(first, all); ++i) largest = std::max(largest, std::abs(row[i]));
      if (!(largest > most * sizes[c])) return;
      most = largest / sizes[c], pivot = at_step, chosen = c;
      while (std::abs(row[pivot]) != largest) ++pivot;
    };
    for (Index c = step; c < own && most < kMuch; ++c) look_at(c);
    if (chosen < 0) {
      most = kDependentLink;
      for (Index c = std::max(step, own); c < count && most < kMuch; ++c) look_at(c);
    }
    if (chosen < 0) return;
    if (chosen != step) {
      M.col(chosen).swap(M.col(step));
      std::swap(f.row[std::size_t(carried + chosen)], f.row[std::size_t(at_step)]);
      std::swap(sizes[chosen], sizes[step]);
    }
    if (pivot != at_step) {
      M.row(pivot).swap(M.row(at_step));
      std::swap(f.col[std::size_t(pivot)], f.col[std::size_t(at_step)]);
    }
    const double* const row = M.data() + step * pad;
    const double inverse = 1 / row[at_step];
    for (Index c = step + 1; c < count; ++c) {
      double* const other = M.data() + c * pad;
      if (other[at_step] == 0) continue;
      other[at_step] *= inverse;
      add(other + at_step + 1, -other[at_step], row + at_step + 1, all - at_step - 1);
    }
    f.rank = at_step + 1;
  }
}

// X = - U11^-1 [ U12 | L11^-1 (rows of the link) ], transposed; the remainder of the other rows is R.
void RiccatiKkt::solve_rows(Factor& f, Index links) {
  const Index of_M = f.M.rows(), all = Index(f.col.size()), carried = f.carried, rank = f.rank;
  const Index basic = rank - carried, free = f.free = all - rank, left = f.M.cols() - basic;
  const Index pad = padded(free + links);
  const double* const M = f.M.data();
  f.X.setZero(pad, basic);
  f.R.setZero(left, links);
  for (Index c = 0; c < basic + left; ++c) {
    const Index row = f.row[std::size_t(carried + c)];
    if (row < links) (c < basic ? f.X(free + row, c) : f.R(c - basic, row)) = 1;
  }
  double* const X = f.X.data();
  const Index of_links = free / kPad * kPad;  // links begin after it
  for (Index begin = 0; begin < basic; begin += kPad) {
    const Index end = std::min(begin + kPad, basic);
    for (Index c = begin; c < end; ++c) {
      double* const column = X + c * pad;
      for (Index j = 0; j < carried; ++j) column[free + f.row[std::size_t(j)]] -= M[j + c * of_M];
    }
    add_product<Factors::kMinusColumns>(X + of_links + begin * pad, pad, X + of_links, pad,
                                        M + carried + begin * of_M, of_M, pad - of_links, begin, end - begin);
    for (Index c = begin; c < end; ++c) {
      double* const column = X + c * pad + of_links;
      for (Index j = begin; j < c; ++j)
        add(column, -M[carried + j + c * of_M], X + j * pad + of_links, pad - of_links);
    }
  }
  for (Index i = 0; i < left; ++i) {
    const double* const row = M + (basic + i) * of_M;
    for (Index j = 0; j < carried; ++j) f.R(i, f.row[std::size_t(j)]) -= row[j];
    for (Index j = 0; j < basic; ++j) {
      const double factor = row[carried + j];
      if (factor == 0) continue;
      for (Index c = 0; c < links; ++c) f.R(i, c) -= factor * X[free + c + j * pad];
    }
  }
  for (Index c = 0; c < basic; ++c) std::copy(M + rank + c * of_M, M + all + c * of_M, X + c * pad);
  for (Index end = basic; end > 0;) {  // signs of columns after the end have changed already
    const Index begin = (end - 1) / kPad * kPad;
    add_product(X + begin * pad, pad, X + end * pad, pad, M + carried + end + begin * of_M, of_M, pad,
                basic - end, end - begin);
    for (Index c = end; c-- > begin;) {
      double* const column = X + c * pad;
      const double* const of_U = M + carried + c + c * of_M;
      add_columns(column, column + pad, pad, of_U + 1, end - c - 1, pad);
      const double inverse = -1 / of_U[0];
      for (Index i = 0; i < pad; ++i) column[i] *= inverse;
    }
    end = begin;
  }
}

// Destinations of entries of Q: S for free or carried variables; Y and B for basic ones.
struct RiccatiKkt::Assembly {
  const Factor& f;
  Index pad, of_B;
  Index* place;    // of each variable (Work), and a buffer
  double* weight;  // of each variable: its factor for the variable at its index
  double *S, *Y, *B;

  double* column(Index to) const { return to >= 0 ? S + to * pad : Y - (to + 1) * pad; }
  void add(Index i, Index j, double value) const {
    const Index to = place[j], at = place[i];
    if (at >= 0)
      column(to)[at] += weight[i] * weight[j] * value;
    else if (to < 0)
      B[-(at + 1) - (to + 1) * of_B] += value;
  }
  // Carried variables come first, in the order of their links, which are also the first of `variables`.
  Index in_order(const std::vector<Index>& variables) const {
    Index i = 0;
    while (i < std::min(f.carried, Index(variables.size())) && f.row[std::size_t(i)] == i &&
           f.col[std::size_t(i)] == i && variables[std::size_t(i)] == i)
      ++i;
    return i;
  }
  void add_columns(const double* W, Index of_W, const std::vector<Index>& variables) const;
};

// Columns of Q by some variables, for these.
void RiccatiKkt::Assembly::add_columns(const double* W, Index of_W,
                                       const std::vector<Index>& variables) const {
  const Index count = Index(variables.size()), simple = in_order(variables);
  // After the simple ones: the rows that are not basic, then the basic ones.
  Index* const order = place + f.col.size();
  Index *rest_end = order, *end = order;
  for (Index i = simple; i < count; ++i) {
    if (place[variables[std::size_t(i)]] >= 0) *rest_end++ = i;
  }
  end = rest_end;
  for (Index i = simple; i < count; ++i) {
    if (place[variables[std::size_t(i)]] < 0) *end++ = i;
  }
  for (Index c = 0; c < count; ++c) {
    const double* const w = W + c * of_W;
    const Index j = variables[std::size_t(c)], to = place[j];
    double* const sum = column(to);
    const double of_j = to >= 0 ? weight[j] : 1;
    for (Index i = 0; i < simple; ++i) sum[f.free + i] += of_j * (f.pivots[i] * w[i]);
    for (const Index* i = order; i != rest_end; ++i) {
      const Index variable = variables[std::size_t(*i)];
      sum[place[variable]] += of_j * (weight[variable] * w[*i]);
    }
    if (to >= 0) continue;
    for (const Index* i = rest_end; i != end; ++i)
      B[-(place[variables[std::size_t(*i)]] + 1) - (to + 1) * of_B] += w[*i];
  }
}

RiccatiKkt::Assembly RiccatiKkt::begin_assembly(const Factor& f, Index n, Index both) {
  const Index all = Index(f.col.size()), basic = f.rank - f.carried, pad = padded(both);
  work_.place.resize(std::size_t(all + n));
  const Assembly to{f,
                    pad,
                    padded(basic),
                    work_.place.data(),
                    room(work_.weight, all),
                    room(work_.S, pad * both),
                    zeros(work_.Y, pad * basic),
                    zeros(work_.B, padded(basic) * basic)};
  for (Index p = 0; p < all; ++p) {
    const Index variable = f.col[std::size_t(p)];
    to.place[variable] = p < f.carried ? f.free + f.row[std::size_t(p)]
                         : p < f.rank  ? f.carried - p - 1
                                       : p - f.rank;
    to.weight[variable] = p < f.carried ? f.pivots[p] : 1;
  }
  for (Index j = 0; j < both; ++j) std::fill(to.S + j * pad + j / kPad * kPad, to.S + (j + 1) * pad, 0.0);
  return to;
}

// H and the cost-to-go of the next stage, C^T P C, if most entries may be nonzero.
void RiccatiKkt::add_all(const Matrices& m, const Factor* next, const Assembly& to) {
  const Index n = m.H_columns.cols(), of_W = padded(n);
  double* const W = room(work_.W, of_W * n);
  std::copy(m.H_columns.data(), m.H_columns.data() + of_W * n, W);
  if (next) {
    const Index of_C = next->P.rows(), links = next->P.cols();
    double* const PC = zeros(work_.PC, of_C * n);
    add_product(PC, of_C, next->P.data(), of_C, m.C_columns.data(), of_C, of_C, links, n);
    add_product(W, of_W, m.Ct.data(), of_W, PC, of_C, of_W, links, n);
  }
  to.add_columns(W, of_W, m.touched);
}

// The same for the nonzero entries only.
void RiccatiKkt::add_nonzeros(const Matrices& m, const Factor* next, const Assembly& to) {
  for (const Entry& e : m.H) to.add(e.row, e.column, e.value);
  const Index count = Index(m.touched.size()), of_W = padded(count), of_C = next ? next->P.rows() : 0;
  double* const PC = room(work_.PC, of_C * count);
  double* const CP = room(work_.CP, of_W * of_C);
  double* const W = room(work_.W, of_W * count);
  const auto multiply = [&](double* product, const double* columns, Index stride) {
    for (Index j = 0; j < count; ++j) {
      std::size_t e = m.C_begin[std::size_t(j)];
      const double* const first = columns + m.C[e].row * stride;
      for (Index i = 0; i < stride; ++i) product[i + j * stride] = m.C[e].value * first[i];
      while (++e < m.C_begin[std::size_t(j) + 1])
        add(product + j * stride, m.C[e].value, columns + m.C[e].row * stride, stride);
    }
  };
  if (next) multiply(PC, next->P.data(), of_C);
  for (Index i = 0; i < of_C; i += kPad) {
    for (Index j = 0; j < count; ++j) {
      for (Index part = i; part < i + kPad; ++part) CP[j + part * of_W] = PC[part + j * of_C];
    }
    for (Index part = i; part < i + kPad; ++part)
      std::fill(CP + count + part * of_W, CP + (part + 1) * of_W, 0.0);
  }
  multiply(W, CP, of_W);
  to.add_columns(W, of_W, m.touched);
}

// S: the cost-to-go as a function of free variables and the link's values, lower triangle.  With Q the cost in all
// variables, where the basic ones are X^T of these:  S = Q_rest + Y X^T + X Y^T,  Y = Q_(rest, basic) + 1/2 X
// Q_(basic, basic).
void RiccatiKkt::assemble(std::size_t k, double shift, double elastic) {
  Factor& f = factors_[k];
  const Index n = stages_[k].H.cols(), basic = f.rank - f.carried, both = f.free + stages_[k].D.rows();
  f.matrices.take(stages_[k], shift);
  const Assembly to = begin_assembly(f, n, both);
  const Factor* const next = k + 1 < stages() ? &factors_[k + 1] : nullptr;
  f.matrices.are_columns ? add_all(f.matrices, next, to) : add_nonzeros(f.matrices, next, to);
  for (Index i = n; i < Index(f.col.size()); ++i) to.add(i, i, 1 / elastic);
  work_.own.resize(f.free);
  for (Index j = 0; j < f.free; ++j) work_.own[j] = to.S[j + j * to.pad];
  if (basic == 0) return;
  for (Index i = 0; i < to.of_B * basic; ++i) to.B[i] *= 0.5;
  const double* const X = f.X.data();
  add_product(to.Y, to.pad, X, to.pad, to.B, to.of_B, to.pad, basic, basic);
  add_symmetric_product<Factors::kRows>(to.S, to.pad, to.Y, to.pad, X, to.pad, to.pad, basic, both);
  add_symmetric_product<Factors::kRows>(to.S, to.pad, X, to.pad, to.Y, to.pad, to.pad, basic, both);
}

// Minimises over free variables, kPad at a time; the remainder is the cost-to-go.  Returns false if there is no
// minimum.  Entries above the diagonal are undefined.
bool RiccatiKkt::minimise(Factor& f, Index links) {
  const Index free = f.free, both = free + links, pad = padded(both);
  double* const S = work_.S.data();
  for (Index begin = 0; begin < free; begin += kPad) {
    const Index end = std::min(begin + kPad, free), length = pad - begin;
    for (Index j = begin; j < end; ++j) {
      double* const column = S + j * pad + begin;
      const double pivot = column[j - begin];
      const double before = std::min(1.0, std::abs(work_.own[j]));  // except springs
      if (!(pivot > kFlat * before) || !std::isfinite(pivot)) return false;
      const double inverse = 1 / std::sqrt(pivot);
      for (Index i = 0; i < length; ++i) column[i] *= inverse;
      for (Index c = j + 1; c < end; ++c) add(S + c * pad + begin, -column[c - begin], column, length);
    }
    // Columns after these.
    const double* const columns = S + begin * pad;
    const Index first = end / kPad * kPad;
    add_symmetric_product<Factors::kMinusRows>(S + first + end * pad, pad, columns + first, pad,
                                               columns + end, pad, pad - first, end - begin, both - end);
  }
  return true;
}

void RiccatiKkt::take_cost_to_go(Factor& f, Index links) {
  const Index free = f.free, pad = padded(free + links), left = f.R.rows();
  const double* const S = work_.S.data();
  f.L.resize(pad, free);
  for (Index j = 0; j < free; ++j) {
    std::fill(f.L.data() + j * pad, f.L.data() + j * pad + j, 0.0);
    std::copy(S + j * pad + j, S + j * pad + pad, f.L.data() + j * pad + j);
  }
  const Index of_P = padded(links);
  resize(f.P, of_P, links);
  double* const P = f.P.data();
  for (Index j = 0; j < links; ++j) {
    const double* const column = S + (free + j) * pad + free;
    std::copy(column + j, column + links, P + j + j * of_P);
    for (Index r = 0; r < left; ++r) {
      for (Index i = j; i < links; ++i) P[i + j * of_P] += kSpring * f.R(r, i) * f.R(r, j);
    }
  }
  for (Index first = 0; first < links; first += kPad) {  // above the diagonal
    const Index end = std::min(first + kPad, links);
    for (Index j = 0; j < end; ++j) {
      for (Index i = std::max(first, j + 1); i < end; ++i) P[j + i * of_P] = P[i + j * of_P];
    }
  }
}

bool RiccatiKkt::factor(double shift, double elastic) {
  inverse_elastic_ = elastic > 0 ? 1 / elastic : 0;
  for (std::size_t k = stages(); k-- > 0;) {
    Factor& f = factors_[k];
    const Index links = stages_[k].D.rows();
    arrange(k, elastic);
    eliminate_rows(f, links);
    solve_rows(f, links);
    assemble(k, shift, elastic);
    if (!minimise(f, links)) return false;
    take_cost_to_go(f, links);
  }
  return true;
}

}  // namespace dyntape
