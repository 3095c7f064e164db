// SPDX-License-Identifier: BSD-3-Clause
//
// Sine and cosine of one number, with the same bits on every processor: additions, multiplications and integers only.  Plain C,
// which the library compiles (own_sines.cpp, pack_functions.cpp) and which generated code contains (codegen/print/own_trig.h).
//
//   dt_circular(x, 0u)     sin(x)
//   dt_circular(x, 1u)     cos(x)
//   dt_circle(x, &s, &c)   both, with the same bits
//
// Of doubles; of floats where DT_SINGLE is defined.
// Within 0.81 ulp of the true value in double, 0.82 in float, however large x is (measured: millions of doubles against 113 bits,
// nearly all floats; tests/codegen/own_trig_test.cpp).  NaN of infinities; the sign of zero is kept.
//
// Reduction: up to 1e3 by two parts of pi / 2 of 43 bits, whose products are exact, and a third; up to 1e6 by parts of 33 bits
// (doubles only); beyond, and for floats always, by an integer product with those bits of 2 / pi that decide (Payne and Hanek).  The
// polynomials are minimax on [-pi/4, pi/4], of degree 13 and 14 for doubles, 7 and 8 for floats, their coefficients rounded one
// after the other.  Without include guard: of every unit its own.
#ifdef DT_SINGLE
/* --- floats --- */
typedef float dt_number;
typedef union dt_parts { float value; uint32_t bits; } dt_parts;
#define DT_MANTISSA 23
#define DT_EXPONENT 0xffu
#define DT_TOP_DIGITS(bits) 0u
#define DT_LOW_DIGITS(bits) (((bits) & 0x7fffffu) | 0x800000u)
#define DT_WORDS 3 /* of a product with 2 / pi that are looked at */
#define DT_SPLIT 4097.0f
#define DT_CONST(c) c##f
#define DT_HALF_PI 1.57079637f
#define DT_HALF_PI_REST -4.37113883e-8f
#define DT_SIN(z, zz) (0.166666552f + (z) * (-0.00833219197f + (z) * 0.00019518788f))
#define DT_COS(z, zz) (0.0416666456f + (z) * (-0.00138873013f + (z) * 2.44306702e-5f))

/* The bits of 2 / pi, behind a word of zeros. */
static const uint32_t dt_two_over_pi[9] = {
  0u, 0xa2f9836eu, 0x4e441529u, 0xfc2757d1u, 0xf534ddc0u, 0xdb629599u, 0x3c439041u, 0xfe5163abu, 0xdebbc561u};
#define DT_ZEROS 32

/* --- end of floats --- */
#else
/* --- doubles --- */
typedef double dt_number;
typedef union dt_parts { double value; uint64_t bits; } dt_parts;
#define DT_MANTISSA 52
#define DT_EXPONENT 0x7ffu
#define DT_TOP_DIGITS(bits) (((uint32_t)((bits) >> 32) & 0xfffffu) | 0x100000u)
#define DT_LOW_DIGITS(bits) ((uint32_t)(bits))
#define DT_WORDS 6 /* of a product with 2 / pi that are looked at */
#define DT_SPLIT 134217729.0
#define DT_CONST(c) c
#define DT_HALF_PI 1.5707963267948966
#define DT_HALF_PI_REST 6.123233995736766e-17
/* (r - sin(r)) / r^3 and (cos(r) - 1 + r^2 / 2) / r^4, of z = r^2 and zz = z^2. */
#define DT_SIN(z, zz) \
  ((0.16666666666666632 + (z) * -0.008333333333322488) + \
   (zz) * ((0.00019841269829855906 + (z) * -2.7557313706170337e-06) + \
           (zz) * (2.505076008939275e-08 + (z) * -1.589689934029946e-10)))
#define DT_COS(z, zz) \
  ((0.0416666666666666 + (z) * -0.0013888888888874472) + \
   (zz) * ((2.4801587289669243e-05 + (z) * -2.7557314400162656e-07) + \
           (zz) * (2.0875724293875604e-09 + (z) * -1.1359103788894843e-11)))

/* The bits of 2 / pi, behind two words of zeros. */
static const uint32_t dt_two_over_pi[39] = {
  0u, 0u, 0xa2f9836eu, 0x4e441529u, 0xfc2757d1u, 0xf534ddc0u, 0xdb629599u, 0x3c439041u, 0xfe5163abu,
  0xdebbc561u, 0xb7246e3au, 0x424dd2e0u, 0x06492eeau, 0x09d1921cu, 0xfe1deb1cu, 0xb129a73eu, 0xe88235f5u,
  0x2ebb4484u, 0xe99c7026u, 0xb45f7e41u, 0x3991d639u, 0x835339f4u, 0x9c845f8bu, 0xbdf9283bu, 0x1ff897ffu,
  0xde05980fu, 0xef2f118bu, 0x5a0a6d1fu, 0x6d367ecfu, 0x27cb09b7u, 0x4f463f66u, 0x9e5fea2du, 0x7527bac7u,
  0xebe5f17bu, 0x3d0739f7u, 0x8a5292eau, 0x6bfb5fb1u, 0x1f8d5d08u, 0x56033046u};
#define DT_ZEROS 64

/* --- end of doubles --- */
#endif
/* --- any numbers --- */
/* a b = product + *error, exactly. */
static dt_number dt_product(dt_number a, dt_number b, dt_number* error) {
  const dt_number product = a * b;
  const dt_number a_split = DT_SPLIT * a, a_high = a_split - (a_split - a), a_low = a - a_high;
  const dt_number b_split = DT_SPLIT * b, b_high = b_split - (b_split - b), b_low = b - b_high;
  *error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
  return product;
}

/* x = quadrant pi / 2 + *r + *low for any x beyond pi / 4.  With x = m 2^e, the bits of 2 / pi before the one
 * of weight 2^(1 - e) make multiples of four, which change nothing. */
static unsigned dt_reduce_any(dt_number x, dt_number* r, dt_number* low) {
  uint32_t word[DT_WORDS], above = 0, flip;
  uint64_t carry = 0;
  unsigned first, shift, quadrant;
  dt_number fraction = DT_CONST(0.0), rest = DT_CONST(0.0), scale = DT_CONST(4.0), error;
  dt_parts parts;
  int i;
  parts.value = x;
  first = (unsigned)(parts.bits >> DT_MANTISSA) & DT_EXPONENT;
  first = first + DT_ZEROS - 2 - (DT_EXPONENT / 2 + DT_MANTISSA);
  shift = first % 32;
  for (i = 0; i < DT_WORDS; ++i) {
    const uint32_t* const bits = dt_two_over_pi + first / 32 + i;
    word[i] = shift ? bits[0] << shift | bits[1] >> (32 - shift) : bits[0];
  }
  for (i = DT_WORDS; i-- > 0;) { /* times m */
    const uint64_t a = (uint64_t)word[i] * DT_LOW_DIGITS(parts.bits);
    const uint64_t b = (uint64_t)above * DT_TOP_DIGITS(parts.bits);
    const uint64_t sum = (a & 0xffffffffu) + (b & 0xffffffffu) + (carry & 0xffffffffu);
    carry = (a >> 32) + (b >> 32) + (carry >> 32) + (sum >> 32);
    above = word[i];
    word[i] = (uint32_t)sum;
  }
  /* Two bits of quadrant, then the fraction; from a half on, what is missing to the next quadrant. */
  quadrant = word[0] >> 30;
  flip = word[0] & 0x20000000u ? 0xffffffffu : 0u;
  quadrant += flip & 1u;
  word[0] = (word[0] ^ flip) & 0x3fffffffu;
  for (i = 1; i < DT_WORDS; ++i) word[i] ^= flip;
  for (i = 0; i < 2 * DT_WORDS; ++i) {
    const uint32_t half = i % 2 ? word[i / 2] & 0xffffu : word[i / 2] >> 16;
    const dt_number before = fraction, part = (dt_number)(int)half * (scale *= DT_CONST(0.0000152587890625));
    fraction = before + part;
    rest += part - (fraction - before);
  }
  *low = dt_product(fraction, DT_HALF_PI, &error);
  error += fraction * DT_HALF_PI_REST + rest * DT_HALF_PI;
  *r = *low + error;
  *low = (*low - *r) + error;
  if ((flip != 0u) != (x < 0)) {
    *r = -*r;
    *low = -*low;
  }
  return x < 0 ? 0u - quadrant : quadrant;
}
/* --- end of any numbers --- */
#ifdef DT_SINGLE
/* --- reduction of floats --- */
static unsigned dt_reduce(float x, float* r, float* low) {
  if (x > 0.78539816f || x < -0.78539816f) return dt_reduce_any(x, r, low);
  *r = x;
  *low = 0.0f;
  return 0u;
}

/* --- end of reduction of floats --- */
#else
/* --- reduction of doubles --- */
/* x = n pi / 2 + *r + *low for a size of x below 1e3, where n of ten bits makes exact products. */
static unsigned dt_reduce_few(double x, double* r, double* low) {
  const double n = (x * 0.6366197723675814 + 6755399441055744.0) - 6755399441055744.0;
  const double left = x - n * 1.5707963267948344, less = n * 6.223372171896261e-14, d = left - less, part = d - left;
  *r = d;
  *low = ((left - (d - part)) - (less + part)) - n * 3.5215598651832e-27;
  return (unsigned)(int)n;
}

/* a - b, and in *rest what rounding lost. */
static double dt_less(double a, double b, double* rest) {
  const double difference = a - b, part = difference - a;
  *rest += (a - (difference - part)) - (b + part);
  return difference;
}

/* The same for any x; up to 1e6 with pi / 2 in parts of 33 bits. */
static unsigned dt_reduce(double x, double* r, double* low) {
  double rest = 0.0, left;
  int n;
  if (x < 1e3 && x > -1e3) return dt_reduce_few(x, r, low);
  if (x >= 1e6 || x <= -1e6) return dt_reduce_any(x, r, low);
  n = (int)(x * 0.6366197723675814 + (x < 0 ? -0.5 : 0.5));
  left = x - n * 1.5707963267341256;
  left = dt_less(left, n * 6.077100506303966e-11, &rest);
  left = dt_less(left, n * 2.0222662487111665e-21, &rest);
  rest -= n * 8.4784276603689e-32;
  *r = left + rest;
  *low = (left - *r) + rest;
  return (unsigned)n;
}
/* --- end of reduction of doubles --- */
#endif
/* --- sine or cosine --- */
/* sin(x + quadrant pi / 2). */
static dt_number dt_circular(dt_number x, unsigned quadrant) {
  dt_number r, low, z, half, value;
  if (!(x - x == 0)) return x - x; /* infinite or NaN */
  quadrant += dt_reduce(x, &r, &low);
  z = r * r;
  half = DT_CONST(0.5) * z;
  if (quadrant & 1u) {
    const dt_number most = DT_CONST(1.0) - half;
    value = most + (((DT_CONST(1.0) - most) - half) + (z * z * DT_COS(z, z * z) - r * low));
  } else {
    value = r - (r * z * DT_SIN(z, z * z) + (half * low - low));
  }
  return quadrant & 2u ? -value : value;
}
/* --- sine and cosine --- */
static __inline__ __attribute__((unused)) void dt_circle(dt_number x, dt_number* s, dt_number* c) {
  dt_number r, low, z, half, most, sine, cosine, odd, even;
  unsigned quadrant;
  if (!(x - x == 0)) { /* infinite or NaN */
    *s = *c = x - x;
    return;
  }
  quadrant = dt_reduce(x, &r, &low);
  z = r * r;
  half = DT_CONST(0.5) * z;
  most = DT_CONST(1.0) - half;
  sine = r - (r * z * DT_SIN(z, z * z) + (half * low - low));
  cosine = most + (((DT_CONST(1.0) - most) - half) + (z * z * DT_COS(z, z * z) - r * low));
  even = quadrant & 1u ? cosine : sine;
  odd = quadrant & 1u ? sine : cosine;
  *s = quadrant & 2u ? -even : even;
  *c = (quadrant + 1u) & 2u ? -odd : odd;
}
/* --- end --- */
