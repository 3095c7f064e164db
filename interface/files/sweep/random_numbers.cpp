// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/sweep/random_numbers.h>

#include <cmath>

#include <dyntape/autodiff/scalars/portable.h>

namespace dyntape {

namespace {

double portable(Op op, double x) {
  double result = 0;
  portable_values(op, &x, nullptr, &result, 1);
  return result;
}

std::array<std::uint32_t, 4> bits_of(std::uint64_t seed, const Draw& draw) {
  return philox({std::uint32_t(draw.sample), std::uint32_t(draw.sample >> 32), draw.value, draw.attempt},
                {std::uint32_t(seed), std::uint32_t(seed >> 32)});
}

// In [0, 1): the upper 53 of 64 bits.
double fraction(std::uint32_t high, std::uint32_t low) {
  return double((std::uint64_t(high) << 32 | low) >> 11) * 0x1p-53;
}

}  // namespace

std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key) {
  constexpr std::uint64_t kA = 0xD2511F53, kB = 0xCD9E8D57;
  constexpr std::uint32_t kWeylA = 0x9E3779B9, kWeylB = 0xBB67AE85;
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t a = kA * counter[0], b = kB * counter[2];
    counter = {std::uint32_t(b >> 32) ^ counter[1] ^ key[0], std::uint32_t(b),
               std::uint32_t(a >> 32) ^ counter[3] ^ key[1], std::uint32_t(a)};
    key = {key[0] + kWeylA, key[1] + kWeylB};
  }
  return counter;
}

double RandomSource::uniform(const Draw& draw) const {
  const auto bits = bits_of(seed_, draw);
  return fraction(bits[0], bits[1]);
}

double RandomSource::normal(const Draw& draw) const {
  const auto bits = bits_of(seed_, draw);
  const double above_zero = 1 - fraction(bits[0], bits[1]);
  const double angle = 6.283185307179586 * fraction(bits[2], bits[3]);
  return std::sqrt(-2 * portable_log(above_zero)) * portable(Op::Cos, angle);
}

double portable_log(double x) { return portable(Op::Log, x); }
double portable_exp(double x) { return portable(Op::Exp, x); }

}  // namespace dyntape
