// SPDX-License-Identifier: BSD-3-Clause
//
// What each effect of a scene costs: a step with it beside the same step without.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/system/scene_system.h>
#include <dyntape/interface/system/steps/stepper.h>

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

struct Count {
  double step = 0, jacobians = 0;
  bool operator==(const Count&) const = default;
};

// A step of a scene, and how often it is wanted.
class Step {
 public:
  Step(const System& system, Route route)
      : stepper_(system, Integrator::kSemiImplicitEuler, {.route = route}, true),
        x_(VectorXd::Constant(stepper_.nx(), 0.3)),
        next_(stepper_.nx()),
        u_(VectorXd::Constant(stepper_.n_u(), 0.3)) {
    x_.head(system.model.nq) = dynamics::neutral(system.model);
  }

  Count count() const {
    return {double(stepper_.report().step_operations), double(stepper_.report().jacobian_operations)};
  }
  void step(int calls) {
    for (int i = 0; i < calls; ++i) stepper_.step(0, 1e-3, x_.data(), u_.data(), nullptr, next_.data());
  }
  void jacobians(int calls) {
    for (int i = 0; i < calls; ++i)
      stepper_.jacobians(0, 1e-3, x_.data(), u_.data(), nullptr, next_.data(), A_, B_, P_);
  }

 private:
  Stepper stepper_;
  VectorXd x_, next_, u_;
  Eigen::MatrixXd A_, B_, P_;
};

// Of the functions as they are recorded: compilers of long ones cut them into pieces, which costs a few more.
Count count_of(const System& system) { return Step(system, Route::kInterpreter).count(); }

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

struct Price {
  std::string name;
  double operations = 0, ratio = 0;  // that are added; with over without
};

std::string costs_told(const Body& body, std::vector<Price> prices, bool is_timed) {
  std::sort(prices.begin(), prices.end(), [](const Price& a, const Price& b) { return a.ratio > b.ratio; });
  std::string text = body.label + (is_timed ? ", time" : ", operations, not timed,") +
                     " with over without (operations added):";
  for (const Price& price : prices) {
    text += (&price == &prices.front() ? " " : ", ") + price.name + " " + io::significant(price.ratio, 3) +
            " (" + io::with_groups((long long)(price.operations)) + ")";
  }
  return text + ".";
}

// Which panel: of a robot with so many effects.
template <class Effect>
std::string kind_of(const Effect& effect) {
  using E = dynamics::effect_type<Effect>;
  (void)effect;
  if constexpr (requires(E e, dynamics::DynamicsTerms<double> acting) { e.enter(acting); })
    return "inertia, gravity";
  if constexpr (requires(E e) { E::kItem; } && !std::is_same_v<E, dynamics::Tendons<double>>)
    return "forces on bodies";
  return "at joints";
}

class Prices {
 public:
  Prices(Study& study, const Body& body, bool is_timed, int batches)
      : study_(study), body_(body), is_timed_(is_timed), batches_(batches), plain_{body.model} {
    count_ = count_of(system_of(plain_));
    if (is_timed) step_.emplace(system_of(plain_), Route::kCompiled);
  }

  // Of a scene beside the plain one: `less` where it has an effect less than that.
  void add(const std::string& name, const std::string& kind, const RobotScene& other, bool less) {
    const System system = system_of(other);
    const Count count = count_of(system), &with = less ? count_ : count, &without = less ? count : count_;
    double seconds[2] = {kNone, kNone},
           ratios[2] = {with.step / without.step, with.jacobians / without.jacobians};
    if (is_timed_) {
      Step its(system, Route::kCompiled);
      Step &dear = less ? *step_ : its, &cheap = less ? its : *step_;
      const auto costs = alternate(
          {[&](int, int calls) { dear.step(calls); }, [&](int, int calls) { cheap.step(calls); },
           [&](int, int calls) { dear.jacobians(calls); }, [&](int, int calls) { cheap.jacobians(calls); }},
          batches_);
      for (int k = 0; k < 2; ++k)
        seconds[k] = costs[std::size_t(2 * k)].best,
        ratios[k] = seconds[k] / costs[std::size_t(2 * k + 1)].best;
    }
    const double added[2] = {with.step - without.step, with.jacobians - without.jacobians};
    for (int k = 0; k < 2; ++k) {
      prices[k].push_back({name, added[k], ratios[k]});
      study_.rows.push_back(
          {k == 0 ? "step" : "jacobian", body_.label + ": " + kind, name, added[k], seconds[k], ratios[k]});
    }
  }

  const RobotScene& plain() const { return plain_; }
  const Count& count() const { return count_; }

  std::vector<Price> prices[2];  // of the step, of its Jacobians

 private:
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  Study& study_;
  const Body& body_;
  bool is_timed_;
  int batches_;
  RobotScene plain_;
  Count count_;
  std::optional<Step> step_;
};

// Of each effect alone; then what is left of those that are chosen and taken away again.
void measure(Study& study, const Body& body, const StudyOptions& options, bool is_timed) {
  options.watch(body.label);
  Prices prices(study, body, is_timed, options.quick ? 20 : 200);
  const RobotScene& plain = prices.plain();
  RobotScene all = plain;
  std::string changed;  // by effects that leave something behind
  dynamics::for_each_effect(plain.effects, [&](const auto& effect) {
    const std::string key = dynamics::effect_key(effect), name = dynamics::effect_name(effect);
    const auto way = ways_to_add().find(key);
    if (way == ways_to_add().end()) {
      study.rows.push_back({"step", body.label + ": " + kind_of(effect), name});
      study.rows.back().trouble = "the study does not know how to add it";
      return;
    }
    options.watch(body.label + ", " + name);
    const auto take_away = [&](RobotScene& scene) {
      dynamics::for_each_effect(scene.effects, [&](auto& its) {
        if (dynamics::effect_key(its) == key) its.reset();
      });
    };
    const bool is_there = bool(effect);  // gravity and velocity products, unless they are taken away
    RobotScene other = plain;
    if (is_there)
      take_away(other);
    else
      way->second(body, other.effects), way->second(body, all.effects);
    prices.add(name, kind_of(effect), other, is_there);
    if (is_there)
      way->second(body, other.effects);
    else
      take_away(other);
    if (count_of(system_of(other)) != prices.count()) changed += " " + key;
  });
  prices.add("all of them", "forces on bodies", all, false);

  for (std::size_t k = 0; k < 2; ++k)
    study.parts[k].findings.push_back(costs_told(body, prices.prices[k], is_timed));
  const Count bare = count_of(bare_system(body, plain));
  const auto told = [](const Count& count) {
    return io::with_groups((long long)(count.step)) + " operations, its Jacobians " +
           io::with_groups((long long)(count.jacobians));
  };
  study.parts[0].findings.push_back(
      body.label + ": a step with no effect chosen has " + told(prices.count()) +
      "; written down from articulated inertias without a word of effects, " + told(bare) +
      (bare == prices.count() ? ": equal. " : ": NOT EQUAL. ") +
      (changed.empty() ? "Each effect, chosen and taken away again, leaves these numbers as they are."
                       : "Something is left behind by" + changed + "."));
}

}  // namespace

Study outline_of_effects() {
  Study study{.name = "effects",
              .title = "What each effect costs",
              .question = "By how much does a step take longer with an effect than without?"};
  study.parts = {{.name = "step",
                  .title = "A step: time with the effect over time without",
                  .x = StudyPart::kParameter,
                  .x_label = "operations that it adds",
                  .y_label = "time with / without [1]",
                  .log_y = false,
                  .mark = io::Mark::kPoints},
                 {.name = "jacobian",
                  .title = "A step's Jacobians: time with the effect over time without",
                  .x = StudyPart::kParameter,
                  .x_label = "operations that it adds",
                  .y_label = "time with / without [1]",
                  .log_y = false,
                  .mark = io::Mark::kPoints}};
  return study;
}

Study study_effects(const StudyOptions& options) {
  Study study = outline_of_effects();
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
      "Steps of semi-implicit Euler, compiled, one state; the least of five medians. "
      "Gravity and "
      "velocity products are there unless taken away: their ratio is of the scene with them to the scene "
      "without; all "
      "other ratios are of the plain scene with the effect to the plain scene.",
      "Operations are those of the functions as they are recorded; the parameter in the table is how many "
      "are added.",
      "Forces on bodies act at the hand of the arm and at each foot of the quadruped; joint effects at all "
      "joints but "
      "the free base; the tendon over three joints; friction with Stribeck's excess, smooth saturation."};
  if (options.quick)
    study.left_out = {
        "Times of the arm and the quadruped: with --quick their operations are counted instead."};
  return study;
}

}  // namespace dyntape::tools
