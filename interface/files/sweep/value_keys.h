// SPDX-License-Identifier: BSD-3-Clause
//
// A block `value` of a sweep file: what varies, and over which numbers.
//
//   std::optional<SweptValue> value = read_value(block, scene);     // null: no scene, whose numbers are unknown
#pragma once

#include <optional>

#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/sweep/sweep.h>

namespace dyntape {

// None: there is a problem, which the section has noted.
std::optional<SweptValue> read_value(io::Section& block, const Scene* scene);

// Whether both set the same number.
bool overlap(const ValuePlace& a, const ValuePlace& b);

}  // namespace dyntape
