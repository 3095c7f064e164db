// SPDX-License-Identifier: BSD-3-Clause
//
// A hand reaches behind a post: a goal for the hand and collision avoidance, in a few lines.
//
//   minimise  int |q''|^2 dt     from rest to rest in 2 s,  with the hand's final position given
#include <cstdio>

#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/solve/solve.h>
#include <dyntape/interface/motion/capsules.h>
#include <dyntape/interface/motion/inverse_kinematics.h>
#include <dyntape/interface/motion/robot_problem.h>

using namespace dyntape;

int main(int argc, char** argv) {
  const RobotScene scene{dynamics::load_urdf(argc > 1 ? argv[1] : "config/robots/ur5.urdf",
                                             {.continuous = dynamics::ContinuousJoint::kAngle})};
  const int n = scene.model.nv;
  const FrameTarget place{"tool0", Eigen::Vector3d(0.4, 0.4, 0.3)};
  const Capsule hand = sphere("hand", "tool0", {0, 0, 0}, 0.08);
  const Capsule post = capsule("post", kWorld, {0.6, 0.1, 0}, {0.6, 0.1, 0.8}, 0.05);

  Problem p = robot_problem(scene, {.duration = 2, .form = DynamicsForm::kInverse});
  p.add(squared_accelerations(p, 1));
  p.add(terminal_equality("place", frame_error(scene, place)));
  p.add(keep_clear(scene, hand, post));
  limit_positions(p, scene);
  limit_efforts(p, scene, ControlUnit::kPhysical);
  p.start.setZero();
  p.start.head(n) << -0.8, -1.2, 1.4, -0.6, 0.9, 0.2;
  p.goal.tail(n).setZero();  // at rest, with free joint positions

  // The guess goes straight to joint positions that put the hand there.
  const auto there = inverse_kinematics(scene, place, p.start.head(n));
  if (!there) return 1;
  Problem ends = p;
  ends.goal.head(n) = *there;
  p.guess = straight_line(ends);

  const Solution s = solve(p);
  double least = 1;
  for (int k = 0; k < s.motion.points(); ++k)
    least = std::min(least, clearance(scene.model, s.motion.x.col(k).head(n), hand, post));
  const Eigen::VectorXd miss = frame_error(scene, place)(Stage<double>{2, s.motion.x.rightCols(1), {}, {}});
  std::printf("%s: %d iterations, cost %.4f, misses by %.1e m, clear by %.1e m\n", s.verdict().c_str(),
              s.iterations(), s.cost(), miss.norm(), least);
  return s.success() && miss.norm() < 1e-6 && least > -1e-6 ? 0 : 1;
}
