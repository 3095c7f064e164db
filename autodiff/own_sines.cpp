// SPDX-License-Identifier: BSD-3-Clause
//
// A file of its own, and a unit: sines.h defines macros.
#include <dyntape/autodiff/own_sines.h>
#include <stdint.h>

namespace dyntape::own {
namespace {
#include <dyntape/autodiff/scalars/sines.h>
}  // namespace

double sin(double x) { return dt_circular(x, 0u); }
double cos(double x) { return dt_circular(x, 1u); }
void sincos(double x, double& sine, double& cosine) { dt_circle(x, &sine, &cosine); }

}  // namespace dyntape::own
