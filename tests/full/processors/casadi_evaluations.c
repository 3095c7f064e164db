/* SPDX-License-Identifier: BSD-3-Clause
 *
 * Evaluates a function that CasADi has printed so many times, for counters of instructions (instructions.py).
 *   casadi_evaluations N      linked with what CasADi printed, whose function is called casadi_function */
#include <stdlib.h>
#include <unistd.h>

typedef long long casadi_int;
int casadi_function(const double** in, double** out, casadi_int* iw, double* w, int memory);
int casadi_function_work(casadi_int* arguments, casadi_int* results, casadi_int* integers,
                         casadi_int* numbers);
casadi_int casadi_function_n_in(void);
casadi_int casadi_function_n_out(void);
const casadi_int* casadi_function_sparsity_in(casadi_int i);
const casadi_int* casadi_function_sparsity_out(casadi_int i);

static casadi_int size_of(const casadi_int* sparsity) {
  return sparsity[2] == 1 ? sparsity[0] * sparsity[1] : sparsity[2 + sparsity[1]];
}

int main(int count, char** arguments) {
  const long n = count == 2 ? atol(arguments[1]) : 0;
  casadi_int arguments_n, results_n, integers, numbers, i, k, entry = 0;
  casadi_function_work(&arguments_n, &results_n, &integers, &numbers);
  const double** in = calloc((size_t)arguments_n, sizeof *in);
  double** out = calloc((size_t)results_n, sizeof *out);
  casadi_int* iw = calloc((size_t)integers + 1, sizeof *iw);
  double* w = calloc((size_t)numbers + 1, sizeof *w);
  for (i = 0; i < casadi_function_n_in(); ++i) {
    const casadi_int size = size_of(casadi_function_sparsity_in(i));
    double* x = calloc((size_t)size, sizeof *x);
    for (k = 0; k < size; ++k, ++entry) x[k] = 0.3 + 0.01 * (double)(entry % 100);
    in[i] = x;
  }
  for (i = 0; i < casadi_function_n_out(); ++i)
    out[i] = calloc((size_t)size_of(casadi_function_sparsity_out(i)), sizeof(double));
  casadi_function(in, out, iw, w, 0);
  close(-31415); /* a mark for the counter (instructions.c) */
  for (k = 0; k < n; ++k) casadi_function(in, out, iw, w, 0);
  close(-31415);
  return 0;
}
