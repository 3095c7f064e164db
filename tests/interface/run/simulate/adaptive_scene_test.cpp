// SPDX-License-Identifier: BSD-3-Clause
//
// Scenes whose integrator adapts its steps: keys, motions, what is reported, how they end.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/report/simulation_results.h>

#include "interface/temporary_cache.h"
#include "source_folder.h"

namespace dyntape::adaptive_scene_test {
namespace {

std::string pendulum_text(const std::string& simulation) {
  return "robot\n{\n  urdf ../robots/pendulum.urdf\n}\nstart\n{\n  q 2\n}\nsimulation\n{\n" + simulation +
         "}\n";
}
Scene read_text(const std::string& text) {
  Scene scene = read_scene_text(text, test::source_folder() + "/config/scenes/adaptive.info");
  scene.evaluation.route = Route::kInterpreter;
  return scene;
}
std::string problem_of(const std::string& simulation) {
  try {
    read_text(pendulum_text(simulation));
  } catch (const FileError& e) {
    return e.what();
  }
  return "";
}

TEST(AdaptiveScene, KeysOfTolerances) {
  const Scene scene = read_text(pendulum_text(
      "duration 1\nintegrator adaptive-stiff\nrelative_tolerance 1e-7\nabsolute_tolerance 1e-8\n"));
  EXPECT_EQ(scene.integrator, Integrator::kAdaptiveStiff);
  EXPECT_EQ(scene.tolerances.relative, 1e-7);
  EXPECT_EQ(scene.tolerances.absolute, 1e-8);
  const Scene again = read_text(scene.effective);
  EXPECT_EQ(again.tolerances.absolute, 1e-8);
  EXPECT_EQ(read_text(again.effective).effective, again.effective);
  EXPECT_EQ(read_text(pendulum_text("duration 1\n")).effective.find("relative_tolerance"), std::string::npos);
  const std::string fixed = problem_of("duration 1\nrelative_tolerance 1e-7\n");
  EXPECT_NE(
      fixed.find("adaptive.info:12:20: 'relative_tolerance' is of adaptive and adaptive-stiff; steps of "
                 "runge-kutta-4 are as long as 'step' says"),
      std::string::npos)
      << fixed;
  EXPECT_NE(
      problem_of("duration 1\nintegrator adaptive\nrelative_tolerance 1e-17\n").find("relative_tolerance"),
      std::string::npos);
  EXPECT_NE(problem_of("duration 1\nintegrator adaptive\nabsolute_tolerance 0\n").find("must be positive"),
            std::string::npos);
}

// Ten periods, at steps of a thousandth of one.
TEST(AdaptiveScene, APendulumComesBack) {
  for (const char* integrator : {"adaptive", "adaptive-stiff"}) {
    Scene scene = read_text(pendulum_text(std::string("duration 1\nintegrator ") + integrator + "\n"));
    scene.step = 2.66587094283493e-3, scene.duration = 10 * 1000 * scene.step, scene.sample = 20 * scene.step;
    SimulationReport report{scene, simulate(scene)};
    const SimulatedMotion& motion = report.motion;
    EXPECT_TRUE(motion.is_whole()) << report.verdict();
    EXPECT_NEAR(motion.q(0, motion.samples() - 1), 2, 1e-5);
    EXPECT_LE(motion.energy_error(), 1e-5 * motion.energy_scale());
    EXPECT_GE(motion.effort.internal_steps, motion.steps);
    EXPECT_NE(report.text().find("internal steps"), std::string::npos) << report.text();
    EXPECT_NE(report.json().find("\"effort\""), std::string::npos);
  }
}

// Stiffness is no matter of the step: no refusal at the start, no warning afterwards.
TEST(AdaptiveScene, StiffScenesAreNotRefused) {
  Scene scene = read_scene(test::source_folder() + "/config/scenes/block_on_slope.info");
  scene.evaluation.route = Route::kInterpreter;
  scene.step = 0.01, scene.sample = 0.01, scene.duration = 0.1;
  scene.integrator = Integrator::kAdaptiveStiff;
  const SimulatedMotion stiff = simulate(scene);
  EXPECT_TRUE(stiff.is_whole()) << stiff.trouble << stiff.warning;
  scene.integrator = Integrator::kRungeKutta4, scene.step = 1e-5;
  const SimulatedMotion fine = simulate(scene);
  EXPECT_LE((stiff.v.rightCols(1) - fine.v.rightCols(1)).norm(), 1e-6);
}

TEST(AdaptiveScene, AStopEndsALongStep) {
  Scene scene = read_text(pendulum_text("duration 1e6\nstep 1e6\nsample 1e6\nintegrator adaptive\n"));
  std::stop_source source;
  std::jthread stops([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    source.request_stop();
  });
  const auto begin = std::chrono::steady_clock::now();
  const SimulatedMotion motion = simulate(scene, {source.get_token(), {}});
  EXPECT_TRUE(motion.was_stopped) << motion.trouble;
  EXPECT_EQ(motion.trouble, "");
  EXPECT_EQ(motion.steps, 0);
  EXPECT_LE(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), 1);
}

TEST(AdaptiveScene, TooManyInternalStepsEndTheMotion) {
  const Scene scene = read_text(pendulum_text("duration 1e6\nstep 1e6\nsample 1e6\nintegrator adaptive\n"));
  const SimulatedMotion motion = simulate(scene);
  EXPECT_NE(motion.trouble.find(
                "at t = 0 s: step of \"pendulum\" from t = 0 s by 1e+06 s: 100000 internal steps lead "
                "only to t = "),
            std::string::npos)
      << motion.trouble;
}

}  // namespace
}  // namespace dyntape::adaptive_scene_test
