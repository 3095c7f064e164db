// SPDX-License-Identifier: BSD-3-Clause
//
// An optimal control problem over a fixed or free time.  Define it here, then call solve() (solve/solve.h):
//
//   minimise  sum of costs  int L dt + M(end)     over x(t), u(t)
//   subject to  x' = f(t, x, u),  path and end constraints,  bounds,  x(0) and x(T) if given
//
//   Problem p("block move", {"p", "v"}, {"u"}, 1.0, [](const auto& s) { return vector(s.x[1], s.u[0]); });
//   p.add(running_squares("effort", [](const auto& s) { return s.u; }));         // int u^2 dt
//   p.start << 0, 0;
//   p.goal << 1, 0;
//   Solution s = optimise(p, {.mesh = {.intervals = 10}});                       // optimise.h
//
// All costs and constraints are Terms of one list.  A Term has a Where (path, instant or end), a Role (cost or
// constraint) and a function of the stage (stage.h).  A lambda is enough for your own cost.
//
// - Inverse form: accelerations a are variables, x' = f(t, x, a, u) is linear, and the dynamics are equations
// residual(t, x, a, u) = 0 at every point.  `ode` then computes x' from x and u alone, to verify the motion.
// - A term acts along the path, at the end, or at one instant (at_fraction()), e.g. a waypoint.
// - Soft limits, and norms other than squares: penalties.h.
// - Parameters, values that change between solves without another recording: parameters.h.
// - Free duration: p.free_duration(0.5, 4) makes the duration a variable in these bounds (s), with initial value
// `duration`.  p.add(minimum_time(weight)) is a cost on it.  Terms read the real time, s.t.
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
  kInstant,   // at a fraction of the duration (Term::share): 0 at the start, in between for a waypoint
  kTerminal,  // at the end
};

enum class Role {
  kCost,        // a scalar cost
  kSquares,     // residuals r; the cost is r.r, which Gauss-Newton uses
  kEquality,    // r = 0
  kInequality,  // lower <= r <= upper
};
inline bool is_constraint(Role role) { return role == Role::kEquality || role == Role::kInequality; }

struct Term {
  std::string name;
  Where where;
  Role role;
  StageFunction function;
  Eigen::VectorXd lower = {}, upper = {};  // (size of r) for an inequality
  double share = 0;                        // of kInstant: fraction of the duration, 0 (start) to 1 (end)
  // Optional, for a plain cost: residuals c whose Jacobian J gives the Gauss-Newton curvature 2 J^T J.
  StageFunction curvature = {};
  // Optional, for a path inequality: a length, in the unit of r.  The violation between mesh points is divided by
  // this length; 0: passings.h derives the length.
  double length = 0;
};

Term running_cost(std::string name, StageFunction function);
Term running_squares(std::string name, StageFunction residuals);
Term path_equality(std::string name, StageFunction residuals);
Term path_inequality(std::string name, StageFunction values, Eigen::VectorXd lower, Eigen::VectorXd upper);
Term path_not_negative(std::string name, StageFunction value);  // value has one entry
Term terminal_cost(std::string name, StageFunction function);
Term terminal_squares(std::string name, StageFunction residuals);
Term terminal_equality(std::string name, StageFunction residuals);
Term terminal_inequality(std::string name, StageFunction values, Eigen::VectorXd lower,
                         Eigen::VectorXd upper);

// Moves a term to one instant, without integration: a fraction of the duration (which may be free), or the start.
// An even mesh moves its nearest node there; given node times must contain the instant.
//
//   p.add(at_fraction(0.5, path_equality("via", frame_position(scene, "panda_hand", {0.4, 0.1, 0.6}))));
//   p.add(at_start(running_squares("calm", [](const auto& s) { return s.u; })));
Term at_fraction(double share, Term term);
Term at_start(Term term);

// The cost w T of the duration T, w = weight.  Written as the square of sqrt(w T) (cos log T, sin log T), its
// Gauss-Newton curvature is 5 w / (2 T).  With an effort c / T^3 the sum has the exact 4 w / T at the minimum.  With
// sqrt(w T) alone, of curvature w / (2 T), it has half: steps have twice Newton's length and do not converge.
Term minimum_time(double weight);

struct Bounds {
  Eigen::VectorXd lower, upper;  // +-infinity: no bound
};

struct Problem {
  Problem() = default;
  // Creates a problem without bounds, start and goal, with a zero guess.  `rate` returns x' at a stage.
  Problem(std::string name, std::vector<std::string> states, std::vector<std::string> controls,
          double duration, StageFunction rate);

  int n_x() const { return static_cast<int>(states.size()); }
  int n_a() const { return static_cast<int>(accelerations.size()); }
  int n_u() const { return static_cast<int>(controls.size()); }

  void add(Term term) { terms.push_back(std::move(term)); }

  // Makes the duration free; `duration` is its initial value; 0 < shortest <= longest.
  void free_duration(double shortest, double longest) { free_time = {shortest, longest}; }

  // Returns the stage of these values and of the parameters at time t, the argument of a function in plain double.
  Stage<double> stage(double t, Eigen::VectorXd x_, Eigen::VectorXd a_, Eigen::VectorXd u_) const {
    return {t, std::move(x_), std::move(a_), std::move(u_), parameters.at(t)};
  }
  Stage<double> first_guess(double t) const;  // at time t: from `guess`; if empty, the straight line

  // Copies the values of `now`: parameters, start, goal, bounds and guess; with a free duration also its range and
  // initial value.  Functions stay as recorded.  ArgumentError if sizes do not fit.
  void take_values(const Problem& now);

  // Sets the inverse form (above).
  void use_accelerations(std::vector<std::string> names, StageFunction residual, StageFunction ode);

  std::string name;
  std::vector<std::string> states, accelerations, controls;  // names
  int positions = 0;    // the first states are positions, whose rates are other states, as in x = (q, v)
  double duration = 0;  // s
  struct Range {
    double shortest, longest;  // s
  };
  std::optional<Range> free_time;  // range of a free duration
  Parameters parameters;
  StageFunction rate;      // x' (n_x)
  StageFunction residual;  // empty in the forward form
  StageFunction ode;       // x' without accelerations, in plain double
  std::vector<Term> terms;
  Bounds x, a, u;               // at every point
  Eigen::VectorXd start, goal;  // (n_x) values at t = 0 and t = duration; kFree: free
  // Typical change of each state in the motion, if the initial guess gives a worse one; 0 or empty: unknown.
  Eigen::VectorXd typical;
  // Upper limit of each state's change where dyntape estimates it from derivatives, e.g. half a turn for an angle; 0:
  // none.  Changes in the initial guess and in `typical` are not limited.  Empty: no limits.
  Eigen::VectorXd most_typical;
  // The difference x - from of two states (n_x); empty: entry by entry.  Robots with orientations set a function,
  // since a quaternion and its negative are the same orientation.
  std::function<Eigen::VectorXd(const Eigen::VectorXd& from, const Eigen::VectorXd& x)> difference;
  // The initial guess at time t: a stage with x, a, u of the right sizes.
  std::function<Stage<double>(double t)> guess;

  static constexpr double kFree = std::numeric_limits<double>::quiet_NaN();
};

// A vector of the given entries: vector(s.x[1], s.u[0]).
template <class First, class... Rest>
auto vector(const First& first, const Rest&... rest) {
  Eigen::Matrix<First, Eigen::Dynamic, 1> v(1 + sizeof...(rest));
  int i = 0;
  v[i++] = first;
  ((v[i++] = First(rest)), ...);
  return v;
}

// The straight line in x from `start` to `goal`, with u = 0.  Entries free at one end: constant; at both: zero.
std::function<Stage<double>(double t)> straight_line(const Problem& problem);

// Throws ArgumentError, naming the part, for wrong sizes, empty bounds, or values that are not finite.
void check(const Problem& problem);

// Returns the instants at which terms act: increasing fractions of the duration, the last is always 1.
std::vector<double> instants_of(const Problem& problem);
bool stands_at(const Term& term, double share);
std::string name_of_instant(double share);  // "the start", "0.5 of the duration", "the end"

// Throws ArgumentError unless a rate has one entry per state, or the cost of this name one entry.
void check_rate(const Problem& problem, Eigen::Index entries);
void check_cost(const Problem& problem, const std::string& name, Eigen::Index entries);

// An ArgumentError that names the problem.
[[noreturn]] void refuse(const Problem& problem, const std::string& what);

// Throws ArgumentError, naming `what`, if no number lies between `lower` and `upper`.
void check_room(const Problem& problem, const std::string& what, double lower, double upper);

}  // namespace dyntape
