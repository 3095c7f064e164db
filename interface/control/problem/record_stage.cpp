// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/problem/record_stage.h>

#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>

namespace dyntape {

namespace {

// Gives Gauss-Newton its curvature; empty where there is none.
const StageFunction& residuals_of(const Term& term) {
  return term.role == Role::kSquares ? term.function : term.curvature;
}

class Parts {
 public:
  explicit Parts(const Problem& problem) : problem_(problem) {}

  // The outputs of a recording; the rows they stand for are noted on the way.
  std::vector<AD> outputs;
  std::vector<std::string> names;
  std::vector<ConstraintRow> rows;

  void append(const VectorXad& values, const std::string& name) {
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      outputs.push_back(values[i]);
      names.push_back(entry_name(name, i, values.size()));
    }
  }

  void add_rows(const VectorXad& values, const std::string& name, const Eigen::VectorXd& lower,
                const Eigen::VectorXd& upper) {
    append(values, name);
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      rows.push_back({entry_name(name, i, values.size()), lower[i], upper[i]});
    }
  }

  void add_constraint(const Term& term, const Stage<AD>& stage) {
    const VectorXad values = term.function(stage);
    if (term.role == Role::kEquality) {
      const Eigen::VectorXd zero = Eigen::VectorXd::Zero(values.size());
      add_rows(values, term.name, zero, zero);
      return;
    }
    if (term.lower.size() != values.size() || term.upper.size() != values.size())
      refuse(problem_, "term \"" + term.name + "\" has " + std::to_string(values.size()) +
                           " entries, its bounds have " + std::to_string(term.lower.size()) + " and " +
                           std::to_string(term.upper.size()));
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      check_room(problem_, "term \"" + entry_name(term.name, i, values.size()) + "\"", term.lower[i],
                 term.upper[i]);
    }
    add_rows(values, term.name, term.lower, term.upper);
  }

  AD cost_of(const Term& term, const Stage<AD>& stage) const {
    const VectorXad values = term.function(stage);
    if (term.role == Role::kSquares) {
      AD sum(0);
      for (const AD& r : values) sum += r * r;
      return sum;
    }
    check_cost(problem_, term.name, values.size());
    return values[0];
  }

  template <class Belongs>
  void add_terms(Belongs belongs, const Stage<AD>& stage) {
    for (const Term& term : problem_.terms) {
      if (belongs(term) && is_constraint(term.role)) add_constraint(term, stage);
    }
    append(VectorXad::Constant(1, costs(belongs, stage)), "cost");
  }

  // What Gauss-Newton knows of the costs, each times `factor`.
  template <class Belongs>
  void add_residuals(Belongs belongs, const Stage<AD>& stage, const AD& factor) {
    for (const Term& term : problem_.terms) {
      if (!belongs(term) || is_constraint(term.role)) continue;
      if (residuals_of(term).empty())
        refuse(problem_, "Gauss-Newton needs every cost as squares of residuals, and \"" + term.name +
                             "\" is a plain cost; use the exact Hessian");
      append(residuals_of(term)(stage) * factor, term.name);
    }
  }

  template <class Belongs>
  AD costs(Belongs belongs, const Stage<AD>& stage) const {
    AD cost(0);
    for (const Term& term : problem_.terms) {
      if (belongs(term) && !is_constraint(term.role)) cost += cost_of(term, stage);
    }
    return cost;
  }

  VectorXad result() const {
    return Eigen::Map<const VectorXad>(outputs.data(), Eigen::Index(outputs.size()));
  }

 private:
  const Problem& problem_;
};

void append_to(std::vector<std::string>& names, const std::vector<std::string>& more,
               const std::string& suffix = "") {
  for (const std::string& name : more) names.push_back(name + suffix);
}

// Recorded at the guess, where branches on values are those of the motion.
// Values from which it is recorded, and names.
RecordOptions options_at(const Problem& problem, double t) {
  const Stage<double> at = problem.first_guess(t);
  const Eigen::VectorXd parameters = parameters_of(problem, t);
  RecordOptions options;
  for (const Eigen::VectorXd* part : {&at.x, &at.a, &at.u}) {
    options.variables.insert(options.variables.end(), part->begin(), part->end());
  }
  options.parameters.assign(parameters.begin(), parameters.end());
  options.variable_names = stage_names(problem);
  options.parameter_names = {"t"};
  append_to(options.parameter_names, problem.parameters.entry_names());
  return options;
}

Function record_part(const Problem& problem, const std::string& name, double t, Parts& parts,
                     const std::function<void(Parts&, const Stage<AD>&)>& fill) {
  const RecordOptions options = options_at(problem, t);
  Function f = record(
      name, options.variables.size(), options.parameters.size(),
      [&](const VectorXad& z, const VectorXad& p) {
        fill(parts, {p[0], z.head(problem.n_x()), z.segment(problem.n_x(), problem.n_a()),
                     z.tail(problem.n_u()), p.tail(p.size() - 1)});
        return parts.result();
      },
      options, nullptr, 0);  // the terms are the user's, this line is not
  f.output_names = parts.names;
  return f;
}

bool is_running(const Term& term) { return term.where == Where::kRunning; }

template <class Belongs>
Function record_squares(const Problem& problem, const std::string& name, double t, Belongs belongs) {
  Parts parts(problem);
  return record_part(problem, name, t, parts, [&](Parts& p, const Stage<AD>& stage) {
    for (const Term& term : problem.terms) {
      if (belongs(term) && !residuals_of(term).empty()) p.append(residuals_of(term)(stage), term.name);
    }
  });
}

RecordedInstant record_instant(const Problem& problem, double share) {
  const auto belongs = [share](const Term& term) { return stands_at(term, share); };
  const bool any = std::any_of(problem.terms.begin(), problem.terms.end(), belongs);
  const std::string name = problem.name + (share == 1 ? " end" : " at " + name_of_instant(share));
  const double t = share * problem.duration;
  Parts parts(problem);
  RecordedInstant instant{share, {}, {}, {}};
  instant.terms = record_part(problem, name, t, parts, [&](Parts& p, const Stage<AD>& s) {
    if (any) p.add_terms(belongs, s);
  });
  instant.squares = record_squares(problem, name + " squares", t, belongs);
  instant.rows = parts.rows;
  return instant;
}

void add_dynamics(const Problem& problem, const Stage<AD>& s, Parts& parts) {
  const VectorXad rate = problem.rate(s);
  check_rate(problem, rate.size());
  for (int i = 0; i < problem.n_x(); ++i) {
    parts.append(rate.segment(i, 1), "rate of " + problem.states[static_cast<std::size_t>(i)]);
  }
  if (problem.residual.empty()) return;
  const VectorXad residual = problem.residual(s);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(residual.size());
  parts.add_rows(residual, "dynamics", zero, zero);
}

}  // namespace

void check_shooting(const Problem& problem) {
  const auto refuse = [&](const std::string& what) {
    throw ArgumentError(
        "problem \"" + problem.name + "\": " + what +
        ", which steps from stage to stage do not know; expected costs, and limits of controls");
  };
  if (problem.free_time) refuse("the duration is free");
  if (problem.n_a() > 0) refuse("the dynamics are in their inverse form");
  if (problem.n_x() == 0) refuse("there are no states");
  if (problem.n_u() == 0) refuse("there are no controls");
  for (const Term& term : problem.terms) {
    if (is_constraint(term.role)) refuse("the term \"" + term.name + "\" is a constraint");
    if (term.where == Where::kInstant)
      refuse("the term \"" + term.name + "\" is at " + name_of_instant(term.share));
  }
  for (int i = 0; i < problem.n_x(); ++i) {
    const std::string state = "\"" + problem.states[std::size_t(i)] + "\"";
    if (std::isnan(problem.start[i])) refuse("the start of the state " + state + " is free");
    if (!std::isnan(problem.goal[i])) refuse("the end of the state " + state + " is given");
    if (problem.x.lower[i] > -HUGE_VAL || problem.x.upper[i] < HUGE_VAL)
      refuse("the state " + state + " has limits");
  }
}

RecordedShooting record_shooting(const Problem& problem, ShootingScheme scheme, bool with_residuals) {
  check(problem);
  check_shooting(problem);
  const int n_x = problem.n_x();
  const double middle = problem.duration / 2;
  const Stage<double> at = problem.first_guess(middle);
  if (at.x.size() != n_x || at.u.size() != problem.n_u())
    refuse(problem, "the guess at t = " + std::to_string(middle) + " s has other sizes than the problem");
  RecordOptions options;
  for (const Eigen::VectorXd* part : {&at.x, &at.u})
    options.variables.insert(options.variables.end(), part->begin(), part->end());
  const Eigen::VectorXd now = problem.parameters.at(middle);
  const std::vector<std::string> names = problem.parameters.entry_names();
  options.parameters = {middle, 0.01 * problem.duration};
  options.variable_names = stage_names(problem);
  options.parameter_names = {"t", "h"};
  for (const char* when : {"", " in the middle", " at the end"}) {
    options.parameters.insert(options.parameters.end(), now.begin(), now.end());
    append_to(options.parameter_names, names, when);
  }
  const Parts parts(problem);
  const auto is_at_end = [](const Term& term) { return stands_at(term, 1); };
  const Problem steps = multiple_shooting(problem, scheme, 1, [](double) { return 1.0; });
  const Eigen::Index n_p = now.size();
  Parts values(steps), residuals(steps);
  RecordedShooting recorded;
  recorded.step = record(
      problem.name + " step", options.variables.size(), options.parameters.size(),
      [&](const VectorXad& z, const VectorXad& p) {
        const AD h = p[1];
        Stage<AD> stage{p[0], z.head(n_x), {}, z.tail(problem.n_u()), VectorXad(1 + 3 * n_p)};
        stage.p << p.segment(2, n_p), h, p.tail(2 * n_p);
        const VectorXad next = stage.x + h * steps.rate(stage);
        for (int i = 0; i < n_x; ++i) values.append(next.segment(i, 1), problem.states[std::size_t(i)]);
        values.append(VectorXad::Constant(1, h * values.costs(is_running, stage)), "cost");
        if (with_residuals) residuals.add_residuals(is_running, stage, sqrt(h));
        VectorXad all(Eigen::Index(values.outputs.size() + residuals.outputs.size()));
        all << values.result(), residuals.result();
        return all;
      },
      options, nullptr, 0);
  recorded.step.output_names = values.names;
  append_to(recorded.step.output_names, residuals.names);
  options.variables.resize(std::size_t(n_x));
  options.variable_names = problem.states;
  const Eigen::VectorXd at_end = parameters_of(problem, problem.duration);
  options.parameters.assign(at_end.begin(), at_end.end());
  options.parameter_names = {"t"};
  append_to(options.parameter_names, names);
  recorded.end = record(
      problem.name + " end of steps", std::size_t(n_x), options.parameters.size(),
      [&](const VectorXad& x, const VectorXad& p) {
        const Stage<AD> stage{p[0], x, {}, VectorXad::Zero(problem.n_u()), p.tail(now.size())};
        return VectorXad(VectorXad::Constant(1, parts.costs(is_at_end, stage)));
      },
      options, nullptr, 0);
  recorded.end.output_names = {"cost"};
  return recorded;
}

Function record_link(const Problem& before, const StageFunction& change, const std::string& name) {
  const Stage<double> at = before.first_guess(before.duration);
  const Eigen::VectorXd parameters = parameters_of(before, before.duration);
  RecordOptions options;
  options.variables.assign(at.x.begin(), at.x.end());
  options.parameters.assign(parameters.begin(), parameters.end());
  options.variable_names = before.states;
  options.parameter_names = {"t"};
  append_to(options.parameter_names, before.parameters.entry_names());
  return record(
      name, options.variables.size(), options.parameters.size(),
      [&](const VectorXad& x, const VectorXad& p) {
        return change(Stage<AD>{p[0], x, {}, {}, p.tail(p.size() - 1)});
      },
      options, nullptr, 0);
}

Eigen::VectorXd parameters_of(const Problem& problem, double t) {
  const Eigen::VectorXd values =
      problem.parameters.at(t);  // may throw, which a comma initializer does not survive
  Eigen::VectorXd all(1 + values.size());
  all << t, values;
  return all;
}

std::vector<std::string> stage_names(const Problem& problem) {
  std::vector<std::string> names = problem.states;
  names.insert(names.end(), problem.accelerations.begin(), problem.accelerations.end());
  names.insert(names.end(), problem.controls.begin(), problem.controls.end());
  return names;
}

RecordedStage record_stage(const Problem& problem) {
  check(problem);
  RecordedStage stage;
  const double middle = problem.duration / 2;
  Parts node(problem);
  stage.node = record_part(problem, problem.name, middle, node, [&](Parts& p, const Stage<AD>& s) {
    add_dynamics(problem, s, p);
    p.add_terms(is_running, s);
  });
  stage.path_rows = node.rows;
  stage.squares = record_squares(problem, problem.name + " squares", middle, is_running);
  for (double share : instants_of(problem)) {
    stage.instants.push_back(record_instant(problem, share));
    const std::vector<ConstraintRow>& rows = stage.instants.back().rows;
    stage.instant_rows.insert(stage.instant_rows.end(), rows.begin(), rows.end());
  }
  return stage;
}

}  // namespace dyntape
