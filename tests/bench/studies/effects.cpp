// SPDX-License-Identifier: BSD-3-Clause
//
// What each effect of a scene costs: a step with it beside the same step without.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/scene/scene_system.h>
#include <dyntape/interface/simulation/stepper.h>

#include "measure.h"
#include "study.h"

namespace dyntape::tools {
namespace {

using Eigen::VectorXd;

// A robot and where forces on bodies act: each effect of a kind at all of these frames.
struct Body {
  std::string label;
  dynamics::Model<double> model;
  std::vector<std::string> frames;

  VectorXd at_joints(double value) const {  // not at a free base
    VectorXd all = VectorXd::Zero(model.nv);
    const int base = floats(model) ? 6 : 0;
    all.tail(model.nv - base).setConstant(value);
    return all;
  }
  template <class List, class Item>
  void place(List& list, Item item) const {
    for (const std::string& frame : frames) {
      dynamics::place_at_frame(model, frame, item);
      list.push_back(item);
    }
  }
};

using Add = std::function<void(const Body& body, dynamics::Effects<double>& effects)>;

// By key (dynamics/effects/effects.def): an effect that is not here has a row with trouble.
const std::map<std::string, Add>& ways_to_add() {
  using namespace dynamics;
  using E = Effects<double>;
  static const std::map<std::string, Add> all = {
      {"gravity", [](const Body&, E& e) { e.gravity = true; }},
      {"coriolis", [](const Body&, E& e) { e.coriolis = true; }},
      {"armature", [](const Body& b, E& e) { e.armature = b.at_joints(0.01); }},
      {"added_mass",
       [](const Body& b, E& e) {
         AddedBody<double> hull;
         hull.mass = {1, 2, 3}, hull.inertia = {0.1, 0.2, 0.3};
         b.place(e.added_mass, hull);
       }},
      {"joint_damping", [](const Body& b, E& e) { e.damping = b.at_joints(0.3); }},
      {"joint_friction",
       [](const Body& b, E& e) {
         e.friction = CoulombFriction<double>{b.at_joints(0.3), 0.01, b.at_joints(0.5), 0.1};
       }},
      {"joint_springs",
       [](const Body& b, E& e) {
         e.springs = Springs<double>{b.at_joints(3), neutral(b.model)};
       }},
      {"joint_limits",
       [](const Body& b, E& e) {
         e.limits = SoftLimits<double>{b.at_joints(100), b.at_joints(1), b.at_joints(0.1)};
         e.limits->margin.setConstant(0.1);
       }},
      {"torque_saturation",
       [](const Body& b, E& e) {
         e.saturation = Saturation<double>{VectorXd::Constant(b.model.nv, 20), SaturationKind::kSmooth};
       }},
      {"back_emf",
       [](const Body& b, E& e) {
         const VectorXd one = VectorXd::Constant(b.model.nv, 1);
         e.back_emf = BackEmf<double>{0.1 * one, 0.1 * one, one, 9 * one};
       }},
      {"tendons",
       [](const Body& b, E& e) {
         Tendon<double> tendon;
         tendon.arms = b.at_joints(0);
         tendon.arms.tail(std::min(3, b.model.nv)).setConstant(0.02);
         tendon.stiffness = 1e3, tendon.damping = 1, tendon.kind = TendonKind::kTension;
         e.tendons.push_back(tendon);
       }},
      {"wrenches",
       [](const Body& b, E& e) {
         Wrench<double> push;
         push.value = {{1, 2, 3}, {0.1, 0.2, 0.3}};
         b.place(e.wrenches, push);
       }},
      {"drag",
       [](const Body& b, E& e) {
         DragBody<double> body;
         body.area = 0.1, body.linear = 0.1;
         b.place(e.drag, body);
         e.drag.medium = {1, 0, 0};
       }},
      {"buoyancy",
       [](const Body& b, E& e) {
         Buoy<double> buoy;
         buoy.volume = 1e-3;
         b.place(e.buoyancy, buoy);
       }},
      {"contacts", [](const Body& b, E& e) {
         ContactBody<double> body;
         body.radius = 0.02, body.stiffness = 1e4, body.dissipation = 0.5, body.friction = 0.7;
         b.place(e.contacts, body);
       }}};
  return all;
}

struct StepCost {
  double operations = 0, jacobian_operations = 0;
  double seconds = 0, jacobian_seconds = 0;
};

// At one state: code has no branches on it.
StepCost cost_of(const System& system, bool is_timed, int repeats) {
  CodegenOptions options;
  if (!is_timed) options.route = Route::kInterpreter;
  Stepper stepper(system, Integrator::kSemiImplicitEuler, options, true);
  StepCost cost{double(stepper.report().step_operations), double(stepper.report().jacobian_operations)};
  if (!is_timed) return cost;
  VectorXd x = VectorXd::Zero(stepper.nx()), next(stepper.nx()), u = VectorXd::Constant(stepper.n_u(), 0.3);
  x.head(system.model.nq) = dynamics::neutral(system.model);
  x.tail(system.model.nv).setConstant(0.3);
  Eigen::MatrixXd A, B, P;
  const auto step = [&](std::size_t) { stepper.step(0, 1e-3, x.data(), u.data(), nullptr, next.data()); };
  const auto slopes = [&](std::size_t) {
    stepper.jacobians(0, 1e-3, x.data(), u.data(), nullptr, next.data(), A, B, P);
  };
  cost.seconds = cost.jacobian_seconds = HUGE_VAL;  // what else goes on only ever adds
  for (int k = 0; k < repeats; ++k) {
    cost.seconds = std::min(cost.seconds, median_seconds(step, 5));
    cost.jacobian_seconds = std::min(cost.jacobian_seconds, median_seconds(slopes, 5));
  }
  return cost;
}

// The robot's step by articulated inertias alone, written down without effects.
System bare_system(const Body& body, const RobotScene& scene) {
  System bare = system_of(scene);
  const std::vector<int> dofs = actuated_dofs(scene);
  dynamics::Model<double> model = body.model;
  for (auto& joint : model.joints) joint.armature = 0;
  bare.acceleration = [model, dofs](const SystemPoint<AD>& at) {
    const dynamics::Model<AD> taped = model.cast<AD>();
    dynamics::Data<AD> data(taped);
    return VectorXad(dynamics::aba<AD>(taped, data, at.q, at.v, torques_at(dofs, at.drive, model.nv)));
  };
  return bare;
}

struct Ratio {
  std::string name;
  double value = 0;
  StepCost with, without;
};

std::string costs_told(const Body& body, std::vector<Ratio> ratios, bool of_jacobian, bool is_timed) {
  std::sort(ratios.begin(), ratios.end(), [&](const Ratio& a, const Ratio& b) { return a.value > b.value; });
  std::string text = body.label + (is_timed ? ", time" : ", operations, not timed,") +
                     " with over without (operations added): ";
  for (const Ratio& r : ratios) {
    const double added = of_jacobian ? r.with.jacobian_operations - r.without.jacobian_operations
                                     : r.with.operations - r.without.operations;
    text += (&r == &ratios.front() ? "" : ", ") + r.name + " " + io::significant(r.value, 3) + " (" +
            (added < 0 ? "" : "+") + io::with_groups((long long)(added)) + ")";
  }
  return text + ".";
}

void measure(Study& study, const Body& body, const StudyOptions& options, bool is_timed) {
  const int repeats = options.quick ? 1 : 5;
  const RobotScene plain{body.model};
  options.watch(body.label);
  const StepCost without = cost_of(system_of(plain), is_timed, repeats);
  const StepCost bare = cost_of(bare_system(body, plain), false, 0);
  std::vector<Ratio> steps, jacobians;
  const auto add = [&](const std::string& name, const StepCost& with, const StepCost& less) {
    const double of_step = is_timed ? with.seconds / less.seconds : with.operations / less.operations;
    const double of_jacobian = is_timed ? with.jacobian_seconds / less.jacobian_seconds
                                        : with.jacobian_operations / less.jacobian_operations;
    const auto seconds = [&](double s) { return is_timed ? s : std::numeric_limits<double>::quiet_NaN(); };
    steps.push_back({name, of_step, with, less}), jacobians.push_back({name, of_jacobian, with, less});
    study.rows.push_back({"step", body.label, name, with.operations, seconds(with.seconds), of_step});
    study.rows.push_back({"jacobian", body.label, name, with.jacobian_operations,
                          seconds(with.jacobian_seconds), of_jacobian});
  };
  std::vector<std::string> changed;  // effects that leave something behind
  RobotScene all = plain;
  dynamics::for_each_effect(plain.effects, [&](const auto& effect) {
    const std::string key = dynamics::effect_key(effect);
    const auto way = ways_to_add().find(key);
    if (way == ways_to_add().end()) {
      study.rows.push_back({"step", body.label, key});
      study.rows.back().trouble = "the study does not know how to add it";
      return;
    }
    options.watch(body.label + ", " + key);
    const bool is_there = bool(effect);  // gravity and velocity products are, unless they are taken away
    RobotScene other = plain;
    if (is_there) {
      dynamics::for_each_effect(other.effects, [&](auto& its) {
        if (dynamics::effect_key(its) == key) its.reset();
      });
      add(dynamics::effect_name(effect), without, cost_of(system_of(other), is_timed, repeats));
    } else {
      way->second(body, other.effects);
      way->second(body, all.effects);
      add(dynamics::effect_name(effect), cost_of(system_of(other), is_timed, repeats), without);
    }
    // There and away again.
    RobotScene again = other;
    dynamics::for_each_effect(again.effects, [&](auto& its) {
      if (dynamics::effect_key(its) != key) return;
      if (is_there)
        way->second(body, again.effects);
      else
        its.reset();
    });
    const StepCost back = cost_of(system_of(again), false, 0);
    if (back.operations != without.operations || back.jacobian_operations != without.jacobian_operations)
      changed.push_back(key);
  });
  add("all of them", cost_of(system_of(all), is_timed, repeats), without);

  study.parts[0].findings.push_back(costs_told(body, steps, false, is_timed));
  study.parts[1].findings.push_back(costs_told(body, jacobians, true, is_timed));
  const auto counted = [](double n) { return io::with_groups((long long)(n)); };
  const bool equal =
      bare.operations == without.operations && bare.jacobian_operations == without.jacobian_operations;
  std::string absent = body.label + ": a step with no effect chosen has " + counted(without.operations) +
                       " operations and its Jacobians " + counted(without.jacobian_operations) +
                       "; written down from articulated inertias without a word of effects " +
                       counted(bare.operations) + " and " + counted(bare.jacobian_operations) +
                       (equal ? ": equal" : ": NOT EQUAL") + ". ";
  if (changed.empty()) {
    absent += "Each effect, chosen and taken away again, leaves these numbers as they are.";
  } else {
    absent += "Something is left behind by:";
    for (const std::string& key : changed) absent += " " + key;
  }
  study.parts[0].findings.push_back(absent);
}

}  // namespace

Study study_effects(const StudyOptions& options) {
  Study study{.name = "effects",
              .title = "What each effect costs",
              .question = "By how much does a step take longer with an effect than without?"};
  study.parts = {{.name = "step",
                  .title = "A step: time with the effect over time without",
                  .x = StudyPart::kParameter,
                  .x_label = "operations of the step with it",
                  .y_label = "time with / without [1]",
                  .mark = io::Mark::kPoints},
                 {.name = "jacobian",
                  .title = "A step's Jacobians: time with the effect over time without",
                  .x = StudyPart::kParameter,
                  .x_label = "operations of the Jacobians with it",
                  .y_label = "time with / without [1]",
                  .mark = io::Mark::kPoints}};
  const std::string robots = options.config + "/robots/";
  const Body arm{
      "arm",
      dynamics::load_urdf(robots + "panda.urdf", {.lock = {"panda_finger_joint1", "panda_finger_joint2"}}),
      {"panda_hand"}};
  const Body quadruped{"quadruped",
                       dynamics::load_urdf(robots + "solo12.urdf", {.base = dynamics::Base::kFloating}),
                       {"FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"}};
  if (options.quick) {
    const Body small{"arm of two joints", dynamics::load_urdf(robots + "arm_2r.urdf"), {"hand"}};
    measure(study, small, options, true);
  }
  measure(study, arm, options, !options.quick);
  measure(study, quadruped, options, !options.quick);
  study.methods = {
      "Steps of semi-implicit Euler, compiled, strict arithmetic, one state; the least of five medians. "
      "Gravity and "
      "velocity products are there unless taken away: their ratio is of the scene with them to the scene "
      "without; all "
      "other ratios are of the plain scene with the effect to the plain scene.",
      "Forces on bodies act at the hand of the arm and at each foot of the quadruped; joint effects at all "
      "joints but "
      "the free base; the tendon over three joints; friction with Stribeck's excess, smooth saturation."};
  if (options.quick)
    study.left_out = {
        "Times of the arm and the quadruped: with --quick their operations are counted instead."};
  return study;
}

}  // namespace dyntape::tools
