// SPDX-License-Identifier: BSD-3-Clause
//
// A robot that moves: its state, and its steps with or without rigid contacts and stops.
//
//   RobotStepper motion(scene.robot, scene.integrator, scene.evaluation, scene.tolerances);     // compiles
//   motion.start(x);                                                     // x = (q, v, motors with a lag)
//   while (...) if (motion.step({k, t, h}, u)) motion.advance(); else say(motion.why());
//   const long made = run(motion, {.to = 1000, .h = h}, inputs);         // the same as a loop (run.h)
//
// With numbers of the scene as parameters, as in its system (scene_system.h): `n_p` and `edit`; start(x, p) has their
// values.  Steps with rigid contacts are those of rigid_step.h.  A step also fails if its end is beyond kBeyond.
//
// Not thread-safe; a twin is for another thread.  Errors of start().  ArgumentError: a rigid contact is below its
// ground, or a joint is beyond its hard limit.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <dyntape/interface/system/rigid/rigid_step.h>
#include <dyntape/interface/system/run.h>
#include <dyntape/interface/system/scene_system.h>

namespace dyntape {

// Squared norm of a state (m, rad, m/s, rad/s) beyond which there is no real motion, although its energy is still a
// number; and the reason that the step gives.
constexpr double kBeyond = 1e100;
constexpr const char* kUnbounded = "the motion grows without bound; take shorter steps";

class RobotStepper {
 public:
  // Keeps a reference to the robot.
  RobotStepper(const RobotScene& robot, Integrator integrator, const CodegenOptions& options,
               const Tolerances& tolerances = {}, int n_p = 0, const SceneEdit& edit = {});
  RobotStepper(const RobotStepper&) = delete;
  RobotStepper& operator=(const RobotStepper&) = delete;
  // The same functions with separate working memory.
  std::unique_ptr<RobotStepper> twin() const;

  // Begins a motion: contacts and stops that touch at x are closed.
  void start(const Eigen::VectorXd& x, const Eigen::VectorXd& p = {});
  // Replaces the state within a motion; closed contacts stay closed.
  void move_to(const Eigen::VectorXd& x) { x_ = x; }

  // The step from x() to next(); false if there is none, for the reason why().
  bool step(const StepTime& s, const Eigen::VectorXd& u);
  void advance() { x_.swap(next_); }

  const Eigen::VectorXd& x() const { return x_; }
  const Eigen::VectorXd& next() const { return next_; }
  const Eigen::VectorXd& p() const { return p_; }
  const std::string& why() const { return why_; }

  // Steps with given forces of contacts and stops, the last parameters: (p, forces).
  Stepper& stepper() { return stepper_; }
  const Stepper& stepper() const { return stepper_; }
  Eigen::VectorXd parameters() const;                            // (p, forces at the end of the last step)
  RigidStepper* rigid() { return rigid_ ? &*rigid_ : nullptr; }  // null: neither contacts nor stops

 private:
  RobotStepper(const RobotStepper& other, Stepper stepper);
  struct Setting {
    const RobotScene& robot;
    Integrator integrator;
    CodegenOptions options;
    Tolerances tolerances;
    int n_p;
    SceneEdit edit;
  };
  static Stepper stepper_of(const Setting& setting);

  Setting setting_;
  Stepper stepper_;
  std::optional<RigidStepper> rigid_;
  Eigen::VectorXd x_, next_, p_;
  std::string why_;
};

}  // namespace dyntape
