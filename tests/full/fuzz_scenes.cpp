// SPDX-License-Identifier: BSD-3-Clause
#include "fuzz_scenes.h"

#include <cmath>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/scene/simulate.h>

#include "../dynamics/all_effects.h"

namespace dyntape::testing {
namespace {

constexpr double kDuration = 0.04, kLongest = 2e-3;  // s
constexpr int kHalvings = 9;                         // of the longest step, until a motion is resolved
constexpr int kRefinements = 5;                      // of that one, to see how its error falls
constexpr double kResolved = 1e-5;                   // of the energy that moves
constexpr double kRounding = 1e-12;                  // likewise: thousands of steps' worth

struct Choice {
  int joints;
  unsigned effects;  // a bit each, in the order of effects.def
};

double decades(dynamics::Random& random, double most) { return std::pow(10, random.uniform(-most, most)); }

// What sets in at some place or velocity has kinks in higher derivatives there, which cost order.
bool has_kinks(const dynamics::Effects<double>& e) {
  return e.limits || e.contacts || e.tendons || e.saturation;
}

Scene scene_of(std::uint64_t seed, const Choice& choice) {
  dynamics::Random random(seed);
  const dynamics::Base base = random.below(2) ? dynamics::Base::kFloating : dynamics::Base::kFixed;
  const bool chain = random.below(3) == 0;
  Scene scene;
  scene.name = "scene";
  scene.robot.model = dynamics::random_tree(random, {.joints = choice.joints, .base = base, .chain = chain});
  dynamics::Model<double>& model = scene.robot.model;
  dynamics::Effects<double>& effects = scene.robot.effects;
  effects = dynamics::all_effects(model, random);
  effects.damping->coefficient *= decades(random, 2);
  effects.friction->torque *= decades(random, 1);
  effects.springs->stiffness *= decades(random, 2);
  effects.limits->stiffness *= decades(random, 1);
  effects.drag.density *= decades(random, 2);
  for (auto& foot : effects.contacts) foot.stiffness *= decades(random, 1);
  effects.contacts.ground.kind =
      dynamics::GroundKind::kPlane;  // on waves the balance has a limit of its own (docs/scenes.md)
  // The length of a tendon over a joint without limits jumps where that has turned by pi (tendons.h).
  for (const auto& joint : model.joints)
    if (joint.type == dynamics::JointType::kContinuous)
      for (auto& tendon : effects.tendons) tendon.arms[joint.idx_v] = 0;
  int row = 0;
  dynamics::for_each_effect(effects, [&](auto& effect) {
    if (!(choice.effects >> row++ & 1u)) effect.reset();
  });
  const dynamics::State state = dynamics::random_state(model, random);
  scene.q = state.q, scene.v = 0.5 * state.v;
  const int driven = int(actuated_dofs(scene.robot).size());
  scene.commands.t = {0};
  scene.commands.u = random.vector(driven);
  scene.duration = kDuration, scene.sample = kDuration;
  scene.integrator = Integrator::kRungeKutta4;
  scene.evaluation.route = Route::kInterpreter;
  return scene;
}

struct Balance {
  double error = 0;             // of the energy that moves
  double rounding = kRounding;  // likewise; more where little moves beside what is stored
  std::string refused = {};
};

Balance balance(Scene scene, double step) {
  scene.step = step;
  try {
    const SimulatedMotion motion = simulate(scene);
    if (!motion.trouble.empty()) return {0, 0, motion.trouble};
    if (!motion.doubt.empty()) return {0, 0, motion.doubt};
    if (!motion.q.allFinite() || !motion.v.allFinite()) return {NAN};
    double stored = 0;
    for (const double energy : motion.stored) stored = std::max(stored, std::abs(energy));
    const double scale = motion.energy_scale();
    return {motion.energy_error() / scale, kRounding * (1 + stored / scale)};
  } catch (const ArgumentError& refused) {  // steps that are too long at the start
    return {0, 0, refused.what()};
  }
}

std::string failure_of(std::uint64_t seed, const Choice& choice) {
  const Scene scene = scene_of(seed, choice);
  double h = kLongest;
  Balance coarse = balance(scene, h);
  for (int k = 0; k < kHalvings && (!coarse.refused.empty() || coarse.error > kResolved); ++k) {
    h /= 2;
    coarse = balance(scene, h);
  }
  if (!coarse.refused.empty()) return "refused at a step of " + io::scientific(h) + " s: " + coarse.refused;
  if (!(coarse.error <= kResolved))
    return "the balance is off by " + io::scientific(coarse.error) + " at a step of " + io::scientific(h) +
           " s";
  // Order 4 would leave a part of 256, order 1 of 4; near rounding, and by kinks, it is more.  Where errors of two kinds are
  // just about to cancel a coarse mesh says little: the next ones do.
  const double part = has_kinks(scene.robot.effects) ? 0.5 : 1.0 / 64;
  std::vector<double> errors = {coarse.error};
  std::string seen = io::scientific(coarse.error);
  for (int k = 1; k <= kRefinements; ++k) {
    const Balance fine = balance(scene, h / std::exp2(k));
    if (!fine.refused.empty())
      return "refused at a smaller step than " + io::scientific(h) + " s: " + fine.refused;
    errors.push_back(fine.error);
    seen += ", " + io::scientific(fine.error);
    if (k >= 2 && fine.error <= std::max(part * errors[std::size_t(k) - 2], fine.rounding)) return "";
  }
  return "the balance does not vanish with the step, halved from " + io::scientific(h) + " s: " + seen;
}

std::string names_of(std::uint64_t seed, const Choice& choice) {
  std::string names;
  const Scene scene = scene_of(seed, choice);
  dynamics::for_each_effect(scene.robot.effects, [&](const auto& effect) {
    if (effect) names += std::string(names.empty() ? "" : ", ") + dynamics::effect_name(effect);
  });
  return names;
}

}  // namespace

std::string scene_failure(std::uint64_t seed) {
  dynamics::Random random(seed ^ 0x9e3779b97f4a7c15u);
  Choice choice{1 + random.below(5), unsigned(random.engine() & random.engine())};
  std::string failure = failure_of(seed, choice);
  if (failure.empty()) return "";
  for (unsigned row = 0; row < 32; ++row) {
    const Choice smaller{choice.joints, choice.effects & ~(1u << row)};
    if (smaller.effects == choice.effects) continue;
    const std::string still = failure_of(seed, smaller);
    if (!still.empty()) choice = smaller, failure = still;
  }
  for (int joints = 1; joints < choice.joints; ++joints) {
    const std::string still = failure_of(seed, {joints, choice.effects});
    if (still.empty()) continue;
    choice.joints = joints, failure = still;
    break;
  }
  return failure + ", with " + std::to_string(choice.joints) + " joints and " + names_of(seed, choice);
}

}  // namespace dyntape::testing
