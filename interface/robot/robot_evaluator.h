// SPDX-License-Identifier: BSD-3-Clause
//
// A robot's functions by every route, with one shape of input and output (robot_functions.h), so that routes
// can be compared entry by entry.
//
//   RobotEvaluator id(arm, RobotFunction("id-derivatives"), RobotRoute::kGenerated);
//   Eigen::VectorXd y = id(state);                        // dtau_dq | dtau_dv | dtau_da, row by row
//
//   route        value functions                derivatives
//   analytic     plain double code              plain double analytic recursion
//   tape         interpreter of the recording   interpreter of the differentiated recorded value: nothing of
//                                               the analytic derivative is used
//   generated    compiled C of the recording    compiled C of the shortest recording (RobotSource::kShortest)
//   machine-code the same recordings, as machine code made in this process without a compiler: the bits of generated
//   fd-forward   -                              (f(x (+) h) - f(x)) / h
//   fd-central   -                              (f(x (+) h) - f(x (+) -h)) / 2h, of the plain double value
//
// Steps of the differences, for an entry x of v, a, tau or of a revolute or prismatic joint: s max(1, |x|),
// as it is after rounding; for tangents of other joints s (rad, m), so that nothing depends on where the base
// is. s = eps^(1/2) forward, eps^(1/3) central (W. Press et al., Numerical Recipes, 3rd ed., 5.7), or as
// given.
//
// Errors: ArgumentError for a state of another size and for differences of a value function; NumericalError
// for forward dynamics of a robot without inertia about a joint; ToolError of the compiler.
#pragma once

#include <memory>
#include <string>

#include <Eigen/Core>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/robot/robot_functions.h>

namespace dyntape {

enum class RobotRoute { kAnalytic, kTape, kGenerated, kMachineCode, kFdForward, kFdCentral };

inline constexpr RobotRoute kRobotRoutes[] = {RobotRoute::kAnalytic,  RobotRoute::kTape,
                                              RobotRoute::kGenerated, RobotRoute::kMachineCode,
                                              RobotRoute::kFdForward, RobotRoute::kFdCentral};

// "analytic", "tape", "generated", "machine-code", "fd-forward", "fd-central"; the reverse throws ArgumentError.
const char* to_string(RobotRoute route);
RobotRoute robot_route_from(const std::string& word);

// Whether the route is defined for the function: all but the differences of a value.
bool has_route(const RobotFunction& function, RobotRoute route);

struct RobotEvaluatorOptions {
  CodegenOptions codegen;  // of the generated route; the machine-code route but for codegen.route
  double step = 0;         // s of the differences; 0: the default
};

// One thread at a time.
class RobotEvaluator {
 public:
  RobotEvaluator(const dynamics::Model<double>& model, const RobotFunction& function, RobotRoute route,
                 const RobotEvaluatorOptions& options = {});
  ~RobotEvaluator();
  RobotEvaluator(RobotEvaluator&&) noexcept;
  RobotEvaluator& operator=(RobotEvaluator&&) noexcept;

  std::size_t n_in() const;
  std::size_t n_out() const;

  // state (n_in) -> result (n_out).
  void evaluate(const double* state, double* result);
  Eigen::VectorXd operator()(const Eigen::Ref<const Eigen::VectorXd>& state);

  // What the tape, generated and machine-code routes run; null on the others.
  const CompiledFunction* compiled() const;

 private:
  struct Path;
  std::unique_ptr<Path> path_;
};

}  // namespace dyntape
