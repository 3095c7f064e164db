// SPDX-License-Identifier: BSD-3-Clause
//
// A printed controller in closed loop with its own model as the plant, and random steps with their instructions.  The target
// defines put, put_number and instructions (target.h).
//
//   -DTEXT='"lift.c"' -DNAME=lift -DSTATES=4 -DCONTROLS=1 -DREAL=float -DLOOP=100 -DSTEPS=1000 -DBUDGETS=2
#include TEXT

#include "target.h"

#define JOIN(a, b) a##b
#define EXPAND(a, b) JOIN(a, b)
#define CALL(function) EXPAND(NAME, function)

static CALL(_state) state;

static uint32_t random_word(void) {
  static uint32_t word = 12345u;
  word = word * 1664525u + 1013904223u;
  return word;
}

// From -1 to 1.
static REAL random_number(void) { return (REAL)((double)(random_word() >> 8) / 8388608.0 - 1.0); }

static void put_scaled(const char* name, double value) { put_number(name, (int32_t)(value * 1e6 + (value < 0 ? -0.5 : 0.5))); }

// States after LOOP intervals of the mesh, in millionths.
static void closed_loop(void) {
  REAL x[STATES], u[CONTROLS], z[STATES + CONTROLS], next[DT_VALUE_Y];
  REAL t = 0;
  int unusable = 0;
  CALL(_init)(&state);
  for (int i = 0; i < STATES; ++i) x[i] = dt_guess[0][i];
  for (int k = 0; k < LOOP; ++k) {
    const int status = (int)CALL(_step)(&state, x, t, k == 0 ? 50 : 2);
    unusable += status == 2;
    CALL(_control)(&state, t, x, u);
    for (int i = 0; i < STATES; ++i) z[i] = x[i];
    for (int i = 0; i < CONTROLS; ++i) z[STATES + i] = u[i];
    dt_stage_value(z, state.p[0], next);
    for (int i = 0; i < STATES; ++i) x[i] = next[i];
    t += (REAL)1 / DT_ONE_OVER_STEP;
  }
  for (int i = 0; i < STATES; ++i) put_scaled("x ", (double)x[i]);
  put_number("unusable ", unusable);
}

// Most instructions of steps with this budget, from the plan before or from none.
static void random_steps(int budget, int count) {
  uint32_t most = 0;
  int32_t interior = 0, trouble = 0;
  REAL t = 0, x[STATES];
  CALL(_init)(&state);
  for (int k = 0; k < count; ++k) {
    const REAL far = (k % 4) == 0 ? (REAL)4 : (REAL)0.3;
    if (k % 10 == 0) CALL(_init)(&state), t = 0;
    for (int i = 0; i < STATES; ++i) x[i] = dt_guess[0][i] + far * (1 / dt_gap_factor[i]) * random_number();
    const uint32_t before = instructions();
    const int status = (int)CALL(_step)(&state, x, t, budget);
    const uint32_t taken = instructions() - before;
    trouble += status == 2;
    if (taken > most) most = taken, interior = state.interior_steps;
    t += (REAL)1 / DT_ONE_OVER_STEP;
  }
  put_number("budget ", budget);
  put_number("most ", (int32_t)most);
  put_number("interior ", interior);
  put_number("last_interior ", state.interior_steps);
  put_number("not_finite ", trouble);
}

void run(void) {
  closed_loop();
  for (int budget = 1; budget <= BUDGETS; ++budget) random_steps(budget, STEPS);
}
