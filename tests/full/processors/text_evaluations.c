/* SPDX-License-Identifier: BSD-3-Clause
 *
 * Evaluates a function that dyntape has printed so many times, for counters of instructions (instructions.py).
 *   text_evaluations N      linked with the text; compiled with -DRUN, its function, -DLANES, and -DINPUTS, -DOUTPUTS
 *                           and -DWORK, doubles of a state */
#include <dyntape/codegen/store/abi.h>
#include <stdlib.h>
#include <unistd.h>

dyntape_function RUN;

static double* doubles(size_t count) {
  double* x = aligned_alloc(64, 64 * 8 * count); /* of 64 states */
  size_t i;
  for (i = 0; i < 64 * count; ++i) x[i] = 0.3 + 0.01 * (double)(i % 100);
  return x;
}

int main(int count, char** arguments) {
  const long n = count == 2 ? atol(arguments[1]) : 0;
  const size_t states = LANES == 1 ? 1 : 64;
  double *x = doubles(INPUTS), *y = doubles(OUTPUTS), *work = doubles(WORK);
  uint32_t status[64];
  long k;
  RUN(x, NULL, NULL, y, NULL, NULL, work, states, NULL, status);
  close(-31415); /* a mark for the counter (instructions.c) */
  for (k = 0; k < n; k += (long)states) RUN(x, NULL, NULL, y, NULL, NULL, work, states, NULL, status);
  close(-31415);
  return 0;
}
