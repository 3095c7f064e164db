// SPDX-License-Identifier: BSD-3-Clause
//
// Resamples a motion at the times of a page's frames.
//
//   const PlayerFrames frames = player_frames(input);
//   frames.X_WB[k][i]        // body i at time frames.t[k]
//
// Times are evenly spaced from the first sample to the last.  Configurations and values are interpolated between
// samples; contacts, which are discontinuous, are those of the previous sample.
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
