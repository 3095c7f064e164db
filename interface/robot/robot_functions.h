// SPDX-License-Identifier: BSD-3-Clause
//
// A robot's dynamics as functions from numbers to numbers: by name, in any scalar, recorded.
//
//   Model<double> arm = load_urdf("arm.urdf");
//   Function f = record_robot_function(arm, RobotFunction("id-derivatives"));
//   std::vector<double> y = evaluate(f, state);          // state: (q, v, a), y: dtau_dq | dtau_dv | dtau_da
//
// robot_rows.h is the table of all functions, a row each; `dyntape eval --help` prints it.  A state is
// q (nq), then v, then a or tau, then mu (nv each), as far as the function takes them; units as in
// dynamics/model/model.h.  A result is one block after the other, matrices row by row, tensors page (i, j, k) with k
// running first.  Derivatives with respect to q are tangent: a column for each increment q (+) d in the moving
// frame of the joint (free-flyer: linear, then angular).
//
// A derivative can be had in ways that know nothing of each other:
//   analytic        the derivative recursion of dynamics/ is recorded
//   factored        of forward dynamics: the factors of M in the place of articulated inertias
//   differentiated  the value of q (+) d is recorded with d and q as inputs, its Jacobian derived graph to
//                   graph at d = 0, where the exponential map folds away
//   shortest        whichever takes the fewest operations, counted; large robots are not differentiated, which
//                   would always take more
#pragma once

#include <string>
#include <vector>

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/record/eigen.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/dynamics/model/mimic_rules.h>

namespace dyntape {

// A row of the table, and what its function is to be told besides the state.
class RobotFunction {
 public:
  // ArgumentError, with the nearest name, for a name that is not in the table.
  explicit RobotFunction(const std::string& name);

  // For functions of a frame: its name (empty: the last of the model), and in which frame the result is.
  std::string frame;
  dynamics::ReferenceFrame in = dynamics::ReferenceFrame::kLocalWorldAligned;
  // For constrained dynamics: frames whose origins are held where they are (none: `frame` is).
  std::vector<std::string> contacts;
  // Joints that follow others (dynamics/algorithms/mimic.h): states and results are then those of the others, nq and nv
  // count these only, and torques act on them.
  std::vector<dynamics::MimicRule> mimics;

  int row() const { return row_; }
  auto operator<=>(const RobotFunction&) const = default;

  static const RobotFunction kRnea, kAba, kCrba, kIdDerivatives, kFdDerivatives;

 private:
  int row_;
};

inline const RobotFunction RobotFunction::kRnea("rnea"), RobotFunction::kAba("aba"),
    RobotFunction::kCrba("crba"), RobotFunction::kIdDerivatives("id-derivatives"),
    RobotFunction::kFdDerivatives("fd-derivatives");

// The five that optimal control is made of.
inline const RobotFunction kCoreFunctions[] = {RobotFunction::kRnea, RobotFunction::kAba,
                                               RobotFunction::kCrba, RobotFunction::kIdDerivatives,
                                               RobotFunction::kFdDerivatives};
// All rows, in their order.
const std::vector<RobotFunction>& robot_functions();

enum class RobotSource { kAnalytic, kDifferentiated, kShortest };  // factored: as a candidate of kShortest

const char* to_string(const RobotFunction& function);
// In one line, for people.
const char* description(const RobotFunction& function);

// Whether the function is the derivative of another one, and of which.
bool is_derivative(const RobotFunction& function);
RobotFunction value_of(const RobotFunction& derivative);
// Whether the function solves for accelerations: it then needs an inertia about every joint.
bool is_forward(const RobotFunction& function);
// Whether it reads `frame`, `contacts`.
bool takes_frame(const RobotFunction& function);
bool takes_contacts(const RobotFunction& function);

// A block of a result or of a state.
struct RobotBlock {
  std::string name, shape;  // "dtau_dq", "nv x nv"
  int rows = 1, cols = 1, pages = 1;
  int size() const { return rows * cols * pages; }
};
std::vector<RobotBlock> inputs(const dynamics::Model<double>& model, const RobotFunction& function);
std::vector<RobotBlock> outputs(const dynamics::Model<double>& model, const RobotFunction& function);

// Names of the entries of a state and of a result: q0, q1, ..., tau0; dtau_dq_0_1 is row 0, column 1.
std::vector<std::string> input_names(const dynamics::Model<double>& model, const RobotFunction& function);
std::vector<std::string> output_names(const dynamics::Model<double>& model, const RobotFunction& function);

// The plain double code: the reference that the others are held against.
Eigen::VectorXd evaluate_analytic(const dynamics::Model<double>& model, const RobotFunction& function,
                                  const Eigen::Ref<const Eigen::VectorXd>& state);

// Variables: the state.  `source` matters for derivatives only.  NumericalError for a function that solves for
// accelerations of a robot without inertia about a joint: its text would hold infinities.
Function record_robot_function(const dynamics::Model<double>& model, const RobotFunction& function,
                               RobotSource source = RobotSource::kShortest);

// Dynamics with effects (dynamics/effects/effects.h), for optimal control: (q, v, tau) -> ddq and (q, v, a) -> tau.
// What is not chosen leaves no node.
Function record_forward_dynamics(const dynamics::Model<double>& model,
                                 const dynamics::Effects<double>& effects);
Function record_inverse_dynamics(const dynamics::Model<double>& model,
                                 const dynamics::Effects<double>& effects);

}  // namespace dyntape
