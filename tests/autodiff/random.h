// SPDX-License-Identifier: BSD-3-Clause
//
// Random numbers for tests: the same everywhere (std's distributions are not), from one printed seed.
//
//   Random random(seed);  SCOPED_TRACE(random.seed_text());
//   double t = random.uniform(-1, 1);  int i = random.below(10);
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace dyntape::testing {

class Random {
 public:
  explicit Random(std::uint64_t seed) : seed_(seed), state_(seed * 0x9e3779b97f4a7c15u + 1) {}

  std::uint64_t bits() {  // splitmix64
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  double uniform(double lo, double hi) {
    return lo + (hi - lo) * (static_cast<double>(bits() >> 11) * 0x1p-53);
  }
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(bits() % n); }
  std::vector<double> vector(std::size_t n, double lo, double hi) {
    std::vector<double> v(n);
    for (double& t : v) t = uniform(lo, hi);
    return v;
  }
  std::string seed_text() const { return "seed " + std::to_string(seed_); }

 private:
  std::uint64_t seed_, state_;
};

}  // namespace dyntape::testing
