// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/nlp/derivative_check.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <set>
#include <tuple>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/nlp/scaled_nlp.h>
#include <dyntape/interface/control/nlp/worst.h>

namespace dyntape {

namespace {

using Vector = std::vector<double>;

constexpr double kRelativeStep = 5e-4;
// Of a difference of f over one step, in units of the rounding of the largest terms of f.
constexpr double kDifferenceError = 16 * std::numeric_limits<double>::epsilon() / kRelativeStep;
constexpr std::size_t kNoColumn = ~std::size_t{0};
constexpr double kPerturbation = 0.05;       // of the point, relative to nominal values
constexpr double kFinest = 1e-6;             // of |x|: steps that are relative to less are rounding
constexpr double kTolerance = 1e-6;          // of |given - difference| / max(1, |given|, |difference|)
constexpr std::size_t kMostMismatches = 20;  // that are named
constexpr std::size_t kMostEntries = 64;     // in a row of a Hessian that is checked column by column
constexpr std::size_t kDirections = 16;      // in which others are checked
// Differences with steps that are shorter by 16 each, where longer ones disagree: far from the origin functions bend on a small scale.
constexpr int kAttempts = 7;
constexpr double kLongestStep = 3e7;  // over the shortest step
constexpr unsigned kPoints = 3;       // at which an entry has to mismatch: a wrong one is wrong everywhere

std::size_t most_entries_of_row(const Pattern& pattern) {
  std::vector<std::size_t> entries(pattern.rows, 0);
  for (std::uint32_t row : pattern.row) ++entries[row];
  return entries.empty() ? 0 : *std::max_element(entries.begin(), entries.end());
}

// y = f(x); throws where that is not finite.
using VectorFunction = std::function<void(const Vector& x, Vector& y)>;

// Fourth-order directional difference of f at x, all components.
Vector difference(const VectorFunction& f, const Vector& x, const Vector& direction, std::size_t size) {
  constexpr double kNodes[] = {1, -1, 2, -2}, kWeights[] = {8. / 12, -8. / 12, -1. / 12, 1. / 12};
  Vector moved(x.size()), y(size), result(size, 0.0);
  for (int k = 0; k < 4; ++k) {
    for (std::size_t i = 0; i < x.size(); ++i) moved[i] = x[i] + kNodes[k] * direction[i];
    f(moved, y);
    for (std::size_t i = 0; i < size; ++i) result[i] += kWeights[k] * y[i];
  }
  return result;
}

// Of a variable that is divided by its nominal value: that value, 1, or what rounding of x still lets it be moved by.
double size_of(double x) { return std::max(1.0, kFinest * std::abs(x)); }

double step_of(double x) { return kRelativeStep * size_of(x); }

// Sums of |J_ij| max(1, |x_j|) over the rows of a matrix: what the terms of a function with these derivatives amount to
// near x, however small their sum is.
void add_terms(Vector& terms, const Pattern& pattern, const Vector& values, const Vector& x) {
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    terms[pattern.row[k]] += std::abs(values[k]) * std::max(1.0, std::abs(x[pattern.col[k]]));
  }
}

// A color for each column of a pattern such that columns of one color share no row.
std::vector<std::size_t> color_columns(const Pattern& pattern) {
  std::vector<std::vector<std::size_t>> rows_of_column(pattern.cols), columns_of_row(pattern.rows);
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    rows_of_column[pattern.col[k]].push_back(pattern.row[k]);
    columns_of_row[pattern.row[k]].push_back(pattern.col[k]);
  }
  std::vector<std::size_t> color(pattern.cols, kNoColumn), taken_by(pattern.cols + 1, kNoColumn);
  for (std::size_t j = 0; j < pattern.cols; ++j) {
    for (std::size_t row : rows_of_column[j]) {
      for (std::size_t other : columns_of_row[row]) {
        if (color[other] != kNoColumn) taken_by[color[other]] = j;
      }
    }
    color[j] = 0;
    while (taken_by[color[j]] == j) ++color[j];
  }
  return color;
}

// Both triangles of a symmetric matrix that is given by its lower one.
std::pair<Pattern, Vector> both_triangles(const Pattern& lower, const Vector& values) {
  std::vector<std::tuple<std::uint32_t, std::uint32_t, double>> entries;
  for (std::size_t k = 0; k < lower.nnz(); ++k) {
    entries.emplace_back(lower.row[k], lower.col[k], values[k]);
    if (lower.row[k] != lower.col[k]) entries.emplace_back(lower.col[k], lower.row[k], values[k]);
  }
  std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) {
    return std::tie(std::get<0>(a), std::get<1>(a)) < std::tie(std::get<0>(b), std::get<1>(b));
  });
  std::vector<std::vector<std::uint32_t>> rows(lower.rows);
  Vector sorted;
  for (const auto& [row, col, value] : entries) {
    rows[row].push_back(col);
    sorted.push_back(value);
  }
  return {pattern_from_rows(rows, lower.cols), sorted};
}

class Checker {
 public:
  Checker(Nlp& problem, const Vector& near, const DerivativeCheckOptions& options, unsigned point)
      : nlp_(problem, problem.scaling(near)),
        shape_(nlp_.shape()),
        options_(options),
        random_(options.seed + point),
        x_(nlp_.in_scaled_units(near)) {
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (std::size_t i = 0; i < x_.size(); ++i) {
      const double moved = x_[i] + kPerturbation * size_of(x_[i]) * uniform(random_);
      const bool fixed = shape_.x_lower[i] == shape_.x_upper[i];
      // Functions need not be defined outside the bounds; differences then reach a little beyond.
      x_[i] = fixed ? moved : std::clamp(moved, shape_.x_lower[i], shape_.x_upper[i]);
    }
  }

  DerivativeCheck run() {
    check_constraints();
    check_objective();
    if (options_.second_order && shape_.hessian_kind == HessianKind::kExact) check_hessian();
    return std::move(result_);
  }

 private:
  [[noreturn]] void not_finite(const std::string& what) const {
    throw NumericalError("derivative check: the " + what +
                         " is not finite near the start; choose another start or first guess");
  }

  // Of a difference of values whose terms are as large as `terms`; their rounding is no error.
  static double error_of(double given, double found, double terms) {
    const double error = std::abs(given - found) - kDifferenceError * terms;
    return (error < 0 ? 0 : error) / std::max({1.0, std::abs(given), std::abs(found)});
  }

  bool agrees(const Vector& given, const Vector& found, const Vector& terms) const {
    if (found.empty()) return false;
    for (std::size_t i = 0; i < given.size(); ++i) {
      if (!(error_of(given[i], found[i], terms[i]) <= kTolerance)) return false;
    }
    return true;
  }

  // `unit` is that of the two numbers.
  void compare(double given, double found, double terms, double unit, double& worst,
               const std::function<std::string()>& row, const std::function<std::string()>& variable) {
    const double error = error_of(given, found, terms);
    worst = dyntape::worst(worst, error);
    const bool bad = !(error <= kTolerance);
    if (bad) result_.mismatches.push_back({row(), variable(), given * unit, found * unit});
  }

  // Compares the columns of a matrix, given by pattern and values, with differences of f, color by color.  A
  // color that disagrees is tried again with shorter steps: the functions may bend on a small scale.
  void compare_columns(const Pattern& pattern, const Vector& given, const VectorFunction& f,
                       const Vector& terms, const Vector& row_unit, double& worst,
                       const std::function<std::string(std::size_t)>& row_name) {
    const std::vector<std::size_t> color = color_columns(pattern);
    const std::size_t colors = color.empty() ? 0 : 1 + *std::max_element(color.begin(), color.end());
    for (std::size_t c = 0; c < colors; ++c) {
      Vector direction(x_.size(), 0.0), expected(pattern.rows, 0.0), best;
      std::vector<std::size_t> column(pattern.rows, kNoColumn);
      for (std::size_t j = 0; j < color.size(); ++j) {
        if (color[j] == c) direction[j] = step_of(x_[j]);
      }
      for (std::size_t k = 0; k < pattern.nnz(); ++k) {
        if (color[pattern.col[k]] != c) continue;
        expected[pattern.row[k]] = given[k];
        column[pattern.row[k]] = pattern.col[k];
      }
      for (int attempt = 0; attempt < kAttempts && !agrees(expected, best, terms); ++attempt) {
        Vector found = difference(f, x_, direction, pattern.rows);
        for (std::size_t i = 0; i < pattern.rows; ++i) {
          found[i] /= column[i] == kNoColumn ? kRelativeStep : direction[column[i]];
          const auto error = [&](double value) { return error_of(expected[i], value, terms[i]); };
          if (!best.empty() && error(best[i]) <= error(found[i])) found[i] = best[i];
        }
        best = std::move(found);
        for (double& d : direction) d /= 16;
      }
      for (std::size_t i = 0; i < pattern.rows; ++i) {
        const auto variable = [&] {
          return column[i] == kNoColumn ? std::string("a variable outside the pattern")
                                        : nlp_.variable_name(column[i]);
        };
        const double unit = row_unit[i] / (column[i] == kNoColumn ? 1 : units().x[column[i]]);
        compare(
            expected[i], best[i], terms[i], unit, worst, [&] { return row_name(i); }, variable);
      }
    }
  }

  // All variables move, with random signs, so that a wrong entry shows in its row.
  Vector random_direction() {
    std::bernoulli_distribution coin;
    Vector direction(x_.size());
    for (std::size_t j = 0; j < x_.size(); ++j)
      direction[j] = coin(random_) ? step_of(x_[j]) : -step_of(x_[j]);
    return direction;
  }

  // Whether products of a Hessian that has a long row with random directions are the differences of f along them.
  bool agrees_along_directions(const Pattern& pattern, const Vector& given, const VectorFunction& f,
                               const Vector& terms) {
    if (most_entries_of_row(pattern) <= kMostEntries) return false;
    double worst = 0;
    for (std::size_t k = 0; k < kDirections; ++k) {
      Vector direction = random_direction();
      double least = HUGE_VAL;
      for (double step = kRelativeStep; step > kRelativeStep / kLongestStep && !(least <= kTolerance);
           step /= 16) {
        least = std::fmin(least, error_along(pattern, given, f, terms, direction, step));
        for (double& d : direction) d /= 16;
      }
      if (!(least <= kTolerance)) return false;
      worst = std::max(worst, least);
    }
    result_.worst_second = worst;
    result_.hessian_directions = kDirections;
    return true;
  }

  // The largest error of a row along a direction whose relative step is given, beside what the row's terms amount to.
  double error_along(const Pattern& pattern, const Vector& given, const VectorFunction& f,
                     const Vector& terms, const Vector& direction, double step) const {
    Vector expected(pattern.rows, 0.0), size(pattern.rows, 1.0);
    for (std::size_t k = 0; k < pattern.nnz(); ++k) {
      const double term = given[k] * direction[pattern.col[k]] / step;
      expected[pattern.row[k]] += term;
      size[pattern.row[k]] = std::max(size[pattern.row[k]], std::abs(term));
    }
    const Vector found = difference(f, x_, direction, pattern.rows);
    double worst = 0;
    for (std::size_t i = 0; i < pattern.rows; ++i) {
      const double error = std::abs(expected[i] - found[i] / step) - kDifferenceError * terms[i];
      worst = dyntape::worst(worst, std::max(error, 0.0) / size[i]);
    }
    return worst;
  }

  void check_constraints() {
    Vector values(shape_.jacobian.nnz());
    if (!nlp_.jacobian(x_.data(), values.data())) not_finite("Jacobian");
    const VectorFunction g = [&](const Vector& x, Vector& y) {
      if (!nlp_.constraints(x.data(), y.data())) not_finite("vector of constraints");
    };
    Vector terms(shape_.m(), 0.0);
    add_terms(terms, shape_.jacobian, values, x_);
    compare_columns(shape_.jacobian, values, g, terms, units().g, result_.worst_first,
                    [&](std::size_t i) { return nlp_.constraint_name(i); });
  }

  // The gradient has one dense row: variables are moved in groups with random signs, and one by one only in a
  // group that fails.
  void check_objective() {
    const std::size_t n = x_.size();
    Vector gradient(n);
    if (!nlp_.gradient(x_.data(), gradient.data())) not_finite("gradient");
    const VectorFunction f = [&](const Vector& x, Vector& y) {
      if (!nlp_.objective(x.data(), y[0])) not_finite("objective");
    };
    Vector value(1), terms(1);
    f(x_, value);
    terms[0] = std::abs(value[0]);
    for (std::size_t j = 0; j < n; ++j) terms[0] += std::abs(gradient[j]) * std::max(1.0, std::abs(x_[j]));
    const std::size_t groups = std::min<std::size_t>(n, 16);
    std::bernoulli_distribution coin;
    for (std::size_t c = 0; c < groups; ++c) {
      Vector direction(n, 0.0);
      double expected = 0, size = 0;
      for (std::size_t j = c; j < n; j += groups) {
        direction[j] = coin(random_) ? step_of(x_[j]) : -step_of(x_[j]);
        expected += gradient[j] * direction[j] / kRelativeStep;
        size += std::abs(gradient[j] * direction[j] / kRelativeStep);
      }
      const double found = difference(f, x_, direction, 1)[0] / kRelativeStep;
      const double allowed = kTolerance * std::max(1e-3, size) + kDifferenceError * terms[0];
      if (std::abs(expected - found) <= allowed) continue;
      for (std::size_t j = c; j < n; j += groups) {
        Vector single(n, 0.0);
        single[j] = step_of(x_[j]);
        double slope = difference(f, x_, single, 1)[0] / single[j];
        for (int attempt = 1; attempt < kAttempts && !agrees({gradient[j]}, {slope}, terms); ++attempt) {
          single[j] /= 16;
          slope = difference(f, x_, single, 1)[0] / single[j];
        }
        compare(
            gradient[j], slope, terms[0], units().objective / units().x[j], result_.worst_first,
            [] { return std::string("objective"); }, [&] { return nlp_.variable_name(j); });
      }
    }
  }

  void check_hessian() {
    std::normal_distribution<double> normal;
    const double sigma = 1 + std::abs(normal(random_));
    Vector lambda(shape_.m()), values(shape_.hessian.nnz());
    for (double& l : lambda) l = normal(random_);
    if (!nlp_.hessian(x_.data(), sigma, lambda.data(), values.data())) not_finite("Hessian");
    Vector jacobian(shape_.jacobian.nnz());
    const VectorFunction lagrangian_gradient = [&](const Vector& x, Vector& y) {
      if (!nlp_.gradient(x.data(), y.data()) || !nlp_.jacobian(x.data(), jacobian.data())) {
        not_finite("gradient");
      }
      for (double& v : y) v *= sigma;
      for (std::size_t k = 0; k < jacobian.size(); ++k) {
        y[shape_.jacobian.col[k]] += lambda[shape_.jacobian.row[k]] * jacobian[k];
      }
    };
    const auto [full, full_values] = both_triangles(shape_.hessian, values);
    // The derivatives that are added up, and what they are made of themselves.
    Vector terms(x_.size(), 0.0), row_unit(x_.size());
    if (!nlp_.gradient(x_.data(), terms.data())) not_finite("gradient");
    for (double& t : terms) t = std::abs(sigma * t);
    if (!nlp_.jacobian(x_.data(), jacobian.data())) not_finite("Jacobian");
    for (std::size_t k = 0; k < jacobian.size(); ++k) {
      terms[shape_.jacobian.col[k]] += std::abs(lambda[shape_.jacobian.row[k]] * jacobian[k]);
    }
    add_terms(terms, full, full_values, x_);
    for (std::size_t i = 0; i < x_.size(); ++i) row_unit[i] = units().objective / units().x[i];
    if (agrees_along_directions(full, full_values, lagrangian_gradient, terms)) return;
    compare_columns(
        full, full_values, lagrangian_gradient, terms, row_unit, result_.worst_second,
        [&](std::size_t i) { return "derivative of the Lagrangian by " + nlp_.variable_name(i); });
  }

  const NlpScaling& units() const { return nlp_.units(); }

  ScaledNlp nlp_;  // so that errors are relative to what the program calls large
  const NlpShape& shape_;
  DerivativeCheckOptions options_;
  std::mt19937_64 random_;
  Vector x_;
  DerivativeCheck result_;
};

// The mismatches that another point shows as well; the errors of the point where they are less.
void keep_common(DerivativeCheck& found, const DerivativeCheck& there) {
  std::set<std::pair<std::string, std::string>> known;
  for (const DerivativeMismatch& m : there.mismatches) known.emplace(m.row, m.variable);
  std::erase_if(found.mismatches, [&](const DerivativeMismatch& m) {
    return !known.count({m.row, m.variable});
  });
  found.worst_first = std::min(found.worst_first, there.worst_first);
  found.worst_second = std::min(found.worst_second, there.worst_second);
}

}  // namespace

DerivativeCheck check_derivatives(Nlp& problem, const std::vector<double>& near,
                                  const DerivativeCheckOptions& options) {
  DerivativeCheck found = Checker(problem, near, options, 0).run();
  // At a kink, where the nearest point of a bar leaves its end, differences tell nothing; elsewhere they do.
  for (unsigned point = 1; point < kPoints && !found.good(); ++point) {
    try {
      keep_common(found, Checker(problem, near, options, point).run());
    } catch (const NumericalError&) {  // functions that are not finite there take nothing back
    }
  }
  if (found.mismatches.size() > kMostMismatches)
    found.mismatches.erase(found.mismatches.begin() + kMostMismatches, found.mismatches.end());
  return found;
}

}  // namespace dyntape
