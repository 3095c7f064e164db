// SPDX-License-Identifier: BSD-3-Clause
//
// What to call the parts of the program, and where a number stopped being finite.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/first_without_slope.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/interface/control/discretize/staged_nlp.h>

namespace dyntape {

namespace {

std::string six_digits(double value) {
  if (std::isnan(value)) return "nan";  // whatever its sign
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

// One phase alone needs no name.
std::string prefix(const StagedProgram& program, const StagedPhase& phase) {
  return program.phases.size() > 1 ? phase.name + ": " : "";
}

std::string name_in(const StagedPhase& phase, std::size_t variable) {
  if (phase.asked.free_time && variable % phase.n_z == std::size_t(phase.asked.n_x()))
    return "the duration";  // at every point the same
  return stage_names(phase.problem)[variable % phase.n_z] + " at " + point_name(phase, variable / phase.n_z);
}

std::string name_in(const StagedPhase& phase, const RowBlock& block, std::size_t i) {
  const Problem& problem = phase.problem;
  switch (block.kind) {
    case RowBlock::Kind::kDefect:
      return "defect of " + problem.states[i] + " in interval " + std::to_string(block.place) +
             (phase.scheme().rows() == 1 ? "" : " (part " + std::to_string(block.part) + ")");
    case RowBlock::Kind::kControl:
      return "course of " + problem.controls[i] + " in interval " + std::to_string(block.place);
    case RowBlock::Kind::kPath:
      return phase.stage.path_rows[i].name + " at " + point_name(phase, block.place);
    case RowBlock::Kind::kInstant:
      break;
    case RowBlock::Kind::kLink:
      break;
  }
  const RecordedInstant& instant = phase.stage.instants[block.place];
  return instant.rows[i].name + " at " + name_of_instant(instant.share);
}

}  // namespace

// Of a free duration a point has its share until it is known.
std::string point_name(const StagedPhase& phase, std::size_t point) {
  const std::string t = six_digits(phase.t[point]);
  return "point " + std::to_string(point) +
         (phase.asked.free_time ? " (" + t + " of the duration)" : " (t = " + t + " s)");
}

std::string variable_name(const StagedProgram& program, std::size_t i) {
  const auto phase = std::find_if(program.phases.rbegin(), program.phases.rend(),
                                  [&](const StagedPhase& p) { return p.variable <= i; });
  return prefix(program, *phase) + name_in(*phase, i - phase->variable);
}

std::string row_name(const StagedProgram& program, std::size_t j) {
  const auto behind =
      std::upper_bound(program.rows.begin(), program.rows.end(), j,
                       [](std::size_t row, const RowBlock& block) { return row < block.row; });
  const RowBlock& block = *(behind - 1);
  if (block.kind == RowBlock::Kind::kLink) {
    const StagedLink& link = program.links[block.place];
    return "link from " + link.name + ": " + program.phases[link.to].asked.states[j - block.row];
  }
  const StagedPhase& phase = program.phases[block.phase];
  return prefix(program, phase) + name_in(phase, block, j - block.row);
}

void StagedNlp::check_finite(const StagedPhase& phase, std::size_t evaluator, std::size_t point,
                             const std::vector<double>& x) const {
  const Evaluator& e = program_.evaluators[evaluator];
  const CompiledFunction& f = e.function;
  const Function& recorded = f.function();
  const Pattern& pattern = f.jacobian_pattern();
  const std::vector<std::string> names = stage_names(phase.problem);
  const std::string head = "problem \"" + phase.problem.name + "\": ";
  const double *z = x.data() + e.at.variable, *parameters = e.parameters.data();
  std::vector<double> y(e.at.count * f.n_y()), j(e.at.count * pattern.nnz());
  CompiledFunction::Workspace workspace(f);
  const Points at_all{.count = e.at.count, .x = z, .p = parameters, .y = y.data(), .jacobian = j.data()};
  try {
    f.check(f.run(Order::kFirst, at_all, workspace), e.at.count);
  } catch (const GuardViolation& error) {
    throw GuardViolation(head + error.what());
  }
  for (std::size_t k = 0; k < y.size(); ++k) {
    if (std::isfinite(y[k])) continue;
    const std::size_t p = k / f.n_y();
    std::string cause = first_not_finite(recorded, z + p * phase.n_z, parameters + p * f.n_p(), nullptr);
    if (cause.find("(Div)") != cause.npos) cause += "; write safe_divide(a, b, smoothing)";
    throw NumericalError(head + "\"" + recorded.output_names[k % f.n_y()] + "\" at " +
                         point_name(phase, point + p) + " is " + six_digits(y[k]) + " at the start" +
                         (cause.empty() ? "" : "; " + cause));
  }
  for (std::size_t k = 0; k < j.size(); ++k) {
    if (std::isfinite(j[k])) continue;
    const std::size_t p = k / pattern.nnz(), i = k % pattern.nnz(), col = pattern.col[i];
    const std::string cause =
        first_without_slope(recorded, z + p * phase.n_z, parameters + p * f.n_p(), nullptr);
    throw NumericalError(head + "the derivative of \"" + recorded.output_names[pattern.row[i]] + "\" by \"" +
                         names[col] + "\" at " + point_name(phase, point + p) + " is " + six_digits(j[k]) +
                         " at the start, where \"" + names[col] + "\" is " +
                         six_digits(z[p * phase.n_z + col]) + (cause.empty() ? "" : "; " + cause));
  }
}

void StagedNlp::check_finite(const StagedLink& link, const std::vector<double>& x) {
  if (link.evaluator < 0) return;
  const auto number = std::size_t(link.evaluator);
  if (first_.run(program_.evaluators, Order::kFirst, x.data(), {number, number + 1})) return;
  throw NumericalError("the link from " + link.name + " " +
                       not_finite(program_.evaluators[number], program_.phases[link.to].asked.states) +
                       " at the start");
}

std::string StagedNlp::not_finite(const Evaluator& e, const std::vector<std::string>& states) const {
  const Function& recorded = e.function.function();
  const double *y = first_.y.data() + e.y, *J = first_.jacobian.data() + e.jacobian;
  std::string what = "leaves a branch that was recorded, or is not finite,";
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!std::isfinite(y[i])) what = "gives " + states[i] + " = " + std::to_string(y[i]);
  }
  const Pattern& at = e.function.jacobian_pattern();
  for (std::size_t i = 0; i < at.nnz(); ++i) {
    if (std::isfinite(y[at.row[i]]) && !std::isfinite(J[i]))
      what = "has a slope of " + states[at.row[i]] + " by " + recorded.input_names[0][at.col[i]] +
             " that is " + std::to_string(J[i]);
  }
  return what;
}

void StagedNlp::check_finite(const std::vector<double>& x) {
  forget();
  for (const StagedPhase& phase : program_.phases) {
    check_finite(phase, phase.evaluator, phase.first_used, x);
    for (std::size_t k = 0; k < phase.instants.size(); ++k)
      check_finite(phase, phase.evaluator + 1 + k, phase.instants[k], x);
  }
  for (const StagedLink& link : program_.links) check_finite(link, x);
}

}  // namespace dyntape
