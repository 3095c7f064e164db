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
// A term acts all along, at the end, or at one instant between: a waypoint (at_fraction()).  Soft limits and norms other than
// squares are in penalties.h.
//
// What shall change from solve to solve without being recorded again is a parameter (parameters.h).
//
// Free duration.  p.free_duration(0.5, 4) leaves the time to the solver, between these bounds (s); `duration` is then
// its first guess, and p.add(minimum_time(weight)) makes it cost something.  Terms read the real time, s.t.
//
// Units are the caller's: SI throughout dyntape.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/interface/control/problem/parameters.h>

namespace dyntape {

enum class Where {
  kRunning,   // at every point; a cost is integrated over time
  kInstant,   // where a share of the duration has passed (Term::share): 0 at the start, between at a waypoint
  kTerminal,  // at the end
};

enum class Role {
  kCost,        // a scalar to be minimised
  kSquares,     // residuals r, whose sum of squares r.r is minimised; known to Gauss-Newton
  kEquality,    // r = 0
  kInequality,  // lower <= r <= upper
};
inline bool is_constraint(Role role) { return role == Role::kEquality || role == Role::kInequality; }

struct Term {
  std::string name;
  Where where;
  Role role;
  StageFunction function;
  Eigen::VectorXd lower = {}, upper = {};  // (size of r) of an inequality
  double share = 0;                        // of an instant, from 0 to 1, which is the end
  // Of a plain cost, where there is one: residuals c whose Jacobian gives the curvature 2 J^T J that Gauss-Newton takes.
  StageFunction curvature = {};
};

Term running_cost(std::string name, StageFunction function);
Term running_squares(std::string name, StageFunction residuals);
Term path_equality(std::string name, StageFunction residuals);
Term path_inequality(std::string name, StageFunction values, Eigen::VectorXd lower, Eigen::VectorXd upper);
Term path_not_negative(std::string name, StageFunction value);  // of one entry
Term terminal_cost(std::string name, StageFunction function);
Term terminal_squares(std::string name, StageFunction residuals);
Term terminal_equality(std::string name, StageFunction residuals);
Term terminal_inequality(std::string name, StageFunction values, Eigen::VectorXd lower,
                         Eigen::VectorXd upper);

// The same demand or cost at one instant of the motion, not integrated: where a share of the duration, which may be free, has
// passed, or at the start.  An even mesh moves its nearest node there; node times that are given must have one.
//
//   p.add(at_fraction(0.5, path_equality("via", frame_position(scene, "panda_hand", {0.4, 0.1, 0.6}))));
//   p.add(at_start(running_squares("calm", [](const auto& s) { return s.u; })));
Term at_fraction(double share, Term term);
Term at_start(Term term);

// weight T, T being the duration.  A square, so that Gauss-Newton knows it: of sqrt(w T) (cos log T, sin log T), whose
// derivatives give 5 w / (2 T) of curvature.  Of sqrt(w T) alone there were w / (2 T), and a cost c / T^3 + w T, which has 4 w / T
// at its least, would keep half of it: steps of twice Newton's length, which never end.
Term minimum_time(double weight);

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

  // The time is the solver's to choose, and `duration` its first guess (above); 0 < shortest <= longest.
  void free_duration(double shortest, double longest) { free_time = {shortest, longest}; }

  // The stage of these parts at time t, parameters included: for functions that run in doubles.
  Stage<double> stage(double t, Eigen::VectorXd x_, Eigen::VectorXd a_, Eigen::VectorXd u_) const {
    return {t, std::move(x_), std::move(a_), std::move(u_), parameters.at(t)};
  }
  Stage<double> first_guess(double t) const;  // of `guess`, else the straight line

  // What may change without another recording is taken from `now`: parameters, start, goal, bounds and guess, and with
  // a free duration its range and first guess.  ArgumentError where that does not fit.
  void take_values(const Problem& now);

  // The inverse form (above).
  void use_accelerations(std::vector<std::string> names, StageFunction residual, StageFunction ode);

  std::string name;
  std::vector<std::string> states, accelerations, controls;  // names
  int positions = 0;    // so many states come first whose rates other states are, as x = (q, v)
  double duration = 0;  // s
  struct Range {
    double shortest, longest;  // s
  };
  std::optional<Range> free_time;  // of the duration, where it is free
  Parameters parameters;
  StageFunction rate;      // x' (n_x)
  StageFunction residual;  // empty in the forward form
  StageFunction ode;       // x' without accelerations, in doubles
  std::vector<Term> terms;
  Bounds x, a, u;               // at every point
  Eigen::VectorXd start, goal;  // (n_x) values at t = 0 and t = duration; kFree where there is none
  // Of each state how far it typically moves, where that is known better than the first guess shows; 0: it is not.
  // Empty: of none.
  Eigen::VectorXd typical;
  // Of each state the most that an estimate of how far it moves may be, as half a turn of an angle; 0: any.  What the first
  // guess moves it by, and `typical`, count whatever they are.  Empty: of none.
  Eigen::VectorXd most_typical;
  // How far a state is from another, as changes of its entries; empty: x - from.  Robots with orientations have one: a
  // quaternion and its negative are the same.
  std::function<Eigen::VectorXd(const Eigen::VectorXd& from, const Eigen::VectorXd& x)> difference;
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

// Where terms stand besides along the path: shares of the duration, increasing, the last one 1, which always counts.
std::vector<double> instants_of(const Problem& problem);
bool stands_at(const Term& term, double share);
std::string name_of_instant(double share);  // "the start", "0.5 of the duration", "the end"

// ArgumentError unless a rate has one entry a state; a cost, whose name this is, one.
void check_rate(const Problem& problem, Eigen::Index entries);
void check_cost(const Problem& problem, const std::string& name, Eigen::Index entries);

// ArgumentError that names the problem.
[[noreturn]] void refuse(const Problem& problem, const std::string& what);

// ArgumentError, naming `what` of the problem, unless a number lies between the bounds or is one of them.
void check_room(const Problem& problem, const std::string& what, double lower, double upper);

}  // namespace dyntape
