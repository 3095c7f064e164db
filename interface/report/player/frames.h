// SPDX-License-Identifier: BSD-3-Clause
//
// The samples of a motion brought to the times at which a page shows it.
//
//   const PlayerFrames frames = player_frames(input);
//   frames.X_WB[k][i]        // body i at time frames.t[k]
//
// Times are evenly spaced from the first sample to the last.  Between samples configurations and values are
// interpolated; contacts, which come and go at once, are those of the last sample before.
#pragma once

#include <vector>

#include <dyntape/interface/report/player/player_input.h>

namespace dyntape {

struct PlayerFrames {
  std::vector<double> t;                                       // s
  std::vector<std::vector<dynamics::Placement<double>>> X_WB;  // [frame][body]
  std::vector<std::vector<PlayerContact>> contacts;            // [frame], or empty
  std::vector<std::vector<Eigen::Vector3d>> traces;            // [trace][frame]
  std::vector<std::vector<double>> values;                     // [value][frame]
};

PlayerFrames player_frames(const PlayerInput& input);

}  // namespace dyntape
