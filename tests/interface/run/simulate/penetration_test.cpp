// SPDX-License-Identifier: BSD-3-Clause
//
// Steps that are so long that a closed contact sinks into its ground say so.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "interface/run/shipped_scenes.h"

namespace dyntape::penetration_test {
namespace {

// The tip of two links of 1 m slides on a floor 1.8 m below the shoulder; its height is -cos a - cos(a + b).
TEST(Penetration, IsToldBeyondAThousandthOfTheRobotsLength) {
  const std::string folder = std::string(test::source_folder()) + "/config/robots";
  for (const double step : {0.02, 0.0005}) {
    const std::string number = std::to_string(step);
    const std::string text =
        "robot { urdf double_pendulum.urdf }\n"
        "constraints { contacts { contact { frames tip offset -1.8 friction 0 } } }\n"
        "start {\nq { shoulder 0.45102681179626236 elbow -0.9020536235925247 }\nv { shoulder 2 elbow 0 }\n}\n"
        "simulation { duration 0.2 step " +
        number + " sample " + number + " integrator semi-implicit-euler }\n";
    const SimulatedMotion motion = simulate(read_scene_text(text, folder + "/sliding_tip.info"));
    double deepest = 0;
    for (int k = 0; k < motion.samples(); ++k) {
      const double a = motion.q(0, k), b = motion.q(1, k);
      deepest = std::max(deepest, std::cos(a) + std::cos(a + b) - 1.8);
    }
    EXPECT_NEAR(motion.deepest, deepest, 1e-12);
    const bool is_told = motion.warning.find("m below its ground") != std::string::npos;
    EXPECT_EQ(is_told, step > 0.01) << motion.warning;
    EXPECT_EQ(deepest > 2e-3, step > 0.01) << deepest;
  }
}

}  // namespace
}  // namespace dyntape::penetration_test
