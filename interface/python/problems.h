// SPDX-License-Identifier: BSD-3-Clause
//
// Optimal control problems as Python makes them: a robot's or one's own, with terms that are Python functions.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/visuals.h>
#include <dyntape/interface/control/solve/solve.h>
#include <dyntape/interface/motion/robot_problem.h>
#include <dyntape/interface/motion/tied/tied_joints.h>

#include "robot.h"

namespace dyntape::python {

// Entries of the parts of a stage.
struct StageSizes {
  Eigen::Index x = 0, a = 0, u = 0, p = 0;
  Eigen::Index nq = 0, nv = 0;  // of x = (q, v), of a robot's problem
};

// A stage as a Python function sees it: recorded values, or numbers.
struct PythonStage {
  nb::object t, x, a, u, p;
  StageSizes sizes;
  Parameters parameters;  // where each stands in p
};

// A frame's origin at a position (m, world), as an equality demands it or a swing ends.
struct FramePosition {
  std::string frame;
  Eigen::Vector3d position;
};

// A stage function that C++ made, or that was recorded of a Python function.
struct PythonStageFunction {
  std::string name;
  StageFunction function;
  std::optional<FramePosition> target = {};  // whose error it is
};

struct PythonProblem {
  bool is_robot = false;                                // or of one's own
  std::function<dynamics::UrdfVisuals()> visuals = {};  // of a robot, for pages
  RobotScene scene;
  RobotProblemOptions options;
  Problem problem;
  std::shared_ptr<const TiedJoints> tied = {};   // of a robot with mimic joints: states have the others
  std::shared_ptr<const Solution> earlier = {};  // that solve() begins with
  struct Given {
    std::string name;
    nb::callable function;
  };
  std::vector<Given> given = {};  // functions of the stage that were recorded, for messages
  struct Demand {
    FramePosition at;
    std::optional<double> share;    // of the duration; none: all along
    bool is_foothold = false;       // of a swing that ends there, otherwise of an equality
    std::optional<double> floor{};  // m, its height under a foothold, where it is known
    double clearance = 0;           // m, of the swing that ends there
    Eigen::Vector3d from{0, 0, 0};  // m, where this swing begins
  };
  std::vector<Demand> demands = {};  // positions of frames, which are checked before a solve

  StageSizes sizes() const;
  int nq() const { return tied ? tied->nq() : scene.model.nq; }  // of a robot's states
  int nv() const { return tied ? tied->nv() : scene.model.nv; }
  // Of the scene's model, which has all joints.
  Eigen::VectorXd all_q(const Eigen::VectorXd& q) const { return tied ? tied->all_q(q) : q; }
  StageFunction of_all(const StageFunction& f) const { return tied ? tied->of_all(f) : f; }
};

// What Problem.solve() returns.
struct ProblemSolution {
  std::shared_ptr<const PythonProblem> of;
  Problem problem;
  std::shared_ptr<const Solution> solution;
  int nq = 0, nv = 0;
};

// Runs the Python function once, on recorded values, and keeps what it did: no Python runs in a solve.
StageFunction record_stage_function(PythonProblem& problem, const std::string& name, nb::callable f);
// Runs the functions again along the first guess: "cost.py:3: sqrt of -1 is no number, in \"effort\"" of the first operation
// whose value or slope is not finite, or "".
std::string first_not_finite_line(const PythonProblem& problem);

// The same error with the user's line in place of a node of the recording, where there is one.
[[noreturn]] void throw_with_line(const PythonProblem& problem, const NumericalError& error);

// Warns, before a solve, of motors that cannot hold the robot at rest at its start, and of positions of frames that are out of
// reach or below the floor.
void warn_of_unmet_demands(const PythonProblem& problem);

// m, the height of the scene's floor at a position; none: the scene has no floor there.
std::optional<double> floor_under(const RobotScene& scene, const Eigen::Vector3d& position);

// What a Python argument stands for: a ready function, or a callable of the stage.
StageFunction stage_function_of(PythonProblem& problem, const std::string& name, nb::handle given);

// A number or an array; of a function of time the array has a row for each of the times, straight lines between.
ParameterValue parameter_value(nb::handle value, nb::handle times);

Eigen::VectorXd vector_of(nb::handle given, const std::string& what, Eigen::Index entries);

// ArgumentError, naming the entry, where a lower bound is above the upper; entries without names are counted.
void check_bounds(const std::string& call, const std::vector<std::string>& names,
                  const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);

// ArgumentError unless a mesh has one interval at least.
void check_intervals(int intervals);

void bind_stages(nb::module_& module);                                   // stages.cpp
void bind_control(nb::module_& module);                                  // control.cpp
void bind_ddp(nb::module_& module, nb::class_<PythonProblem>& problem);  // ddp.cpp
void bind_terms(nb::class_<PythonProblem>& problem);                     // problems/terms.cpp
void bind_problem_sensitivities(nb::module_& module,
                                nb::class_<ProblemSolution>& solution);  // problems/sensitivities.cpp
void bind_problem_solve(nb::module_& module, nb::class_<PythonProblem>& problem);  // problems/solve.cpp

}  // namespace dyntape::python
