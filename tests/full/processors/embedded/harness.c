// SPDX-License-Identifier: BSD-3-Clause
//
// Runs an embedded function at the states of states.h and prints the bits of every result as of a double.
//   -DHEADER='"panda_rnea.h"' -DFUNCTION=panda_rnea_value -DREAL=double -DN_X=21 -DN_Y=7 -DN_JACOBIAN=0
#include HEADER
#include "target.h"
#include "states.h"

static void put_bits(double number) {
  union {
    double number;
    unsigned long long bits;
  } parts;
  char line[18];
  int i;
  parts.number = number;
  for (i = 0; i < 16; ++i) line[i] = "0123456789abcdef"[parts.bits >> (60 - 4 * i) & 15];
  line[16] = '\n';
  line[17] = 0;
  put(line);
}

static REAL x[N_X], y[N_Y], jacobian[N_JACOBIAN + 1];

void run(void) {
  int state, i;
  for (state = 0; state < N_STATES; ++state) {
    for (i = 0; i < N_X; ++i) x[i] = (REAL)states[state][i];
#if N_JACOBIAN
    FUNCTION(x, y, jacobian);
#else
    FUNCTION(x, y);
#endif
    for (i = 0; i < N_Y; ++i) put_bits(y[i]);
    for (i = 0; i < N_JACOBIAN; ++i) put_bits(jacobian[i]);
  }
}
