// SPDX-License-Identifier: BSD-3-Clause
//
// A motion of a robot as one HTML file that plays it in 3D, in any browser with WebGL2, without a network.
//
//   const UrdfRobot dog = read_urdf("solo12.urdf", {.base = Base::kFloating});
//   PlayerInput input{.title = "trot", .model = dog.model, .t = t, .q = q};       // (samples), (nq x samples)
//   input.visuals = read_visuals("solo12.urdf", dog.model);                       // without: sticks
//   input.contacts = contacts;                                                    // a list a sample
//   input.values = {{"kinetic energy", "J", T}};
//   write_player(input, "out/trot.html");                                         // whole or not at all
//
// Units: s, m, N, rad; world frame, z upwards.  Bodies are placed here by forward kinematics, at 60 frames a second
// between the samples: configurations are interpolated on their own space (configuration.h), so that joints hold
// together; a motion of more than 100 s gets 6000 frames.  The page only turns bodies from frame to frame.
//
// A body without shapes, or with a mesh that could not be read, is drawn as sticks from its joint to the joints and
// frames that it carries; so is the world, from its origin to what turns on it.  The same input gives the same bytes.  Numbers have six digits: a humanoid of 30 joints
// takes 120 kB a second, an arm of seven 30 kB, the page itself 32 kB.
//
// In the page: drag to turn, shift and drag to move, wheel or two fingers to zoom; space plays, arrows step.
// `window.dyntape_player` has seek(seconds) and state() for programs.
//
// Errors: ArgumentError where sizes do not match, times decrease, or a number is not finite.
#pragma once

#include <string>

#include <dyntape/interface/report/player/player_input.h>

namespace dyntape {

std::string player_page(const PlayerInput& input);

void write_player(const PlayerInput& input, const std::string& path);

}  // namespace dyntape
