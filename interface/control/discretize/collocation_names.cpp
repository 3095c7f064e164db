// SPDX-License-Identifier: BSD-3-Clause
//
// What to call the parts of the program, and where a number stopped being finite.
#include <cmath>
#include <cstdio>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/interface/control/discretize/collocation.h>

namespace dyntape {

namespace {

std::string six_digits(double value) {
  if (std::isnan(value)) return "nan";  // whatever its sign
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

}  // namespace

// Of a free duration a point has its share until it is known.
std::string Collocation::at(std::size_t point) const {
  const std::string t = six_digits(t_[point]);
  return "point " + std::to_string(point) +
         (asked_.free_time ? " (" + t + " of the duration)" : " (t = " + t + " s)");
}

std::vector<double> Collocation::times() const {
  std::vector<double> times = t_;
  if (asked_.free_time) {
    for (double& t : times) t *= asked_.duration;
  }
  return times;
}

NlpScaling Collocation::of_motion(const NlpScaling& scaling) const {
  if (!asked_.free_time) return scaling;
  NlpScaling result{scaling.objective};
  const auto n = static_cast<std::size_t>(asked_.n_x());  // the number of the duration among the states
  for (std::size_t i = 0; i < scaling.x.size(); ++i) {
    if (i % n_z_ != n) result.x.push_back(scaling.x[i]);
  }
  for (std::size_t j = 0; j < scaling.g.size(); ++j) {
    if (j >= defects() || j % n_x_ != n) result.g.push_back(scaling.g[j]);
  }
  return result;
}

std::string Collocation::variable_name(std::size_t i) const {
  if (asked_.free_time && i % n_z_ == std::size_t(asked_.n_x()))
    return "the duration";  // at every point the same
  return stage_names(problem_)[i % n_z_] + " at " + at(i / n_z_);
}

std::string Collocation::constraint_name(std::size_t j) const {
  if (j < defects()) {
    const std::size_t interval = j / (rows_ * n_x_), part = j / n_x_ % rows_;
    const std::string which = rows_ == 1 ? "" : " (part " + std::to_string(part) + ")";
    return "defect of " + problem_.states[j % n_x_] + " in interval " + std::to_string(interval) + which;
  }
  if (j < first_path_row()) {
    const std::size_t k = j - defects(), n_u = std::size_t(problem_.n_u());
    return "course of " + problem_.controls[k % n_u] + " in interval " + std::to_string(k / held_rows());
  }
  if (j >= first_instant_row()) {
    std::size_t i = j - first_instant_row(), k = 0;
    while (i >= stage_.instants[k].rows.size()) i -= stage_.instants[k++].rows.size();
    return stage_.instants[k].rows[i].name + " at " + name_of_instant(stage_.instants[k].share);
  }
  const std::size_t k = j - first_path_row(), rows = stage_.path_rows.size();
  return stage_.path_rows[k % rows].name + " at " + at(first_used_ + k / rows);
}

void Collocation::check_finite(const std::vector<double>& x) {
  const std::vector<std::string> names = stage_names(problem_);
  const std::string head = "problem \"" + problem_.name + "\": ";
  const auto check_part = [&](const CompiledFunction& f, std::size_t first_point, std::size_t points) {
    const double *z = x.data() + first_point * n_z_, *parameters = parameters_at(first_point);
    const Function& recorded = f.function();
    const Pattern& pattern = f.jacobian_pattern();
    std::vector<double> y(points * f.n_y()), j(points * pattern.nnz());
    CompiledFunction::Workspace workspace(f);
    const Points at_all{.count = points, .x = z, .p = parameters, .y = y.data(), .jacobian = j.data()};
    try {
      f.check(f.run(Order::kFirst, at_all, workspace), points);
    } catch (const GuardViolation& e) {
      throw GuardViolation(head + e.what());
    }
    for (std::size_t k = 0; k < y.size(); ++k) {
      if (std::isfinite(y[k])) continue;
      const std::size_t p = k / f.n_y();
      const std::string cause = first_not_finite(recorded, z + p * n_z_, parameters + p * f.n_p(), nullptr);
      throw NumericalError(head + "\"" + recorded.output_names[k % f.n_y()] + "\" at " + at(first_point + p) +
                           " is " + six_digits(y[k]) + " at the start" + (cause.empty() ? "" : "; " + cause));
    }
    for (std::size_t k = 0; k < j.size(); ++k) {
      if (std::isfinite(j[k])) continue;
      const std::size_t p = k / pattern.nnz(), e = k % pattern.nnz(), col = pattern.col[e];
      throw NumericalError(head + "the derivative of \"" + recorded.output_names[pattern.row[e]] +
                           "\" by \"" + names[col] + "\" at " + at(first_point + p) + " is " +
                           six_digits(j[k]) + " at the start, where \"" + names[col] + "\" is " +
                           six_digits(z[p * n_z_ + col]));
    }
  };
  check_part(functions_->node(), first_used_, used_);
  for (std::size_t k = 0; k < instant_points_.size(); ++k)
    check_part(functions_->instants()[k].function, instant_points_[k], 1);
}

}  // namespace dyntape
