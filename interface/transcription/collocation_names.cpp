// SPDX-License-Identifier: BSD-3-Clause
//
// What to call the parts of the program, and where a number stopped being finite.
#include <cmath>
#include <cstdio>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/interface/transcription/collocation.h>

namespace dyntape {

namespace {

std::string six_digits(double value) {
  if (std::isnan(value)) return "nan";  // whatever its sign
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::string at(std::size_t point, double t) {
  return "point " + std::to_string(point) + " (t = " + six_digits(t) + " s)";
}

}  // namespace

std::string Collocation::variable_name(std::size_t i) const {
  const std::size_t point = i / n_z_;
  return stage_names(problem_)[i % n_z_] + " at " + at(point, t_[point]);
}

std::string Collocation::constraint_name(std::size_t j) const {
  if (j < defects()) {
    const std::size_t interval = j / (rows_ * n_x_), part = j / n_x_ % rows_;
    const std::string which = rows_ == 1 ? "" : " (part " + std::to_string(part) + ")";
    return "defect of " + problem_.states[j % n_x_] + " in interval " + std::to_string(interval) + which;
  }
  if (j >= end_row(0)) return stage_.terminal_rows[j - end_row(0)].name + " at the end";
  const std::size_t k = j - defects(), rows = stage_.path_rows.size();
  return stage_.path_rows[k % rows].name + " at " + at(k / rows, t_[k / rows]);
}

void Collocation::check_finite(const std::vector<double>& x) {
  const std::vector<std::string> names = stage_names(problem_);
  const std::string head = "problem \"" + problem_.name + "\": ";
  const auto check_part = [&](const CompiledFunction& f, const double* z, const double* t,
                              std::size_t first_point, std::size_t points) {
    const Function& recorded = f.function();
    const Pattern& pattern = f.jacobian_pattern();
    std::vector<double> y(points * f.n_y()), j(points * pattern.nnz());
    CompiledFunction::Workspace workspace(f);
    const Points at_all{.count = points, .x = z, .p = t, .y = y.data(), .jacobian = j.data()};
    try {
      f.check(f.run(Order::kFirst, at_all, workspace), points);
    } catch (const GuardViolation& e) {
      throw GuardViolation(head + e.what());
    }
    for (std::size_t k = 0; k < y.size(); ++k) {
      if (std::isfinite(y[k])) continue;
      const std::size_t p = k / f.n_y();
      const std::string cause = first_not_finite(recorded, z + p * n_z_, t + p, nullptr);
      throw NumericalError(head + "\"" + recorded.output_names[k % f.n_y()] + "\" at " +
                           at(first_point + p, t[p]) + " is " + six_digits(y[k]) + " at the start" +
                           (cause.empty() ? "" : "; " + cause));
    }
    for (std::size_t k = 0; k < j.size(); ++k) {
      if (std::isfinite(j[k])) continue;
      const std::size_t p = k / pattern.nnz(), e = k % pattern.nnz(), col = pattern.col[e];
      throw NumericalError(head + "the derivative of \"" + recorded.output_names[pattern.row[e]] +
                           "\" by \"" + names[col] + "\" at " + at(first_point + p, t[p]) + " is " +
                           six_digits(j[k]) + " at the start, where \"" + names[col] + "\" is " +
                           six_digits(z[p * n_z_ + col]));
    }
  };
  check_part(functions_->node(), x.data(), t_.data(), 0, used_);
  check_part(functions_->end(), end_point(x.data()), &t_.back(), points_ - 1, 1);
}

}  // namespace dyntape
