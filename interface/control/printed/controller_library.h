// SPDX-License-Identifier: BSD-3-Clause
//
// A printed controller, compiled and run on this machine: the numbers of the microcontroller, and often a faster step
// than RecedingHorizon's.
//
//   ControllerLibrary mpc(p, {.mesh = mesh});                   // prints, compiles once (cached)
//   const ControllerStep s = mpc.step(t, x, 2);                 // at most 2 iterations
//   if (s.usable()) plant.apply(mpc.control(t, x));
//
// In double the results have the bits of any other processor that runs the text.  Parameters that are functions of time
// use the plant's time, as in RecedingHorizon.  A ControllerLibrary is for one thread at a time.
//
// Errors.  Those of generate_controller; ToolError without compiler; ArgumentError for a state of the wrong size.
#pragma once

#include <memory>

#include <dyntape/codegen/build/text_library.h>
#include <dyntape/interface/control/discretize/trajectory.h>
#include <dyntape/interface/control/printed/controller.h>

namespace dyntape {

// The results of a step in C.
//
// - kSolved: the plan changed by less than the tolerance
// - kBudgetEnded: the next step continues from this plan
// - kNotFinite: the time, the state, a limit or a value of the functions is not finite; the plan is kept
// - kNoRoom: a lower limit is above its upper one, or equal to it for a control; the plan is kept
struct ControllerStep {
  enum class Status { kSolved, kBudgetEnded, kNotFinite, kNoRoom } status = Status::kNotFinite;
  int iterations = 0, interior_steps = 0;
  double cost = 0, violation = 0;  // violation: the largest, in nominal values
  bool usable() const { return status == Status::kSolved || status == Status::kBudgetEnded; }
};

class ControllerLibrary {
 public:
  ControllerLibrary(const Problem& problem, const ControllerOptions& options,
                    const CodegenOptions& codegen = {});

  ControllerStep step(double t, const Eigen::VectorXd& x, int budget);
  Eigen::VectorXd control(double t, const Eigen::VectorXd& x) const;
  Trajectory plan() const;       // times from 0
  Eigen::MatrixXd gain() const;  // (n_u x n_x) of the first interval
  void restart();                // forgets the plan
  // Changes parameters from the next step on; they use the plant's time.
  Problem& values() { return problem_; }
  const PrintedController& printed() const { return printed_; }
  double number(std::size_t i) const;  // of the state, by index (ControllerLayout)

 private:
  void set(std::size_t i, double value);
  std::vector<double> state_vector(const Eigen::VectorXd& x) const;

  Problem problem_;
  ControllerOptions options_;
  PrintedController printed_;
  std::shared_ptr<const codegen::TextLibrary> library_;
  std::vector<double> state_;  // memory of the struct
};

}  // namespace dyntape
