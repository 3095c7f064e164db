// SPDX-License-Identifier: BSD-3-Clause
//
// Makes a stage function of a robot's kinematics; the state must begin with the configuration q, then v.
//
//   StageFunction height = of_kinematics(scene, [frame](const auto& model, const auto& data, const auto& s) {
//     return dynamics::frame_placement(model, data, frame).p[2];
//   });
//
// `data` holds placements and velocities of all bodies at (q, v); unused results are not recorded.  Functions of one
// stage share their kinematics, since equal operations on a tape are merged.
#pragma once

#include <memory>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/interface/control/problem/stage.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

template <class F>
StageFunction of_kinematics(const RobotScene& scene, F f) {
  const auto robot = std::make_shared<const dynamics::Model<double>>(scene.model);
  return [robot, f](const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    const dynamics::Model<T> model = robot->template cast<T>();
    dynamics::Data<T> data(model);
    dynamics::forward_kinematics<T>(model, data, s.x.head(model.nq), s.x.segment(model.nq, model.nv));
    return f(model, data, s);
  };
}

}  // namespace dyntape
