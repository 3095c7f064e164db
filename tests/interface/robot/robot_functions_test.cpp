// SPDX-License-Identifier: BSD-3-Clause
//
// The robots' functions by every route: they agree, and the generated code has the interpreter's bits.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>
#include <random>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_evaluator.h>
#include <dyntape/interface/robot/robot_rows.h>
#include "interface/temporary_cache.h"
#include "source_folder.h"

namespace dyntape::robot_functions_test {
namespace {

using dynamics::Base;
using dynamics::Model;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Robot {
  const char* name;
  Base base;
};

const Robot kSmall[] = {
    {"block", Base::kFixed},     {"iiwa14", Base::kFloating},       {"pendulum", Base::kFixed},
    {"cart_pole", Base::kFixed}, {"double_pendulum", Base::kFixed}, {"arm_2r", Base::kFixed},
    {"ur5", Base::kFixed},       {"panda", Base::kFixed},           {"iiwa14", Base::kFixed},
    {"solo12", Base::kFloating}};
const Robot kLarge[] = {
    {"simple_humanoid", Base::kFloating}, {"talos", Base::kFloating}, {"g1", Base::kFloating}};

Model<double> load(const Robot& robot) {
  const auto root = std::filesystem::path(test::source_folder());
  dynamics::UrdfOptions options;
  options.base = robot.base;
  return dynamics::load_urdf((root / "config" / "robots" / (std::string(robot.name) + ".urdf")).string(),
                             options);
}

std::vector<Robot> all_robots() {
  std::vector<Robot> all(std::begin(kSmall), std::end(kSmall));
  all.insert(all.end(), std::begin(kLarge), std::end(kLarge));
  return all;
}

VectorXd uniform(Eigen::Index n, double bound, std::mt19937_64& random) {
  return VectorXd::NullaryExpr(n,
                               [&] { return std::uniform_real_distribution<double>(-bound, bound)(random); });
}

VectorXd random_state(const Model<double>& model, const RobotFunction& function, std::mt19937_64& random) {
  const VectorXd q = dynamics::random_configuration<double>(model, random);
  VectorXd state(static_cast<Eigen::Index>(input_names(model, function).size()));
  const Eigen::Index rest = state.size() - model.nq, n = std::min<Eigen::Index>(rest, model.nv);
  state << q, uniform(n, 2, random), uniform(rest - n, 5, random);
  return state;
}

// The largest error of a block relative to the largest entry of that block: Minv does not hide the others.
double error(const VectorXd& got, const VectorXd& expected, const Model<double>& model,
             const RobotFunction& function) {
  Eigen::Index first = 0;
  double worst = 0;
  for (const RobotBlock& block : outputs(model, function)) {
    const auto part = expected.segment(first, block.size());
    const double scale = std::max(part.cwiseAbs().maxCoeff(), 1e-300);
    const double e = (got.segment(first, block.size()) - part).cwiseAbs().maxCoeff() / scale;
    worst = e <= worst ? worst : e;
    first += block.size();
  }
  EXPECT_EQ(first, expected.size());
  return worst;
}

bool same_bits(const VectorXd& a, const VectorXd& b) {
  return a.size() == b.size() &&
         std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<std::size_t>(a.size())) == 0;
}

// Equal up to the sign of zero, which a simplification may change.
bool same_numbers(const VectorXd& a, const VectorXd& b) {
  return a.size() == b.size() && (a.array() == b.array()).all();
}

// One for all tests of this file, so that a library is compiled once.
const std::string& shared_cache() {
  static const TemporaryCache cache;
  return cache.path();
}

// The recorded templates on numbers, without a recording: the same sums in the same order.  (Eigen adds doubles in
// another order where it packs two into a register, so that plain code differs in last bits.)
VectorXd run_on_numbers(const Model<double>& model, const RobotFunction& function, const VectorXd& state) {
  const Model<AD> numbers = model.cast<AD>();
  detail::RobotWorkspace<AD> work(numbers, function);
  const VectorXad x = state.cast<AD>();
  VectorXad y(static_cast<Eigen::Index>(work.n_out()));
  work.evaluate(x.data(), y.data());
  return y.unaryExpr([](const AD& a) { return a.value(); }).cast<double>();
}

// Its text would hold infinities.
TEST(RobotFunctions, RecordNoAccelerationsOfWhatHasNoInertia) {
  Model<double> model = load({"block", Base::kFixed});
  model.inertias[0] = {};
  for (const RobotFunction& function : robot_functions()) {
    if (takes_contacts(function)) continue;
    if (is_forward(function)) {
      EXPECT_THROW(record_robot_function(model, function), NumericalError) << to_string(function);
    } else {
      EXPECT_NO_THROW(record_robot_function(model, function)) << to_string(function);
    }
  }
  dynamics::Effects<double> effects;
  EXPECT_THROW(record_forward_dynamics(model, effects), NumericalError);
  effects.armature = VectorXd::Ones(1);
  EXPECT_NO_THROW(record_forward_dynamics(model, effects));
}

TEST(RobotFunctions, AnalyticAndDifferentiatedRecordingsAgreeWithPlainCodeOnAllRobots) {
  for (const Robot& robot : all_robots()) {
    const Model<double> model = load(robot);
    for (const RobotFunction& function : kCoreFunctions) {
      SCOPED_TRACE(std::string(robot.name) + " " + to_string(function) + ", seed 1");
      RobotEvaluator tape(model, function, RobotRoute::kTape);
      const Interpreter analytic(record_robot_function(model, function, RobotSource::kAnalytic));
      Interpreter::Workspace workspace(analytic);
      std::mt19937_64 random(1);
      const double tolerance = function == RobotFunction::kFdDerivatives ? 1e-11 : 1e-12;
      for (int i = 0; i < (model.nv > 20 ? 3 : 20); ++i) {
        const VectorXd state = random_state(model, function, random);
        const VectorXd plain = evaluate_analytic(model, function, state);
        EXPECT_LE(error(tape(state), plain, model, function), tolerance);
        VectorXd recorded(plain.size());
        analytic(state.data(), nullptr, nullptr, recorded.data(), workspace);
        EXPECT_LE(error(recorded, plain, model, function), tolerance);
        EXPECT_TRUE(same_numbers(recorded, run_on_numbers(model, function, state)));
      }
    }
  }
}

TEST(RobotFunctions, GeneratedCodeHasTheBitsOfTheInterpreter) {
  for (const Robot& robot : kSmall) {
    const Model<double> model = load(robot);
    for (const RobotFunction& function : kCoreFunctions) {
      if (model.nv > 7 && function == RobotFunction::kFdDerivatives)
        continue;  // minutes of gcc, no new operator
      SCOPED_TRACE(std::string(robot.name) + " " + to_string(function) + ", seed 2");
      RobotEvaluatorOptions options;
      options.codegen.cache_folder = shared_cache();
      options.codegen.flags = {model.nv > 7 ? "-O0" : "-O1"};
      RobotEvaluator generated(model, function, RobotRoute::kGenerated, options);
      ASSERT_EQ(generated.compiled()->route(), Route::kCompiled);
      const Interpreter interpreter(generated.compiled()->function());
      Interpreter::Workspace workspace(interpreter);
      std::mt19937_64 random(2);
      for (int i = 0; i < 100; ++i) {
        const VectorXd state = random_state(model, function, random);
        const VectorXd y = generated(state);
        VectorXd reference(y.size());
        interpreter(state.data(), nullptr, nullptr, reference.data(), workspace);
        EXPECT_TRUE(same_bits(y, reference));
        EXPECT_LE(error(y, evaluate_analytic(model, function, state), model, function), 1e-11);
      }
    }
  }
}

TEST(RobotFunctions, DifferencesAreAsAccurateAsTheirOrder) {
  for (const Robot& robot : kSmall) {
    const Model<double> model = load(robot);
    for (const RobotFunction& function : {RobotFunction::kIdDerivatives, RobotFunction::kFdDerivatives}) {
      SCOPED_TRACE(std::string(robot.name) + " " + to_string(function) + ", seed 3");
      RobotEvaluator forward(model, function, RobotRoute::kFdForward);
      RobotEvaluator central(model, function, RobotRoute::kFdCentral);
      std::mt19937_64 random(3);
      for (int i = 0; i < 5; ++i) {
        const VectorXd state = random_state(model, function, random);
        const VectorXd exact = evaluate_analytic(model, function, state);
        const double first = error(forward(state), exact, model, function),
                     second = error(central(state), exact, model, function);
        EXPECT_LT(first, 1e-3);
        EXPECT_LT(second, 1e-6);
        if (model.nv > 1) {  // differences, not the derivative under another name
          EXPECT_GT(first, 0.0);
          EXPECT_GT(second, 0.0);
        }
      }
    }
  }
}

// Halving the step halves the error of forward differences and quarters that of central ones.
TEST(RobotFunctions, DifferencesConvergeWithTheirOrder) {
  for (const Robot& robot : {Robot{"ur5", Base::kFixed}, Robot{"solo12", Base::kFloating}}) {
    const Model<double> model = load(robot);
    for (const RobotFunction& function : {RobotFunction::kIdDerivatives, RobotFunction::kFdDerivatives}) {
      SCOPED_TRACE(std::string(robot.name) + " " + to_string(function) + ", seed 7");
      std::mt19937_64 random(7);
      const VectorXd state = random_state(model, function, random);
      const VectorXd exact = evaluate_analytic(model, function, state);
      const auto distance = [&](RobotRoute route, double step) {
        RobotEvaluatorOptions options;
        options.step = step;
        return (RobotEvaluator(model, function, route, options)(state) - exact).norm();
      };
      EXPECT_NEAR(distance(RobotRoute::kFdForward, 2e-4) / distance(RobotRoute::kFdForward, 1e-4), 2, 0.1);
      EXPECT_NEAR(distance(RobotRoute::kFdCentral, 2e-3) / distance(RobotRoute::kFdCentral, 1e-3), 4, 0.2);
    }
  }
}

TEST(RobotFunctions, NothingDependsOnWhereTheBaseIs) {
  const Model<double> model = load({"solo12", Base::kFloating});
  for (const RobotFunction& function : kCoreFunctions) {
    for (RobotRoute route : kRobotRoutes) {
      if (!has_route(function, route)) continue;
      SCOPED_TRACE(std::string(to_string(function)) + " " + to_string(route) + ", seed 4");
      RobotEvaluatorOptions options;
      options.codegen.cache_folder = shared_cache();
      options.codegen.flags = {"-O0"};
      RobotEvaluator evaluate(model, function, route, options);
      std::mt19937_64 random(4);
      for (int i = 0; i < 3; ++i) {
        VectorXd near = random_state(model, function, random), far = near;
        near.head(3).setZero();
        far.head(3) << 1e8, -1e8, 1e8;
        EXPECT_TRUE(same_bits(evaluate(near), evaluate(far)));
      }
    }
  }
}

TEST(RobotFunctions, BothQuaternionsOfARotationGiveTheSameBits) {
  const Model<double> model = load({"solo12", Base::kFloating});
  for (const RobotFunction& function : kCoreFunctions) {
    for (RobotRoute route : {RobotRoute::kAnalytic, RobotRoute::kTape}) {
      SCOPED_TRACE(std::string(to_string(function)) + " " + to_string(route) + ", seed 5");
      RobotEvaluator evaluate(model, function, route);
      std::mt19937_64 random(5);
      VectorXd state = random_state(model, function, random), other = state;
      other.segment<4>(3) *= -1;
      EXPECT_TRUE(same_numbers(evaluate(state), evaluate(other)));
    }
  }
}

// A pair of joints that are not on one path from the root has no entry, and the position of a base has none.
TEST(RobotFunctions, PatternsFollowTheTree) {
  for (const Robot& robot : all_robots()) {
    const Model<double> model = load(robot);
    SCOPED_TRACE(robot.name);
    std::vector<int> joint_of(static_cast<std::size_t>(model.nv));
    for (int i = 0; i < model.njoints(); ++i) {
      for (int k = 0; k < dynamics::nv(model.joints[i].type); ++k) joint_of[model.joints[i].idx_v + k] = i;
    }
    const auto above = [&](int a, int b) {
      while (b > a) b = model.parent[b];
      return a == b;
    };
    for (RobotSource source : {RobotSource::kAnalytic, RobotSource::kDifferentiated}) {
      const Function f = record_robot_function(model, RobotFunction::kIdDerivatives, source);
      const int n = model.nv;
      for (int b = 0; b < 3; ++b) {
        for (int i = 0; i < n; ++i) {
          for (int j = 0; j < n; ++j) {
            const NodeId entry = f.outputs[static_cast<std::size_t>((b * n + i) * n + j)];
            const bool related = above(joint_of[i], joint_of[j]) || above(joint_of[j], joint_of[i]);
            const bool base_position = robot.base == Base::kFloating && b == 0 && j < 3;
            if (!related || base_position) {
              EXPECT_TRUE(f.graph.is_constant(entry, 0)) << "block " << b << " (" << i << ", " << j << ")";
            }
          }
        }
      }
    }
  }
}

// What is not chosen leaves no node: the recording is the one of a program that knows no effects.
TEST(RobotFunctions, AbsentEffectsLeaveNoNode) {
  for (const Robot& robot : all_robots()) {
    const Model<double> model = load(robot);
    SCOPED_TRACE(robot.name);
    const Model<AD> taped = model.cast<AD>();
    const auto bare = [&](bool forward) {
      return record("bare", static_cast<std::size_t>(model.nq + 2 * model.nv), [&](const VectorXad& x) {
        dynamics::Data<AD> data(taped);
        dynamics::DynamicsTerms<AD> acting;
        acting.armature = false;
        const VectorXad q = x.head(model.nq), v = x.segment(model.nq, model.nv), w = x.tail(model.nv);
        return forward ? VectorXad(dynamics::aba<AD>(taped, data, q, v, w, acting))
                       : VectorXad(dynamics::rnea<AD>(taped, data, q, v, w, acting));
      });
    };
    EXPECT_EQ(content_hash(record_forward_dynamics(model, {})), content_hash(bare(true)));
    EXPECT_EQ(content_hash(record_inverse_dynamics(model, {})), content_hash(bare(false)));
  }
}

TEST(RobotFunctions, EachEffectAddsItsOwnOperationsAndNoOther) {
  const Model<double> model = load({"arm_2r", Base::kFixed});
  const auto count = [&](auto choose) {
    dynamics::Effects<double> effects;
    choose(effects);
    std::map<Op, int> counts;
    for (const OperationCount& c : count_operations(record_inverse_dynamics(model, effects))) {
      counts[c.op] = static_cast<int>(c.count);
    }
    return counts;
  };
  const VectorXd k = VectorXd::Constant(model.nv, 2.5);
  const auto bare = count([](auto&) {});
  const auto damped = count([&](auto& e) { e.damping = k; });
  const auto rotors = count([&](auto& e) { e.armature = k; });
  const auto rubbing = count([&](auto& e) { e.friction = dynamics::CoulombFriction<double>{k, 0.01}; });
  const auto sprung = count([&](auto& e) { e.springs = dynamics::Springs<double>{k, k}; });
  const auto gained = [&](const std::map<Op, int>& with, Op op) {
    const auto at = [op](const std::map<Op, int>& m) { return m.contains(op) ? m.at(op) : 0; };
    return at(with) - at(bare);
  };
  EXPECT_EQ(gained(damped, Op::Mul), model.nv);  // d v
  EXPECT_EQ(gained(rotors, Op::Mul), model.nv);  // I a
  EXPECT_EQ(gained(rubbing, Op::Mul), model.nv);
  EXPECT_EQ(gained(rubbing, Op::Tanh), model.nv);
  EXPECT_EQ(gained(rubbing, Op::Div), model.nv);
  EXPECT_EQ(gained(sprung, Op::Mul), model.nv);
  for (const auto& with : {damped, rotors, sprung}) {
    EXPECT_FALSE(with.contains(Op::Tanh));
    EXPECT_EQ(gained(with, Op::Sin) + gained(with, Op::Cos) + gained(with, Op::Div), 0);
  }
  const auto weightless = count([](auto& e) { e.gravity = false; });
  EXPECT_LT(gained(weightless, Op::Mul), 0);
}

TEST(RobotFunctions, RecordedEffectsAreTheEffects) {
  const Model<double> model = load({"ur5", Base::kFixed});
  std::mt19937_64 random(6);
  dynamics::Effects<double> effects;
  effects.armature = uniform(model.nv, 1, random).cwiseAbs();
  effects.damping = uniform(model.nv, 1, random).cwiseAbs();
  effects.friction = dynamics::CoulombFriction<double>{uniform(model.nv, 1, random).cwiseAbs(), 0.05};
  effects.springs =
      dynamics::Springs<double>{uniform(model.nv, 1, random).cwiseAbs(), uniform(model.nq, 1, random)};
  const VectorXd state = random_state(model, RobotFunction::kRnea, random);
  const VectorXd q = state.head(model.nq), v = state.segment(model.nq, model.nv), w = state.tail(model.nv);
  dynamics::Data<double> data(model);
  dynamics::EffectTorques<double> torques(model);
  const std::vector<double> x(state.begin(), state.end());
  const auto check = [&](const Function& f, const VectorXd& expected) {
    const std::vector<double> y = evaluate(f, x);
    EXPECT_TRUE(same_numbers(Eigen::Map<const VectorXd>(y.data(), model.nv), expected)) << "seed 6";
  };
  check(record_forward_dynamics(model, effects),
        dynamics::forward_dynamics<double>(model, data, torques, effects, q, v, w));
  check(record_inverse_dynamics(model, effects),
        dynamics::inverse_dynamics<double>(model, data, torques, effects, q, v, w));
}

TEST(RobotFunctions, ErrorsSayWhatAndWhichChoices) {
  const Model<double> model = load({"arm_2r", Base::kFixed});
  const auto message = [](auto f) -> std::string {
    try {
      f();
    } catch (const ArgumentError& e) {
      return e.what();
    }
    return "nothing was thrown";
  };
  EXPECT_EQ(message([] { RobotFunction("rne"); }),
            "there is no function \"rne\" of a robot; did you mean 'rnea'?");
  EXPECT_EQ(message([] { robot_route_from("tap"); }),
            "there is no route \"tap\"; choose one of analytic, tape, generated, machine-code, fd-forward, "
            "fd-central");
  EXPECT_EQ(message([&] { RobotEvaluator(model, RobotFunction::kRnea, RobotRoute::kFdCentral); }),
            "rnea is a value: the route \"fd-central\" exists for derivatives only");
  RobotEvaluator rnea(model, RobotFunction::kRnea, RobotRoute::kAnalytic);
  EXPECT_EQ(message([&] { rnea(VectorXd::Zero(5)); }),
            "rnea: the state has 5 entries, model \"" + model.name + "\" expects 6");
}

TEST(RobotFunctions, ForwardDynamicsWithoutInertiaNamesTheJoint) {
  Model<double> model;
  model.name = "ghost";
  dynamics::Joint<double> joint;
  joint.name = "idle";
  model.add_joint(-1, joint, {}, {});
  EXPECT_NO_THROW(RobotEvaluator(model, RobotFunction::kRnea, RobotRoute::kTape));
  try {
    RobotEvaluator(model, RobotFunction::kAba, RobotRoute::kTape);
    FAIL() << "nothing was thrown";
  } catch (const NumericalError& e) {
    EXPECT_NE(std::string(e.what()).find("\"idle\""), std::string::npos) << e.what();
  }
}

TEST(RobotFunctions, NamesCountInputsAndOutputs) {
  const Model<double> model = load({"solo12", Base::kFloating});
  for (const RobotFunction& function : kCoreFunctions) {
    const Function f = record_robot_function(model, function);
    EXPECT_EQ(f.n_x(), input_names(model, function).size());
    EXPECT_EQ(f.n_y(), output_names(model, function).size());
    EXPECT_EQ(RobotFunction(to_string(function)), function);
  }
  EXPECT_EQ(output_names(model, RobotFunction::kIdDerivatives)[18 * 18 + 1], "dtau_dv_0_1");
  EXPECT_EQ(input_names(model, RobotFunction::kFdDerivatives)[19 + 18], "tau0");
}

}  // namespace
}  // namespace dyntape::robot_functions_test
