// SPDX-License-Identifier: BSD-3-Clause
//
// New robots from old ones.  Models go in and come out as values; joint names stay valid, indices change.
//
//   Model<double> arm  = lock_joints(model, {"finger_1", "finger_2"}, q);   // fingers held where q has them
//   Model<double> moon = with_gravity(model, {0, 0, -1.62});
//   Model<double> hung = change_base(floating, "left_foot", Base::kFixed);  // the foot stands on the world
//
// lock_joints   The listed joints are held at their entries of q (nq).  A body behind a locked joint is
// welded
//               to the body before it, its frames follow.  The dynamics are those of the full model with zero
//               velocity and acceleration in the locked joints, without their rows; what is welded to the
//               world no longer acts.  Remaining joints keep their order.
// change_base   The tree hung up at another frame.  Joints on the way from the new to the old root turn
// round:
//               the same q, v, tau mean the same motion, limits keep their meaning, because the moving side
//               of a reversed joint is its old fixed side and the axis changes sign.  So body i of such a
//               joint is expressed in the frame of the joint's old fixed side. Needs a model with a floating
//               base: only there is the inertia of the root link known.  A fixed new base is the frame
//               `frame_name` at the world's origin; a floating one is carried by a free-flyer of the old
//               one's name, which places `frame_name` in the world. Joints are numbered depth-first, children
//               by name.
// with_gravity  Acceleration of free fall in the world frame, m/s^2.
//
// Errors: ArgumentError for an unknown name (with the nearest), a q of the wrong size or not finite, a
// quaternion or (cos, sin) pair that is far from unit length (1e-6), change_base on a fixed base or through a
// joint of several degrees of freedom (its inverse is no such joint).
#pragma once

#include <string>
#include <vector>

#include <dyntape/dynamics/model/model.h>

namespace dyntape::dynamics {

Model<double> lock_joints(const Model<double>& model, const std::vector<std::string>& joint_names,
                          const Eigen::VectorXd& q);

Model<double> change_base(const Model<double>& model, const std::string& frame_name, Base base);

// Two rigid parts welded together, both in one frame; a part without mass and inertia changes no digit.
Inertia<double> welded(const Inertia<double>& a, const Inertia<double>& b);

Model<double> with_gravity(Model<double> model, const Eigen::Vector3d& gravity);

}  // namespace dyntape::dynamics
