// SPDX-License-Identifier: BSD-3-Clause
//
// The rows of the table of robot functions (robot_table.hxx), and how a row is run.  Internal.
//
//   .inputs    inputs of the state, in this order: q v (a | tau) mu
//   .outputs   blocks of the result: name, rows, columns, pages
//   .of, .by   for a derivative: the row of its value, with the same state, and the inputs of the derivative; its
//              blocks are, for each block of the value, one for each of these inputs
//   .needs     further settings
//   .run       computes; .write writes the result
// Rows do not handle mimic joints: they get full vectors, and a Data with their rules (following.h).
#pragma once

#include <dyntape/interface/robot/robot_workspace.h>

#include <algorithm>
#include <string>

namespace dyntape::detail {

// kNv: torques, and derivatives by q, v and a; kNvMoved: velocities and accelerations, and derivatives by torques.
// Both differ with mimic joints (robot_reduction.hxx).  k3Nv, k3NvMoved: q, v and a | tau together.
enum class Extent { kOne, k3, k6, kNv, kNvMoved, k3Nv, k3NvMoved, k10Bodies, kContactRows };

struct BlockShape {
  const char* name;
  Extent rows = Extent::kOne, cols = Extent::kOne, pages = Extent::kOne;
};

enum Need : unsigned { kNothing = 0, kInertia = 1, kFrame = 2, kContacts = 4 };

template <class T>
struct RobotRow {
  const char* name;
  const char* what;
  const char* inputs;
  std::vector<BlockShape> outputs;
  const char* of = "";
  const char* by = "";
  unsigned needs = kNothing;
  void (*run)(RobotWorkspace<T>&, const RobotState<T>&);
  void (*write)(const RobotWorkspace<T>&, RobotWriter<T>&);
};

// The table.
template <class T>
const std::vector<RobotRow<T>>& robot_rows();

// --- Sizes -----------------------------------------------------------------------------------------------

template <class T>
RobotSizes sizes_of(const dynamics::Model<T>& model, const RobotFunction& function) {
  int nq = model.nq;
  for (const dynamics::MimicRule& rule : function.mimics)
    nq -= dynamics::nq(model.joints[static_cast<std::size_t>(model.joint_index(rule.joint))].type);
  return {nq, model.nv - static_cast<int>(function.mimics.size()), model.njoints(),
          std::max(1, static_cast<int>(function.contacts.size()))};
}

inline int extent(Extent e, const RobotSizes& sizes) {
  const int n = sizes.nv,
            in_their_order[] = {1, 3, 6, n, n, 3 * n, 3 * n, 10 * sizes.bodies, 3 * sizes.contacts};
  return in_their_order[static_cast<int>(e)];
}

inline int size_of(const BlockShape& shape, const RobotSizes& sizes) {
  return extent(shape.rows, sizes) * extent(shape.cols, sizes) * extent(shape.pages, sizes);
}

// Number of inputs after q: 0 to 3.
inline int inputs_behind_q(const char* inputs) {
  return static_cast<int>(std::count(inputs, inputs + std::char_traits<char>::length(inputs), ' '));
}

// The inputs (0: q) of a derivative.
std::vector<int> derived_by(const RobotFunction& derivative);

}  // namespace dyntape::detail
