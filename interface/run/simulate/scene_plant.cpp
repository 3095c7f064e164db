// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/scene_plant.h>

#include <cmath>

#include <dyntape/interface/system/scene_system.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

constexpr int kHalvings = 2;  // of a step: feet that hit the floor hard

bool needs_jacobians(const Scene& scene) {
  return !scene.robot.constraints.rigid.empty() && RigidStepper::needs_jacobians(scene.integrator);
}

}  // namespace

ScenePlant::ScenePlant(const Scene& scene, const VectorXd& start)
    : scene_(scene),
      commands_(Eigen::Index(actuated_dofs(scene.robot).size())),
      moving_(start.size()),
      stepper_(system_of(scene_.robot), scene.integrator, scene.evaluation, needs_jacobians(scene), 1,
               scene.tolerances),
      x_(VectorXd::Zero(stepper_.nx())),
      next_(x_) {
  x_.head(moving_) = start;
  if (scene.robot.constraints.rigid.empty()) return;
  rigid_.emplace(scene_.robot, stepper_, scene.integrator, scene.evaluation);
  rigid_->start(x_);
}

// A step, or two of half the length where it has no solution.
bool ScenePlant::advance(double t, double h, const VectorXd& u, int halvings, std::string& why) {
  const bool is_done = rigid_ ? rigid_->step(t, h, x_, u, next_, &why)
                              : stepper_.step(t, h, x_.data(), u.data(), nullptr, next_.data(), &why);
  if (is_done) {
    x_.swap(next_);
    return true;
  }
  return halvings > 0 && advance(t, h / 2, u, halvings - 1, why) &&
         advance(t + h / 2, h / 2, u, halvings - 1, why);
}

std::string ScenePlant::move(VectorXd& x, double from, double to,
                             const std::function<VectorXd(double t)>& control) {
  x_.head(moving_) = x;
  const long steps = std::max(1L, std::lround(std::ceil((to - from) / scene_.step * (1 - 1e-9))));
  const double h = (to - from) / double(steps);
  std::string why;
  for (long k = 0; k < steps; ++k) {
    const double t = from + double(k) * h;
    const VectorXd u = control(t).head(commands_);
    if (!advance(t, h, u, kHalvings, why)) return why;
  }
  x = x_.head(moving_);
  return x.allFinite() ? "" : "its state is no longer finite";
}

}  // namespace dyntape
