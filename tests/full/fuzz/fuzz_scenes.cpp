// SPDX-License-Identifier: BSD-3-Clause
#include "fuzz_scenes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <atomic>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/run/simulate/accuracy.h>
#include <dyntape/interface/run/simulate/rigid_account.h>
#include <dyntape/interface/run/simulate/simulate.h>

#include "dynamics/all_effects.h"

namespace dyntape::testing {
namespace {

using Eigen::VectorXd;

// A robot of fewer joints is the beginning of the one of more, and each effect has random numbers of its own, so that
// what is left of a scene stays what it was.
struct Recipe {
  std::uint64_t seed;
  int joints;
  std::vector<bool> has;  // the effects in their order, then the others

  enum Other { kCommands, kLag, kContacts, kStops, kLoop, kAdaptive, kOthers };
  bool has_other(Other other) const { return has[has.size() - kOthers + other]; }
};
constexpr const char* kOtherNames[] = {
    "commands that change", "motors with a lag", "rigid contacts", "hard limits", "a loop", "adaptive steps"};

constexpr double kSteps = 64;  // the fewest of a motion

dynamics::Random numbers(const Recipe& recipe, unsigned long use) {
  return dynamics::Random(recipe.seed * 64 + use);
}

// Of each effect, from weak to strong beside bodies of a kilogram and 0.3 m.
dynamics::Effects<double> effects_of(const Recipe& recipe, dynamics::Model<double>& model) {
  dynamics::Random limits = numbers(recipe, 1), values = numbers(recipe, 2), scales = numbers(recipe, 3);
  dynamics::limit_joints(model, limits);
  dynamics::Effects<double> effects;
  dynamics::add_joint_effects(model, values, effects);
  dynamics::add_body_effects(model, values, effects);
  const auto scale = [&](double decades = 2) { return std::pow(10, scales.uniform(-decades, decades)); };
  effects.armature->inertia *= scale();
  effects.damping->coefficient *= scale();
  effects.friction->smoothing *= scale(1);
  if (scales.below(2) == 0) effects.friction->breakaway.reset(), effects.friction->stribeck_speed.reset();
  effects.springs->stiffness *= scale(3);
  effects.limits->stiffness *= scale(), effects.limits->damping *= scale();
  if (scales.below(3) == 0) effects.saturation->kind = dynamics::SaturationKind::kHard;
  effects.back_emf->torque_constant *= scale();
  for (auto& tendon : effects.tendons) tendon.stiffness *= scale(), tendon.damping *= scale();
  for (const dynamics::Joint<double>& joint :
       model.joints) {  // the angle of a wheel jumps by a turn, and its tendon with it
    if (joint.type != dynamics::JointType::kContinuous) continue;
    for (auto& tendon : effects.tendons) tendon.arms[joint.idx_v] = 0;
  }
  for (auto& wrench : effects.wrenches) wrench.value = wrench.value * scale(1);
  for (auto& sail : effects.drag) sail.area *= scale(), sail.linear *= scale();
  for (auto& buoy : effects.buoyancy) buoy.volume *= scale(1);
  for (auto& foot : effects.contacts) foot.stiffness *= scale(), foot.dissipation *= scale(1);
  effects.contacts.slip *= scale(1);
  effects.contacts.ground.kind =
      dynamics::GroundKind::kPlane;  // on waves the balance is not exact (docs/scenes.md)
  std::size_t i = 0;
  dynamics::for_each_effect(effects, [&](auto& effect) {
    if (!recipe.has[i++]) effect.reset();
  });
  return effects;
}

// 1/s: modes at the start and at its turn, how fast bodies turn, how fast joints pass what smooths their friction.
double fastest(const Scene& scene) {
  const RobotScene& robot = scene.robot;
  const int nv = robot.model.nv;
  dynamics::Data<double> data(robot.model);
  dynamics::EffectTorques<double> torques(robot.model);
  const VectorXd tau = torques_at(actuated_dofs(robot), VectorXd(scene.commands.u.col(0)), nv);
  double rate = 1 + scene.v.cwiseAbs().maxCoeff();
  for (const double moving : {1.0, 0.0}) {
    dynamics::forward_dynamics_derivatives<double>(robot.model, data, torques, robot.effects, scene.q,
                                                   moving * scene.v, tau);
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(2 * nv, 2 * nv);
    A.topRightCorner(nv, nv).setIdentity();
    A.bottomRows(nv) << data.ddq_dq, data.ddq_dv;
    rate = std::max(rate, A.eigenvalues().cwiseAbs().maxCoeff());
    const double most = data.ddq.cwiseAbs().maxCoeff();
    rate = std::max(rate, std::sqrt(most));
    if (robot.effects.friction) rate = std::max(rate, most / robot.effects.friction->smoothing);
  }
  return rate;
}

// Two bodies, or one and the world, meet at a point where they do so already; of rows that are too many, some hang together.
void add_loop(const Recipe& recipe, Scene& scene) {
  dynamics::Random random = numbers(recipe, 6);
  const dynamics::Model<double>& model = scene.robot.model;
  dynamics::Data<double> data(model);
  dynamics::forward_kinematics<double>(model, data, scene.q);
  dynamics::Constraint<double> loop;
  loop.body_1 = model.njoints() - 1, loop.body_2 = random.below(model.njoints()) - 1;
  if (loop.body_2 == loop.body_1 - 1) loop.body_2 = -1;
  loop.rows = random.below(4) == 0 ? 6 : 3;
  loop.X_1 = dynamics::random_placement(random, 0.3);
  const dynamics::Placement<double> X_W1 = data.X_WB[std::size_t(loop.body_1)] * loop.X_1;
  loop.X_2 = X_W1;
  if (loop.body_2 >= 0) {
    const dynamics::Placement<double>& X_W2 = data.X_WB[std::size_t(loop.body_2)];
    loop.X_2 = {X_W2.R.transpose() * X_W1.R, X_W2.R.transpose() * (X_W1.p - X_W2.p)};
  }
  scene.robot.constraints.loops = {loop};
  scene.robot.constraints.loop_names = {"loop"};
}

// Planes and stops that are open at the start, some by nothing, most so near that the motion reaches them.
void add_rigid(const Recipe& recipe, Scene& scene) {
  dynamics::Random random = numbers(recipe, 7);
  const double near = scene.v.cwiseAbs().maxCoeff() * scene.duration;
  const auto room = [&] { return random.below(4) == 0 ? 0 : random.uniform(0, near); };
  const auto restitution = [&] { return random.below(2) == 0 ? 0 : random.uniform(0, 1); };
  dynamics::UnilateralConstraints& rigid = scene.robot.constraints.rigid;
  dynamics::Model<double>& model = scene.robot.model;
  for (dynamics::Joint<double>& joint : model.joints) {
    const bool on_a_line = dynamics::traits(joint.type).on_a_line;
    const double q = on_a_line ? scene.q[joint.idx_q] : 0, below = room(), above = room(), e = restitution();
    if (!recipe.has_other(Recipe::kStops) || !on_a_line) continue;
    rigid.stops.push_back({joint.name, joint.idx_q, joint.idx_v, 1, q - below, e});
    rigid.stops.push_back({joint.name, joint.idx_q, joint.idx_v, -1, q + above, e});
  }
  if (!recipe.has_other(Recipe::kContacts)) return;
  dynamics::Data<double> data(model);
  for (int i = 0, n = 1 + random.below(3); i < n; ++i) {
    dynamics::RigidContact contact;
    contact.name = "contact " + std::to_string(i);
    contact.body = model.njoints() - 1 - random.below(std::min(2, model.njoints()));
    contact.X_BF = dynamics::random_placement(random, 0.3);
    contact.radius = random.below(2) == 0 ? 0 : random.uniform(0, 0.2);
    contact.normal = random.vector3();
    contact.friction = random.below(3) == 0 ? 0 : random.uniform(0, 1.5);
    contact.restitution = restitution();
    dynamics::UnilateralConstraints alone;
    alone.contacts = {contact};
    contact.offset = dynamics::unilateral_rows<double>(model, data, alone, scene.q).gap[0] - room();
    rigid.contacts.push_back(contact);
  }
}

Scene scene_of(const Recipe& recipe) {
  dynamics::Random tree = numbers(recipe, 0), rest = numbers(recipe, 4);
  Scene scene;
  scene.name = "random";
  scene.robot.model = dynamics::random_tree(
      tree, {.joints = recipe.joints,
             .base = recipe.seed % 2 ? dynamics::Base::kFloating : dynamics::Base::kFixed,
             .chain = recipe.seed % 5 == 0});
  scene.robot.effects = effects_of(recipe, scene.robot.model);
  constexpr Integrator kSchemes[] = {Integrator::kRungeKutta4,       Integrator::kRungeKutta4,
                                     Integrator::kRungeKutta4,       Integrator::kImplicitMidpoint,
                                     Integrator::kSemiImplicitEuler, Integrator::kImplicitVelocity,
                                     Integrator::kVariational};
  scene.integrator = kSchemes[rest.below(7)];
  if (recipe.has_other(Recipe::kAdaptive))
    scene.integrator = rest.below(2) == 0 ? Integrator::kAdaptive : Integrator::kAdaptiveStiff;
  // Without velocity products, or with loops, there is no Lagrangian, which is refused.
  if (scene.integrator == Integrator::kVariational &&
      (!scene.robot.effects.coriolis || recipe.has_other(Recipe::kLoop)))
    scene.integrator = Integrator::kImplicitMidpoint;
  scene.evaluation.route = Route::kInterpreter;
  scene.q = dynamics::random_configuration(scene.robot.model, rest.engine);
  scene.v = rest.vector(scene.robot.model.nv, std::pow(10, rest.uniform(-1, 0.5)));
  const long n = long(actuated_dofs(scene.robot).size());
  scene.commands.t = {0, 1};
  scene.commands.u = rest.vector(n, 3).replicate(1, 2);
  if (recipe.has_other(Recipe::kLoop)) add_loop(recipe, scene);
  // At most a twentieth of the shortest time, of which an open loop has one as well; a power of two is exact.
  const double rate = std::max(fastest(scene), recipe.has_other(Recipe::kLoop) ? 20.0 : 0.0);
  scene.step = std::exp2(std::floor(std::log2(0.05 / rate)));
  scene.duration = scene.sample = kSteps * scene.step;
  scene.sample /= 16;
  scene.commands.t.back() = 2 * scene.duration;
  if (recipe.has_other(Recipe::kCommands)) scene.commands.u.col(1) += rest.vector(n, 3);
  if (recipe.has_other(Recipe::kLag)) scene.robot.lag = rest.vector(n, 2).cwiseAbs() * scene.duration;
  add_rigid(recipe, scene);
  return scene;
}

int order_of(Integrator scheme) {
  if (scheme == Integrator::kRungeKutta4 || is_adaptive(scheme))
    return 4;  // of these, the integral of powers
  return scheme == Integrator::kImplicitMidpoint || scheme == Integrator::kVariational ? 2 : 1;
}

// By how much what is off must fall where the step is a sixteenth: h^p less half an order, for what is not yet small of
// higher order; with forces that begin within a step, less a whole one, as their errors depend on where in it.
double fall(const Scene& scene, const Recipe& recipe) {
  const dynamics::Effects<double>& effects = scene.robot.effects;
  const bool begins =
      effects.contacts || (effects.saturation && effects.saturation->kind == dynamics::SaturationKind::kHard);
  double order = order_of(scene.integrator) - 0.5;
  if (recipe.has_other(Recipe::kCommands)) order = std::min(order, 1.5);  // commands are held over a step
  if (begins) order = std::min(order, 1.0);
  // A spring of a wheel turns over where the wheel is opposite to its rest.
  for (const dynamics::Joint<double>& joint : scene.robot.model.joints) {
    if (effects.springs && joint.type == dynamics::JointType::kContinuous) order = std::min(order, 0.5);
  }
  // Rigid contacts: order 1 while closed, and they close and open within steps.
  if (!scene.robot.constraints.rigid.empty()) order = std::min(order, 0.5);
  return std::pow(16, -order);
}

struct Balance {
  double off = 0, rounding = 0;  // of what moved
  bool refused = false;
};

Balance balance_of(Scene scene, double finer) {
  scene.step /= finer;
  const SimulatedMotion motion = simulate(scene);
  const bool of_energy = motion.warning.starts_with("the balance of energy");
  if (!motion.trouble.empty() || (!motion.warning.empty() && !of_energy)) return {.refused = true};
  constexpr double kNothing = 1e-12;  // J: a robot that is held
  const double scale = motion.energy_scale() + kNothing;
  double stored = 0;  // differences of it are compared
  for (const double energy : motion.stored) stored = std::max(stored, std::abs(energy));
  // What does not give way takes energy or leaves it, all of it together.
  const std::vector<std::string> rigid = RigidAccount::names(scene.robot.constraints);
  double given = 0;
  for (std::size_t k = 0; k < motion.t.size(); ++k) {
    double work = 0;
    for (const EnergyFlow& flow : motion.flows) {
      if (std::find(rigid.begin(), rigid.end(), flow.name) != rigid.end()) work += flow.work[k];
    }
    given = std::max(given, work);
  }
  // 2000 and more sums, each rounded, of forces that lose some digits themselves.  Adaptive steps begin anew each time, which
  // takes up to the tolerance of 1e-10 each time.
  const double digits = is_adaptive(scene.integrator) ? 1e-9 * kSteps * finer : 1e-11;
  return {(motion.energy_error() + given) / scale + std::max(motion.deepest, motion.loop_error),
          digits * (1 + stored / scale)};
}

std::atomic<std::uint64_t> refused = 0;

// "" where nothing is wrong; up to "[" the kind of what is.
std::string wrong(const Recipe& recipe) {
  const Scene scene = scene_of(recipe);
  const double least = fall(scene, recipe);
  std::vector<double> off;
  std::string seen;
  // Where 1024 steps are too few for what comes up on the way, as contacts, more are.
  for (double finer = 1; finer <= 256; finer *= 4) {
    Balance now;
    try {
      now = balance_of(scene, finer);
    } catch (const ArgumentError&) {
      now.refused = true;
    }
    if (now.refused) {
      if (finer < 16) continue;
      ++refused;
      return "";
    }
    if (!std::isfinite(now.off))
      return std::string(to_string(scene.integrator)) + ": the balance is not finite";
    off.push_back(now.off);
    seen += (seen.empty() ? "" : ", ") + io::scientific(now.off);
    if (now.off <= now.rounding) return "";
    const std::size_t n = off.size();
    if (n >= 3 && off[n - 1] <= least * std::max(off[n - 3], now.rounding)) return "";
  }
  return std::string(to_string(scene.integrator)) + ": the balance of energy does not fall with the step [" +
         seen + " of what moved by steps from " + io::shortest(scene.step) + " s, each a quarter]";
}

std::string remains(const Recipe& recipe) {
  std::string text = std::to_string(recipe.joints) + " joints";
  std::size_t i = 0;
  dynamics::Effects<double> effects;
  dynamics::for_each_effect(effects, [&](const auto& effect) {
    if (recipe.has[i++]) text += std::string(", ") + dynamics::effect_name(effect);
  });
  for (const char* name : kOtherNames) {
    if (recipe.has[i++]) text += std::string(", ") + name;
  }
  return text;
}

Recipe shrunk(Recipe recipe, const std::string& found) {
  const auto kind = [](const std::string& words) { return words.substr(0, words.find('[')); };
  const auto remains_wrong = [&](const Recipe& smaller) { return kind(wrong(smaller)) == kind(found); };
  for (std::size_t i = 0; i < recipe.has.size(); ++i) {
    Recipe smaller = recipe;
    smaller.has[i] = false;
    if (recipe.has[i] && remains_wrong(smaller)) recipe = smaller;
  }
  for (Recipe smaller = recipe; --smaller.joints > 0 && remains_wrong(smaller);) recipe = smaller;
  return recipe;
}

}  // namespace

std::uint64_t refused_scenes() { return refused; }

namespace {

Recipe recipe_of(std::uint64_t seed) {
  Recipe recipe{seed, 1, {}};
  dynamics::Random random = numbers(recipe, 5);
  recipe.joints += random.below(6);
  dynamics::Effects<double> effects;
  dynamics::for_each_effect(effects, [&](const auto&) { recipe.has.push_back(random.below(3) == 0); });
  recipe.has[0] = random.below(4) != 0, recipe.has[1] = random.below(8) != 0;  // gravity, velocity products
  for (int i = 0; i < Recipe::kOthers; ++i) recipe.has.push_back(random.below(4) == 0);
  return recipe;
}

}  // namespace

std::string accuracy_failure(std::uint64_t seed) {
  constexpr double kFactor = 30, kRounding = 1e-8;
  Recipe recipe = recipe_of(seed);
  std::fill(recipe.has.end() - Recipe::kOthers, recipe.has.end(), false);
  try {
    Scene scene = scene_of(recipe);
    // Forces that begin within a step have no order.
    scene.robot.effects.contacts.reset(), scene.robot.effects.saturation.reset();
    const SimulatedMotion motion = simulate(scene);
    Scene exact = scene;
    exact.integrator = Integrator::kAdaptive;
    exact.tolerances.relative = 1e-12, exact.tolerances.absolute = 1e-12;
    const SimulatedMotion reference = simulate(exact);
    if (!motion.is_whole() || !reference.is_whole()) {
      ++refused;
      return "";
    }
    const Accuracy told = accuracy_of(scene);
    if (!told.trouble.empty() || told.parts) return "";
    const VectorXd q = motion.q.rightCols(1), q_exact = reference.q.rightCols(1);
    const double off_q = dynamics::difference<double>(scene.robot.model, q_exact, q).cwiseAbs().maxCoeff();
    const double off_v = (motion.v.rightCols(1) - reference.v.rightCols(1)).cwiseAbs().maxCoeff();
    const double size = 1 + reference.v.cwiseAbs().maxCoeff();
    if (off_q <= kFactor * told.q.value + kRounding * size &&
        off_v <= kFactor * told.v.value + kRounding * size)
      return "";
    return "the end is off by " + io::shortest(off_q) + " and " + io::shortest(off_v) + ", told are " +
           io::shortest(told.q.value) + " and " + io::shortest(told.v.value) + "; with " + remains(recipe);
  } catch (const std::exception& error) {
    return std::string("throws: ") + error.what() + "; with " + remains(recipe);
  }
}

std::string scene_failure(std::uint64_t seed) {
  const Recipe recipe = recipe_of(seed);
  try {
    const std::string found = wrong(recipe);
    if (found.empty()) return "";
    const Recipe small = shrunk(recipe, found);
    return wrong(small) + "; with " + remains(small);
  } catch (const std::exception& error) {
    return std::string("throws: ") + error.what() + "; with " + remains(recipe);
  }
}

}  // namespace dyntape::testing
