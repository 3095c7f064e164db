// SPDX-License-Identifier: BSD-3-Clause
//
// player.html.in with its scripts, as they were when the library was built (embed.cmake); the scene goes where it says
// @SCENE@.
#pragma once

namespace dyntape {

extern const char* const kPlayerPage;

}  // namespace dyntape
