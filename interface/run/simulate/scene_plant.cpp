// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/scene_plant.h>

#include <cmath>

namespace dyntape {

namespace {

using Eigen::VectorXd;

constexpr int kHalvings = 2;  // of a step: feet that hit the floor hard

}  // namespace

ScenePlant::ScenePlant(const Scene& scene, const VectorXd& start)
    : scene_(scene),
      commands_(Eigen::Index(actuated_dofs(scene.robot).size())),
      moving_(start.size()),
      stepper_(scene_, scene.evaluation),
      x_(VectorXd::Zero(stepper_.stepper.nx())),
      next_(x_) {
  x_.head(moving_) = start;
  stepper_.start(x_);
}

// A step, or two of half the length where it has no solution.
bool ScenePlant::advance(double t, double h, const VectorXd& u, int halvings, std::string& why) {
  if (stepper_.step(t, h, x_, u, next_, &why)) {
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
