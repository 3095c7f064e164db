// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/print/own_trig.h>

#include <string_view>

#include "sines.inc"

namespace dyntape::codegen {
namespace {

// From the mark of a part of autodiff/scalars/sines.h to another.
std::string part_of_sines(const std::string& begin, const std::string& end) {
  const std::string_view text = kSinesText;
  const std::size_t from = text.find('\n', text.find("/* --- " + begin + " --- */")) + 1;
  return std::string(text.substr(from, text.find("/* --- " + end + " --- */", from) - from));
}
std::string part_of_sines(const std::string& part) { return part_of_sines(part, "end of " + part); }

}  // namespace

std::string own_trig(bool single, bool sine, bool cosine) {
  if (!sine && !cosine) return {};
  const std::string type = single ? "floats" : "doubles";
  std::string text = "\n/* sin and cos: the same bits on every processor. */\n" + part_of_sines(type) +
                     part_of_sines("any numbers") + part_of_sines("reduction of " + type) +
                     part_of_sines("sine or cosine", "sine and cosine");
  if (sine) text += "#define sin(a) dt_circular(a, 0u)\n";
  if (cosine) text += "#define cos(a) dt_circular(a, 1u)\n";
  return text;
}

std::string own_circle() { return part_of_sines("sine and cosine", "end"); }

std::string own_trig_in_lanes() {
  const std::string_view text = kSinesInLanesText;
  constexpr std::string_view kBegin = "/* --- begin --- */\n";
  return "\n" + std::string(text.substr(text.find(kBegin) + kBegin.size()));
}

}  // namespace dyntape::codegen
