// SPDX-License-Identifier: BSD-3-Clause
//
// The functions of a robot by name, with names, shapes and properties.
//
//   RobotFunction id("id-derivatives");
//   input_names(arm, id)        q0, ..., v0, ..., a0, ...
//   outputs(arm, id)            dtau_dq, dtau_dv, dtau_da: name, shape, size
//
// robot_rows.h is the table of all functions; `dyntape eval --help` prints it.
#pragma once

#include <string>
#include <vector>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/mimic_rules.h>

namespace dyntape {

// A row of the table, and the settings of its function.
class RobotFunction {
 public:
  // ArgumentError, with the nearest name, for a name that is not in the table.
  explicit RobotFunction(const std::string& name);

  // For functions of a frame: its name (empty: the last frame of the model), and the axes of the result.
  std::string frame;
  dynamics::ReferenceFrame in = dynamics::ReferenceFrame::kLocalWorldAligned;
  // For constrained dynamics: frames whose origins are held (empty: `frame`).
  std::vector<std::string> contacts;
  // Mimic joints (dynamics/algorithms/mimic.h): states and results then have the other joints only, nq and nv count
  // only these, and torques act on them.
  std::vector<dynamics::MimicRule> mimics;

  int row() const { return row_; }
  auto operator<=>(const RobotFunction&) const = default;

  static const RobotFunction kRnea, kAba, kCrba, kIdDerivatives, kFdDerivatives;

 private:
  int row_;
};
#if !defined(DYNTAPE_LEVEL)  // levels use the library's object
inline const RobotFunction RobotFunction::kRnea("rnea"), RobotFunction::kAba("aba"),
    RobotFunction::kCrba("crba"), RobotFunction::kIdDerivatives("id-derivatives"),
    RobotFunction::kFdDerivatives("fd-derivatives");

// The five functions of optimal control.
inline const RobotFunction kCoreFunctions[] = {RobotFunction::kRnea, RobotFunction::kAba,
                                               RobotFunction::kCrba, RobotFunction::kIdDerivatives,
                                               RobotFunction::kFdDerivatives};
#endif
const std::vector<RobotFunction>& robot_functions();  // all rows, in their order

const char* to_string(const RobotFunction& function);
// A description in one line.
const char* description(const RobotFunction& function);

// Returns the function of which this is a derivative, if any.
bool is_derivative(const RobotFunction& function);
RobotFunction value_of(const RobotFunction& derivative);
// Returns true if the function solves for accelerations; it then needs an inertia about every joint.
bool is_forward(const RobotFunction& function);
// Returns true if it reads `frame`, `contacts`.
bool takes_frame(const RobotFunction& function);
bool takes_contacts(const RobotFunction& function);

// A block of a result or state.
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

}  // namespace dyntape
