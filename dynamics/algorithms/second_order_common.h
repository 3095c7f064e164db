// SPDX-License-Identifier: BSD-3-Clause
//
// The common part of both forms of second derivatives: motions of the bodies, and moments of the mass beyond each
// joint.
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>

#include <vector>

namespace dyntape::dynamics {

// In body frames.
template <class T>
struct MovingBodies {
  explicit MovingBodies(const Model<T>& model);

  TreeShape shape;
  std::vector<Motion<T>> v_p, v, a;              // (njoints) of the parent in the body's frame; of the body
  std::vector<Motion<T>> S, S_dot, S_ddot, S_v;  // (nv) see algorithms.h
  std::vector<Composite<T>> composites;          // (njoints)
  std::vector<VelocityProduct<T>> products;      // (njoints)
  std::vector<Force<T>> f;                       // (njoints)
  std::vector<int> above;                        // (njoints) columns above
  int levels = 0, longest_path = 0;              // in joints and in columns
};

}  // namespace dyntape::dynamics
