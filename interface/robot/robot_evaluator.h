// SPDX-License-Identifier: BSD-3-Clause
//
// Evaluates a robot function by any route (plain, tape, generated, finite differences) with the same inputs and
// outputs (robot_functions.h).  Use it to compare routes.
//
//   RobotEvaluator id(arm, RobotFunction("id-derivatives"), RobotRoute::kGenerated);
//   Eigen::VectorXd y = id(state);                        // dtau_dq | dtau_dv | dtau_da, row-major
//
//   route        value functions                derivatives
//   analytic     plain double code              plain double analytic recursion
//   tape         interpreter of the recording   interpreter of the differentiated recorded value, independent of the
//                                               analytic derivative
//   generated    compiled C of the recording    compiled C of the shortest recording (RobotSource::kShortest)
//   machine-code the same recordings as machine code generated in the process, without compiler; the bits of generated
//   fd-forward   -                              (f(x (+) h) - f(x)) / h
//   fd-central   -                              (f(x (+) h) - f(x (+) -h)) / 2h, of the plain double value
//
// Steps of finite differences:
//
// - for an entry x of v, a, tau, or of a revolute or prismatic joint: s max(1, |x|), after rounding
// - for tangents of other joints: s (rad, m), so that the result does not depend on the base's position
// - s = eps^(1/2) forward, eps^(1/3) central (W. Press et al., Numerical Recipes, 3rd ed., 5.7), or as given
//
// Errors.  ArgumentError: a state of wrong size, differences of a value function.  NumericalError: forward dynamics
// if a joint moves no inertia.  ToolError: the compiler.
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

// "analytic", "tape", "generated", "machine-code", "fd-forward", "fd-central".  robot_route_from throws
// ArgumentError for other words.
const char* to_string(RobotRoute route);
RobotRoute robot_route_from(const std::string& word);

// Returns false only for finite differences of a value function.
bool has_route(const RobotFunction& function, RobotRoute route);

struct RobotEvaluatorOptions {
  CodegenOptions
      codegen;      // for the generated and machine-code routes; codegen.route is ignored by machine-code
  double step = 0;  // s of the differences; 0: default
};

// Not thread-safe.
class RobotEvaluator {
 public:
  RobotEvaluator(const dynamics::Model<double>& model, const RobotFunction& function, RobotRoute route,
                 const RobotEvaluatorOptions& options = {});
  ~RobotEvaluator();
  RobotEvaluator(RobotEvaluator&&) noexcept;
  RobotEvaluator& operator=(RobotEvaluator&&) noexcept;

  std::size_t n_in() const;
  std::size_t n_out() const;

  // state (n_in) -> result (n_out)
  void evaluate(const double* state, double* result);
  Eigen::VectorXd operator()(const Eigen::Ref<const Eigen::VectorXd>& state);

  // The function of the tape, generated and machine-code routes; null for the others.
  const CompiledFunction* compiled() const;

 private:
  struct Path;
  std::unique_ptr<Path> path_;
};

}  // namespace dyntape
