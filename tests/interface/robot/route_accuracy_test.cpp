// SPDX-License-Identifier: BSD-3-Clause
//
// Accelerations and their derivatives by every route against 113 bits, where inertia matrices are badly conditioned: short
// levers, bodies much heavier than others, trees of both, axes in line.
#include <gtest/gtest.h>

#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/algorithms/inertia_condition.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/factored_dynamics.h>
#include <dyntape/interface/robot/robot_evaluator.h>

#include <cstdio>
#include <filesystem>

#include "dynamics/random_robots.h"
#include "source_folder.h"

namespace dyntape::route_accuracy_test {
namespace {

using dynamics::Base;
using dynamics::Float128;
using dynamics::Model;
using dynamics::Random;
using dynamics::State;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Relative errors of blocks: the inverse of M, and the worse of ddq_dq and ddq_dv.
struct Errors {
  double inverse = 0, derivatives = 0;

  void include(const Errors& other) {
    inverse = std::max(inverse, other.inverse);
    derivatives = std::max(derivatives, other.derivatives);
  }
};

VectorXd row_by_row(const MatrixXd& m) { return m.transpose().reshaped(); }

// What fd-derivatives are: ddq_dq, ddq_dv, Minv.
struct Exact {
  VectorXd ddq_dq, ddq_dv, Minv;

  Exact(const Model<double>& model, const State& s) {
    const Model<Float128> exact = model.cast<Float128>();
    dynamics::Data<Float128> data(exact);
    dynamics::fd_derivatives<Float128>(exact, data, s.q.cast<Float128>(), s.v.cast<Float128>(),
                                       s.tau.cast<Float128>());
    ddq_dq = row_by_row(data.ddq_dq.cast<double>());
    ddq_dv = row_by_row(data.ddq_dv.cast<double>());
    Minv = row_by_row(data.Minv.cast<double>());
  }

  // Of a result of fd-derivatives, or of minverse.
  Errors errors(const VectorXd& y) const {
    const Eigen::Index n = Minv.size();
    if (y.size() == n) return {dynamics::relative_error(y, Minv), 0};
    return {dynamics::relative_error(y.tail(n), Minv),
            std::max(dynamics::relative_error(y.head(n), ddq_dq),
                     dynamics::relative_error(y.segment(n, n), ddq_dv))};
  }
};

VectorXd state_of(const State& s, const RobotFunction& function) {
  if (function.row() != RobotFunction::kFdDerivatives.row()) return s.q;
  VectorXd x(s.q.size() + s.v.size() + s.tau.size());
  x << s.q, s.v, s.tau;
  return x;
}

VectorXd interpret(const Function& f, const VectorXd& x) {
  const std::vector<double> y = evaluate(f, x);
  return Eigen::Map<const VectorXd>(y.data(), static_cast<Eigen::Index>(y.size()));
}

const RobotFunction kFunctions[] = {RobotFunction("minverse"), RobotFunction::kFdDerivatives};
enum Way { kPlain, kTape, kGenerated, kWays };
using Table = std::array<Errors, kWays>;

// Generated code has the bits of its interpreted recording (RobotBits, MinverseProduct), so that is what is run here.
Table errors_of(const Model<double>& model, const std::vector<State>& states) {
  Table table;
  for (const RobotFunction& function : kFunctions) {
    const Function generated = record_robot_function(model, function),
                   tape = record_robot_function(model, function, RobotSource::kDifferentiated);
    for (const State& s : states) {
      const Exact exact(model, s);
      const VectorXd x = state_of(s, function);
      table[kPlain].include(exact.errors(evaluate_analytic(model, function, x)));
      table[kTape].include(exact.errors(interpret(tape, x)));
      table[kGenerated].include(exact.errors(interpret(generated, x)));
    }
  }
  return table;
}

std::vector<State> random_states(const Model<double>& model, Random& random, int count) {
  std::vector<State> states;
  for (int i = 0; i < count; ++i) states.push_back(dynamics::random_state(model, random));
  return states;
}

// Every way is as good as plain code, which uses articulated inertias, and that loses no more than the condition says.
Table expect_equally_good(const std::string& what, const Model<double>& model,
                          const std::vector<State>& states) {
  const Table table = errors_of(model, states);
  const double condition = dynamics::worst_inertia_condition(model);
  std::printf("%-22s %8.0e |", what.c_str(), condition);
  const char* const names[] = {"plain", "tape", "generated"};
  for (int way = 0; way < kWays; ++way) {
    std::printf(" %s %7.0e %7.0e", names[way], table[way].inverse, table[way].derivatives);
    EXPECT_LE(table[way].inverse, 1e-13 + 10 * table[kPlain].inverse) << what << ", " << names[way];
    EXPECT_LE(table[way].derivatives, 1e-13 + 10 * table[kPlain].derivatives) << what << ", " << names[way];
  }
  std::printf("\n");
  EXPECT_LE(table[kPlain].inverse, 1e-14 + 1e-15 * condition) << what;
  EXPECT_LE(table[kPlain].derivatives, 1e-13 + 1e-15 * condition) << what;
  return table;
}

// Two parallel joints, the second a lever away from the first; a body beyond them and nothing between.
Model<double> two_parallel_joints(double lever) {
  Model<double> model;
  model.name = "lever";
  dynamics::Joint<double> joint;
  joint.name = "first";
  model.add_joint(-1, joint, {}, {});
  joint.name = "second";
  dynamics::Placement<double> away;
  away.p = {lever, 0, 0};
  model.add_joint(0, joint, away,
                  {1, {0.3, 0.1, 0.05}, Eigen::Matrix3d(Eigen::Vector3d(0.01, 0.02, 0.015).asDiagonal())});
  return model;
}

TEST(RouteAccuracy, ShortLevers) {
  Random random(41);
  for (const double lever : {1e-2, 1e-4, 1e-6, 1e-8, 1e-10}) {
    const Model<double> model = two_parallel_joints(lever);
    char name[32];
    std::snprintf(name, sizeof name, "lever %.0e", lever);
    const Table table = expect_equally_good(name, model, random_states(model, random, 10));
    for (const Errors& of_way : table) EXPECT_LE(of_way.inverse, 1e-14) << name;
  }
}

// No diagonal entry of an inverse is negative, in compiled code as little as in the recording.
TEST(RouteAccuracy, CompiledInverseOfAShortLeverIsPositive) {
  const Model<double> model = two_parallel_joints(1e-10);
  Random random(42);
  const State s = dynamics::random_state(model, random);
  RobotEvaluatorOptions options;
  options.codegen.use_cache = false;
  RobotEvaluator generated(model, RobotFunction("minverse"), RobotRoute::kGenerated, options);
  const VectorXd Minv = generated(s.q);
  EXPECT_GT(Minv[0], 0);
  EXPECT_LE(Exact(model, s).errors(Minv).inverse, 1e-14);
}

TEST(RouteAccuracy, MassRatios) {
  for (const bool outer : {false, true}) {
    for (const double ratio : {1.0, 1e3, 1e6, 1e9}) {
      Random random(43);
      Model<double> model = random_tree(random, {.joints = 6, .chain = true});
      for (int i = 0; i < 6; ++i) {
        model.joints[i].armature = 0;
        if ((i < 3) == outer) continue;
        model.inertias[i].mass *= ratio;
        model.inertias[i].I_c *= ratio;
      }
      char name[32];
      std::snprintf(name, sizeof name, "%s bodies times %.0e", outer ? "outer" : "inner", ratio);
      expect_equally_good(name, model, random_states(model, random, 5));
    }
  }
}

// Trees with distances and masses over six decades each, every fourth body without any mass.
TEST(RouteAccuracy, RandomTrees) {
  for (unsigned long seed = 1; seed <= 24; ++seed) {
    Random random(seed);
    Model<double> model = random_tree(random, {.joints = 4 + random.below(5),
                                               .base = seed % 2 ? Base::kFloating : Base::kFixed,
                                               .chain = seed % 3 == 0});
    for (int i = 0; i < model.njoints(); ++i) {
      model.X_PJ[i].p *= std::pow(10, random.uniform(-6, 0));
      const double scale = std::pow(10, random.uniform(-3, 3));
      const bool massless = i > 0 && i + 1 < model.njoints() && random.below(4) == 0;
      model.inertias[i].mass *= scale;
      model.inertias[i].I_c *= scale;
      model.joints[i].armature = massless ? 1e-3 : 0;
      if (massless && dynamics::is_single(model.joints[i].type)) model.inertias[i] = {};
    }
    expect_equally_good((seed % 2 ? "floating tree " : "fixed tree ") + std::to_string(seed), model,
                        random_states(model, random, 3));
  }
}

// --- Factored recordings ---------------------------------------------------------------------------------

Model<double> load(const std::filesystem::path& file, Base base) {
  return dynamics::load_urdf(file.string(), {.base = base});
}

// Joint by joint to the multiple of a right angle at which the condition is largest.
VectorXd badly_conditioned(const Model<double>& model, VectorXd q) {
  dynamics::Data<double> data(model);
  double worst = dynamics::inertia_condition(model, data, q);
  for (const auto& joint : model.joints) {
    if (joint.type != dynamics::JointType::kRevolute) continue;
    for (int k = 0; k < 4; ++k) {
      VectorXd turned = q;
      turned[joint.idx_q] = k * 1.5707963267948966;
      const double condition = dynamics::inertia_condition(model, data, turned);
      if (condition > worst) worst = condition, q = turned;
    }
  }
  return q;
}

// The shipped robots with one exception are recorded by factors, whatever the shortest way is: near 1e3 the inverse loses
// two digits, the derivatives no more than in plain code.
TEST(RouteAccuracy, FactorsOfShippedRobots) {
  const auto folder = std::filesystem::path(test::source_folder()) / "config" / "robots";
  int factored = 0;
  for (const char* name : {"arm_2r", "ur5", "panda", "iiwa14", "solo12", "g1", "talos", "simple_humanoid"}) {
    for (const Base base : {Base::kFixed, Base::kFloating}) {
      const Model<double> model = load((folder / name).replace_extension("urdf"), base);
      if (base == Base::kFloating && model.name == "arm_2r") continue;  // its root has no mass
      Random random(44);
      std::vector<State> states = random_states(model, random, 2);
      states.push_back(states[0]);
      states.back().q = badly_conditioned(model, states[0].q);
      Errors plain, of_factors;
      for (const RobotFunction& function : kFunctions) {
        const std::vector<Function> ways = detail::record_factored(model, function);
        EXPECT_EQ(ways.empty(), std::string(name) == "g1");
        factored += static_cast<int>(ways.size());
        for (const State& s : states) {
          const Exact exact(model, s);
          const VectorXd x = state_of(s, function);
          plain.include(exact.errors(evaluate_analytic(model, function, x)));
          for (const Function& way : ways) of_factors.include(exact.errors(interpret(way, x)));
        }
      }
      std::printf("%-16s %-8s %8.0e | plain %7.0e %7.0e factored %7.0e %7.0e\n", name,
                  base == Base::kFixed ? "fixed" : "floating", dynamics::worst_inertia_condition(model),
                  plain.inverse, plain.derivatives, of_factors.inverse, of_factors.derivatives);
      EXPECT_LE(of_factors.inverse, 1e-12) << name;
      EXPECT_LE(of_factors.derivatives, 1e-14 + 20 * plain.derivatives) << name;
    }
  }
  EXPECT_GT(factored, 20);
}

TEST(RouteAccuracy, BadlyConditionedRobotsAreNotFactored) {
  for (const RobotFunction& function : kFunctions) {
    EXPECT_FALSE(detail::record_factored(two_parallel_joints(0.1), function).empty());
    EXPECT_TRUE(detail::record_factored(two_parallel_joints(1e-3), function).empty());
  }
}

TEST(RouteAccuracy, ABadConditionIsSaid) {
  const auto said = [](double lever) {
    ::testing::internal::CaptureStderr();
    (void)record_robot_function(two_parallel_joints(lever), RobotFunction("minverse"));
    return ::testing::internal::GetCapturedStderr();
  };
  EXPECT_EQ(said(1e-5), "");
  EXPECT_NE(said(1e-7).find("the inertia matrix of model \"lever\" has a condition of 6.5e+13"),
            std::string::npos);
}

}  // namespace
}  // namespace dyntape::route_accuracy_test
