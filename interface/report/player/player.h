// SPDX-License-Identifier: BSD-3-Clause
//
// Writes a motion of a robot as one HTML file that plays it in 3D, in any browser with WebGL2, without network.
//
//   const UrdfRobot dog = read_urdf("solo12.urdf", {.base = Base::kFloating});
//   PlayerInput input{.title = "trot", .model = dog.model, .t = t, .q = q};       // (samples), (nq x samples)
//   input.visuals = read_visuals("solo12.urdf", dog.model);                       // optional; default: sticks
//   input.contacts = contacts;                                                    // one list per sample
//   input.values = {{"kinetic energy", "J", T}};
//   write_player(input, "out/trot.html");                                         // atomic
//
// Units: s, m, N, rad; world frame, z upwards.  Forward kinematics places the bodies at 60 frames per second;
// between samples, configurations are interpolated on their own space (configuration.h), so that joints stay
// connected.  A motion of more than 100 s has 6000 frames.  The page interpolates bodies between frames.
//
// A body without shapes, or with an unreadable mesh, is drawn as sticks from its joint to the joints and frames that
// it carries; so is the world.  The same input gives the same bytes.  Numbers have six digits.  Sizes: a humanoid of
// 30 joints 120 kB per second, an arm of seven joints 30 kB per second, the page itself 32 kB.
//
// In the page: drag to rotate, shift and drag to move, wheel or two fingers to zoom; space plays, arrow keys step.
// `window.dyntape_player` has seek(seconds) and state() for programs.
//
// Errors.  ArgumentError: sizes that do not match, decreasing times, numbers that are not finite.
#pragma once

#include <string>

#include <dyntape/interface/report/player/player_input.h>

namespace dyntape {

std::string player_page(const PlayerInput& input);

void write_player(const PlayerInput& input, const std::string& path);

}  // namespace dyntape
