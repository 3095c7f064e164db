// SPDX-License-Identifier: BSD-3-Clause
//
// Sine and cosine of dyntape's own: the same bits on every processor, which the interpreter, generated code, packs and the
// algorithms of dynamics/ have too.  Within 0.81 ulp of the true value, floats within 0.82, however large x is
// (scalars/sines.h).
//
//   using dyntape::own::cos, dyntape::own::sin;      // in a template that runs on double and on recorded numbers, in the
//   return sin(x) * cos(x);                          // place of std's: then both have the same bits
//
// Like error.h, this header includes no other header of dyntape; every part may include this header.
#pragma once

#include <cmath>

namespace dyntape::own {

double sin(double x);
double cos(double x);
void sincos(double x, double& sine,
            double& cosine);  // with the bits of the two, in three quarters of their time

// Of n numbers, as many at a time as the processor has lanes, with the same bits.  The arrays do not overlap.
void sin(const double* x, double* sine, int n);
void cos(const double* x, double* cosine, int n);
void sincos(const double* x, double* sine, double* cosine, int n);

float sin(float x);
float cos(float x);
void sincos(float x, float& sine, float& cosine);

// Of other widths there are only libm's.
inline long double sin(long double x) { return std::sin(x); }
inline long double cos(long double x) { return std::cos(x); }

}  // namespace dyntape::own
