/* The square root within 0.51 units of its last digit, by additions, multiplications and integers only: the same bits on
 * every processor.  NaN of negative numbers. */
typedef union {
  real value;
  @BITS@ bits;
} dt_word;

static real dt_root(real a) {
  real result = (real)0;
  if (!(a == (real)0)) {
    dt_word w;
    real y;
    real s;
    real split;
    real high;
    real low;
    real left;
    w.value = a;
    w.bits = @MAGIC@ - (w.bits >> 1);
    y = w.value; /* of 1 / sqrt(a), to 4 % */
    y = y * ((real)1.5 - (((real)0.5 * a) * (y * y)));
    y = y * ((real)1.5 - (((real)0.5 * a) * (y * y)));
    y = y * ((real)1.5 - (((real)0.5 * a) * (y * y)));
    y = y * ((real)1.5 - (((real)0.5 * a) * (y * y)));
    s = a * y;
    split = @SPLIT@ * s;
    high = split - (split - s);
    low = s - high;
    left = ((a - (high * high)) - (((real)2 * high) * low)) - (low * low);
    result = (a < (real)0) ? ((a - a) / (a - a)) : (s + (((real)0.5 * left) * y));
  }
  return result;
}
#define sqrt(a) dt_root(a)

