// SPDX-License-Identifier: BSD-3-Clause
//
// Finds the parts of a robot's bones that obstacles hide in a picture (private to the pictures).
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/report/plot/picture.h>

namespace dyntape {

// World to picture.  Oblique: z upwards, x to the right, y backwards at half length.
std::array<double, 2> project(View view, const Eigen::Vector3d& p);

// The direction from the picture to the viewer.
Eigen::Vector3d towards_viewer(View view);

// Returns true if a fixed obstacle is between the point and the viewer.
bool is_hidden(View view, const std::vector<Capsule>& obstacles, const Eigen::Vector3d& p);

using Bone = std::array<Eigen::Vector3d, 2>;

// The frame with its bones in the picture: whole if nothing hides them; else behind the obstacles, with the visible
// parts drawn again in front.
io::MotionFrame frame_of(View view, const std::vector<Capsule>& obstacles, double time,
                         const std::vector<Bone>& bones);

}  // namespace dyntape
