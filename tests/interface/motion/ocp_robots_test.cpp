// SPDX-License-Identifier: BSD-3-Clause
//
// Robots of config/ as optimal control problems.
//
// The oracle.  With torque as the control and the integral of |q''|^2 as the cost, torque and acceleration
// determine each other at every point, so the problem is the block move in disguise for any inertia: optimum
// 12 |dq|^2 / T^3, motion q0 + dq (3 s^2 - 2 s^3), on every mesh.  The value alone would also come out of a wrong
// dynamics; so the torques must be those of an inverse dynamics in plain doubles along that cubic.
#include <gtest/gtest.h>

#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/solve/optimise.h>
#include <dyntape/interface/motion/robot_problem.h>
#include "dynamics/robot_files.h"

namespace dyntape::ocp_robots_test {
namespace {

using Eigen::VectorXd;

struct Case {
  std::string robot;
  std::vector<std::string> lock;
  DynamicsForm form;
  VectorXd from, to;  // empty: chosen by the seed
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.robot << (c.form == DynamicsForm::kForward ? "_forward" : "_inverse");
}

std::vector<Case> cases() {
  const std::vector<std::string> fingers = {"panda_finger_joint1", "panda_finger_joint2"};
  std::vector<Case> all;
  VectorXd from(7), to(7);
  from << 0, -0.5, 0, -2, 0, 1.5, 0.5;
  to << 1, 0.5, -0.5, -1.2, 0.5, 2, -0.5;
  for (DynamicsForm form : {DynamicsForm::kForward, DynamicsForm::kInverse}) {
    for (const char* robot :
         {"block", "pendulum", "double_pendulum", "arm_2r", "cart_pole", "ur5", "iiwa14"}) {
      all.push_back({robot, {}, form, {}, {}});
    }
    all.push_back({"panda", fingers, form, from, to});
  }
  // Trees: a quadruped held by its trunk, and a humanoid held by its root.
  all.push_back({"solo12", {}, DynamicsForm::kInverse, {}, {}});
  all.push_back({"solo12", {}, DynamicsForm::kForward, {}, {}});
  all.push_back({"g1", {}, DynamicsForm::kInverse, {}, {}});
  return all;
}

class FullyActuated : public ::testing::TestWithParam<Case> {
 protected:
  FullyActuated() {
    const Case& c = GetParam();
    scene_.model = dynamics::load_urdf(dynamics::robot_file(c.robot),
                                       {.lock = c.lock, .continuous = dynamics::ContinuousJoint::kAngle});
    from_ = c.from;
    to_ = c.to;
    if (from_.size() > 0) return;
    std::mt19937_64 random(kSeed);
    std::uniform_real_distribution<double> uniform(-0.6, 0.6);
    from_ = to_ = VectorXd::Zero(scene_.model.nv);
    for (double& q : from_) q = uniform(random);
    for (double& q : to_) q = uniform(random);
  }

  Problem problem() const {
    const int n = scene_.model.nv;
    Problem p = robot_problem(scene_, {.duration = kDuration, .form = GetParam().form});
    p.add(squared_accelerations(p, 1));
    p.start << from_, VectorXd::Zero(n);
    p.goal << to_, VectorXd::Zero(n);
    const auto line = straight_line(p);
    p.guess = [this, line, n](double t) {
      Stage<double> s = line(t);
      s.u = holding_torque(scene_, s.x.head(n));
      return s;
    };
    return p;
  }

  static constexpr unsigned kSeed = 3;
  static constexpr double kDuration = 1.25;
  RobotScene scene_;
  VectorXd from_, to_;
};

TEST_P(FullyActuated, MinimumAccelerationIsTheClosedForm) {
  const int n = scene_.model.nv;
  const Problem p = problem();
  OptimiseOptions options;
  options.mesh.intervals = 5;
  options.mesh.evaluation.route = Route::kInterpreter;
  options.solver.tolerance = 1e-10;
  const Solution s = optimise(p, options);
  EXPECT_TRUE(s.converged() || s.nlp.status == SolveStatus::kAcceptable) << describe(s.nlp.status);
  const VectorXd dq = to_ - from_;
  const double optimum = 12 * dq.squaredNorm() / std::pow(kDuration, 3);
  EXPECT_NEAR(s.cost() / optimum, 1, 1e-9) << "seed " << kSeed;
  EXPECT_LT(s.verification.violation, 1e-8);
  dynamics::Data<double> data(scene_.model);
  for (int k = 0; k < s.motion.points(); ++k) {
    const double r = s.motion.t[k] / kDuration;
    const VectorXd q = from_ + dq * (3 * r * r - 2 * r * r * r);
    const VectorXd v = dq * (6 * r - 6 * r * r) / kDuration, a = dq * (6 - 12 * r) / (kDuration * kDuration);
    EXPECT_LT((s.motion.x.col(k).head(n) - q).cwiseAbs().maxCoeff(), 1e-9) << "point " << k;
    EXPECT_LT((s.motion.x.col(k).tail(n) - v).cwiseAbs().maxCoeff(), 1e-9) << "point " << k;
    const VectorXd tau = dynamics::rnea(scene_.model, data, q, v, a);
    const double scale = std::max(1.0, tau.cwiseAbs().maxCoeff());
    EXPECT_LT((s.motion.u.col(k) - tau).cwiseAbs().maxCoeff(), 1e-9 * scale) << "point " << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, FullyActuated, ::testing::ValuesIn(cases()), [](const auto& info) {
  return info.param.robot + (info.param.form == DynamicsForm::kForward ? "_forward" : "_inverse");
});

// Trapezoid and Euler have closed forms of their own, for the same reason.
TEST(RobotProblem, OtherSchemesHaveTheirClosedForms) {
  const RobotScene scene{dynamics::load_urdf(dynamics::robot_file("arm_2r")), {}, {}};
  for (int n : {5, 10}) {
    const double trapezoidal = 12.0 * n * n * n / ((n - 1.0) * (n * n + n - 3.0)),
                 explicit_euler = 12.0 * n * n / (n * n - 1.0);
    for (const auto& [scheme, value] :
         {std::pair{trapezoid(), trapezoidal}, std::pair{euler(), explicit_euler}}) {
      Problem p = robot_problem(scene, {.duration = 1});
      p.add(squared_accelerations(p, 1));
      p.start << -0.6, 0.3, 0, 0;
      p.goal << 0.5, 1.0, 0, 0;
      OptimiseOptions options;
      options.mesh = {.scheme = scheme, .intervals = n, .evaluation = {.route = Route::kInterpreter}};
      options.solver.tolerance = 1e-10;
      const Solution s = optimise(p, options);
      EXPECT_NEAR(s.cost() / (value * (1.1 * 1.1 + 0.7 * 0.7)), 1, 1e-9)
          << scheme.name << ", " << n << " intervals";
    }
  }
}

// Whatever acts on the robot, the torques make up for it: same motion, other torques.
TEST(RobotProblem, EffectsChangeTheTorquesOnly) {
  for (DynamicsForm form : {DynamicsForm::kForward, DynamicsForm::kInverse}) {
    RobotScene scene{dynamics::load_urdf(dynamics::robot_file("arm_2r")), {}, {}};
    scene.effects.armature = Eigen::Vector2d(0.2, 0.1);
    scene.effects.damping = Eigen::Vector2d(0.7, 0.4);
    scene.effects.friction = {Eigen::Vector2d(0.5, 0.3), 0.01};
    scene.effects.springs = {Eigen::Vector2d(3, 2), Eigen::Vector2d(0.1, -0.2)};
    Problem p = robot_problem(scene, {.duration = 1, .form = form});
    p.add(squared_accelerations(p, 1));
    const Eigen::Vector2d from(-0.6, 0.3), dq(1.1, 0.7);
    p.start << from, 0, 0;
    p.goal << from + dq, 0, 0;
    OptimiseOptions options;
    options.mesh = {.intervals = 5, .evaluation = {.route = Route::kInterpreter}};
    options.solver.tolerance = 1e-10;
    const Solution s = optimise(p, options);
    EXPECT_NEAR(s.cost() / (12 * dq.squaredNorm()), 1, 1e-9);
    dynamics::Data<double> data(scene.model);
    for (int k = 0; k < s.motion.points(); ++k) {
      const double r = s.motion.t[k];
      const VectorXd q = from + dq * (3 * r * r - 2 * r * r * r), v = dq * (6 * r - 6 * r * r),
                     a = dq * (6 - 12 * r);
      const VectorXd tau = dynamics::rnea(scene.model, data, q, v, a);
      // Written out: armature a + d v + c tanh(v / w) + k (q - q_rest), on top of the rigid bodies.
      const VectorXd passive = (Eigen::Array2d(0.2, 0.1) * a.array() + Eigen::Array2d(0.7, 0.4) * v.array() +
                                Eigen::Array2d(0.5, 0.3) * (v.array() / 0.01).tanh() +
                                Eigen::Array2d(3, 2) * (q.array() - Eigen::Array2d(0.1, -0.2)))
                                   .matrix();
      // tau of rnea has the model's armature, which the file leaves at zero.
      EXPECT_LT((s.motion.u.col(k) - tau - passive).cwiseAbs().maxCoeff(), 1e-6) << "point " << k;
    }
  }
}

// The program that is solved and the model that verifies it have the same effects, whichever are chosen, also where
// the dynamics enter as callees.
TEST(RobotProblem, RecordedAndPlainRatesHaveTheSameEffects) {
  RobotScene scene{dynamics::load_urdf(dynamics::robot_file("ur5")), {}, {}};
  const int n = scene.model.nv;
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto draw = [&](int size) {
    return VectorXd(VectorXd::NullaryExpr(size, [&] { return number(random); }));
  };
  scene.effects.armature = draw(n).cwiseAbs();
  scene.effects.damping = draw(n).cwiseAbs();
  scene.effects.friction = {draw(n).cwiseAbs(), 0.3};
  scene.effects.springs = {draw(n).cwiseAbs(), draw(n)};
  for (const auto fixed_in : {dynamics::FixedIn::kBody, dynamics::FixedIn::kWorld}) {
    scene.effects.wrenches.push_back(dynamics::wrench_at_frame(scene.model, 7, fixed_in, {draw(3), draw(3)}));
  }
  const VectorXd state = draw(3 * n);
  const auto rates_of = [&](const RobotScene& s) {
    const Problem p = robot_problem(s, {.duration = 1, .form = DynamicsForm::kForward});
    const Function f = record("rate", static_cast<std::size_t>(3 * n), [&](const VectorXad& x) {
      Stage<AD> stage;
      stage.x = x.head(2 * n), stage.u = x.tail(n);
      return p.rate(stage);
    });
    Stage<double> stage;
    stage.x = state.head(2 * n), stage.u = state.tail(n);
    const std::vector<double> recorded = evaluate(f, state);
    return std::pair(VectorXd(VectorXd::Map(recorded.data(), 2 * n)), p.rate(stage));
  };
  const auto [recorded, plain] = rates_of(scene);
  EXPECT_LT((recorded - plain).norm(), 1e-12 * plain.norm());
  RobotScene without = scene;
  dynamics::for_each_effect(without.effects, [&](auto& effect) {
    SCOPED_TRACE(dynamics::effect_name(effect));
    if (!effect) return;
    const auto kept = effect;
    effect.reset();
    const auto [less_recorded, less_plain] = rates_of(without);
    EXPECT_LT((less_recorded - less_plain).norm(), 1e-12 * less_plain.norm());
    EXPECT_GT((less_plain - plain).norm(), 1e-6 * plain.norm());
    effect = kept;
  });
}

RobotScene cart_pole() { return {dynamics::load_urdf(dynamics::robot_file("cart_pole")), {}, {"slider"}}; }

// The file's cart-pole is the one written by hand.
TEST(RobotProblem, CartPoleSwingUpFromItsFile) {
  for (DynamicsForm form : {DynamicsForm::kForward, DynamicsForm::kInverse}) {
    const RobotScene scene = cart_pole();
    Problem p = robot_problem(scene, {.duration = 2, .form = form});
    p.add(squared_controls(1));
    p.start << 0, 0, 0, 0;
    p.goal << 1, 3.141592653589793, 0, 0;
    limit_positions(p, scene);
    limit_efforts(p, scene, ControlUnit::kPhysical);
    OptimiseOptions options;
    options.mesh.intervals = 160;
    options.mesh.evaluation.route = Route::kInterpreter;
    options.solver = {.tolerance = 1e-12, .dual_tolerance = 1e-10, .bound_relaxation = 0};
    const Solution s = optimise(p, options);
    EXPECT_TRUE(s.success());
    EXPECT_NEAR(s.cost(), 58.8076672550, 1e-9);
  }
}

// What is not chosen is not recorded.
TEST(RobotProblem, AbsentEffectsLeaveNoOperation) {
  const auto model = dynamics::load_urdf(dynamics::robot_file("iiwa14"));
  const auto hash = [&](const dynamics::Effects<double>& effects) {
    return content_hash(
        record_stage(robot_problem({model, effects, {}}, {.form = DynamicsForm::kInverse})).node);
  };
  const auto operations = [&](const dynamics::Effects<double>& effects) {
    return total_operations(
        dissolved(record_stage(robot_problem({model, effects, {}}, {.form = DynamicsForm::kInverse})).node));
  };
  dynamics::Effects<double> plain, again, damped, free_fall;
  damped.damping = dynamics::model_damping(model);
  free_fall.gravity = false;
  EXPECT_EQ(hash(plain), hash(again));
  EXPECT_NE(hash(plain), hash(damped));
  EXPECT_GT(operations(damped), operations(plain));
  EXPECT_LT(operations(free_fall), operations(plain));
}

TEST(RobotProblem, FractionsOfTheLimitAreTheSameProblem) {
  const RobotScene scene{dynamics::load_urdf(dynamics::robot_file("arm_2r")), {}, {}};
  double cost[2];
  for (ControlUnit unit : {ControlUnit::kPhysical, ControlUnit::kFraction}) {
    Problem p = robot_problem(scene, {.duration = 1, .form = DynamicsForm::kForward, .unit = unit});
    p.add(squared_fractions(scene, 1, unit));
    p.start << -0.6, 0.3, 0, 0;
    p.goal << 0.5, 1.0, 0, 0;
    OptimiseOptions options;
    options.mesh.evaluation.route = Route::kInterpreter;
    const Solution s = optimise(p, options);
    EXPECT_TRUE(s.success());
    cost[int(unit)] = s.cost();
  }
  EXPECT_NEAR(cost[0], cost[1], 1e-8 * cost[0]);
}

TEST(RobotProblem, RefusesWhatItCannotDescribe) {
  const auto message = [](const RobotScene& scene, const RobotProblemOptions& options) {
    try {
      robot_problem(scene, options);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("nothing thrown");
  };
  RobotScene scene = cart_pole();
  scene.actuated = {"slidr"};
  EXPECT_NE(message(scene, {}).find("slider"), std::string::npos);
  scene.actuated = {"slider", "slider"};
  EXPECT_NE(message(scene, {}).find("\"slider\" is named twice"), std::string::npos);
  scene.actuated = {"pivot"};  // its effort limit is zero
  EXPECT_NE(message(scene, {.unit = ControlUnit::kFraction}).find("no effort limit"), std::string::npos);
}

}  // namespace
}  // namespace dyntape::ocp_robots_test
