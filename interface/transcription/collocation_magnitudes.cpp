// SPDX-License-Identifier: BSD-3-Clause
//
// How large the numbers of a program typically are.  Every rule below multiplies and compares quantities of one
// unit, so that other units of mass, length and time change the magnitudes as they change the numbers.
#include <algorithm>
#include <cmath>

#include <dyntape/interface/transcription/collocation.h>

namespace dyntape {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRounding = 1e-13;     // what is smaller, relative to its like, is rounding
constexpr double kNegligible = 1e-12;   // a state that its rate outgrows by more moves by rounding alone
constexpr double kPace = 4;             // a motion speeds up and slows down again: it changes in T / kPace
constexpr double kDisplacement = 1e-3;  // at which curvature of the cost is looked for
constexpr double kGolden = 0.61803398874989485;  // its multiples, less whole numbers, lie evenly
constexpr double kUnresolved = 1e-7;  // what a solve leaves of its unit need not be more than its tolerance
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
// least over all rows in which they count.  Rows of size 0 say nothing, and one that gives what is rounding beside what another
// gives is rounding itself.
void balance(VectorXd& z, Index first, Index last, const MatrixXd& slopes, const VectorXd& rows) {
  for (Index c = first; c < last; ++c) {
    double least = HUGE_VAL, most = 0;
    for (Index i = 0; i < rows.size(); ++i) {
      if (rows[i] > 0 && slopes(i, c) > 0) most = std::max(most, rows[i] / slopes(i, c));
    }
    for (Index i = 0; i < rows.size(); ++i) {
      if (rows[i] > 0 && slopes(i, c) > 0 && rows[i] / slopes(i, c) >= kNegligible * most)
        least = std::min(least, rows[i] / slopes(i, c));
    }
    if (z[c] == 0 && std::isfinite(least)) z[c] = least;
  }
}

// Whether the terms of some row are much larger by other slopes.
bool have_grown(const MatrixXd& slopes, const MatrixXd& there, const VectorXd& z) {
  constexpr double kMuch = 4;
  for (Index i = 0; i < slopes.rows(); ++i) {
    if (term(there, i, z) > kMuch * term(slopes, i, z)) return true;
  }
  return false;
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

// Of constraint rows: their largest term, else the room between their bounds, else 1.  A row whose terms are rounding
// beside its value is constant: the distance of two bodies that no joint moves but by rounding.
std::vector<double> row_magnitudes(const MatrixXd& slopes, const std::vector<ConstraintRow>& rows,
                                   const VectorXd& z, const VectorXd& values) {
  VectorXd sizes(Index(rows.size())), room = sizes;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    sizes[Index(i)] = term(slopes, Index(i), z);
    if (sizes[Index(i)] < kRounding * values[Index(i)]) sizes[Index(i)] = 0;
    room[Index(i)] = sizes[Index(i)] > 0 ? HUGE_VAL : rows[i].upper - rows[i].lower;
  }
  keep_within(sizes, room);
  return {sizes.begin(), sizes.end()};
}

}  // namespace

VectorXd Collocation::instant_values(const std::vector<double>& y) const {
  VectorXd values(Index(stage_.instant_rows.size()));
  Index row = 0;
  for (std::size_t k = 0; k < stage_.instants.size(); ++k) {
    const Index n = Index(stage_.instants[k].rows.size());
    values.segment(row, n) = Eigen::Map<const VectorXd>(y.data() + functions_->instants()[k].y, n);
    row += n;
  }
  return values;
}

MatrixXd Collocation::instant_slopes() const {
  MatrixXd slopes(Index(stage_.instant_rows.size()), Index(n_z_));
  Index row = 0;
  for (std::size_t k = 0; k < stage_.instants.size(); ++k) {
    const StageFunctions::Instant& instant = functions_->instants()[k];
    const Index n = Index(stage_.instants[k].rows.size());
    if (n == 0) continue;
    slopes.middleRows(row, n) =
        largest_slopes(instant.function.jacobian_pattern(), first_j_, instant.jacobian, 1).topRows(n);
    row += n;
  }
  return slopes;
}

// By how much the path rows lie outside their bounds at the point that was evaluated last, at most.
VectorXd Collocation::missing_of_path() const {
  VectorXd most = VectorXd::Zero(Index(stage_.path_rows.size()));
  for (std::size_t p = 0; p < used_; ++p) {
    most = most.cwiseMax(missing(stage_.path_rows, first_y_.data() + p * stage_.node.n_y() + n_x_));
  }
  return most;
}

// The largest values of the path rows there.
VectorXd Collocation::largest_of_path() const {
  const Index n_c = Index(stage_.path_rows.size());
  VectorXd most = VectorXd::Zero(n_c);
  for (std::size_t p = 0; p < used_; ++p) {
    const double* rows = first_y_.data() + p * stage_.node.n_y() + n_x_;
    most = most.cwiseMax(Eigen::Map<const VectorXd>(rows, n_c).cwiseAbs());
  }
  return most;
}

// How far the cost alone would move an entry: its slope over its curvature, 0 where that says nothing.  The second
// look is from a displacement in the entry's own unit.
double Collocation::newton_step(const std::vector<double>& start, std::size_t entry) {
  std::vector<double> here(shape_.n()), there(shape_.n());
  double step = 1;
  if (!gradient(start.data(), here.data())) return 0;
  for (int look = 0; look < 2; ++look) {
    std::vector<double> moved = start;
    for (std::size_t i = entry; i < moved.size(); i += n_z_) moved[i] += kDisplacement * step;
    if (!gradient(moved.data(), there.data())) return 0;
    double slope = 0, bend = 0;
    for (std::size_t i = entry; i < moved.size(); i += n_z_) {
      slope += std::abs(here[i]);
      bend += std::abs(there[i] - here[i]) / (kDisplacement * step);
    }
    step = slope / bend;
    if (!(step > 0 && std::isfinite(step))) return 0;
  }
  return step;
}

// How far a bound that has no counterpart is away, where there is one.
VectorXd Collocation::one_sided_room(const std::vector<double>& start) const {
  VectorXd room = VectorXd::Zero(Index(n_x_));
  for (std::size_t i = 0; i < start.size(); ++i) {
    const Index c = Index(i % n_z_);
    if (c >= room.size()) continue;
    const double lower = problem_.x.lower[c], upper = problem_.x.upper[c];
    if (std::isfinite(lower) == std::isfinite(upper)) continue;
    room[c] = std::max(room[c], std::abs(start[i] - (std::isfinite(lower) ? lower : upper)));
  }
  return room;
}

// What the entries that are known make of the others.
void Collocation::propagate(VectorXd& z, const std::vector<double>& start, const MatrixXd& slopes) const {
  const Index n_x = Index(n_x_), n_z = Index(n_z_), n_c = Index(stage_.path_rows.size());
  const double time = problem_.duration / kPace;
  const Eigen::Map<const MatrixXd> values(start.data(), n_z, Index(points_));
  const auto rates = slopes.topRows(n_x), relations = slopes.middleRows(n_x, n_c);

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
  const VectorXd given = values.bottomRows(n_z - n_x)
                             .middleCols(Index(first_used_), Index(used_))
                             .cwiseAbs()
                             .rowwise()
                             .maxCoeff();
  z.tail(n_z - n_x) = z.tail(n_z - n_x).cwiseMax(given);

  // A state that starts and ends alike is moved by what its rate is made of.
  for (Index sweep = 0; sweep < n_x; ++sweep) {
    for (Index i = 0; i < n_x; ++i) {
      if (z[i] == 0) z[i] = time * term(rates, i, z);
    }
  }
}

// A state that moves by rounding alone is moved by what its rate is made of, too.  Once: a stiff spring moves a speed
// that moves the spring.
void Collocation::replace_rounding(VectorXd& z, const MatrixXd& slopes) const {
  const double time = problem_.duration / kPace;
  std::vector<bool> replaced(n_x_, false);
  for (std::size_t sweep = 0; sweep < n_x_; ++sweep) {
    for (std::size_t i = 0; i < n_x_; ++i) {
      const double moved = time * term(slopes, Index(i), z);
      if (replaced[i] || !(z[Index(i)] < kNegligible * moved)) continue;
      z[Index(i)] = moved;
      replaced[i] = true;
    }
  }
}

// Of the entries of a point.  What is zero afterwards is moved by nothing.  The start may stand still: then what its
// end, or an instant, lacks moves it, else what the path lacks, else the cost, else it has the room that a bound leaves.
VectorXd Collocation::stage_magnitudes(const std::vector<double>& start, const MatrixXd& slopes,
                                       const MatrixXd& end_slopes) {
  VectorXd path = missing_of_path();
  VectorXd end = missing(stage_.instant_rows, instant_values(first_y_).data());
  VectorXd z = stage_magnitudes(start, slopes, end_slopes, path, end);
  // What a row lacks by rounding, beside what it then amounts to, moves nothing.
  bool is_rounding = false;
  const auto drop = [&](VectorXd& lacks, const MatrixXd& of, Index first) {
    for (Index i = 0; i < lacks.size(); ++i) {
      if (lacks[i] == 0 || lacks[i] >= kNegligible * term(of, first + i, z)) continue;
      lacks[i] = 0;
      is_rounding = true;
    }
  };
  drop(path, slopes, Index(n_x_));
  drop(end, end_slopes, 0);
  return is_rounding ? stage_magnitudes(start, slopes, end_slopes, path, end) : z;
}

VectorXd Collocation::stage_magnitudes(const std::vector<double>& start, const MatrixXd& slopes,
                                       const MatrixXd& end_slopes, const VectorXd& path,
                                       const VectorXd& end) {
  const Index n_x = Index(n_x_), n_z = Index(n_z_), n_c = Index(stage_.path_rows.size());
  VectorXd z = VectorXd::Zero(n_z);
  z.head(n_x) = extents(Eigen::Map<const MatrixXd>(start.data(), n_z, Index(points_))).head(n_x);
  for (Index c = 0; c < problem_.typical.size(); ++c) {
    if (problem_.typical[c] > 0) z[c] = problem_.typical[c];
  }
  lacked_.setZero(n_z);
  // Of states that were zero before: by what a row lacks, or by the cost.  An angle moves by half a turn at most.
  const auto note_new = [&](const VectorXd& before) {
    for (Index c = 0; c < n_x; ++c) {
      if (before[c] > 0 || z[c] == 0) continue;
      lacked_[c] = 1;
      if (c < problem_.most_typical.size() && problem_.most_typical[c] > 0)
        z[c] = std::min(z[c], problem_.most_typical[c]);
    }
  };
  VectorXd before = z;
  balance(z, 0, n_x, end_slopes, end);
  note_new(before);
  propagate(z, start, slopes);
  replace_rounding(z, slopes);

  // What is missing from a row that a control enters is the control's to give.
  const MatrixXd relations = slopes.middleRows(n_x, n_c);
  VectorXd of_states = path;
  for (Index i = 0; i < n_c; ++i) {
    if (!relations.row(i).tail(n_z - n_x).isZero(0)) of_states[i] = 0;
  }
  before = z;
  balance(z, 0, n_x, relations, of_states);
  note_new(before);
  balance(z, n_x, n_z, relations, path);
  propagate(z, start, slopes);

  before = z;
  for (Index c = 0; c < n_x; ++c) {
    if (z[c] == 0) z[c] = newton_step(start, std::size_t(c));
  }
  note_new(before);
  propagate(z, start, slopes);
  z.head(n_x) = (z.head(n_x).array() == 0).select(one_sided_room(start), z.head(n_x));
  propagate(z, start, slopes);
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

// The largest slopes there are over the points of a guess, of the node's rows and of those of instants.
MatrixXd Collocation::node_slopes() const {
  return largest_slopes(functions_->node().jacobian_pattern(), first_j_, 0, used_);
}

// A slope at the start may be rounding, or hold nearby alone, as that of a cosine next to its top, and what it gives
// reaches farther than it holds.  The slopes around the start, as far away as what they give, tell: the longest reach that
// they agree with is taken, and slopes that are no less than these.
VectorXd Collocation::look_around(const std::vector<double>& start, VectorXd z, MatrixXd& slopes,
                                  MatrixXd& end_slopes) {
  // What a row lacks is far away, so slopes on the way there are to agree more closely than those of rates nearby.
  constexpr double kAgrees = 0.125, kAgreesFar = 0.25, kShorter = 0.25, kShortest = 1e-18;
  const Eigen::VectorXi far = lacked_;
  for (double share = 1; share > kShortest; share *= kShorter) {
    std::vector<double> moved = start;
    for (std::size_t i = 0; i < moved.size(); ++i) {
      const double part = 2 * std::fmod(kGolden * double(i + 1), 1) - 1;  // evenly over -1 .. 1
      const double reach = z[Index(i % n_z_)];
      if (std::isfinite(reach)) moved[i] += share * part * reach;
    }
    if (!evaluate_first(moved.data())) continue;
    MatrixXd there = slopes.cwiseMax(node_slopes()), end_there = end_slopes.cwiseMax(instant_slopes());
    evaluate_first(start.data());
    const VectorXd found = stage_magnitudes(start, there, end_there);
    const VectorXd agrees = (far.array() > 0).select(VectorXd::Constant(z.size(), kAgreesFar), kAgrees);
    if (!(found.array() >= share * agrees.array() * z.array()).all()) continue;
    // Rows are as large as the slopes on the way make them, where what they lack gave a state its reach.
    const VectorXd reach = (far.array() > 0).select(z, 0);
    const Index path = slopes.rows() - Index(n_x_);
    const bool is_same = !have_grown(end_slopes, end_there, reach) &&
                         !have_grown(slopes.bottomRows(path), there.bottomRows(path), reach);
    if (share == 1 && is_same) return z;
    slopes = std::move(there), end_slopes = std::move(end_there);
    return found;
  }
  evaluate_first(start.data());
  return z;
}

NlpMagnitudes Collocation::magnitudes(const std::vector<double>& at, const NlpMagnitudes& before) {
  if (!evaluate_first(at.data())) return before;
  MatrixXd slopes = node_slopes(), end_slopes = instant_slopes();
  VectorXd z = look_around(at, stage_magnitudes(at, slopes, end_slopes), slopes, end_slopes);
  VectorXd lower(z.size()), upper(z.size());
  lower << problem_.x.lower, problem_.a.lower, problem_.u.lower;
  upper << problem_.x.upper, problem_.a.upper, problem_.u.upper;
  keep_within(z, upper - lower);
  if (!before.x.empty()) {
    const VectorXd last = Eigen::Map<const VectorXd>(before.x.data(), z.size());
    z = (z.array() < kUnresolved * last.array()).select(last, z);
  }
  NlpMagnitudes m{cost_magnitude(at, z)};
  const auto path =
      row_magnitudes(slopes.bottomRows(slopes.rows() - Index(n_x_)), stage_.path_rows, z, largest_of_path());
  const auto append = [](std::vector<double>& to, const auto& part) {
    to.insert(to.end(), part.begin(), part.end());
  };
  for (std::size_t p = 0; p < points_; ++p) append(m.x, z);
  for (std::size_t k = 0; k < intervals_ * rows_; ++k) append(m.g, z.head(Index(n_x_)));
  for (std::size_t k = 0; k < intervals_ * std::size_t(scheme_.held.rows()); ++k)
    append(m.g, z.tail(Index(problem_.n_u())));
  for (std::size_t p = 0; p < used_; ++p) append(m.g, path);
  append(m.g, row_magnitudes(end_slopes, stage_.instant_rows, z, instant_values(first_y_).cwiseAbs()));
  return m;
}

}  // namespace dyntape
