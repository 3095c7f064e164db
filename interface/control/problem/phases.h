// SPDX-License-Identifier: BSD-3-Clause
//
// A motion in phases: a sequence of problems, each with its own dynamics, terms, limits and duration, and links
// between their states.  Use it if the dynamics change during the motion, e.g. with contacts.
//
//   Phases jump("jump");
//   jump.add("push-off", stance);                             // Problem: start given, goal free
//   jump.add("flight", flight);                               // starts at the final state of the push-off
//   jump.add("landing", landing, [](const auto& s) { return impact(s.x); });    // starts at impact(final state)
//   Solution s = optimise(jump, ...);                         // optimise.h
//
// A link is a function of the stage (stage.h) at the end of the previous phase: its state and parameters, at the
// time `duration` (the initial value if free), without accelerations and controls.  It returns the first state of
// the next phase (its n_x entries).  Without a link both states are equal and must have the same size.
// jump.close(link) links the end of the last phase to the start of the first, for periodic motions.
//
// The time of each phase starts at 0.  Each duration may be free (problem.h).  Costs are summed.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/interface/control/problem/problem.h>

namespace dyntape {

struct Phases {
  explicit Phases(std::string name_) : name(std::move(name_)) {}

  struct Phase {
    std::string name;
    Problem problem;
    StageFunction link;  // from the final state of the previous phase; empty: the same state
  };

  void add(std::string phase, Problem problem, StageFunction link = {}) {
    phases.push_back({std::move(phase), std::move(problem), std::move(link)});
  }
  void close(StageFunction link = {}) { closing = std::move(link); }

  std::string name;
  std::vector<Phase> phases;
  std::vector<std::string> controls =
      {};  // all controls of the motion in their order; empty: in order of appearance
  std::optional<StageFunction> closing;  // from the end of the last phase to the start of the first
};

// A transition from the end of a phase to the start of another.
struct PhaseLink {
  std::size_t from, to;         // phases
  const StageFunction* change;  // empty: equal states
};
std::vector<PhaseLink> links_of(const Phases& phases);

// Returns the problems with Problem::typical set from the movement of the same states in neighbouring phases, if no
// link changes the states.  A phase with free ends gives no estimate of its own.
std::vector<Problem> told_of_each_other(const Phases& phases);

// Throws ArgumentError, naming the phase, if a problem is inconsistent (check() in problem.h) or does not fit its
// neighbours.
void check(const Phases& phases);

}  // namespace dyntape
