// SPDX-License-Identifier: BSD-3-Clause
//
// Scaling: the nominal values of variables, rows and the cost, by which solvers divide (scaled_nlp.h).
//
//   Betts, Practical Methods for Optimal Control, 1.16.5 and 4.8: a variable's nominal value is its movement in the
//   initial guess, at most the range of its bounds; one value for all points; a defect has that of its state.
//
//   Ruiz, A scaling algorithm to equilibrate both rows and columns norms in matrices, 2001: for variables that the
//   guess does not move, the nominal value makes the largest entry of the column one, with rows divided by their
//   norms; sweeps go half of the way in logarithms.  Each samples the Jacobian around a constant guess, since
//   derivatives at the guess itself may be zero.
//
// Formulas multiply and compare quantities of equal units, so a change of the units of mass, length and time changes
// nominal values like the numbers.
#include <algorithm>
#include <cmath>
#include <optional>

#include <dyntape/interface/control/discretize/staged_nlp.h>

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
constexpr double kFollowed =
    0.25;  // of what the derivatives of rows say: less, and a control has too large a value
constexpr int kMostHalvings = 20;
constexpr int kSweeps = 8;        // at most, until nominal values change by less than
constexpr double kSettled = 1.5;  // this factor
// The scaled size of the cost: with tolerance 1e-8 its optimum is then found to 1e-10, and barrier terms, which
// start at 0.1, do not dominate it.
constexpr double kCostResolution = 100;

// Largest entries of a Jacobian over some points, without entries that are rounding relative to their row.
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

// The factor that makes the infinity norm of a column one, with rows divided by their norms.  Ignores rows whose
// norm is zero or negligible; returns 0 if all are.
double column_scale(const Eigen::Ref<const VectorXd>& column, const VectorXd& norms) {
  VectorXd scales = (norms.array() > 0 && column.array() > 0).select(norms.cwiseQuotient(column), 0);
  const double rounding = kNegligible * scales.maxCoeff();
  const double least = (scales.array() > rounding).select(scales, HUGE_VAL).minCoeff();
  return std::isfinite(least) ? least : 0;
}

// Evenly over an interval of length `reach` around a start, a different point for each number.
std::vector<double> sample(std::vector<double> start, const VectorXd& reach, int number) {
  const double first = double(std::size_t(number) * start.size());
  for (std::size_t i = 0; i < start.size(); ++i)
    start[i] += (std::fmod(kGolden * (first + double(i + 1)), 1) - 0.5) * reach[Index(i) % reach.size()];
  return start;
}

// The first variable in the sums of rows, or none.
std::optional<std::size_t> variable_of(const StagedProgram& program, const RowBlock& block) {
  for (std::size_t t = block.first_term; t < block.last_term; ++t) {
    if (program.terms[t].evaluator == LinearTerm::kVariables) return program.terms[t].first;
  }
  return std::nullopt;
}

bool has_costs(const Problem& problem) {
  return std::any_of(problem.terms.begin(), problem.terms.end(),
                     [](const Term& term) { return !is_constraint(term.role); });
}

}  // namespace

// The nominal values of one phase; its functions are evaluated by the whole program's.
class PhaseScaling {
 public:
  PhaseScaling(StagedNlp& nlp, std::size_t k, const std::vector<double>& at)
      : nlp_(nlp), k_(k), phase_(nlp.phase(k)), problem_(phase_.problem), x_(at) {}

  // Writes into its part of `all`; returns false if nothing can be evaluated at the start and there are no previous
  // values.
  bool add_to(NlpScaling& all, const NlpScaling& before);

 private:
  // Of the node's rows, rates first, then of those of instants, for the last evaluation.
  struct Linearisation {
    MatrixXd derivatives;    // (rows x n_z) the largest |entries| of the Jacobian over the points
    VectorXd lacks, values;  // by how much rows lie outside their bounds, and |values|, at most
    VectorXd room;           // between their bounds
    RowFlags equations() const { return room.array() == 0 || lacks.array() > 0; }
  };
  bool evaluate_first(const std::vector<double>& own);
  bool gradient(const std::vector<double>& own, std::vector<double>& gradient);
  Linearisation linearisation() const;
  VectorXd extents(const std::vector<double>& start) const;
  VectorXd completed(VectorXd z, const Linearisation& at) const;
  VectorXd nominal_values(const std::vector<double>& start, Linearisation at);
  std::pair<VectorXd, VectorXd> cost_slopes(const std::vector<double>& start, const VectorXd& displacement);
  double newton_step(const std::vector<double>& start, Index entry);
  std::optional<MatrixXd> rows_at(const std::vector<double>& start, const VectorXd& displacement);
  void limit_controls(const std::vector<double>& start, const MatrixXd& derivatives, VectorXd& z);

  StagedNlp& nlp_;
  std::size_t k_;
  const StagedPhase& phase_;
  const Problem& problem_;
  std::vector<double> x_;  // of the whole program
};

bool PhaseScaling::evaluate_first(const std::vector<double>& own) {
  std::copy(own.begin(), own.end(), x_.begin() + long(phase_.variable));
  return nlp_.first_.run(nlp_.program_.evaluators, Order::kFirst, x_.data(), phase_.evaluators());
}

bool PhaseScaling::gradient(const std::vector<double>& own, std::vector<double>& gradient) {
  if (!evaluate_first(own)) return false;
  std::fill(gradient.begin(), gradient.end(), 0.0);
  for (std::size_t c = nlp_.gradient_begin_[k_]; c < nlp_.gradient_begin_[k_ + 1]; ++c) {
    const StagedNlp::Contribution& one = nlp_.of_gradient_[c];
    gradient[one.target - phase_.variable] += one.factor * nlp_.first_.jacobian[one.source];
  }
  return true;
}

PhaseScaling::Linearisation PhaseScaling::linearisation() const {
  const Index n_c = Index(phase_.stage.path_rows.size()), n_node = Index(phase_.n_x) + n_c,
              m = n_node + Index(phase_.stage.instant_rows.size());
  const VectorXd zero = VectorXd::Zero(m);
  Linearisation at{MatrixXd::Zero(m, Index(phase_.n_z)), zero, zero, zero};
  const auto read = [&](Index to, const std::vector<ConstraintRow>& rows, const double* values) {
    for (const auto& [name, lower, upper] : rows) {
      at.lacks[to] = std::max({at.lacks[to], lower - *values, *values - upper});
      at.values[to] = std::max(at.values[to], std::abs(*values++));
      at.room[to++] = upper - lower;
    }
  };
  const std::vector<Evaluator>& evaluators = nlp_.program_.evaluators;
  const double *y = nlp_.first_.y.data(), *jacobian = nlp_.first_.jacobian.data();
  const Evaluator& node = evaluators[phase_.evaluator];
  at.derivatives.topRows(n_node) =
      largest_slopes(node.function.jacobian_pattern(), jacobian + node.jacobian, phase_.used).topRows(n_node);
  for (std::size_t p = 0; p < phase_.used; ++p)
    read(Index(phase_.n_x), phase_.stage.path_rows, y + node.y + p * node.function.n_y() + phase_.n_x);
  Index first = n_node;
  for (std::size_t k = 0; k < phase_.instants.size(); ++k) {
    const Evaluator& instant = evaluators[phase_.evaluator + 1 + k];
    const std::vector<ConstraintRow>& rows = phase_.stage.instants[k].rows;
    if (rows.empty()) continue;
    at.derivatives.middleRows(first, Index(rows.size())) =
        largest_slopes(instant.function.jacobian_pattern(), jacobian + instant.jacobian, 1)
            .topRows(Index(rows.size()));
    read(first, rows, y + instant.y);
    first += Index(rows.size());
  }
  return at;
}

// Fills unknown nominal values (0) from known ones and from residuals of rows: states moved by other states, then
// accelerations and controls, then states moved by these.
VectorXd PhaseScaling::completed(VectorXd z, const Linearisation& at) const {
  const Index n_x = Index(phase_.n_x), n_z = Index(phase_.n_z), n_u = n_z - n_x;
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

// Sums over the points of the cost's derivatives by entries of z, and of their changes for a displacement of all
// points.
std::pair<VectorXd, VectorXd> PhaseScaling::cost_slopes(const std::vector<double>& start,
                                                        const VectorXd& displacement) {
  std::vector<double> here(phase_.variables()), there(phase_.variables()), moved = start;
  std::pair<VectorXd, VectorXd> sums{VectorXd::Zero(Index(phase_.n_z)), VectorXd::Zero(Index(phase_.n_z))};
  for (std::size_t i = 0; i < moved.size(); ++i) moved[i] += displacement[Index(i % phase_.n_z)];
  const bool bends = gradient(moved, there);
  if (!gradient(start, here)) return sums;
  for (std::size_t i = 0; i < start.size(); ++i) {
    sums.first[Index(i % phase_.n_z)] += std::abs(here[i]);
    if (bends) sums.second[Index(i % phase_.n_z)] += std::abs(there[i] - here[i]);
  }
  return sums;
}

// How far the cost alone would move an entry: its gradient over its curvature, or 0.  The second evaluation is at a
// displacement in the entry's own unit.
double PhaseScaling::newton_step(const std::vector<double>& start, Index entry) {
  double step = 1;
  for (int look = 0; look < 2; ++look) {
    const double displacement = kDisplacement * step;
    const auto [slope, bend] = cost_slopes(start, displacement * VectorXd::Unit(Index(phase_.n_z), entry));
    step = slope[entry] / (bend[entry] / displacement);
    if (!(step > 0 && std::isfinite(step))) return 0;
  }
  return step;
}

// The movement of states in the guess, if nothing better is known; 0: constant.
VectorXd PhaseScaling::extents(const std::vector<double>& start) const {
  const Eigen::Map<const MatrixXd> values(start.data(), Index(phase_.n_z), Index(phase_.points));
  VectorXd extent = values.rowwise().maxCoeff() - values.rowwise().minCoeff();
  extent = (extent.array() < kRounding * values.cwiseAbs().maxCoeff()).select(0, extent);
  extent.tail(Index(phase_.n_z - phase_.n_x)).setZero();
  for (Index c = 0; c < problem_.typical.size(); ++c) {
    if (problem_.typical[c] > 0) extent[c] = problem_.typical[c];
  }
  return extent;
}

VectorXd PhaseScaling::nominal_values(const std::vector<double>& start, Linearisation at) {
  const Index n_x = Index(phase_.n_x), n_z = Index(phase_.n_z);
  const Eigen::Map<const MatrixXd> values(start.data(), n_z, Index(phase_.points));
  const VectorXd extent = extents(start);
  VectorXd given =
      values.middleCols(Index(phase_.first_used), Index(phase_.used)).cwiseAbs().rowwise().maxCoeff();
  given.head(n_x).setZero();
  // Forces that balance up to rounding, as in a symmetric arm, give no information.
  given = (given.array() < kRounding * given.maxCoeff()).select(0, given);
  // Residuals that are rounding relative to the row's size are ignored.
  const VectorXd norms = row_norms(at.derivatives, completed(extent, at).cwiseMax(given));
  at.lacks = (at.lacks.array() < kNegligible * norms.array()).select(0, at.lacks);
  VectorXd z = completed(extent, at);
  // A state that moves by rounding only is scaled by the terms of its rate.  Once only: a stiff spring moves a speed
  // that moves the spring.
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

  // At most the range of the bounds; without information this range, or 1.
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

// (rows of a node x points) for a start with all points displaced; nothing if they cannot be evaluated.
std::optional<MatrixXd> PhaseScaling::rows_at(const std::vector<double>& start,
                                              const VectorXd& displacement) {
  std::vector<double> moved = start;
  for (std::size_t i = 0; i < moved.size(); ++i) moved[i] += displacement[Index(i % phase_.n_z)];
  if (!evaluate_first(moved)) return {};
  const Evaluator& node = nlp_.program_.evaluators[phase_.evaluator];
  MatrixXd rows(Index(phase_.n_x + phase_.stage.path_rows.size()), Index(phase_.used));
  for (std::size_t p = 0; p < phase_.used; ++p)
    rows.col(Index(p)) = VectorXd::Map(nlp_.first_.y.data() + node.y + p * node.function.n_y(), rows.rows());
  return rows;
}

// Halves the nominal value of a control while the rows follow it by less than their derivatives say: the sine of an angle does not
// follow it to 30 rad.  Solvers would weight its stationarity too much, and step over several turns.
void PhaseScaling::limit_controls(const std::vector<double>& start, const MatrixXd& derivatives,
                                  VectorXd& z) {
  const Index n_x = Index(phase_.n_x), n_z = z.size();
  VectorXd controls = z;
  controls.head(n_x).setZero();
  const auto here = rows_at(start, 0 * z), there = rows_at(start, controls),
             half = rows_at(start, controls / 2);
  if (!here || !there || !half) return;
  const double bend = (*there - 2 * *half + *here).cwiseAbs().maxCoeff();
  if (bend <= kUnresolved * (*there - *here).cwiseAbs().maxCoeff()) return;  // linear, as forces are
  const VectorXd norms = row_norms(derivatives.topRows(here->rows()), z);
  const auto size = [&](const VectorXd& rows) {
    return (norms.array() > 0).select(rows.cwiseQuotient(norms), 0).sum();
  };
  for (Index c = n_x; c < n_z; ++c) {
    for (int k = 0; k < kMostHalvings; ++k) {
      const auto moved = rows_at(start, z[c] * VectorXd::Unit(n_z, c));
      if (!moved) break;
      const VectorXd said = derivatives.col(c).head(here->rows()) * z[c],
                     done = (*moved - *here).cwiseAbs().rowwise().maxCoeff().cwiseMin(said);
      if (size(done) >= kFollowed * size(said)) break;
      z[c] /= 2;
    }
  }
}

bool PhaseScaling::add_to(NlpScaling& all, const NlpScaling& before) {
  const auto first_variable = x_.begin() + long(phase_.variable);
  const std::vector<double> at(first_variable, first_variable + long(phase_.variables()));
  if (!evaluate_first(at)) return false;
  const Index n_x = Index(phase_.n_x), n_c = Index(phase_.stage.path_rows.size());
  const Linearisation here = linearisation();
  const RowFlags equations = here.equations();
  Linearisation around = here;
  VectorXd z = nominal_values(at, here);
  // States that only residuals of rows, or the cost, move; and the rows that change as a result.
  Linearisation met = here;
  met.lacks.setZero();
  RowFlags still = completed(extents(at), met).array() == 0;
  still.tail(z.size() - n_x).setConstant(false);
  bool settled = !still.any();
  for (int sweep = 0; sweep < kSweeps && !settled; ++sweep) {
    if (!evaluate_first(sample(at, still.select(z, 0), sweep))) continue;
    MatrixXd there = linearisation().derivatives;
    // Movement of a state by rounding, relative to its own nominal value: forces that cancel.
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
  limit_controls(at, here.derivatives, z);
  if (!before.x.empty()) {
    const VectorXd last = Eigen::Map<const VectorXd>(before.x.data() + phase_.variable, z.size());
    z = (z.array() < kUnresolved * last.array()).select(last, z);
  }
  // Of the cost, from its derivatives at the start and near it: a least-squares cost may start at its minimum.
  const auto [slope, bend] = cost_slopes(at, kDisplacement * z);
  const double cost = slope.cwiseMax(bend / (2 * kDisplacement)).cwiseProduct(z).maxCoeff();
  if (phase_.cost < nlp_.program_.end_of_costs(k_) && has_costs(problem_))
    all.objective += cost > 0 && std::isfinite(cost) ? cost / kCostResolution : 1;
  // Of rows their norms, else the range of their bounds, else 1.  A row whose norm is rounding relative to its value
  // is constant, e.g. the distance of two bodies without a joint between them.
  VectorXd norms = row_norms(around.derivatives, z);
  for (Index i = 0; i < norms.size(); ++i) {
    if (norms[i] > kRounding * here.values[i]) continue;
    norms[i] = here.room[i] > 0 && std::isfinite(here.room[i]) ? here.room[i] : 1;
  }
  for (std::size_t p = 0; p < phase_.points; ++p)
    std::copy(z.begin(), z.end(), all.x.begin() + long(phase_.variable_of(p)));
  Index of_instants = n_x + n_c;
  for (const RowBlock& block : nlp_.program_.rows) {
    if (block.phase != k_ || variable_of(nlp_.program_, block)) continue;
    const auto size = Index(block.size);
    const bool is_of_node = nlp_.program_.terms[block.first_term].evaluator == phase_.evaluator;
    const Index first = is_of_node ? n_x : of_instants;
    VectorXd::Map(all.g.data() + block.row, size) = norms.segment(first, size);
    if (!is_of_node) of_instants += size;
  }
  return true;
}

// Sums the costs of phases.  Rows that are sums of variables have the size of these.
NlpScaling StagedNlp::scaling(const std::vector<double>& at, const NlpScaling& before) {
  NlpScaling all{0, std::vector<double>(shape().n()), std::vector<double>(shape().m())};
  forget();
  for (std::size_t k = 0; k < phases(); ++k) {
    if (!PhaseScaling(*this, k, at).add_to(all, before)) return before;
  }
  if (all.objective == 0) all.objective = 1;
  for (const RowBlock& block : program_.rows) {
    if (const std::optional<std::size_t> variable = variable_of(program_, block))
      std::copy_n(all.x.begin() + long(*variable), block.size, all.g.begin() + long(block.row));
  }
  return all;
}

}  // namespace dyntape
