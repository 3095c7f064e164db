// SPDX-License-Identifier: BSD-3-Clause
//
// An optimal control problem over a fixed time:
//
//   minimise  sum of costs  int L dt + M(end)     over x(t), u(t)
//   subject to  x' = f(t, x, u),  path and end constraints,  bounds,  x(0) and x(T) where they are given
//
//   Problem p("block move", {"p", "v"}, {"u"}, 1.0, [](const auto& s) { return vector(s.x[1], s.u[0]); });
//   p.add(running_squares("effort", [](const auto& s) { return s.u; }));         // int u^2 dt
//   p.start << 0, 0;
//   p.goal << 1, 0;
//   Solution s = optimise(p, {.mesh = {.intervals = 10}});                       // optimise.h
//
// Everything that is minimised or constrained is a Term of one list: where it acts, its role, and a function
// of the stage (stage.h).  Adding a cost of one's own is adding a lambda.
//
// Inverse form.  With accelerations a as variables of their own, x' = f(t, x, a, u) is linear and the
// dynamics are the equations residual(t, x, a, u) = 0 at every point; `ode` then gives x' from x and u alone,
// for the checks after the solve.
//
// Units are the caller's: SI throughout dyntape.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include <dyntape/interface/ocp/stage.h>

namespace dyntape {

enum class Where {
  kRunning,   // at every point; a cost is integrated over time
  kTerminal,  // at the end
};

enum class Role {
  kCost,        // a scalar to be minimised
  kSquares,     // residuals r, whose sum of squares r.r is minimised; known to Gauss-Newton
  kEquality,    // r = 0
  kInequality,  // lower <= r <= upper
};

struct Term {
  std::string name;
  Where where;
  Role role;
  StageFunction function;
  Eigen::VectorXd lower = {}, upper = {};  // (size of r) of an inequality
};

Term running_cost(std::string name, StageFunction function);
Term running_squares(std::string name, StageFunction residuals);
Term path_equality(std::string name, StageFunction residuals);
Term path_inequality(std::string name, StageFunction values, Eigen::VectorXd lower, Eigen::VectorXd upper);
Term terminal_cost(std::string name, StageFunction function);
Term terminal_squares(std::string name, StageFunction residuals);
Term terminal_equality(std::string name, StageFunction residuals);
Term terminal_inequality(std::string name, StageFunction values, Eigen::VectorXd lower,
                         Eigen::VectorXd upper);

struct Bounds {
  Eigen::VectorXd lower, upper;  // +-infinity where there is none
};

struct Problem {
  Problem() = default;
  // Free, unbounded and started at zero; x' = f of the stage.
  Problem(std::string name, std::vector<std::string> states, std::vector<std::string> controls,
          double duration, StageFunction rate);

  int n_x() const { return static_cast<int>(states.size()); }
  int n_a() const { return static_cast<int>(accelerations.size()); }
  int n_u() const { return static_cast<int>(controls.size()); }

  void add(Term term) { terms.push_back(std::move(term)); }

  // The inverse form (above).
  void use_accelerations(std::vector<std::string> names, StageFunction residual, StageFunction ode);

  std::string name;
  std::vector<std::string> states, accelerations, controls;  // names
  double duration = 0;                                       // s
  StageFunction rate;                                        // x' (n_x)
  StageFunction residual;                                    // empty in the forward form
  StageFunction ode;                                         // x' without accelerations, in doubles
  std::vector<Term> terms;
  Bounds x, a, u;               // at every point
  Eigen::VectorXd start, goal;  // (n_x) values at t = 0 and t = duration; kFree where there is none
  // The first guess at time t: a stage with x, a, u of the right sizes.
  std::function<Stage<double>(double t)> guess;

  static constexpr double kFree = std::numeric_limits<double>::quiet_NaN();
};

// A vector from its entries: vector(s.x[1], s.u[0]).
template <class First, class... Rest>
auto vector(const First& first, const Rest&... rest) {
  Eigen::Matrix<First, Eigen::Dynamic, 1> v(1 + sizeof...(rest));
  int i = 0;
  v[i++] = first;
  ((v[i++] = First(rest)), ...);
  return v;
}

// Straight line in x from `start` to `goal` (free entries: constant at the other end's value, or zero), u =
// 0.
std::function<Stage<double>(double t)> straight_line(const Problem& problem);

// ArgumentError, naming the part, unless all sizes fit together, bounds leave room, and values are numbers.
void check(const Problem& problem);

// ArgumentError, naming `what` of the problem, unless a number lies between the bounds or is one of them.
void check_room(const Problem& problem, const std::string& what, double lower, double upper);

}  // namespace dyntape
