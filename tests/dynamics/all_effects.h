// SPDX-License-Identifier: BSD-3-Clause
//
// Every effect at once on a random robot, in double and in 113 bits.
#pragma once

#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/effects/effects.h>

#include "random_robots.h"

namespace dyntape::dynamics {

inline Effects<double> all_effects(const Model<double>& model, Random& random) {
  Effects<double> effects;
  effects.armature = model_armature(model);
  effects.damping = model_damping(model);
  effects.friction = CoulombFriction<double>{model_friction(model), 0.3};
  effects.springs =
      Springs<double>{random.vector(model.nv).cwiseAbs(), random_configuration(model, random.engine)};
  for (const FixedIn fixed_in : {FixedIn::kBody, FixedIn::kWorld}) {
    effects.wrenches.push_back(wrench_at_frame(model, random.below(model.njoints()), fixed_in,
                                               {random.vector3(5), random.vector3(5)}));
  }
  return effects;
}

}  // namespace dyntape::dynamics
