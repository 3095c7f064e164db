// SPDX-License-Identifier: BSD-3-Clause
//
// Reads a block `value` of a sweep file: the varied value and its numbers.
//
//   std::optional<SweptValue> value = read_value(block, scene);     // null: no scene, whose numbers are unknown
#pragma once

#include <optional>

#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/sweep/sweep.h>

namespace dyntape {

// None if there is a problem; the section has noted it.
std::optional<SweptValue> read_value(io::Section& block, const Scene* scene);

// Whether both change the same number.
bool overlap(const ValuePlace& a, const ValuePlace& b);

}  // namespace dyntape
