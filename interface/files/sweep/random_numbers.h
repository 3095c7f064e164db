// SPDX-License-Identifier: BSD-3-Clause
//
// Random numbers without state: each is a function of a seed and its indices, independent of the order of the calls.
//
//   const RandomSource random(seed);
//   random.uniform({.sample = 17, .value = 2})       // in [0, 1), 53 random bits
//   random.normal({.sample = 17, .value = 2})        // mean 0, deviation 1
//
// Philox 4x32-10: J. Salmon, M. Moraes, R. Dror, D. Shaw, Parallel random numbers: as easy as 1, 2, 3, SC 2011.  The
// key is the seed, the counter (sample, value, attempt).  Normal ones by G. Box, M. Muller, A note on the generation of
// random normal deviates, 1958, with portable functions (autodiff/scalars/portable.h): the same bits on every
// processor.
#pragma once

#include <array>
#include <cstdint>

namespace dyntape {

// What a number is for.
struct Draw {
  std::uint64_t sample = 0;
  std::uint32_t value = 0;
  std::uint32_t attempt = 0;  // of numbers that are drawn until one fits
};

class RandomSource {
 public:
  explicit RandomSource(std::uint64_t seed) : seed_(seed) {}
  double uniform(const Draw& draw) const;
  double normal(const Draw& draw) const;

 private:
  std::uint64_t seed_;
};

// Ten rounds.
std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key);

// Portable: log x, exp x.
double portable_log(double x);
double portable_exp(double x);

}  // namespace dyntape
