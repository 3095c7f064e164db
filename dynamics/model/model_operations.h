// SPDX-License-Identifier: BSD-3-Clause
//
// Makes new robot models from existing ones.  Models are values; joint names stay valid, indices change.
//
//   Model<double> arm  = lock_joints(model, {"finger_1", "finger_2"}, q);   // fingers held where q has them
//   Model<double> moon = with_gravity(model, {0, 0, -1.62});
//   Model<double> hung = change_base(floating, "left_foot", Base::kFixed);  // the foot stands on the world
//
// lock_joints:
//
// - The listed joints are fixed at their entries of q (nq).
// - Bodies beyond a locked joint are welded to the body before it; their frames follow.
// - The dynamics are those of the full model with zero velocity and acceleration in the locked joints, without their
// rows.
// - Bodies welded to the world no longer act.  The other joints keep their order.
//
// change_base:
//
// - The tree has a new root frame.  Joints between the new and the old root are reversed.
// - The same q, v, tau mean the same motion, and limits keep their meaning: the moving side of a reversed joint is
// its old fixed side, and its axis changes sign.  Body i of a reversed joint is in the frame of the old fixed side.
// - The model needs a floating base, since a fixed base does not know the inertia of the root link.
// - A fixed new base puts the frame `frame_name` at the world's origin.
// - A floating new base has a free-flyer with the old name, which places `frame_name` in the world.
// - Joints are numbered depth-first, children by name.
//
// with_gravity sets the acceleration of free fall in the world frame (m/s^2).
//
// Errors.  ArgumentError for:
//
// - an unknown name (the message has the nearest name)
// - a q of the wrong size, or not finite, or with a quaternion or (cos, sin) pair off unit length by more than 1e-6
// - change_base on a fixed base, or through a joint of several degrees of freedom (its inverse is no such joint)
#pragma once

#include <string>
#include <vector>

#include <dyntape/dynamics/model/model.h>

namespace dyntape::dynamics {

Model<double> lock_joints(const Model<double>& model, const std::vector<std::string>& joint_names,
                          const Eigen::VectorXd& q);

Model<double> change_base(const Model<double>& model, const std::string& frame_name, Base base);

// Welds two rigid parts, both in one frame.  A part without mass and inertia changes no digit.
Inertia<double> welded(const Inertia<double>& a, const Inertia<double>& b);

Model<double> with_gravity(Model<double> model, const Eigen::Vector3d& gravity);

}  // namespace dyntape::dynamics
