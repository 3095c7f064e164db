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
/* Whether a word of a mask is set. */
static __inline__ __attribute__((unused)) int dt_any(dt_vector_words mask) {
#if DT_WIDTH == 8 && defined(__AVX512F__)
  unsigned char set;
  __asm__("vptestmq %1, %1, %0" : "=k"(set) : "v"(mask));
  return set;
#elif DT_WIDTH == 4 && defined(__AVX__)
  int set;
  __asm__("vmovmskpd %1, %0" : "=r"(set) : "x"(mask));
  return set;
#elif DT_WIDTH == 2 && defined(__SSE2__)
  int set;
  __asm__("movmskpd %1, %0" : "=r"(set) : "x"(mask));
  return set;
#else
  int lane, set = 0;
  for (lane = 0; lane < DT_WIDTH; ++lane) set |= mask[lane] != 0;
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

static __inline__ __attribute__((unused, always_inline)) void dt_turn(dt_vector x, dt_vector* s, dt_vector* c) {
  const dt_vector turned = x * 0.6366197723675814 + 6755399441055744.0, n = turned - 6755399441055744.0;
  const dt_vector left = x - n * 1.5707963267948344, less = n * 6.223372171896261e-14, r = left - less, part = r - left;
  const dt_vector low = ((left - (r - part)) - (less + part)) - n * 3.5215598651832e-27;
  const dt_vector z = r * r, zz = z * z, half = 0.5 * z, most = 1.0 - half;
  const dt_vector sine = r - (r * z * DT_SIN(z, zz) + (half * low - low));
  const dt_vector cosine = most + (((1.0 - most) - half) + (zz * DT_COS(z, zz) - r * low));
  const dt_vector_words quadrant = (dt_vector_words)turned, odd = -(quadrant & 1);
  if (dt_any(~((dt_vector_words)((dt_vector)((dt_vector_words)x & 0x7fffffffffffffff) < 1e3)))) {
    dt_turn_each(x, s, c);
    return;
  }
  *s = (dt_vector)(((odd & (dt_vector_words)cosine) | (~odd & (dt_vector_words)sine)) ^ ((quadrant & 2) << 62));
  *c = (dt_vector)(((odd & (dt_vector_words)sine) | (~odd & (dt_vector_words)cosine)) ^ (((quadrant + 1) & 2) << 62));
}
