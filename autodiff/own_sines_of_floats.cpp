// SPDX-License-Identifier: BSD-3-Clause
//
// A file of its own, and a unit: sines.h defines macros.
#include <dyntape/autodiff/own_sines.h>
#include <stdint.h>

namespace dyntape::own {
namespace {
#define DT_SINGLE
#include <dyntape/autodiff/scalars/sines.h>
}  // namespace

float sin(float x) { return dt_circular(x, 0u); }
float cos(float x) { return dt_circular(x, 1u); }
void sincos(float x, float& sine, float& cosine) { dt_circle(x, &sine, &cosine); }

}  // namespace dyntape::own
