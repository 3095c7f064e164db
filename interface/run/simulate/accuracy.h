// SPDX-License-Identifier: BSD-3-Clause
//
// Estimates the error at the end of a scene's motion, and detects whether nearby motions diverge.
//
//   const Accuracy accuracy = accuracy_of(scene);
//   accuracy.sentence()          // "the end is off by about 4.4 rad at 'elbow' and 12 rad/s at 'shoulder', ..."
//
// Method.  Three runs: as given; with half steps and the same commands, or a hundredth of the tolerances; and from a
// start that differs by 1e-8.  For a scheme of order p the error is the difference of the first two times 2^p / (2^p
// - 1); with rigid contacts p = 1.  If nearby motions diverge, the estimate is only an order of magnitude.
#pragma once

#include <stop_token>
#include <string>

#include <dyntape/interface/files/scene/scene.h>

namespace dyntape {

// The largest entry of the difference of two states.
struct EndError {
  double value = 0;   // rad, m, rad/s or m/s
  std::string joint;  // its joint
  std::string unit;
};

struct Accuracy {
  EndError q, v;
  double apart = 0;     // distance of nearby motions at the end relative to the start
  bool parts = false;   // true: faster than proportional to time
  std::string trouble;  // why there is no estimate, or ""

  std::string sentence() const;
};

Accuracy accuracy_of(const Scene& scene, const std::stop_token& stop = {});

}  // namespace dyntape
