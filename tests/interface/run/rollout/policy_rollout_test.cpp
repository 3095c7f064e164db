// SPDX-License-Identifier: BSD-3-Clause
//
// Roll-outs of a scene with a policy: against a loop of single steps, differences of roll-outs, and alone.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/run/rollout/policy_rollout.h>
#include <dyntape/interface/system/rigid/robot_stepper.h>
#include "interface/message_of.h"
#include "source_folder.h"

namespace dyntape::policy_rollout_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Scene scene_of(const std::string& name) {
  Scene scene = read_scene(test::source_folder() + "/config/scenes/" + name + ".info");
  scene.evaluation.route = Route::kInterpreter;  // nothing is compiled
  return scene;
}

VectorXd state_at_start(const Scene& scene) {
  VectorXd x(scene.q.size() + scene.v.size());
  x << scene.q, scene.v;
  return x;
}

// Nonlinear; reads positions, the quaternion and speeds of a floating robot.
Function law_of(const Scene& scene) {
  const Index nq = scene.robot.model.nq, nv = scene.robot.model.nv;
  const auto n_u = Index(actuated_dofs(scene.robot).size());
  return record("law", std::size_t(nq + nv), 5, [=](const VectorXad& x, const VectorXad& p) {
    VectorXad u(n_u);
    for (Index k = 0; k < n_u; ++k)
      u[k] = p[k % 3] * sin(-x[nq - n_u + k]) - p[3] * x[nq + nv - n_u + k] + p[4] * x[3] * x[nq - 1];
    return u;
  });
}

struct Case {
  Scene scene = scene_of("quadruped_dropped");
  Function law = law_of(scene);
  Index worlds;
  MatrixXd x0, p;

  explicit Case(Index n) : worlds(n), x0(state_at_start(scene).replicate(1, n)), p(5, n) {
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> unit(0, 1);
    for (Index k = 0; k < n; ++k) {
      x0(2, k) += 0.1 * unit(random);
      for (Index i = 0; i < 5; ++i) p(i, k) = 1 + 2 * unit(random);
    }
  }
};

TEST(PolicyRollout, IsALoopOfSteps) {
  const Case of(21);
  constexpr int kSteps = 20;
  PolicyRollout rollout(of.scene, of.law);
  const PolicyMotions motions = rollout.run(of.x0, of.p, kSteps);
  Stepper stepper(system_of(of.scene.robot), of.scene.integrator, of.scene.evaluation);
  for (Index world : {Index(0), Index(7), Index(20)}) {
    VectorXd x = of.x0.col(world);
    const MatrixXd found = motions.of_world(world);
    for (Index k = 0; k < kSteps; ++k) {
      const VectorXd here = x, p = of.p.col(world);
      const std::vector<double> u = evaluate(of.law, here, p);
      ASSERT_TRUE(
          stepper.step(double(k) * of.scene.step, of.scene.step, here.data(), u.data(), nullptr, x.data()));
      ASSERT_TRUE((found.col(k).array() == x.array()).all()) << "world " << world << ", step " << k;
    }
    const PolicyMotions alone = rollout.run(of.x0.col(world), of.p.col(world), kSteps);  // in any company
    EXPECT_TRUE((alone.x.array() == found.array()).all());
  }
}

// The height of the trunk and the joints at the end, whose increments are those of their entries.
TEST(PolicyRollout, GradientsAreDifferences) {
  const Case of(3);
  constexpr int kSteps = 15;
  const Index nq = of.scene.robot.model.nq, nv = of.scene.robot.model.nv, n_u = nv - 6;
  PolicyRollout rollout(of.scene, of.law);
  ASSERT_EQ(rollout.n_t(), 2 * nv);
  const auto cost = [&](const MatrixXd& x) {
    return x.col(kSteps - 1).segment(7, n_u).squaredNorm() / 2 + x.row(nq + 8).sum();
  };
  const auto by_states = [&](Index, const auto& x, MatrixXd& weights) {
    weights.col(kSteps - 1).segment(6, n_u) = x.col(kSteps - 1).segment(7, n_u);
    weights.row(nv + 8).array() += 1;  // of every state
  };
  const PolicyGradient g = rollout.gradient(of.x0, of.p, kSteps, by_states);
  const PolicyMotions motions = rollout.run(of.x0, of.p, kSteps);
  EXPECT_LT((g.motions.x - motions.x).cwiseAbs().maxCoeff(), 1e-12);
  const double h = 1e-6;
  for (Index world = 0; world < 3; ++world) {
    const VectorXd x = of.x0.col(world), p = of.p.col(world);
    const auto cost_at = [&](const VectorXd& from, const VectorXd& with) {
      return cost(rollout.run(from, with, kSteps).x);
    };
    for (Index i = 0; i < 5; ++i) {
      const VectorXd d = h * VectorXd::Unit(5, i);
      const double slope = (cost_at(x, p + d) - cost_at(x, p - d)) / (2 * h);
      EXPECT_NEAR(g.parameters(i, world), slope, 1e-6 * (1 + std::abs(slope))) << i;
    }
    for (Index i = 0; i < 2 * nv; ++i) {
      const auto moved = [&](double by) {
        VectorXd from = x;
        if (i < nv)
          from.head(nq) = dynamics::integrate<double>(of.scene.robot.model, VectorXd(x.head(nq)),
                                                      VectorXd(by * VectorXd::Unit(nv, i)));
        else
          from[nq + i - nv] += by;
        return cost_at(from, p);
      };
      const double slope = (moved(h) - moved(-h)) / (2 * h);
      EXPECT_NEAR(g.start(i, world), slope, 2e-6 * (1 + std::abs(slope))) << i;
    }
  }
}

TEST(PolicyRollout, AWorldThatDivergesLeavesTheOthers) {
  const Case of(5);
  MatrixXd p = of.p;
  p.col(2).setConstant(1e200);
  PolicyRollout rollout(of.scene, of.law);
  const PolicyMotions motions = rollout.run(of.x0, p, 10);
  EXPECT_TRUE(motions.of_world(2).col(9).hasNaN());
  const PolicyMotions sound = rollout.run(of.x0, of.p, 10);
  for (Index world : {0, 1, 3, 4})
    EXPECT_TRUE((motions.of_world(world).array() == sound.of_world(world).array()).all()) << world;
  const PolicyGradient g =
      rollout.gradient(of.x0, p, 10, [](Index, const auto&, MatrixXd& weights) { weights.setOnes(); });
  EXPECT_TRUE(g.parameters.col(2).hasNaN() && g.parameters.col(1).allFinite());
}

TEST(PolicyRollout, SaysWhatDoesNotFit) {
  const Case of(3);
  const auto message = [](const std::function<void()>& act) { return message_of<ArgumentError>(act); };
  PolicyRollout rollout(of.scene, of.law);
  EXPECT_NE(message([&] {
              rollout.run(of.x0.topRows(5), of.p, 3);
            }).find("expected starts of 37 x worlds, got 5 x 3"),
            std::string::npos);
  EXPECT_NE(message([&] {
              rollout.run(of.x0, of.p.leftCols(2), 3);
            }).find("expected parameters of 5 x 1 or 5 x 3, got 5 x 2"),
            std::string::npos);
  EXPECT_NE(message([&] { rollout.run(of.x0, of.p, -1); }).find("got -1 steps"), std::string::npos);
  const Function small = record("small", 2, 0, [](const VectorXad& x, const VectorXad&) { return x; });
  EXPECT_NE(
      message([&] { PolicyRollout(of.scene, small); }).find("policy \"small\" takes 2 values and returns 2"),
      std::string::npos);
}

// Each world is the motion of its scene, whatever others there are; what starts below its ground is refused.
TEST(PolicyRollout, RigidContactsMoveAsInTheirScene) {
  Scene scene = scene_of("tumbling_box");
  scene.step = 2e-3;
  constexpr int kSteps = 200;
  const Function nothing =
      record("nothing", 13, 0, [](const VectorXad&, const VectorXad&) { return VectorXad(0); });
  PolicyRollout rollout(scene, nothing);
  MatrixXd x0 = state_at_start(scene).replicate(1, 3);
  x0(2, 1) = 0.35, x0(2, 2) = 0.4;
  const PolicyMotions motions = rollout.run(x0, {}, kSteps);
  RobotStepper motion(scene.robot, scene.integrator, scene.evaluation);
  for (Index world = 0; world < 3; ++world) {
    motion.start(x0.col(world));
    long impacts = 0;
    for (int k = 0; k < kSteps; ++k) {
      ASSERT_TRUE(motion.step({k, k * scene.step, scene.step}, VectorXd(0))) << motion.why();
      motion.advance();
      impacts += long(motion.rigid()->impacts().size());
      ASSERT_TRUE((motions.of_world(world).col(k).array() == motion.x().array()).all()) << world << ", " << k;
    }
    EXPECT_GT(impacts, 0);
  }
  x0(2, 1) = 0;
  const auto message = [](const std::function<void()>& act) { return message_of<ArgumentError>(act); };
  EXPECT_NE(message([&] { rollout.run(x0, {}, kSteps); }).find("below its ground"), std::string::npos);
  const auto ones = [](Index, const auto&, MatrixXd& weights) { weights.setOnes(); };
  EXPECT_NE(message([&] {
              rollout.gradient(x0, {}, kSteps, ones);
            }).find("has rigid contacts or hard limits, whose impacts have no derivatives here"),
            std::string::npos);
}

}  // namespace
}  // namespace dyntape::policy_rollout_test
