// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/print/own_trig.h>

#include <string_view>

#include "sines.inc"

namespace dyntape::codegen {
namespace {

constexpr char kSingle[] = R"(
/* sin and cos: the same bits on every processor. */
typedef float dt_number;
typedef union dt_parts { float value; uint32_t bits; } dt_parts;
#define DT_MANTISSA 23
#define DT_EXPONENT 0xffu
#define DT_TOP_DIGITS(bits) 0u
#define DT_LOW_DIGITS(bits) (((bits) & 0x7fffffu) | 0x800000u)
#define DT_WORDS 3 /* of a product with 2 / pi that are looked at */
#define DT_SPLIT 4097.0f
#define DT_CONST(c) c##f
#define DT_HALF_PI 1.57079637f
#define DT_HALF_PI_REST -4.37113883e-8f
#define DT_SIN(z, zz) (0.166666552f + (z) * (-0.00833219197f + (z) * 0.00019518788f))
#define DT_COS(z, zz) (0.0416666456f + (z) * (-0.00138873013f + (z) * 2.44306702e-5f))

/* The bits of 2 / pi, behind a word of zeros. */
static const uint32_t dt_two_over_pi[9] = {
  0u, 0xa2f9836eu, 0x4e441529u, 0xfc2757d1u, 0xf534ddc0u, 0xdb629599u, 0x3c439041u, 0xfe5163abu, 0xdebbc561u};
#define DT_ZEROS 32
)";

constexpr char kReductionOfSingles[] = R"(
static unsigned dt_reduce(float x, float* r, float* low) {
  if (x > 0.78539816f || x < -0.78539816f) return dt_reduce_any(x, r, low);
  *r = x;
  *low = 0.0f;
  return 0u;
}

)";

// From one mark of autodiff/scalars/sines.h to another.
std::string part_of_sines(std::string_view begin, std::string_view end) {
  const std::string_view text = kSinesText;
  const std::size_t from = text.find('\n', text.find(begin)) + 1;
  return std::string(text.substr(from, text.find(end, from) - from));
}

}  // namespace

std::string own_trig(bool single, bool sine, bool cosine) {
  if (!sine && !cosine) return {};
  constexpr const char *kDoubles = "/* --- of doubles", *kAny = "/* --- of any numbers",
                       *kReduction = "/* --- reduction of", *kEnd = "/* --- sine and cosine";
  std::string text =
      single ? kSingle
             : "\n/* sin and cos: the same bits on every processor. */\n" + part_of_sines(kDoubles, kAny);
  text += part_of_sines(kAny, kReduction);
  text += single ? kReductionOfSingles : part_of_sines(kReduction, kEnd);
  text += part_of_sines(kEnd, "/* --- end");
  if (sine) text += "#define sin(a) dt_circular(a, 0u)\n";
  if (cosine) text += "#define cos(a) dt_circular(a, 1u)\n";
  return text;
}

std::string own_trig_in_lanes() {
  const std::string_view text = kSinesInLanesText;
  constexpr std::string_view kBegin = "/* --- begin --- */\n";
  return "\n" + std::string(text.substr(text.find(kBegin) + kBegin.size()));
}

}  // namespace dyntape::codegen
