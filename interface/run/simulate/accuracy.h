// SPDX-License-Identifier: BSD-3-Clause
//
// How far the end of a scene's motion is from where its equations lead, and whether nearby motions part.
//
//   const Accuracy accuracy = accuracy_of(scene);
//   accuracy.sentence()          // "the end is off by about 4.4 rad at 'elbow' and 12 rad/s at 'shoulder', ..."
//
// The motion is run three times: as it is; with every step made in two halves, commands held as before, or to a hundredth of
// the tolerances; and from a start that is a hundred-millionth elsewhere.  Of a scheme of order p the error is the difference
// of the first two by 2^p / (2^p - 1); with rigid contacts, of order 1.  Where nearby motions part it is a size and no more.
#pragma once

#include <stop_token>
#include <string>

#include <dyntape/interface/files/scene/scene.h>

namespace dyntape {

// The largest entry of a difference of two states.
struct EndError {
  double value = 0;   // rad, m, rad/s or m/s
  std::string joint;  // whose
  std::string unit;
};

struct Accuracy {
  EndError q, v;
  double apart = 0;     // how many times farther apart nearby motions are at the end than at the start
  bool parts = false;   // faster than in proportion to time
  std::string trouble;  // why there is no estimate, or ""

  std::string sentence() const;
};

Accuracy accuracy_of(const Scene& scene, const std::stop_token& stop = {});

}  // namespace dyntape
