// SPDX-License-Identifier: BSD-3-Clause
//
// A motion in phases: problems one after another, each with dynamics, terms, limits and a duration of its own, and what
// becomes of the state between them.
//
//   Phases jump("jump");
//   jump.add("push-off", stance);                             // Problem: start given, goal free
//   jump.add("flight", flight);                               // begins in the state in which the push-off ends
//   jump.add("landing", landing, [](const auto& s) { return impact(s.x); });    // begins in impact(state of before)
//   Solution s = optimise(jump, ...);                         // optimise.h
//
// A link is a function of the stage (stage.h) at the end of the phase before: its state and parameters, at the time that the
// problem calls its duration (of a free one the first guess), without accelerations and controls.  It gives the first state of the next phase (n_x of that one); without a link both are the same,
// and are to have as many entries.  jump.close(link) makes the first phase begin where the last one ends, so that the motion
// can go on for ever.
//
// The time of a phase begins at 0.  A duration may be free (problem.h), each by itself.  Costs are added up.
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
    StageFunction link;  // from the state at the end of the phase before; empty: the same state
  };

  void add(std::string phase, Problem problem, StageFunction link = {}) {
    phases.push_back({std::move(phase), std::move(problem), std::move(link)});
  }
  void close(StageFunction link = {}) { closing = std::move(link); }

  std::string name;
  std::vector<Phase> phases;
  std::vector<std::string> controls =
      {};  // of the whole motion, in their order; empty: as they appear in phases
  std::optional<StageFunction> closing;  // from the end of the last phase to the start of the first
};

// From the end of one phase to the start of another.
struct PhaseLink {
  std::size_t from, to;         // phases
  const StageFunction* change;  // empty: none
};
std::vector<PhaseLink> links_of(const Phases& phases);

// The problems, each told how far the motion moves its states before and after it (Problem::typical), where no link changes
// them: a phase that begins and ends anywhere cannot know.
std::vector<Problem> told_of_each_other(const Phases& phases);

// ArgumentError, naming the phase, unless each problem fits together (check() in problem.h), and with its neighbours.
void check(const Phases& phases);

}  // namespace dyntape
