// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/printed/controller_functions.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/interface/control/discretize/staged_nlp.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

constexpr const char* kLength = "length of an interval";  // a parameter of multiple_shooting()

void check_printable(const Problem& problem, const MeshOptions& mesh) {
  if (problem.free_time) refuse(problem, "its duration is free, expected a horizon for a controller in C");
  if (problem.n_a() > 0)
    refuse(problem,
           "its accelerations are variables (inverse dynamics), which a controller in C does not know; "
           "expected the "
           "forward form");
  if (problem.n_x() == 0 || problem.n_u() == 0)
    refuse(problem, "a controller in C needs at least one state and one control");
  if (mesh.hessian != HessianKind::kGaussNewton)
    refuse(problem, "a controller in C has Gauss-Newton's Hessian; expected hessian gauss_newton");
  if (!mesh.nodes.empty())
    refuse(problem, "a controller in C has intervals of equal length; expected no node times");
  for (const Term& term : problem.terms) {
    if (term.where == Where::kInstant)
      refuse(problem,
             "the term \"" + term.name + "\" is at " + name_of_instant(term.share) +
                 ", which a controller in C does not know; expected a running term, or one at the end");
  }
  for (int i = 0; i < problem.n_x(); ++i) {
    if (std::isnan(problem.start[i]))
      refuse(problem, "the start of \"" + problem.states[std::size_t(i)] + "\" is free");
  }
  for (int i = 0; i < problem.n_u(); ++i) {
    if (problem.u.lower[i] == problem.u.upper[i])
      refuse(problem, "the limits of the control \"" + problem.controls[std::size_t(i)] +
                          "\" are equal, and leave a controller in C nothing to choose");
  }
}

void check_explicit(const Problem& problem, const Scheme& scheme) {
  const bool is_explicit = scheme.points() == 2 && scheme.rows() == 1 && scheme.alpha(0, 0) == -1 &&
                           scheme.alpha(0, 1) == 1 && scheme.beta(0, 0) == -1 && scheme.beta(0, 1) == 0 &&
                           scheme.gamma[0] == 1 && scheme.gamma[1] == 0 && scheme.held.size() == 0;
  if (!is_explicit)
    refuse(problem, "the scheme " + scheme.name +
                        " is not a step from point to point, which a controller in C takes; expected euler, "
                        "semi-implicit-euler, runge-kutta-4 or runge-kutta-4x<steps>");
}

void check_options(const ControllerOptions& o) {
  const auto check = [](bool is_good, const std::string& what, const std::string& expected) {
    if (!is_good) throw ArgumentError("generate_controller: " + what + " expected " + expected);
  };
  check(o.iterations >= 1 && o.iterations <= 10000, "iterations:", "1 to 10000");
  check(o.interior_steps >= 1 && o.interior_steps <= 1000, "interior_steps:", "1 to 1000");
  check(o.trials >= 1 && o.trials <= 30, "trials:", "1 to 30");
  check(o.price > 0 && o.price <= 1e6, "price:", "a number above 0, up to 1e6");
  check(o.tolerance >= 0 && o.tolerance < 1, "tolerance:", "0, or a number below 1");
}

using RecordedValues = std::vector<AD>;

void append(RecordedValues& to, const VectorXad& values) {
  to.insert(to.end(), values.begin(), values.end());
}

class PointRecorder {
 public:
  PointRecorder(const Problem& taken, double step, double cost_unit, Where where)
      : problem_(taken), step_(step), where_(where) {
    scale_ = 2 / cost_unit * (where == Where::kRunning ? step : 1.0);
  }

  // The stage of the recorded z and (t, p), whose parameter of the step length is a constant.
  Stage<AD> stage(const VectorXad& z, const VectorXad& p) const {
    VectorXad all(problem_.parameters.size());
    Eigen::Index at = 1, i = 0;
    for (const std::string& name : problem_.parameters.entry_names())
      all[i++] = name == kLength ? AD(step_) : p[at++];
    const int n_x = problem_.n_x();
    const VectorXad u = where_ == Where::kRunning ? VectorXad(z.tail(problem_.n_u()))
                                                  : VectorXad(VectorXad::Constant(problem_.n_u(), AD(0)));
    return {p[0], z.head(n_x), {}, u, all};
  }

  Function record_point(const std::string& name, bool is_first, PointFunctions& to) const {
    RecordOptions options;
    const double t = where_ == Where::kRunning ? problem_.duration / 2 : problem_.duration;
    const Stage<double> at = problem_.first_guess(t);
    options.variables.assign(at.x.begin(), at.x.end());
    if (where_ == Where::kRunning)
      options.variables.insert(options.variables.end(), at.u.begin(), at.u.end());
    const Eigen::VectorXd p = controller_parameters(problem_, t);
    options.parameters.assign(p.begin(), p.end());
    return record(
        problem_.name + name, options.variables.size(), options.parameters.size(),
        [&](const VectorXad& z, const VectorXad& parameters) {
          const RecordedValues all = outputs(stage(z, parameters), is_first, to);
          return VectorXad(Eigen::Map<const VectorXad>(all.data(), Eigen::Index(all.size())));
        },
        options, nullptr, 0);
  }

 private:
  RecordedValues outputs(const Stage<AD>& s, bool is_first, PointFunctions& to) const {
    RecordedValues all;
    if (where_ == Where::kRunning) {
      const VectorXad rate = problem_.rate(s);
      check_rate(problem_, rate.size());
      append(all, s.x + AD(step_) * rate);
    }
    const std::size_t before = all.size();
    for_terms([](const Term& t) { return is_constraint(t.role); },
              [&](const Term& t) { append(all, t.function(s)); });
    to.rows = all.size() - before;
    is_first ? add_residuals(s, all, to) : all.push_back(cost(s));
    return all;
  }

  template <class Chooses, class Visit>
  void for_terms(Chooses chooses, Visit visit) const {
    for (const Term& term : problem_.terms) {
      if (term.where == where_ && chooses(term)) visit(term);
    }
  }

  AD cost(const Stage<AD>& s) const {
    AD sum(0);
    for_terms([](const Term& t) { return t.role == Role::kSquares; },
              [&](const Term& t) {
                for (const AD& r : t.function(s)) sum += r * r;
              });
    for_terms([](const Term& t) { return t.role == Role::kCost; },
              [&](const Term& t) { sum += t.function(s)[0]; });
    return AD(0.5 * scale_) * sum;
  }

  void add_residuals(const Stage<AD>& s, RecordedValues& all, PointFunctions& to) const {
    const AD root(std::sqrt(scale_));
    std::size_t before = all.size();
    for_terms([](const Term& t) { return t.role == Role::kSquares; },
              [&](const Term& t) { append(all, root * t.function(s)); });
    to.squares = all.size() - before;
    AD plain(0);
    to.has_plain = false;
    for_terms([](const Term& t) { return t.role == Role::kCost; },
              [&](const Term& t) { plain += t.function(s)[0], to.has_plain = true; });
    if (to.has_plain) all.push_back(AD(0.5 * scale_) * plain);
    before = all.size();
    for_terms([](const Term& t) { return t.role == Role::kCost && !t.curvature.empty(); },
              [&](const Term& t) { append(all, root * t.curvature(s)); });
    to.curvatures = all.size() - before;
  }

  const Problem& problem_;
  double step_, scale_ = 1;
  Where where_;
};

void check_recorded(const Problem& problem, const Function& f) {
  if (f.guards.empty()) return;
  const Guard& guard = f.guards.front();
  refuse(problem, "its functions have a branch that is fixed in the recording, at " + guard.file + ":" +
                      std::to_string(guard.line) +
                      ", which a controller in C cannot check; expected select()");
}

double nearest_power(double value) { return std::exp2(std::round(std::log2(value))); }

// Largest nominal value of each entry of z over the points, rounded to a power of two.
std::vector<double> nominal_of(const std::vector<double>& units, std::size_t n_z) {
  std::vector<double> most(n_z, 0);
  for (std::size_t i = 0; i < units.size(); ++i) most[i % n_z] = std::max(most[i % n_z], units[i]);
  for (double& value : most) value = nearest_power(value);
  return most;
}

class Sides {
 public:
  Sides(std::vector<ControllerSide>& to) : to_(to) {}

  void add(std::size_t entry, const std::string& name, double nominal, double lower, double upper) {
    if (std::isfinite(lower)) to_.push_back({entry, 1 / nominal, lower, "lower limit of " + name});
    if (std::isfinite(upper)) to_.push_back({entry, -1 / nominal, upper, "upper limit of " + name});
  }

 private:
  std::vector<ControllerSide>& to_;
};

// Nominal values of rows are those of the staged program's.
std::vector<double> row_units(const StagedNlp& nlp, const NlpScaling& scaling, RowBlock::Kind kind) {
  std::vector<double> units;
  for (const RowBlock& block : nlp.program().rows) {
    if (block.kind != kind) continue;
    units.resize(block.size, 0);
    for (std::size_t i = 0; i < block.size; ++i)
      units[i] = std::max(units[i], scaling.g.empty() ? 1.0 : scaling.g[block.row + i]);
  }
  for (double& unit : units) unit = nearest_power(unit);
  return units;
}

void add_sides(ControllerParts& parts, const StagedNlp& nlp, const NlpScaling& scaling) {
  const Problem& p = parts.problem;
  const auto n_x = std::size_t(p.n_x()), n_u = std::size_t(p.n_u());
  Sides of_stage(parts.stage.sides), of_end(parts.end.sides);
  for (std::size_t i = 0; i < n_u; ++i)
    of_stage.add(n_x + i, p.controls[i], parts.nominal[n_x + i], p.u.lower[long(i)], p.u.upper[long(i)]);
  parts.stage.hard = parts.stage.sides.size();
  const auto add_rows = [&](Sides& to, const std::vector<ConstraintRow>& rows, std::size_t first,
                            const std::vector<double>& units) {
    for (std::size_t i = 0; i < rows.size(); ++i)
      to.add(first + i, rows[i].name, units.at(i), rows[i].lower, rows[i].upper);
  };
  for (std::size_t i = 0; i < n_x; ++i) {
    of_stage.add(i, p.states[i], parts.nominal[i], p.x.lower[long(i)], p.x.upper[long(i)]);
    const double goal = p.goal[long(i)];
    if (std::isnan(goal))
      of_end.add(i, p.states[i], parts.nominal[i], p.x.lower[long(i)], p.x.upper[long(i)]);
    else
      of_end.add(i, "the goal of " + p.states[i], parts.nominal[i], goal, goal);
  }
  const RecordedStage& recorded = nlp.phase().stage;
  add_rows(of_stage, recorded.path_rows, n_x + n_u, row_units(nlp, scaling, RowBlock::Kind::kPath));
  add_rows(of_end, recorded.instants.back().rows, n_x, row_units(nlp, scaling, RowBlock::Kind::kInstant));
}

// Without code of its own for the end: what is there must not read controls, which the last point does not have.
void check_end(const StagedNlp& nlp) {
  const Function& end = nlp.phase().stage.instants.back().terms;
  if (end.n_y() == 0) return;
  const auto n_x = std::uint32_t(nlp.phase().n_x);
  const Pattern pattern = sparse_jacobian(end).pattern;
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    if (pattern.col[k] < n_x) continue;
    refuse(nlp.problem(), "the terms at the end read the control \"" +
                              nlp.problem().controls[pattern.col[k] - n_x] +
                              "\", which the last point of a controller in C does not have");
  }
}

}  // namespace

Eigen::VectorXd controller_parameters(const Problem& taken, double t) {
  const Eigen::VectorXd all = taken.parameters.at(t);
  const std::vector<std::string> names = taken.parameters.entry_names();
  std::vector<double> kept = {t};
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] != kLength) kept.push_back(all[long(i)]);
  }
  return Eigen::Map<const Eigen::VectorXd>(kept.data(), long(kept.size()));
}

ControllerParts controller_parts(const Problem& problem, const ControllerOptions& options) {
  check_options(options);
  check_printable(problem, options.mesh);
  check_explicit(problem, options.mesh.scheme);
  MeshOptions mesh = options.mesh;
  mesh.evaluation.route = Route::kInterpreter;
  StagedNlp nlp(discretize(problem, mesh));
  check_end(nlp);
  const std::vector<double> start = nlp.start();
  nlp.check_finite(start);
  const NlpScaling scaling = nlp.scaling(start);

  ControllerParts parts;
  parts.problem = nlp.phase().problem;
  parts.times = nlp.times();
  parts.step = problem.duration / mesh.intervals;
  parts.cost_unit = nearest_power(scaling.objective);
  parts.guess = start;
  parts.nominal = nominal_of(scaling.x, nlp.phase().n_z);
  parts.n_parameters = int(problem.parameters.size());
  parts.parameter_names = {"t"};
  std::size_t number = 0;
  for (const std::string& name : parts.problem.parameters.entry_names()) {
    if (name == kLength) continue;
    parts.parameter_names.push_back(name);
    parts.caller_parameter.push_back(number++ % std::size_t(std::max(parts.n_parameters, 1)));
  }
  const PointRecorder of_stage(parts.problem, parts.step, parts.cost_unit, Where::kRunning);
  const PointRecorder of_end(parts.problem, parts.step, parts.cost_unit, Where::kTerminal);
  parts.stage.value = of_stage.record_point("", false, parts.stage);
  parts.stage.first = of_stage.record_point("", true, parts.stage);
  parts.end.value = of_end.record_point(" end", false, parts.end);
  parts.end.first = of_end.record_point(" end", true, parts.end);
  for (const Function* f : {&parts.stage.value, &parts.stage.first, &parts.end.value, &parts.end.first})
    check_recorded(problem, *f);
  add_sides(parts, nlp, scaling);
  return parts;
}

}  // namespace dyntape
