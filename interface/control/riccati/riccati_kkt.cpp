// SPDX-License-Identifier: BSD-3-Clause
//
// Matrices are small, so what counts is that all that moves lies side by side: everything is sums of columns, and rows of the
// problem are stored as columns.
#include <dyntape/interface/control/riccati/riccati_kkt.h>

#include <cmath>

#include <dyntape/interface/control/riccati/columns.h>

namespace dyntape {

using namespace columns;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of its largest entry: what is left of a row that others make up.  A pivot p that a link is solved for leaves a cost to go of
// 1 / p^2: below this no digit of what is free would be left.  Least time has such pivots at its optimum, as multipliers of its last
// rows cancel there.  Rows of the stage itself come first, so that theirs leave nothing.
constexpr double kDependentLink = 1e-7, kDependent = 1e-11;
constexpr double kMuch = 0.01;    // the same: enough to be solved for
constexpr double kFlat = 1e-14;   // of its entry: what is left of a variable that has no curvature of its own
constexpr double kSpring = 1e10;  // what rows without a variable of their own cost, squared and halved
}  // namespace

RiccatiKkt::RiccatiKkt(const std::vector<StageSizes>& sizes, bool puts_in_links)
    : stages_(sizes.size()),
      factors_(sizes.size()),
      first_variable_{0},
      first_row_{0},
      puts_in_links_(puts_in_links) {
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    const Eigen::Index n = sizes[k].variables, links = sizes[k].links;
    const Eigen::Index next = k + 1 < sizes.size() ? sizes[k + 1].links : 0;
    stages_[k] = {MatrixXd::Zero(n, n), MatrixXd::Zero(next, n), Rows::Zero(sizes[k].rows, n),
                  Rows::Zero(links, n)};
    first_variable_.push_back(first_variable_.back() + n);
    first_row_.push_back(first_row_.back() + links + sizes[k].rows);
  }
}

// Links that say one variable each by the stage before, as steps forward do, come first: solved for, they leave all other
// rows as they are.  Then the rows of the stage itself, then other links.
void RiccatiKkt::order_rows(Factor& f, const Stage& s, bool puts_in) {
  const Eigen::Index n = s.H.rows(), links = s.D.rows(), rows = links + s.G.rows();
  f.row.clear(), f.col.clear();
  std::vector<Eigen::Index> others;
  std::vector<bool> is_taken(std::size_t(n), false);
  for (Eigen::Index r = 0; r < links; ++r) {
    const double* const row = s.D.data() + r * n;
    Eigen::Index count = 0, at = 0;
    for (Eigen::Index i = 0; puts_in && i < n && count < 2; ++i) {
      if (row[i] != 0) ++count, at = i;
    }
    if (count != 1 || is_taken[std::size_t(at)]) {
      others.push_back(r);
      continue;
    }
    is_taken[std::size_t(at)] = true;
    f.row.push_back(r), f.col.push_back(at);
  }
  f.carried = Eigen::Index(f.row.size());
  for (Eigen::Index r = links; r < rows; ++r) f.row.push_back(r);
  f.row.insert(f.row.end(), others.begin(), others.end());
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!is_taken[std::size_t(i)]) f.col.push_back(i);
  }
  for (Eigen::Index i = n; i < f.M.rows(); ++i) f.col.push_back(i);
}

// The cost of a stage with all behind it, and its rows.
void RiccatiKkt::assemble(std::size_t k, double shift, double elastic) {
  const Stage& s = stages_[k];
  Factor& f = factors_[k];
  const Eigen::Index n = s.H.rows(), links = s.D.rows(), own = links + s.G.rows();
  const Eigen::Index all = n + (elastic > 0 ? own : 0);
  const Factor* const next = k + 1 < stages_.size() ? &factors_[k + 1] : nullptr;
  f.Q.resize(all, all);
  f.M.resize(all, own);
  if (all > n) {
    f.Q.setZero(), f.M.setZero();
    f.Q.diagonal().tail(own).setConstant(1 / elastic);
    f.M.bottomLeftCorner(own, own).setIdentity();  // of rows in their order here
  }
  f.Q.topLeftCorner(n, n) = s.H;
  f.Q.diagonal().head(n).array() += shift;
  order_rows(f, s, puts_in_links_ && elastic == 0);
  for (Eigen::Index r = 0; r < own; ++r) {
    const Eigen::Index row = f.row[std::size_t(r)];
    const double* const from = row < links ? s.D.data() + row * n : s.G.data() + (row - links) * n;
    std::copy(from, from + n, f.M.data() + r * all);
  }
  if (!next) return;
  // Q += C^T P C
  for (Eigen::Index j = 0; j < n; ++j) {
    double* const column = f.Q.data() + j * all;
    for (std::size_t e = f.C_begin[std::size_t(j)]; e < f.C_begin[std::size_t(j) + 1]; ++e)
      add(column, f.C[e].value, next->CP.data() + f.C[e].row * n, n);
  }
}

// Each row is solved for the free variable that it weighs most, those of the stage before its links.  Rows of which others have
// left little wait, as what is left of them has lost digits; those of which nothing is left are made up by others.
void RiccatiKkt::eliminate_rows(Factor& f, Eigen::Index links) {
  MatrixXd& M = f.M;
  const Eigen::Index n = M.rows(), rows = M.cols();
  const Eigen::Index carried = f.carried, own = carried + rows - links;
  f.s.resize(rows);  // sizes of the rows
  for (Eigen::Index r = 0; r < rows; ++r) f.s[r] = n > 0 ? M.col(r).cwiseAbs().maxCoeff() : 0;
  if (carried > 0) order_variables(f);
  f.rank = carried;
  for (Eigen::Index step = carried; step < std::min(rows, n); ++step) {
    Eigen::Index pivot = step, chosen = -1;
    double most = kDependent;
    const auto look_at = [&](Eigen::Index r) {
      const double* const row = M.data() + r * n;
      Eigen::Index at = step;
      double largest = 0;
      for (Eigen::Index i = step; i < n; ++i) {
        if (std::abs(row[i]) > largest) largest = std::abs(row[i]), at = i;
      }
      if (largest > most * f.s[r]) most = largest / f.s[r], pivot = at, chosen = r;
    };
    for (Eigen::Index r = step; r < own && most < kMuch; ++r) look_at(r);
    if (chosen < 0) {
      most = kDependentLink;
      for (Eigen::Index r = std::max(step, own); r < rows && most < kMuch; ++r) look_at(r);
    }
    if (chosen < 0) return;
    if (chosen != step) {
      M.col(chosen).swap(M.col(step));
      std::swap(f.row[std::size_t(chosen)], f.row[std::size_t(step)]), std::swap(f.s[chosen], f.s[step]);
    }
    if (pivot != step) {
      M.row(pivot).swap(M.row(step));
      std::swap(f.col[std::size_t(pivot)], f.col[std::size_t(step)]);
    }
    const double* const row = M.data() + step * n;
    const double inverse = 1 / row[step];
    for (Eigen::Index r = step + 1; r < rows; ++r) {
      double* const other = M.data() + r * n;
      if (other[step] == 0) continue;
      other[step] *= inverse;
      add(other + step + 1, -other[step], row + step + 1, n - step - 1);
    }
    f.rank = step + 1;
  }
}

// Variables in the order of f.col; carried ones are solved for.
void RiccatiKkt::order_variables(Factor& f) {
  const Eigen::Index n = f.M.rows(), rows = f.M.cols();
  f.t.resize(n);
  for (Eigen::Index r = 0; r < rows; ++r) {
    double* const row = f.M.data() + r * n;
    for (Eigen::Index i = 0; i < n; ++i) f.t[i] = row[f.col[std::size_t(i)]];
    std::copy(f.t.data(), f.t.data() + n, row);
  }
  for (Eigen::Index r = f.carried; r < rows; ++r) {
    for (Eigen::Index i = 0; i < f.carried; ++i) f.M(i, r) /= f.M(i, i);
  }
}

// Free variables are minimised, kPad at a time: what is left is the cost to go.  False where they have no minimum.
bool RiccatiKkt::minimise(Factor& f, Eigen::Index links) {
  const Eigen::Index free = f.free, both = free + links, pad = f.S.rows();
  double* const S = f.S.data();
  for (Eigen::Index begin = 0; begin < free; begin += kPad) {
    const Eigen::Index end = std::min(begin + kPad, free);
    for (Eigen::Index j = begin; j < end; ++j) {
      double* const column = S + j * pad;
      const double pivot = column[j];
      const double before = std::min(1.0, std::abs(f.Q(f.rank + j, f.rank + j)));  // but for springs
      if (!(pivot > kFlat * before) || !std::isfinite(pivot)) return false;
      const double inverse = 1 / std::sqrt(pivot);
      for (Eigen::Index i = j; i < both; ++i) column[i] *= inverse;
      for (Eigen::Index c = j + 1; c < end; ++c) add(S + c * pad + c, -column[c], column + c, both - c);
    }
    // Columns behind these: what is above the diagonal is nobody's.
    const double* const columns = S + begin * pad;
    add_product<Factors::kMinusRows>(S + begin + end * pad, pad, columns + begin, pad, columns + end, pad,
                                     pad - begin, end - begin, both - end);
  }
  return true;
}

// False where what is free has no minimum.
bool RiccatiKkt::eliminate(std::size_t k) {
  Factor& f = factors_[k];
  const Eigen::Index links = stages_[k].D.rows();
  eliminate_rows(f, links);
  const Eigen::Index n = f.M.rows(), rows = f.M.cols(), rank = f.rank;
  const Eigen::Index free = f.free = n - rank, left = rows - rank, both = free + links, pad = padded(both);
  const double* const M = f.M.data();

  // X = - U11^-1 [ U12 | L11^-1 (rows that the link's are) ], transposed; what is left of the others is R.
  f.X.setZero(pad, rank);
  f.R.setZero(left, links);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Eigen::Index row = f.row[std::size_t(i)];
    if (row < links) (i < rank ? f.X(free + row, i) : f.R(i - rank, row)) = 1;
  }
  double* const X = f.X.data();
  const Eigen::Index carried = f.carried;
  for (Eigen::Index i = carried; i < rank; ++i) {
    double* const column = X + i * pad;
    for (Eigen::Index j = 0; j < carried; ++j) column[free + f.row[std::size_t(j)]] -= M[j + i * n];
    for (Eigen::Index j = carried; j < i; ++j) {
      const double factor = M[j + i * n];
      if (factor != 0) add(column + free, -factor, X + j * pad + free, links);
    }
  }
  for (Eigen::Index i = 0; i < left; ++i) {
    for (Eigen::Index j = 0; j < carried; ++j) f.R(i, f.row[std::size_t(j)]) -= M[j + (rank + i) * n];
    for (Eigen::Index j = carried; j < rank; ++j) {
      const double factor = M[j + (rank + i) * n];
      if (factor == 0) continue;
      for (Eigen::Index c = 0; c < links; ++c) f.R(i, c) -= factor * X[free + c + j * pad];
    }
  }
  for (Eigen::Index i = carried; i < rank; ++i) std::copy(M + rank + i * n, M + n + i * n, X + i * pad);
  for (Eigen::Index i = 0; i < carried; ++i) X[free + f.row[std::size_t(i)] + i * pad] = -1 / M[i + i * n];
  for (Eigen::Index i = rank; i-- > carried;) {
    double* const column = X + i * pad;
    add_columns(column, column + pad, pad, M + i + 1 + i * n, rank - i - 1,
                pad);  // their sign has changed already
    const double inverse = -1 / M[i + i * n];
    for (Eigen::Index c = 0; c < pad; ++c) column[c] *= inverse;
  }

  // Q in the order of the pivots.
  f.ordered.resize(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const double* from = f.Q.data() + f.col[std::size_t(j)] * n;
    double* to = f.ordered.data() + j * n;
    for (Eigen::Index i = 0; i < n; ++i) to[i] = from[f.col[std::size_t(i)]];
  }
  f.Q.swap(f.ordered);

  // V = (X | I) Q, S = V (X | I)^T: its lower triangle.
  f.V.resize(pad, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    double* const column = f.V.data() + j * pad;
    const double* const of_Q = f.Q.data() + j * n;
    std::copy(of_Q + rank, of_Q + n, column);
    std::fill(column + free, column + pad, 0.0);
  }
  f.t.resize(carried);
  bool in_order = true;
  for (Eigen::Index i = 0; i < carried; ++i) {
    const Eigen::Index row = f.row[std::size_t(i)];
    f.t[i] = X[free + row + i * pad], in_order &= row == i;
  }
  for (Eigen::Index j = 0; j < n; ++j) {
    double* const of_links = f.V.data() + j * pad + free;
    const double* const of_Q = f.Q.data() + j * n;
    if (in_order) {
      for (Eigen::Index i = 0; i < carried; ++i) of_links[i] += f.t[i] * of_Q[i];
    } else {
      for (Eigen::Index i = 0; i < carried; ++i) of_links[f.row[std::size_t(i)]] += f.t[i] * of_Q[i];
    }
  }
  add_product(f.V.data(), pad, X + carried * pad, pad, f.Q.data() + carried, n, pad, rank - carried, n);
  f.S.resize(pad, both);
  std::copy(f.V.data() + rank * pad, f.V.data() + n * pad, f.S.data());
  std::fill(f.S.data() + free * pad, f.S.data() + both * pad, 0.0);
  for (Eigen::Index i = 0; i < carried; ++i) {
    const Eigen::Index at = free + f.row[std::size_t(i)];
    add(f.S.data() + at * pad, X[at + i * pad], f.V.data() + i * pad, pad);
  }
  add_symmetric_product<Factors::kRows>(f.S.data(), pad, f.V.data() + carried * pad, pad, X + carried * pad,
                                        pad, pad, rank - carried, both);
  if (!minimise(f, links)) return false;
  f.P.resize(links, links);
  for (Eigen::Index j = 0; j < links; ++j) {
    for (Eigen::Index i = j; i < links; ++i) {
      double spring = 0;
      for (Eigen::Index r = 0; r < left; ++r) spring += f.R(r, i) * f.R(r, j);
      f.P(i, j) = f.P(j, i) = f.S(free + i, free + j) + kSpring * spring;
    }
  }
  return true;
}

// What the stage before gets of this one.
void RiccatiKkt::hand_down(std::size_t k) {
  Factor &f = factors_[k], &before = factors_[k - 1];
  const MatrixXd& C = stages_[k - 1].C;
  const Eigen::Index n = C.cols(), links = C.rows();
  before.C.clear(), before.C_begin.assign(1, 0);
  f.PC.setZero(links, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = 0; i < links; ++i) {
      const double value = C(i, j);
      if (value == 0) continue;
      before.C.push_back({i, value});
      add(f.PC.data() + j * links, value, f.P.data() + i * links, links);
    }
    before.C_begin.push_back(before.C.size());
  }
  f.CP = f.PC.transpose();
}

bool RiccatiKkt::factor(double shift, double elastic) {
  for (std::size_t k = stages_.size(); k-- > 0;) {
    assemble(k, shift, elastic);
    if (!eliminate(k)) return false;
    if (k > 0) hand_down(k);
  }
  return true;
}

// What a stage and all behind it make of the right side: z0, r0, y.  `slope` (links of the next stage): of the cost to go by what
// the next link brings; null: zero.
void RiccatiKkt::sweep_back(std::size_t k, const VectorXd& a, const VectorXd& b, const double* slope) {
  Factor& f = factors_[k];
  const Eigen::Index links = stages_[k].D.rows();
  const Eigen::Index rows = f.M.cols(), n = f.M.rows(), rank = f.rank, free = f.free, pad = f.X.rows();
  const double* const M = f.M.data();
  // q and the constants of the rows, by pivots.
  f.q.resize(n), f.s.resize(rows);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index variable = f.col[std::size_t(i)];
    if (variable >= stages_[k].H.rows()) {
      f.q[i] = 0;
      continue;
    }
    f.q[i] = -a[first_variable_[k] + variable];
    if (!slope) continue;
    for (std::size_t e = f.C_begin[std::size_t(variable)]; e < f.C_begin[std::size_t(variable) + 1]; ++e)
      f.q[i] += f.C[e].value * slope[f.C[e].row];
  }
  for (Eigen::Index i = 0; i < rows; ++i) {
    f.s[i] = -b[first_row_[k] + f.row[std::size_t(i)]];
  }
  for (Eigen::Index i = 0; i < rows; ++i) f.s[i] -= dot(M + i * n, f.s.data(), std::min(i, rank));
  f.r0 = f.s.tail(rows - rank);
  f.z0.resize(rank);
  for (Eigen::Index i = rank; i-- > 0;) {
    const double* const of_U = M + i * n + i;
    f.z0[i] = -(f.s[i] + dot(of_U + 1, f.z0.data() + i + 1, rank - i - 1)) / of_U[0];
  }
  f.t = f.q;
  add_columns(f.t.data(), f.Q.data(), n, f.z0.data(), rank, n);
  // Slope of the free variables and of the cost to go.
  f.y.setZero(pad);
  f.y.head(free) = f.t.tail(free);
  add_columns(f.y.data(), f.X.data(), pad, f.t.data(), rank, pad);
  for (Eigen::Index j = 0; j < free; ++j) {
    const double* const column = f.S.data() + j * pad;
    f.y[j] /= column[j];
    add(f.y.data() + j + 1, -f.y[j], column + j + 1, free + links - j - 1);
  }
  for (Eigen::Index r = 0; r < rows - rank; ++r) {
    for (Eigen::Index c = 0; c < links; ++c) f.y[free + c] += kSpring * f.R(r, c) * f.r0[r];
  }
}

// A stage's variables (its entries of z) and f.t, the same by pivots, once those of the stage before are there.
void RiccatiKkt::sweep_forward(std::size_t k, double* z) {
  Factor& f = factors_[k];
  const Eigen::Index links = stages_[k].D.rows();
  const Eigen::Index n = f.M.rows(), rank = f.rank, free = f.free, pad = f.X.rows();
  // Free variables, in the place of their derivatives; what the link brings behind them.
  auto brought = f.y.segment(free, links);
  brought.setZero();
  if (k > 0) {
    const Factor& before = factors_[k - 1];
    const double* const of_z = z + first_variable_[k - 1];
    for (std::size_t j = 0; j + 1 < before.C_begin.size(); ++j) {
      for (std::size_t e = before.C_begin[j]; e < before.C_begin[j + 1]; ++e)
        brought[before.C[e].row] += before.C[e].value * of_z[j];
    }
  }
  for (Eigen::Index j = free; j-- > 0;) {
    const double* const column = f.S.data() + j * pad;
    // Minus L^-T (w + W y): free entries behind j have their sign changed already.
    f.y[j] = -(f.y[j] + dot(column + free, brought.data(), links)) / column[j] -
             dot(column + j + 1, f.y.data() + j + 1, free - j - 1) / column[j];
  }
  f.t.resize(n);
  for (Eigen::Index i = 0; i < rank; ++i)
    f.t[i] = f.z0[i] + dot(f.X.data() + i * pad, f.y.data(), free + links);
  f.t.tail(free) = f.y.head(free);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index variable = f.col[std::size_t(i)];
    if (variable < stages_[k].H.rows()) z[first_variable_[k] + variable] = f.t[i];
  }
}

// Multipliers of a stage's rows, by what they hold against.
void RiccatiKkt::take_multipliers(std::size_t k, double* lambda) {
  Factor& f = factors_[k];
  const Eigen::Index links = stages_[k].D.rows();
  const Eigen::Index rows = f.M.cols(), n = f.M.rows(), rank = f.rank;
  const double* const M = f.M.data();
  f.lambda.setZero(rows);
  double* const multiplier = f.lambda.data();
  add_columns(multiplier, f.Q.data(), n, f.t.data(), n, rank);
  for (Eigen::Index i = 0; i < rank; ++i) multiplier[i] = -(multiplier[i] + f.q[i]);
  for (Eigen::Index i = 0; i < rank; ++i) {
    multiplier[i] /= M[i + i * n];
    add(multiplier + i + 1, -multiplier[i], M + i + 1 + i * n, rank - i - 1);
  }
  for (Eigen::Index i = rank; k > 0 && i < rows; ++i) {
    double missed = f.r0[i - rank];
    for (Eigen::Index c = 0; c < links; ++c) missed += f.R(i - rank, c) * f.y[f.free + c];
    multiplier[i] = kSpring * missed;
    add(multiplier, -multiplier[i], M + i * n, rank);
  }
  for (Eigen::Index i = rank; i-- > 0;) add(multiplier, -multiplier[i], M + i * n, i);
  for (Eigen::Index i = 0; i < rows; ++i) lambda[first_row_[k] + f.row[std::size_t(i)]] = multiplier[i];
}

void RiccatiKkt::solve(const VectorXd& a, const VectorXd& b, VectorXd& z, VectorXd& lambda) {
  z.resize(variables()), lambda.resize(rows());
  for (std::size_t k = stages(); k-- > 0;) {
    const Factor* const next = k + 1 < stages() ? &factors_[k + 1] : nullptr;
    sweep_back(k, a, b, next ? next->y.data() + next->free : nullptr);
  }
  for (std::size_t k = 0; k < stages(); ++k) {
    sweep_forward(k, z.data());
    take_multipliers(k, lambda.data());
  }
}

void RiccatiKkt::solve_first(const VectorXd& a, const VectorXd& b, VectorXd& z) {
  if (stages() > 1) sweep_back(1, a, b, nullptr);
  sweep_back(0, a, b, stages() > 1 ? factors_[1].y.data() + factors_[1].free : nullptr);
  sweep_forward(0, z.data());
}

}  // namespace dyntape
