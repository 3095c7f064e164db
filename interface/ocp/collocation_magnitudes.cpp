// SPDX-License-Identifier: BSD-3-Clause
//
// How large the numbers of a program typically are.  Every rule below multiplies and compares quantities of one
// unit, so that other units of mass, length and time change the magnitudes as they change the numbers.
#include <algorithm>
#include <cmath>

#include <dyntape/interface/ocp/collocation.h>

namespace dyntape {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRounding = 1e-13;     // what is smaller, relative to its like, is rounding
constexpr double kNegligible = 1e-6;    // a state that its rate outgrows by more is not known yet
constexpr double kPace = 4;             // a motion speeds up and slows down again: it changes in T / kPace
constexpr double kDisplacement = 1e-3;  // at which curvature of the cost is looked for
// What the cost amounts to once it is divided: its optimum is then found to 1e-10 with a tolerance of 1e-8, and
// barrier terms, which start at 0.1, do not outweigh it.
constexpr double kCostResolution = 100;

// Largest slopes over all points, (rows x variables of a point), without what is rounding beside others of its row.
MatrixXd largest_slopes(const Pattern& pattern, const std::vector<double>& nonzeros, std::size_t first,
                        std::size_t points) {
  MatrixXd slopes = MatrixXd::Zero(Index(pattern.rows), Index(pattern.cols));
  for (std::size_t k = 0; k < points * pattern.nnz(); ++k) {
    double& most = slopes(pattern.row[k % pattern.nnz()], pattern.col[k % pattern.nnz()]);
    most = std::max(most, std::abs(nonzeros[first + k]));
  }
  for (auto row : slopes.rowwise()) row = (row.array() < kRounding * row.maxCoeff()).select(0, row);
  return slopes;
}

// The largest term of row i, as far as its terms are known.
double term(const MatrixXd& slopes, Index i, const VectorXd& z) {
  return slopes.row(i).transpose().cwiseProduct(z).maxCoeff();
}

// Gives entries [first, last) that are not known what makes their term in a row as large as the row is: the
// least over all rows in which they count.  Rows of size 0 say nothing.
void balance(VectorXd& z, Index first, Index last, const MatrixXd& slopes, const VectorXd& rows) {
  for (Index c = first; c < last; ++c) {
    double least = HUGE_VAL;
    for (Index i = 0; i < rows.size(); ++i) {
      if (rows[i] > 0 && slopes(i, c) > 0) least = std::min(least, rows[i] / slopes(i, c));
    }
    if (z[c] == 0 && std::isfinite(least)) z[c] = least;
  }
}

// By how much each row lies outside its bounds.
VectorXd missing(const std::vector<ConstraintRow>& rows, const double* values) {
  VectorXd result(Index(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    result[Index(i)] = std::max({0.0, rows[i].lower - values[i], values[i] - rows[i].upper});
  }
  return result;
}

// How far each entry moves over the points.
VectorXd extents(const Eigen::Map<const MatrixXd>& values) {
  const VectorXd extent = values.rowwise().maxCoeff() - values.rowwise().minCoeff();
  const double rounding = kRounding * values.cwiseAbs().maxCoeff();
  return (extent.array() < rounding).select(0, extent);
}

// Nothing is larger than its bounds leave room for; what nothing tells takes that room, or 1.
void keep_within(VectorXd& z, const VectorXd& room) {
  for (Index c = 0; c < z.size(); ++c) {
    const bool bounded = std::isfinite(room[c]) && room[c] > 0;
    if (bounded && (z[c] == 0 || z[c] > room[c])) z[c] = room[c];
    if (z[c] == 0 || !std::isfinite(z[c])) z[c] = 1;
  }
}

// Of constraint rows: their largest term, else the room between their bounds, else 1.
std::vector<double> row_magnitudes(const MatrixXd& slopes, const std::vector<ConstraintRow>& rows,
                                   const VectorXd& z) {
  VectorXd sizes(Index(rows.size())), room = sizes;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    sizes[Index(i)] = term(slopes, Index(i), z);
    room[Index(i)] = sizes[Index(i)] > 0 ? HUGE_VAL : rows[i].upper - rows[i].lower;
  }
  keep_within(sizes, room);
  return {sizes.begin(), sizes.end()};
}

}  // namespace

// Of the entries of a point.  What is zero afterwards is moved by nothing.
VectorXd Collocation::stage_magnitudes(const std::vector<double>& start, const MatrixXd& slopes,
                                       const MatrixXd& end_slopes) const {
  const Index n_x = Index(n_x_), n_z = Index(n_z_);
  const double time = problem_.duration / kPace;
  const Eigen::Map<const MatrixXd> values(start.data(), n_z, Index(points_));
  const Index n_c = Index(stage_.path_rows.size());
  const auto rates = slopes.topRows(n_x), relations = slopes.middleRows(n_x, n_c);
  VectorXd z = VectorXd::Zero(n_z);
  z.head(n_x) = extents(Eigen::Map<const MatrixXd>(start.data(), n_z, Index(points_))).head(n_x);

  // A start that stands still has to move as far as its end lacks.
  const double* end = first_y_.data() + used_ * node_->n_y();
  balance(z, 0, n_x, end_slopes, missing(stage_.terminal_rows, end));

  // States whose rate no control enters are moved by other states: a position gives its velocity.
  VectorXd kinematic = z.head(n_x) / time;
  for (Index i = 0; i < n_x; ++i) {
    if (!rates.row(i).tail(n_z - n_x).isZero(0)) kinematic[i] = 0;
  }
  balance(z, 0, n_x, rates, kinematic);

  // Accelerations and controls balance the rates, then what is left of them the path equations.
  VectorXd rows = z.head(n_x) / time;
  for (Index i = 0; i < n_x; ++i) {
    if (rows[i] > 0) rows[i] = std::max(rows[i], term(rates, i, z));
  }
  balance(z, n_x, n_z, rates, rows);
  VectorXd equations = VectorXd::Zero(n_c);
  for (Index i = 0; i < n_c; ++i) {
    const ConstraintRow& row = stage_.path_rows[std::size_t(i)];
    if (row.lower == row.upper) equations[i] = term(relations, i, z);
  }
  balance(z, n_x, n_z, relations, equations);
  const VectorXd given = values.bottomRows(n_z - n_x).leftCols(Index(used_)).cwiseAbs().rowwise().maxCoeff();
  z.tail(n_z - n_x) = z.tail(n_z - n_x).cwiseMax(given);

  // A state that starts and ends alike is moved by what its rate is made of.
  for (Index sweep = 0; sweep < n_x; ++sweep) {
    for (Index i = 0; i < n_x; ++i) {
      const double moved = time * term(rates, i, z);
      if (z[i] < kNegligible * moved) z[i] = moved;
    }
  }
  return z;
}

// Of the cost, from its slopes at the start and a little beside it: a least-squares cost may start at its least.
double Collocation::cost_magnitude(const std::vector<double>& start, const VectorXd& z) {
  std::vector<double> there = start, here_slope(shape_.n()), there_slope(shape_.n());
  for (std::size_t i = 0; i < there.size(); ++i) there[i] += kDisplacement * z[Index(i % n_z_)];
  if (!gradient(start.data(), here_slope.data())) return 1;
  const bool curved = gradient(there.data(), there_slope.data());
  VectorXd slope = VectorXd::Zero(z.size()), bend = slope;
  for (std::size_t i = 0; i < start.size(); ++i) {
    const Index c = Index(i % n_z_);
    slope[c] += std::abs(here_slope[i]) * z[c];
    if (curved) bend[c] += std::abs(there_slope[i] - here_slope[i]) * z[c] / (2 * kDisplacement);
  }
  const double cost = slope.cwiseMax(bend).maxCoeff();
  return cost > 0 && std::isfinite(cost) ? cost / kCostResolution : 1;
}

NlpMagnitudes Collocation::magnitudes(const std::vector<double>& start) {
  if (!evaluate_first(start.data())) return {};
  const std::size_t nonzeros = used_ * node_->jacobian().nnz();
  const MatrixXd slopes = largest_slopes(node_->jacobian(), first_j_, 0, used_);
  const MatrixXd end_slopes = largest_slopes(terminal_->jacobian(), first_j_, nonzeros, 1);
  VectorXd z = stage_magnitudes(start, slopes, end_slopes), lower(z.size()), upper(z.size());
  lower << problem_.x.lower, problem_.a.lower, problem_.u.lower;
  upper << problem_.x.upper, problem_.a.upper, problem_.u.upper;
  keep_within(z, upper - lower);
  NlpMagnitudes m{cost_magnitude(start, z)};
  const auto path = row_magnitudes(slopes.bottomRows(slopes.rows() - Index(n_x_)), stage_.path_rows, z);
  const auto append = [](std::vector<double>& to, const auto& part) {
    to.insert(to.end(), part.begin(), part.end());
  };
  for (std::size_t p = 0; p < points_; ++p) append(m.x, z);
  for (std::size_t k = 0; k < intervals_ * rows_; ++k) append(m.g, z.head(Index(n_x_)));
  for (std::size_t p = 0; p < used_; ++p) append(m.g, path);
  append(m.g, row_magnitudes(end_slopes, stage_.terminal_rows, z));
  return m;
}

}  // namespace dyntape
