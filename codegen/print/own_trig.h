// SPDX-License-Identifier: BSD-3-Clause
//
// sin and cos as C text (autodiff/scalars/sines.h), which generated code contains unless libm's are asked for: additions,
// multiplications and integers only, hence the same bits on every processor with IEEE arithmetic.
#pragma once

#include <string>

namespace dyntape::codegen {

// Text that defines sin and cos, those that are asked for, of doubles or floats; it needs <stdint.h>.
std::string own_trig(bool single, bool sine, bool cosine);

// Text that defines dt_circle, both of one double, behind the first.
std::string own_circle();

// Text that defines dt_turn of DT_WIDTH doubles (autodiff/scalars/sines_in_lanes.h), behind the first.
std::string own_trig_in_lanes();

}  // namespace dyntape::codegen
