// SPDX-License-Identifier: BSD-3-Clause
//
// What a page is told, as JSON that may stand in HTML: no <, > or &, ASCII only.
//
//   const std::string json = scene_json(input, player_frames(input));
//
//   title, robot    text
//   notes           [text]: what could not be drawn as the URDF has it
//   t               [frames] s
//   bodies          number of bodies
//   poses           [frames][bodies * 7]: x y z (m), quaternion x y z w, never jumping to its negative
//   shapes          [{kind, body, p, q, scale, color, mesh}]: visuals.h; body -1 stands still
//   meshes          [{vertices, triangles}]
//   contacts        [frames][6 per contact]: point (m), force (N)
//   traces          [{name, points}]
//   values          [{name, unit, y}]
//   plane           {normal, offset}, or heights {corner, step, rows, columns, z}: z of a row i at z[i * columns ...]
//   center, radius  the ball that the robot stays in (m); ground: the height of a grid below it
//   size            of the robot in its first frame (m); arrow: m per N
#pragma once

#include <string>

#include <dyntape/interface/report/player/frames.h>

namespace dyntape {

std::string scene_json(const PlayerInput& input, const PlayerFrames& frames);

}  // namespace dyntape
