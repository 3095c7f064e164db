// SPDX-License-Identifier: BSD-3-Clause
//
// Advances states through time: the loop of simulations, sweeps, roll-outs and plants of closed loops.
//
//   RobotStepper motion(scene.robot, scene.integrator, scene.evaluation);           // what moves (robot_stepper.h)
//   motion.start(x);
//   struct Heights {                                                                // an observer
//     void reached(long k) { z.push_back(motion.x()[2]); }
//     const RobotStepper& motion;
//     std::vector<double> z;
//   } heights{motion, {}};
//   const long made = run(motion, {.to = 1000, .h = 1e-3}, [&](const StepTime& s) { return u(s.t); }, heights);
//
// Motion: one state, rows of states, or states in lanes, with the commands of a step in the motion's own form U.
//
//   bool step(const StepTime& s, const U& u)    computes the end of the step; false: there is no step
//   void advance()                              makes the end the current state
//
// Inputs: U inputs(const StepTime& s).
//
// Observers have any of these functions.  They are called in the order of the arguments.
//
//   bool goes_on(const StepTime& s)                first; false ends the run before this step
//   void before(const StepTime& s, const U& u)     the commands are known
//   void after(const StepTime& s, const U& u)      the step is computed: the motion has its beginning and its end
//   void reached(long k)                           the end is the current state, at the beginning of step k
//
// Returns the index of the first step that was not made; range.to if all were made.
#pragma once

namespace dyntape {

// Step k lasts from t to t + h (s).
struct StepTime {
  long k = 0;
  double t = 0, h = 0;
};

// The steps from .. to - 1 of equal length; step k begins at start + k h.
struct StepRange {
  long from = 0, to = 0;
  double h = 0, start = 0;  // s

  StepTime at(long k) const { return {k, start + double(k) * h, h}; }
};

namespace detail {

template <class Observer>
bool goes_on(Observer& observer, const StepTime& s) {
  if constexpr (requires { observer.goes_on(s); }) return observer.goes_on(s);
  return true;
}

template <class Observer, class U>
void before(Observer& observer, const StepTime& s, const U& u) {
  if constexpr (requires { observer.before(s, u); }) observer.before(s, u);
}

template <class Observer, class U>
void after(Observer& observer, const StepTime& s, const U& u) {
  if constexpr (requires { observer.after(s, u); }) observer.after(s, u);
}

template <class Observer>
void reached(Observer& observer, long k) {
  if constexpr (requires { observer.reached(k); }) observer.reached(k);
}

}  // namespace detail

template <class Motion, class Inputs, class... Observers>
long run(Motion& motion, const StepRange& range, Inputs&& inputs, Observers&&... observers) {
  for (long k = range.from; k < range.to; ++k) {
    const StepTime s = range.at(k);
    if (!(detail::goes_on(observers, s) && ...)) return k;
    const auto& u = inputs(s);
    (detail::before(observers, s, u), ...);
    if (!motion.step(s, u)) return k;
    (detail::after(observers, s, u), ...);
    motion.advance();
    (detail::reached(observers, k + 1), ...);
  }
  return range.to;
}

}  // namespace dyntape
