/* SPDX-License-Identifier: BSD-3-Clause */
/* The kernel of two lanes against the one of a single point, bit for bit, for the widths that the text describes. */
#include HEADER
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define POINTS 64
#define N_X (int)(DESCRIPTOR.x.size)
#define N_Y (int)(DESCRIPTOR.y.size)

static double* numbers(size_t n) {
  double* const all = calloc(n ? n : 1, sizeof *all);
  if (!all) exit(2);
  return all;
}

int main(void) {
  double *const x = numbers(POINTS * N_X), *const side = numbers(POINTS * N_X), *const y = numbers(POINTS * N_Y),
         *const found = numbers(POINTS * N_Y);
  const dyntape_kernel *one = NULL, *two = NULL;
  uint32_t k;
  int point, i, wrong = 0;
  for (k = 0; k < DESCRIPTOR.n_kernels; ++k) {
    if (DESCRIPTOR.kernels[k].order != 0) continue;
    if (DESCRIPTOR.kernels[k].lane_width == 1) one = DESCRIPTOR.kernels + k;
    if (DESCRIPTOR.kernels[k].lane_width == 2) two = DESCRIPTOR.kernels + k;
  }
  if (!one || !two) return 2;
  srand(5);
  for (point = 0; point < POINTS; ++point) {
    for (i = 0; i < N_X; ++i) {
      const double value = 4.0 * rand() / RAND_MAX - 2;
      x[point * N_X + i] = side[(point / 2 * N_X + i) * 2 + point % 2] = value;
    }
  }
  one->run(x, NULL, NULL, y, NULL, NULL, numbers(one->work), POINTS, NULL, NULL);
  two->run(side, NULL, NULL, found, NULL, NULL, numbers(two->work), POINTS, NULL, NULL);
  for (point = 0; point < POINTS; ++point) {
    for (i = 0; i < N_Y; ++i)
      wrong += memcmp(y + point * N_Y + i, found + (point / 2 * N_Y + i) * 2 + point % 2, sizeof *y) != 0;
  }
  printf("%d of %d numbers differ\n", wrong, POINTS * N_Y);
  return wrong != 0;
}
