// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/scene_plant.h>

#include <cmath>

namespace dyntape {

namespace {

using Eigen::VectorXd;

// A step that has no solution becomes two of half the length: feet that hit the floor hard.
struct HalvedSteps {
  bool step(const StepTime& s, const VectorXd& u) { return step(s, u, 2); }
  void advance() {}

  bool step(const StepTime& s, const VectorXd& u, int halvings) {
    if (motion.step(s, u)) {
      motion.advance();
      return true;
    }
    const double half = s.h / 2;
    return halvings > 0 && step({s.k, s.t, half}, u, halvings - 1) &&
           step({s.k, s.t + half, half}, u, halvings - 1);
  }

  RobotStepper& motion;
};

Scene with_stop(Scene scene, const std::stop_token& stop) {
  scene.evaluation.stop = stop;
  return scene;
}

}  // namespace

ScenePlant::ScenePlant(const Scene& scene, const VectorXd& start, const std::stop_token& stop)
    : scene_(with_stop(scene, stop)),
      commands_(Eigen::Index(actuated_dofs(scene.robot).size())),
      moving_(start.size()),
      motion_(stepper_of(scene_, scene_.evaluation)) {
  VectorXd x = VectorXd::Zero(motion_.stepper().nx());  // with motors
  x.head(moving_) = start;
  motion_.start(x);
}

std::string ScenePlant::move(VectorXd& x, double from, double to,
                             const std::function<VectorXd(double t)>& control) {
  VectorXd whole = motion_.x();
  whole.head(moving_) = x;
  motion_.move_to(whole);
  const long steps = std::max(1L, std::lround(std::ceil((to - from) / scene_.step * (1 - 1e-9))));
  const double h = (to - from) / double(steps);
  HalvedSteps halved{motion_};
  const auto commands = [&](const StepTime& s) { return VectorXd(control(s.t).head(commands_)); };
  if (run(halved, {.to = steps, .h = h, .start = from}, commands) < steps) return motion_.why();
  x = motion_.x().head(moving_);
  return "";
}

}  // namespace dyntape
