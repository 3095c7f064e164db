// SPDX-License-Identifier: BSD-3-Clause
//
// Scenes of config/scenes, compiled into a folder that goes with the tests.
#pragma once

#include <gtest/gtest.h>

#include <dyntape/interface/run/simulate/simulate.h>

#include "interface/temporary_cache.h"
#include "source_folder.h"

namespace dyntape {

inline const TemporaryCache& cache() {
  static const TemporaryCache cache;
  return cache;
}

inline std::string scene_file(const std::string& name) {
  return test::source_folder() + "/config/scenes/" + name + ".info";
}

inline Scene shipped(const std::string& name) {
  Scene scene = read_scene(scene_file(name));
  scene.evaluation.cache_folder = cache().path();
  return scene;
}

// To its end, by steps that can be trusted.
inline SimulatedMotion run(const Scene& scene) {
  SimulatedMotion motion = simulate(scene);
  EXPECT_EQ(motion.trouble, "") << scene.name;
  EXPECT_EQ(motion.warning, "") << scene.name;
  return motion;
}

// Sum of the normal forces and impulses of all contacts (N).
inline double upward_force(const Scene& scene, const Eigen::VectorXd& reactions) {
  double sum = 0;
  Eigen::Index row = 0;
  for (const auto& block : dynamics::blocks_of(scene.robot.constraints.rigid)) {
    sum += reactions[row];
    row += block.rows;
  }
  return sum;
}

}  // namespace dyntape
