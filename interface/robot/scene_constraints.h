// SPDX-License-Identifier: BSD-3-Clause
//
// The constraints of a scene's robot: closed loops, rigid contacts, hard limits.
//
//   scene.constraints.loops.push_back(dynamics::loop_constraint(model, frame_1, frame_2, 3));
//   scene.constraints.rigid.stops = dynamics::hard_stops(model, 0.0);
//
// Loops are equations, which every fixed-step scheme of a Stepper supports (scene_system.h).  Contacts and stops are
// unilateral and need a RigidStepper (rigid_step.h), whose forces are parameters of the system.
#pragma once

#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/dynamics/contact/rigid_contacts.h>

namespace dyntape {

struct SceneConstraints {
  std::vector<dynamics::Constraint<double>> loops;
  std::vector<std::string> loop_names = {};  // "a to b", for messages
  dynamics::UnilateralConstraints rigid = {};

  bool empty() const { return loops.empty() && rigid.empty(); }
};

template <class T>
std::vector<dynamics::Constraint<T>> loops_of(const SceneConstraints& constraints) {
  std::vector<dynamics::Constraint<T>> loops;
  for (const auto& loop : constraints.loops) loops.push_back(loop.cast<T>());
  return loops;
}

}  // namespace dyntape
