// SPDX-License-Identifier: BSD-3-Clause
//
// The data of a page, as JSON that may be embedded in HTML: no <, > or &, ASCII only.
//
//   const std::string json = scene_json(input, player_frames(input));
//
//   title, robot    text
//   notes           [text]: shapes that differ from the URDF
//   t               [frames] s
//   bodies          number of bodies
//   poses           [frames][bodies * 7]: x y z (m), quaternion x y z w, never jumping to its negative
//   shapes          [{kind, body, p, q, scale, color, mesh}]: visuals.h; body -1 is fixed
//   meshes          [{vertices, triangles}]
//   contacts        [frames][6 per contact]: point (m), force (N)
//   traces          [{name, points}]
//   values          [{name, unit, y}]
//   plane           {normal, offset}, or heights {corner, step, rows, columns, z}: z of a row i at z[i * columns ...]
//   center, radius  a ball that contains the motion (m); ground: the height of a grid below the robot
//   size            of the robot in its first frame (m); arrow: m per N
#pragma once

#include <string>

#include <dyntape/interface/report/player/frames.h>

namespace dyntape {

std::string scene_json(const PlayerInput& input, const PlayerFrames& frames);

}  // namespace dyntape
