// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/sensitivity/motion_sensitivities.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

constexpr double kOfLimit = 1e-7;  // of a value beside a limit that holds it

// The function f of a stage whose last states are its parameters.
StageFunction of_states(const StageFunction& f, Eigen::Index n_x) {
  if (f.empty()) return {};
  return [f, n_x](const auto& s) {
    auto told = s;
    told.x = s.x.head(n_x);
    told.p = s.x.tail(s.x.size() - n_x);
    return f(told);
  };
}

StageFunction with_zeros(const StageFunction& f, Eigen::Index zeros) {
  return [f, zeros](const auto& s) {
    auto values = f(s);
    const Eigen::Index n = values.size();
    values.conservativeResize(n + zeros);
    for (Eigen::Index i = n; i < n + zeros; ++i) values[i] = 0;
    return values;
  };
}

VectorXd one_after_other(const VectorXd& a, const VectorXd& b) {
  VectorXd all(a.size() + b.size());
  all << a, b;
  return all;
}

// The problem with its parameters as additional states of rate zero.
Problem with_parameters_as_states(const Problem& problem) {
  check(problem);
  const Eigen::Index n_x = problem.n_x(), n_p = problem.parameters.size();
  Problem result = problem;
  result.parameters = {};
  for (const std::string& name : problem.parameters.entry_names()) result.states.push_back(name);
  result.rate = with_zeros(of_states(problem.rate, n_x), n_p);
  result.residual = of_states(problem.residual, n_x);
  result.ode = {};
  for (Term& term : result.terms) {
    term.function = of_states(term.function, n_x);
    term.curvature = of_states(term.curvature, n_x);
  }
  const VectorXd now = problem.parameters.at(0);
  result.x = {one_after_other(problem.x.lower, VectorXd::Constant(n_p, -HUGE_VAL)),
              one_after_other(problem.x.upper, VectorXd::Constant(n_p, HUGE_VAL))};
  result.start = one_after_other(problem.start, now);
  result.goal = one_after_other(problem.goal, VectorXd::Constant(n_p, Problem::kFree));
  if (problem.typical.size() > 0) result.typical = one_after_other(problem.typical, VectorXd::Zero(n_p));
  if (problem.most_typical.size() > 0)
    result.most_typical = one_after_other(problem.most_typical, VectorXd::Zero(n_p));
  result.guess = [problem](double t) {
    Stage<double> stage = problem.first_guess(t);
    stage.x = one_after_other(stage.x, problem.parameters.at(t));
    return stage;
  };
  return result;
}

MeshOptions exact(MeshOptions mesh) {
  mesh.hessian = HessianKind::kExact;
  return mesh;
}

std::vector<double> spread(const std::vector<double>& values, const std::vector<Eigen::Index>& to,
                           std::size_t size, double rest) {
  std::vector<double> all(size, rest);
  for (std::size_t i = 0; i < to.size(); ++i) all[std::size_t(to[i])] = values[i];
  return all;
}

}  // namespace

struct MotionSensitivity::Made {
  // Indices of the problem's variables and rows in the program with parameters as states.
  struct Places {
    Eigen::Index own;            // states but a free duration: parameters stand behind them
    Eigen::Index n_x, n_p, n_z;  // of the problem: states, parameters, entries of a point
    Eigen::Index points, intervals, rows;

    Eigen::Index variable(Eigen::Index point, Eigen::Index entry) const {
      return point * (n_z + n_p) + entry + (entry < own ? 0 : n_p);
    }
    Eigen::Index parameter(Eigen::Index point, Eigen::Index i) const { return point * (n_z + n_p) + own + i; }
    std::vector<Eigen::Index> variables() const {
      std::vector<Eigen::Index> all;
      for (Eigen::Index point = 0; point < points; ++point)
        for (Eigen::Index entry = 0; entry < n_z; ++entry) all.push_back(variable(point, entry));
      return all;
    }
    std::vector<Eigen::Index> rows_of(Eigen::Index m) const {  // m: of the program with parameters as states
      std::vector<Eigen::Index> all;
      for (Eigen::Index block = 0; block < intervals * rows; ++block)
        for (Eigen::Index i = 0; i < n_x; ++i) all.push_back(block * (n_x + n_p) + i + (i < own ? 0 : n_p));
      for (Eigen::Index j = intervals * rows * (n_x + n_p); j < m; ++j) all.push_back(j);
      return all;
    }
  };

  // The program with its parameters fixed at every node.
  class HeldParameters : public StagedNlp {
   public:
    HeldParameters(const Problem& problem, const MeshOptions& mesh)
        : StagedNlp(discretize(with_parameters_as_states(problem), exact(mesh))),
          shape_(program().shape),
          is_of_steps_(mesh.scheme.step) {
      const Eigen::Index free = problem.free_time ? 1 : 0, n_p = problem.parameters.size();
      places_ = {.own = problem.n_x(),
                 .n_x = problem.n_x() + free,
                 .n_p = n_p,
                 .n_z = problem.n_x() + free + problem.n_a() + problem.n_u(),
                 .points = 0,
                 .intervals = Eigen::Index(shape_.stages.size()) - 1,
                 .rows = mesh.scheme.rows()};
      places_.points = Eigen::Index(shape_.n()) / (places_.n_z + n_p);
      for (Eigen::Index block = 0; block < places_.intervals * places_.rows; ++block) {
        for (Eigen::Index i = 0; i < n_p; ++i) {
          const auto row = std::size_t(block * (places_.n_x + n_p) + places_.own + i);
          shape_.g_lower[row] = -HUGE_VAL, shape_.g_upper[row] = HUGE_VAL;
        }
      }
      hold(problem);
    }
    const Places& places() const { return places_; }

    // A start beyond its bounds, as a controller may measure it, is kept.
    void set_values(const Problem& now) {
      Problem inside = now;
      bool is_inside = true;
      for (Eigen::Index i = 0; i < now.start.size(); ++i) {
        if (std::isnan(now.start[i])) continue;
        inside.start[i] = std::min(std::max(now.start[i], now.x.lower[i]), now.x.upper[i]);
        is_inside = is_inside && inside.start[i] == now.start[i];
      }
      const Problem wide = with_parameters_as_states(inside);
      StagedNlp::set_values(wide);
      if (!is_inside && now.start.allFinite())
        start_at(one_after_other(now.start, wide.start.tail(places_.n_p)));
      hold(now);
    }

    const NlpShape& shape() const override { return shape_; }

   private:
    void hold(const Problem& now) {
      const std::string varies = now.parameters.first_of_time();
      if (is_of_steps_ && !varies.empty())
        throw ArgumentError(
            "problem \"" + now.name + "\": the parameter \"" + varies +
            "\" varies with time, on the way of a step as well, which derivatives of multiple "
            "shooting do not know; expected constants");
      shape_.x_lower = program().shape.x_lower, shape_.x_upper = program().shape.x_upper;
      const std::vector<double> t = times();
      for (Eigen::Index point = 0; point < places_.points; ++point) {
        const VectorXd values = now.parameters.at(t[std::size_t(point)]);
        for (Eigen::Index i = 0; i < places_.n_p; ++i) {
          const auto at = std::size_t(places_.parameter(point, i));
          shape_.x_lower[at] = shape_.x_upper[at] = values[i];
        }
      }
    }

    NlpShape shape_;
    bool is_of_steps_;
    Places places_;
  };

  Made(const Problem& given, const MeshOptions& mesh)
      : problem(given),
        scheme(mesh.scheme),
        program(given, mesh),
        variables(program.places().variables()),
        rows(program.places().rows_of(Eigen::Index(program.shape().m()))) {}

  // The solution in the variables of the program with parameters as states.
  void check_sizes(const NlpSolution& s) const {
    const std::size_t n = variables.size(), m = rows.size();
    if (s.x.size() != n || s.lambda.size() != m || s.lower_multiplier.size() != n ||
        s.upper_multiplier.size() != n)
      refuse(problem, "the solution has " + std::to_string(s.x.size()) + " variables and " +
                          std::to_string(s.lambda.size()) + " multipliers, on this mesh there are " +
                          std::to_string(n) + " and " + std::to_string(m));
  }

  NlpSolution widened(const NlpSolution& s) const {
    check_sizes(s);
    const NlpShape& shape = program.shape();
    NlpSolution wide = s;
    wide.x = shape.x_lower;  // of the parameters
    for (std::size_t i = 0; i < s.x.size(); ++i) wide.x[std::size_t(variables[i])] = s.x[i];
    wide.lambda = spread(s.lambda, rows, shape.m(), 0);
    wide.lower_multiplier = spread(s.lower_multiplier, variables, shape.n(), 0);
    wide.upper_multiplier = spread(s.upper_multiplier, variables, shape.n(), 0);
    if (!s.units.x.empty()) wide.units.x = spread(s.units.x, variables, shape.n(), 1);
    if (!s.units.g.empty()) wide.units.g = spread(s.units.g, rows, shape.m(), 1);
    return wide;
  }

  SensitivityTable table(std::vector<std::string> names, const std::vector<VectorXd>& directions) {
    const auto k = Eigen::Index(directions.size());
    SensitivityTable t{std::move(names),
                       {Eigen::Index(variables.size()), k},
                       {Eigen::Index(rows.size()), k},
                       VectorXd(k),
                       VectorXd(k),
                       VectorXd(k)};
    const VectorXd still = VectorXd::Zero(Eigen::Index(program.shape().m()));
    for (Eigen::Index i = 0; i < k; ++i) {
      const SolutionStep s = derivatives->along(directions[std::size_t(i)], still);
      t.x.col(i) = s.x(variables), t.lambda.col(i) = s.lambda(rows);
      t.cost[i] = s.cost, t.from[i] = s.from, t.to[i] = s.to;
    }
    return t;
  }

  Problem problem;
  Scheme scheme;
  HeldParameters program;
  std::vector<Eigen::Index> variables, rows;
  NlpSolution solution;  // of the last at(), as widened; its bounds
  std::vector<double> lower, upper;
  NlpScaling units;  // as they were given
  std::optional<SolutionSensitivities> derivatives;
};

MotionSensitivity::MotionSensitivity(const Problem& problem, const MeshOptions& mesh)
    : made_(std::make_unique<Made>(problem, mesh)) {}
MotionSensitivity::~MotionSensitivity() = default;
MotionSensitivity::MotionSensitivity(MotionSensitivity&&) noexcept = default;
MotionSensitivity& MotionSensitivity::operator=(MotionSensitivity&&) noexcept = default;

MotionSensitivities MotionSensitivity::at(const Problem& now, const NlpSolution& solution) {
  Made& made = *made_;
  made.program.set_values(now);
  made.solution = made.widened(solution);
  made.units = solution.units;
  made.lower = made.program.shape().x_lower, made.upper = made.program.shape().x_upper;
  made.derivatives.emplace(made.program, made.solution);
  const auto& places = made.program.places();
  const auto n = Eigen::Index(made.program.shape().n());
  std::vector<VectorXd> by_parameters, by_start;
  for (Eigen::Index i = 0; i < places.n_p; ++i) {
    VectorXd d = VectorXd::Zero(n);
    for (Eigen::Index point = 0; point < places.points; ++point) d[places.parameter(point, i)] = 1;
    by_parameters.push_back(std::move(d));
  }
  for (Eigen::Index i = 0; i < now.n_x(); ++i)
    by_start.push_back(VectorXd::Unit(n, places.variable(0, i)) * (std::isnan(now.start[i]) ? 0 : 1));
  MotionSensitivities result;
  result.status = made.derivatives->status();
  result.why = made.derivatives->why();
  result.parameters = made.table(now.parameters.entry_names(), by_parameters);
  result.start = made.table(now.states, by_start);
  result.gain = Eigen::MatrixXd::Zero(now.n_u(), now.n_x());
  const VectorXd weights = made.scheme.control_weights(0);  // of the points of the first interval
  for (Eigen::Index point = 0; point < weights.size(); ++point) {
    if (weights[point] != 0)
      result.gain +=
          weights[point] * result.start.x.middleRows((point + 1) * places.n_z - now.n_u(), now.n_u());
  }
  return result;
}

NlpSolution MotionSensitivity::predict(const Problem& next) {
  Made& made = *made_;
  if (!made.derivatives)
    refuse(made.problem, "a prediction needs a solution to start from; expected at() before predict()");
  made.program.set_values(next);
  const NlpShape& shape = made.program.shape();
  const auto n = Eigen::Index(shape.n()), m = Eigen::Index(shape.m());
  VectorXd d = VectorXd::Zero(n);
  const auto refuse = [&](std::size_t i, const std::string& what) {
    dyntape::refuse(made.problem,
                    "\"" + made.program.variable_name(i) + "\" " + what + ", which no prediction knows");
  };
  for (std::size_t i = 0; i < shape.n(); ++i) {
    const bool was_given = made.lower[i] == made.upper[i], is_given = shape.x_lower[i] == shape.x_upper[i];
    if (was_given && !is_given) refuse(i, "is open where it was held");
    if (!was_given && is_given) refuse(i, "is given where it was open");
    if (was_given) d[Eigen::Index(i)] = shape.x_lower[i] - made.lower[i];
  }
  for (std::size_t i : made.derivatives->held_variables()) {
    const bool at_lower = made.solution.lower_multiplier[i] > made.solution.upper_multiplier[i];
    d[Eigen::Index(i)] = at_lower ? shape.x_lower[i] - made.lower[i] : shape.x_upper[i] - made.upper[i];
  }
  for (std::size_t i = 0; i < shape.n(); ++i) {
    if (!std::isfinite(d[Eigen::Index(i)])) refuse(i, "is open where it was held");
  }
  const SolutionStep s = made.derivatives->along(d, VectorXd::Zero(m)), &c = made.derivatives->correction();
  for (std::size_t i = 0; i < shape.n(); ++i) {
    const double value = made.solution.x[i] + c.x[Eigen::Index(i)] + s.x[Eigen::Index(i)];
    const double room = kOfLimit * (1 + std::abs(value));
    const auto check_limit = [&](double before, double now, double beyond) {
      if (now != before && beyond > room)
        refuse(i, "would be " + io::with_digits(value, 6) + ", beyond its new limit of " +
                      io::with_digits(now, 6) + " that did not hold it before");
    };
    check_limit(made.lower[i], shape.x_lower[i], shape.x_lower[i] - value);
    check_limit(made.upper[i], shape.x_upper[i], value - shape.x_upper[i]);
  }
  NlpSolution result;
  result.status = made.solution.status;
  result.units = made.units;
  result.objective = made.solution.objective + s.cost;
  for (const Eigen::Index i : made.variables) {
    const auto at = std::size_t(i);
    result.x.push_back(made.solution.x[at] + c.x[i] + s.x[i]);
    const bool is_given = made.lower[at] == made.upper[at];  // which solvers give no bound multiplier
    const double bound_multiplier = is_given ? 0
                                             : made.solution.upper_multiplier[at] -
                                                   made.solution.lower_multiplier[at] +
                                                   c.bound_multiplier[i] + s.bound_multiplier[i];
    result.lower_multiplier.push_back(std::max(0.0, -bound_multiplier)),
        result.upper_multiplier.push_back(std::max(0.0, bound_multiplier));
  }
  for (const Eigen::Index j : made.rows)
    result.lambda.push_back(made.solution.lambda[std::size_t(j)] + c.lambda[j] + s.lambda[j]);
  return result;
}

}  // namespace dyntape
