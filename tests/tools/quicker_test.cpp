// SPDX-License-Identifier: BSD-3-Clause
//
// What `dyntape advise` takes for quicker: not what noise makes of two that are alike.
#include "../bench/studies/quicker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace quicker_test {
namespace {

using dyntape::tools::is_quicker;
using dyntape::tools::Timed;

TEST(Quicker, NoiseIsNot) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.1);
  const auto taking = [&](double seconds) -> Timed {
    return [&noise, &random, seconds] { return seconds * (1 + std::abs(noise(random))); };
  };
  for (double seconds : {1e-6, 1e-3, 0.5}) {
    int alike = 0, by_figures = 0, quicker = 0;
    const Timed one = taking(seconds), other = taking(seconds), third = taking(0.7 * seconds);
    for (int k = 0; k < 1000; ++k) {
      by_figures += is_quicker(one(), other());
      alike += is_quicker(one, other);
      quicker += is_quicker(third, one);
    }
    EXPECT_GT(by_figures, 200);                  // one figure each says so a third of the time
    EXPECT_LT(alike, seconds > 0.1 ? 120 : 20);  // of what takes long there are fewer turns
    EXPECT_GT(quicker, 900);
  }
}

}  // namespace

}  // namespace quicker_test
