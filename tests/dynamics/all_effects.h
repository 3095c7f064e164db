// SPDX-License-Identifier: BSD-3-Clause
//
// Every effect at once on a random robot.
#pragma once

#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/effects/check.h>
#include <dyntape/dynamics/effects/effects.h>

#include "random_robots.h"

namespace dyntape::dynamics {

// Limits that a random configuration is often beyond, on every second joint.
inline void limit_joints(Model<double>& model, Random& random) {
  for (Joint<double>& joint : model.joints) {
    joint.limits.effort = random.uniform(0.5, 4);
    if (random.below(2) == 0) joint.limits.lower = random.uniform(-0.5, 0);
    if (random.below(2) == 0) joint.limits.upper = random.uniform(0, 0.5);
  }
}

template <class Item>
Item on_random_body(const Model<double>& model, Random& random) {
  Item item;
  item.body = random.below(model.njoints());
  item.X_BF = random_placement(random);
  return item;
}

inline void add_joint_effects(const Model<double>& model, Random& random, Effects<double>& effects) {
  const auto sizes = [&](double least, double most) {
    return Eigen::VectorXd(random.vector(model.nv, (most - least) / 2).array() + (most + least) / 2);
  };
  effects.gravity.vector = random.vector3(9);
  effects.armature = model_armature(model);
  effects.armature->rotor_inertia = sizes(0, 0.01), effects.armature->gear_ratio = sizes(-5, 5);
  effects.damping = model_damping(model);
  effects.friction = CoulombFriction<double>{model_friction(model), 0.3, sizes(1, 3), 0.5};
  effects.springs = Springs<double>{sizes(0, 1), random_configuration(model, random.engine)};
  effects.limits = SoftLimits<double>{sizes(1, 9), sizes(0, 2), sizes(0.1, 0.3)};
  effects.saturation = Saturation<double>{model_effort(model), SaturationKind::kSmooth};
  effects.back_emf = BackEmf<double>{sizes(0.1, 0.2), sizes(0.1, 0.2), sizes(0.5, 1), sizes(1, 5)};
  for (const TendonKind kind : {TendonKind::kBothWays, TendonKind::kTension}) {
    effects.tendons.push_back({random.vector(model.nv), 0.3, 0.1, 4, 0.7, kind, 0.2});
  }
}

inline void add_body_effects(const Model<double>& model, Random& random, Effects<double>& effects) {
  for (const FixedIn fixed_in : {FixedIn::kBody, FixedIn::kWorld}) {
    effects.wrenches.push_back(wrench_at_frame(model, random.below(model.njoints()), fixed_in,
                                               {random.vector3(5), random.vector3(5)}));
    DragBody<double> sail = on_random_body<DragBody<double>>(model, random);
    sail.area = random.uniform(0.5, 2), sail.linear = random.uniform(0, 1);
    effects.drag.push_back(sail);
    Buoy<double> buoy = on_random_body<Buoy<double>>(model, random);
    buoy.volume = random.uniform(1e-4, 1e-3);
    effects.buoyancy.push_back(buoy);
    AddedBody<double> hull = on_random_body<AddedBody<double>>(model, random);
    for (double* x : {hull.mass.data(), hull.inertia.data()}) {
      for (int k = 0; k < 3; ++k) x[k] = random.uniform(0, 2);
    }
    effects.added_mass.push_back(hull);
  }
  effects.drag.medium = random.vector3(2), effects.drag.smoothing = 0.1;
  for (const ContactExponent exponent :
       {ContactExponent::kOne, ContactExponent::kThreeHalves, ContactExponent::kTwo}) {
    ContactBody<double> foot = on_random_body<ContactBody<double>>(model, random);
    foot.radius = random.uniform(0, 0.5), foot.stiffness = random.uniform(5, 20);
    foot.exponent = exponent, foot.dissipation = 0.2, foot.friction = 0.7;
    if (exponent == ContactExponent::kTwo) foot.second_end = random.vector3(0.4);
    effects.contacts.push_back(foot);
  }
  effects.contacts.slip = 0.5;
  Ground<double>& ground = effects.contacts.ground;
  ground.kind = random.below(2) == 0 ? GroundKind::kPlane : GroundKind::kWaves;
  ground.normal = Vector3<double>(0.1, -0.2, 1.5), ground.offset = 0.3;
  ground.slope = random.vector3(0.3), ground.amplitude = 0.1, ground.wave = random.vector3(2);
}

// The model gets limits, which some of the effects read.
inline Effects<double> all_effects(Model<double>& model, Random& random) {
  Effects<double> effects;
  limit_joints(model, random);
  add_joint_effects(model, random, effects);
  add_body_effects(model, random, effects);
  check(model, effects);
  return effects;
}

}  // namespace dyntape::dynamics
