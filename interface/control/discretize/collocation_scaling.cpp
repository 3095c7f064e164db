// SPDX-License-Identifier: BSD-3-Clause
//
// Scaling: the nominal values of variables, rows and the cost, by which solvers divide (scaled_nlp.h).
//
//   Betts, Practical Methods for Optimal Control, 1.16.5 and 4.8: a variable's nominal value is how far the first guess moves it,
//   and no more than its bounds leave; it is one for all points; a defect has that of its state.
//
//   Ruiz, A scaling algorithm to equilibrate both rows and columns norms in matrices, 2001: of what the guess leaves at rest,
//   the nominal value makes the largest entry of its column one where rows are divided by theirs; sweeps go half of the
//   way in logarithms.  Each samples the Jacobian around the guess where it stands still, as derivatives there may be those of a cosine
//   at its top.
//
// Formulas multiply and compare quantities of one unit, so that other units of mass, length and time change nominal values
// as they change the numbers.
#include <algorithm>
#include <cmath>

#include <dyntape/interface/control/discretize/collocation.h>

namespace dyntape {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowFlags = Eigen::Array<bool, Eigen::Dynamic, 1>;

constexpr double kRounding = 1e-13;     // what is smaller, relative to its like, is rounding
constexpr double kNegligible = 1e-12;   // and what is computed from it
constexpr double kPace = 4;             // a motion speeds up and slows down again: it changes in T / kPace
constexpr double kDisplacement = 1e-3;  // at which curvature of the cost is looked for
constexpr double kGolden = 0.61803398874989485;  // its multiples, less whole numbers, lie evenly
constexpr double kUnresolved = 1e-7;  // what a solve leaves of its unit need not be more than its tolerance
constexpr int kSweeps = 8;            // at most, until nominal values change by less than
constexpr double kSettled = 1.5;      // this factor
// What the cost amounts to once it is divided: its optimum is then found to 1e-10 with a tolerance of 1e-8, and
// barrier terms, which start at 0.1, do not outweigh it.
constexpr double kCostResolution = 100;

// Largest entries over some points of a Jacobian, without what is rounding beside others of its row.
MatrixXd largest_slopes(const Pattern& pattern, const double* nonzeros, std::size_t points) {
  MatrixXd derivatives = MatrixXd::Zero(Index(pattern.rows), Index(pattern.cols));
  for (std::size_t k = 0; k < points * pattern.nnz(); ++k) {
    double& most = derivatives(pattern.row[k % pattern.nnz()], pattern.col[k % pattern.nnz()]);
    most = std::max(most, std::abs(nonzeros[k]));
  }
  for (auto row : derivatives.rowwise()) row = (row.array() < kRounding * row.maxCoeff()).select(0, row);
  return derivatives;
}

// Infinity norms of rows whose columns are multiplied by z.
VectorXd row_norms(const MatrixXd& derivatives, const VectorXd& z) {
  return (derivatives * z.asDiagonal()).rowwise().maxCoeff();
}

// What makes the infinity norm of a column one, its rows divided by their norms.  Rows of norm 0 say nothing, nor do those whose
// norm is rounding beside another's; 0: none says anything.
double column_scale(const Eigen::Ref<const VectorXd>& column, const VectorXd& norms) {
  VectorXd scales = (norms.array() > 0 && column.array() > 0).select(norms.cwiseQuotient(column), 0);
  const double rounding = kNegligible * scales.maxCoeff();
  const double least = (scales.array() > rounding).select(scales, HUGE_VAL).minCoeff();
  return std::isfinite(least) ? least : 0;
}

// Evenly over an interval as long as `reach` around a start, another point for each number.
std::vector<double> sample(std::vector<double> start, const VectorXd& reach, int number) {
  const double first = double(std::size_t(number) * start.size());
  for (std::size_t i = 0; i < start.size(); ++i)
    start[i] += (std::fmod(kGolden * (first + double(i + 1)), 1) - 0.5) * reach[Index(i) % reach.size()];
  return start;
}

}  // namespace

Collocation::Linearisation Collocation::linearisation() const {
  const Index n_c = Index(stage_.path_rows.size()), n_node = Index(n_x_) + n_c,
              m = n_node + Index(stage_.instant_rows.size());
  const VectorXd zero = VectorXd::Zero(m);
  Linearisation at{MatrixXd::Zero(m, Index(n_z_)), zero, zero, zero};
  const auto read = [&](Index to, const std::vector<ConstraintRow>& rows, const double* values) {
    for (const auto& [name, lower, upper] : rows) {
      at.lacks[to] = std::max({at.lacks[to], lower - *values, *values - upper});
      at.values[to] = std::max(at.values[to], std::abs(*values++));
      at.room[to++] = upper - lower;
    }
  };
  at.derivatives.topRows(n_node) =
      largest_slopes(functions_->node().jacobian_pattern(), first_j_.data(), used_).topRows(n_node);
  for (std::size_t p = 0; p < used_; ++p)
    read(Index(n_x_), stage_.path_rows, first_y_.data() + p * stage_.node.n_y() + n_x_);
  Index first = n_node;
  for (std::size_t k = 0; k < stage_.instants.size(); ++k) {
    const StageFunctions::Instant& instant = functions_->instants()[k];
    const std::vector<ConstraintRow>& rows = stage_.instants[k].rows;
    if (rows.empty()) continue;
    const Pattern& pattern = instant.function.jacobian_pattern();
    at.derivatives.middleRows(first, Index(rows.size())) =
        largest_slopes(pattern, first_j_.data() + instant.jacobian, 1).topRows(Index(rows.size()));
    read(first, rows, first_y_.data() + instant.y);
    first += Index(rows.size());
  }
  return at;
}

// Nominal values that are not known (0), from those that are and from what rows lack: states that other states move, then
// accelerations and controls, then states that these move.
VectorXd Collocation::completed(VectorXd z, const Linearisation& at) const {
  const Index n_x = Index(n_x_), n_z = Index(n_z_), n_u = n_z - n_x;
  MatrixXd derivatives = at.derivatives;
  auto own = derivatives.topLeftCorner(n_x, n_x).diagonal();
  own = own.cwiseMax(kPace / problem_.duration);
  const RowFlags all = at.equations(),
                 of_states = all && derivatives.rightCols(n_u).rowwise().sum().array() == 0;
  RowFlags rates = RowFlags::Constant(derivatives.rows(), false);
  rates.head(n_x).setConstant(true);
  const auto give = [&](Index first, Index last, const RowFlags& rows) {
    const VectorXd norms = rows.select(row_norms(derivatives, z).cwiseMax(at.lacks), 0), before = z;
    for (Index c = first; c < last; ++c) {
      if (z[c] > 0) continue;
      z[c] = column_scale(derivatives.col(c), norms);
      if (c < problem_.most_typical.size() && problem_.most_typical[c] > 0)
        z[c] = std::min(z[c], problem_.most_typical[c]);
    }
    return z != before;
  };
  while (give(0, n_x, of_states) || give(n_x, n_z, rates) || give(n_x, n_z, all) || give(0, n_x, rates)) {
  }
  return z;
}

// Sums over the points of the cost's derivatives by entries of z, and of what a displacement of all points changes them by.
std::pair<VectorXd, VectorXd> Collocation::cost_slopes(const std::vector<double>& start,
                                                       const VectorXd& displacement) {
  std::vector<double> here(shape_.n()), there(shape_.n()), moved = start;
  std::pair<VectorXd, VectorXd> sums{VectorXd::Zero(Index(n_z_)), VectorXd::Zero(Index(n_z_))};
  for (std::size_t i = 0; i < moved.size(); ++i) moved[i] += displacement[Index(i % n_z_)];
  const bool bends = gradient(moved.data(), there.data());
  if (!gradient(start.data(), here.data())) return sums;
  for (std::size_t i = 0; i < start.size(); ++i) {
    sums.first[Index(i % n_z_)] += std::abs(here[i]);
    if (bends) sums.second[Index(i % n_z_)] += std::abs(there[i] - here[i]);
  }
  return sums;
}

// How far the cost alone would move an entry: its slope over its curvature, 0 where that says nothing.  The second
// look is from a displacement in the entry's own unit.
double Collocation::newton_step(const std::vector<double>& start, Index entry) {
  double step = 1;
  for (int look = 0; look < 2; ++look) {
    const double displacement = kDisplacement * step;
    const auto [slope, bend] = cost_slopes(start, displacement * VectorXd::Unit(Index(n_z_), entry));
    step = slope[entry] / (bend[entry] / displacement);
    if (!(step > 0 && std::isfinite(step))) return 0;
  }
  return step;
}

// How far the guess moves states, where nothing better is known of them; 0: they stand still.
VectorXd Collocation::extents(const std::vector<double>& start) const {
  const Eigen::Map<const MatrixXd> values(start.data(), Index(n_z_), Index(points_));
  VectorXd extent = values.rowwise().maxCoeff() - values.rowwise().minCoeff();
  extent = (extent.array() < kRounding * values.cwiseAbs().maxCoeff()).select(0, extent);
  extent.tail(Index(n_z_ - n_x_)).setZero();
  for (Index c = 0; c < problem_.typical.size(); ++c) {
    if (problem_.typical[c] > 0) extent[c] = problem_.typical[c];
  }
  return extent;
}

VectorXd Collocation::nominal_values(const std::vector<double>& start, Linearisation at) {
  const Index n_x = Index(n_x_), n_z = Index(n_z_);
  const Eigen::Map<const MatrixXd> values(start.data(), n_z, Index(points_));
  const VectorXd extent = extents(start);
  VectorXd given = values.middleCols(Index(first_used_), Index(used_)).cwiseAbs().rowwise().maxCoeff();
  given.head(n_x).setZero();
  // What a row lacks by rounding, beside what it then amounts to, moves nothing.
  const VectorXd norms = row_norms(at.derivatives, completed(extent, at).cwiseMax(given));
  at.lacks = (at.lacks.array() < kNegligible * norms.array()).select(0, at.lacks);
  VectorXd z = completed(extent, at);
  // A state that moves by rounding alone is moved by what its rate is made of.  Once: a stiff spring moves a speed that moves
  // the spring.
  RowFlags replaced = RowFlags::Constant(n_x, false);
  for (Index sweep = 0; sweep < n_x; ++sweep) {
    const VectorXd moved = problem_.duration / kPace * row_norms(at.derivatives.topRows(n_x), z);
    const RowFlags by_rounding = !replaced && z.head(n_x).array() < kNegligible * moved.array();
    z.head(n_x) = by_rounding.select(moved, z.head(n_x));
    replaced = replaced || by_rounding;
  }
  z = completed(z.cwiseMax(given), at);
  for (Index c = 0; c < n_x; ++c) {
    if (z[c] == 0) z[c] = newton_step(start, c);
  }
  z = completed(z, at);

  // Nothing is larger than its bounds leave room for; what nothing tells takes that room, or 1.
  VectorXd lower(n_z), upper(n_z);
  lower << problem_.x.lower, problem_.a.lower, problem_.u.lower;
  upper << problem_.x.upper, problem_.a.upper, problem_.u.upper;
  const VectorXd room = upper - lower;
  for (Index c = 0; c < n_x; ++c) {
    if (z[c] > 0 || std::isfinite(lower[c]) == std::isfinite(upper[c])) continue;
    z[c] = (values.row(c).array() - (std::isfinite(lower[c]) ? lower[c] : upper[c])).abs().maxCoeff();
  }
  z = completed(z, at);
  for (Index c = 0; c < n_z; ++c) {
    if (std::isfinite(room[c]) && room[c] > 0 && (z[c] == 0 || z[c] > room[c])) z[c] = room[c];
    if (z[c] == 0 || !std::isfinite(z[c])) z[c] = 1;
  }
  return z;
}

NlpScaling Collocation::scaling(const std::vector<double>& at, const NlpScaling& before) {
  if (!evaluate_first(at.data())) return before;
  const Index n_x = Index(n_x_), n_c = Index(stage_.path_rows.size());
  const Linearisation here = linearisation();
  const RowFlags equations = here.equations();
  Linearisation around = here;
  VectorXd z = nominal_values(at, here);
  // States that only what rows lack moves, or the cost, and the rows that are then to change.
  Linearisation met = here;
  met.lacks.setZero();
  RowFlags still = completed(extents(at), met).array() == 0;
  still.tail(z.size() - n_x).setConstant(false);
  bool settled = !still.any();
  for (int sweep = 0; sweep < kSweeps && !settled; ++sweep) {
    if (!evaluate_first(sample(at, still.select(z, 0), sweep).data())) continue;
    MatrixXd there = linearisation().derivatives;
    // What moves a state by rounding beside the change that its own nominal value is: forces that cancel.
    for (Index i = 0; i < n_x; ++i) {
      auto row = there.row(i).array();
      const double own = kPace / problem_.duration * z[i];
      row = (row * z.transpose().array() < kNegligible * own).select(0, row);
    }
    for (Index i = 0; i < there.rows(); ++i) {
      if (equations[i]) around.derivatives.row(i) = here.derivatives.row(i).cwiseMax(there.row(i));
    }
    const VectorXd last = z;
    z = z.array().sqrt() * nominal_values(at, around).array().sqrt();
    settled = (z.array() < kSettled * last.array() && last.array() < kSettled * z.array()).all();
  }
  if (!before.x.empty()) {
    const VectorXd last = Eigen::Map<const VectorXd>(before.x.data(), z.size());
    z = (z.array() < kUnresolved * last.array()).select(last, z);
  }
  // Of the cost, from its derivatives at the start and a little beside it: a least-squares cost may start at its least.
  const auto [slope, bend] = cost_slopes(at, kDisplacement * z);
  const double cost = slope.cwiseMax(bend / (2 * kDisplacement)).cwiseProduct(z).maxCoeff();
  NlpScaling m{cost > 0 && std::isfinite(cost) ? cost / kCostResolution : 1};
  // Of rows their norms, else the room between their bounds, else 1.  A row whose norm is rounding beside its value is constant:
  // the distance of two bodies that no joint moves.
  VectorXd norms = row_norms(around.derivatives, z);
  for (Index i = 0; i < norms.size(); ++i) {
    if (norms[i] > kRounding * here.values[i]) continue;
    norms[i] = here.room[i] > 0 && std::isfinite(here.room[i]) ? here.room[i] : 1;
  }
  const auto append = [](std::vector<double>& to, const auto& part) {
    to.insert(to.end(), part.begin(), part.end());
  };
  for (std::size_t p = 0; p < points_; ++p) append(m.x, z);
  for (std::size_t k = 0; k < intervals_ * rows_; ++k) append(m.g, z.head(n_x));
  for (std::size_t k = 0; k < intervals_ * std::size_t(scheme_.held.rows()); ++k)
    append(m.g, z.tail(Index(problem_.n_u())));
  for (std::size_t p = 0; p < used_; ++p) append(m.g, norms.segment(n_x, n_c));
  append(m.g, norms.tail(norms.size() - n_x - n_c));
  return m;
}

}  // namespace dyntape
