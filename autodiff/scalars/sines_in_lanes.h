// SPDX-License-Identifier: BSD-3-Clause
//
// Sines and cosines of DT_WIDTH numbers at once, with the bits of one at a time.  Plain C with vectors of gcc and clang, for the
// library and for generated code; sines.h stands before it, and
//
//   typedef double dt_vector __attribute__((vector_size(8 * DT_WIDTH)));
//   typedef int64_t dt_vector_words __attribute__((vector_size(8 * DT_WIDTH)));
//
//   dt_turn(x, &s, &c);      a lane beyond 1e3 sends all of them one by one
/* --- begin --- */
/* Whether every word of a mask is set. */
static __inline__ __attribute__((unused)) int dt_all(dt_vector_words mask) {
#if DT_WIDTH == 8 && defined(__AVX512F__)
  unsigned char set;
  __asm__("vptestmq %1, %1, %0" : "=k"(set) : "v"(mask));
  return set == 0xff;
#elif DT_WIDTH == 4 && defined(__AVX__)
  int set;
  __asm__("vmovmskpd %1, %0" : "=r"(set) : "x"(mask));
  return set == 0xf;
#elif DT_WIDTH == 2 && defined(__SSE2__)
  int set;
  __asm__("movmskpd %1, %0" : "=r"(set) : "x"(mask));
  return set == 0x3;
#elif DT_WIDTH == 2 && defined(__aarch64__)
  int64_t sum;
  __asm__("addp %d0, %1.2d" : "=w"(sum) : "w"(mask));
  return sum == -2;
#else
  int lane, set = 1;
  for (lane = 0; lane < DT_WIDTH; ++lane) set &= mask[lane] != 0;
  return set;
#endif
}

static __attribute__((unused, noinline)) void dt_turn_each(dt_vector x, dt_vector* s, dt_vector* c) {
  int lane;
  for (lane = 0; lane < DT_WIDTH; ++lane) {
    const double one = x[lane];
    (*s)[lane] = dt_circular(one, 0u);
    (*c)[lane] = dt_circular(one, 1u);
  }
}

/* The same for lanes below 1e3; returns the mask of those.  The square of another is 1e6 or more, or NaN. */
static __inline__ __attribute__((unused, always_inline)) dt_vector_words dt_turn_few(dt_vector x, dt_vector* s, dt_vector* c) {
  const dt_vector turned = x * 0.6366197723675814 + 6755399441055744.0, n = turned - 6755399441055744.0;
  const dt_vector left = x - n * 1.5707963267948344, less = n * 6.223372171896261e-14, r = left - less, part = r - left;
  const dt_vector low = ((left - (r - part)) - (less + part)) - n * 3.5215598651832e-27;
  const dt_vector z = r * r, zz = z * z, half = 0.5 * z, most = 1.0 - half;
  const dt_vector_words sine = (dt_vector_words)(r - (r * z * DT_SIN(z, zz) + (half * low - low)));
  const dt_vector_words cosine = (dt_vector_words)(most + (((1.0 - most) - half) + (zz * DT_COS(z, zz) - r * low)));
  /* Bit 0 of the quadrant exchanges the two; bit 1 is the sign of the sine, and where bit 0 is not the same, of the cosine. */
  const dt_vector_words odd = -((dt_vector_words)turned & 1), sign = (dt_vector_words)turned << 62;
  const dt_vector_words exchanged = (sine ^ cosine) & odd;
  *s = (dt_vector)(sine ^ exchanged ^ (sign & INT64_MIN));
  *c = (dt_vector)(cosine ^ exchanged ^ ((sign ^ odd) & INT64_MIN));
  return (dt_vector_words)(x * x < 1e6);
}

static __inline__ __attribute__((unused, always_inline)) void dt_turn(dt_vector x, dt_vector* s, dt_vector* c) {
  if (!dt_all(dt_turn_few(x, s, c))) dt_turn_each(x, s, c);
}
