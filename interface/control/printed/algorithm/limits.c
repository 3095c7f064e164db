/* A step: shift, then iterations of sequential quadratic programming.  Each iteration linearises all stages, solves the
 * quadratic program by an interior-point method whose linear systems are Riccati recursions, and moves along the
 * solution as far as a merit function falls.
 *
 *   z = (x, u) of a stage, dz its change; x_next = ab z + c to first order, cost = 1/2 dz' h dz + g' dz
 *   side:  sign (quantity - bound) / nominal value >= 0, a quantity being an entry of z or a row; with slack t and
 *          multiplier l; soft sides have an excess s >= 0 at a price, so that every quadratic program has a solution */

static real dt_larger(real a, real b) { return (a > b) ? a : b; }

static real dt_smaller(real a, real b) { return (a < b) ? a : b; }

static real dt_size(real a) { return (a < (real)0) ? -a : a; }

/* Neither infinite nor NaN. */
static int dt_is_finite(real a) { return ((a - a) == (real)0) ? 1 : 0; }

/* ---- limits ---- */

typedef struct {
  real most;   /* part of the way to the boundary that may be taken: it tends to 1 with the products */
  real part;   /* of the step that can be taken */
  real first;  /* products of slacks and multipliers as a polynomial of the part: its coefficients */
  real second;
  real moved; /* the largest change of a multiplier of a soft side */
} dt_barrier;

/* Shortens the step so that v + part * change stays positive, with a distance. */
static void dt_shorten(dt_barrier* barrier, real v, real change) {
  const real most = -barrier->most * v;
  if (most > (barrier->part * change)) {
    barrier->part = most / change;
  }
}

/* Slack, multiplier and excess at the beginning of a quadratic program, from the multiplier before and for products mu. */
static void dt_begin_side(dt_side* side, real b, real mu, int is_soft) {
  const real l = dt_larger(side->l, mu);
  side->b = b;
  side->t = dt_larger(b, mu / l);
  side->l = mu / side->t;
  side->s = (real)0;
  side->n = DT_PRICE;
  side->dt = (real)0;
  side->dl = (real)0;
  side->ds = (real)0;
  if (is_soft != 0) {
    side->l = dt_smaller(side->l, (real)0.5 * DT_PRICE);
    side->n = DT_PRICE - side->l;
    side->s = mu / side->n;
    if (-b > side->s) {
      side->s = -b;
      side->n = dt_smaller(mu / side->s, (real)0.5 * DT_PRICE);
      side->l = DT_PRICE - side->n;
      side->t = mu / side->l;
    }
  }
}

/* The weight of a side in the Hessian, and no aim: those of the predictor.  A soft side gives way in proportion to the
 * change of its multiplier, which bounds the weight, so that the recursion keeps its digits; at the end the change is
 * zero (a proximal method of multipliers). */
static void dt_weigh(dt_side* side, int is_soft) {
  real w = side->t / side->l;
  if (is_soft != 0) {
    w += (side->s / side->n) + DT_GIVE;
  }
  side->w = (real)1 / w;
  side->aim_t = (real)0;
  side->aim_s = (real)0;
}

static real dt_pull(const dt_side* side) {
  return side->l - (side->w * ((side->b + side->aim_s) - side->aim_t));
}

/* The change of slack, multiplier and excess, if the side's value becomes v; what part of it is possible. */
static void dt_change(dt_barrier* barrier, dt_side* side, real v, int is_soft) {
  side->dl = -(side->w * ((v + side->aim_s) - side->aim_t));
  side->dt = (side->aim_t - ((side->t / side->l) * side->dl)) - side->t;
  dt_shorten(barrier, side->t, side->dt);
  dt_shorten(barrier, side->l, side->dl);
  barrier->first += (side->t * side->dl) + (side->l * side->dt);
  barrier->second += side->dt * side->dl;
  if (is_soft != 0) {
    barrier->moved = dt_larger(barrier->moved, dt_size(side->dl));
    side->ds = (side->aim_s + ((side->s / side->n) * side->dl)) - side->s;
    dt_shorten(barrier, side->s, side->ds);
    dt_shorten(barrier, side->n, -side->dl);
    barrier->first += (side->n * side->ds) - (side->s * side->dl);
    barrier->second -= side->ds * side->dl;
  }
}

/* Mehrotra's corrector: the aim less the product of the changes of the predictor. */
static void dt_aim(dt_side* side, real mu, int is_soft) {
  side->aim_t = (mu - (side->dt * side->dl)) / side->l;
  if (is_soft != 0) {
    side->aim_s = (mu + (side->ds * side->dl)) / side->n;
  }
}

/* Moves along the change; returns the products. */
static real dt_move(dt_side* side, real part, int is_soft) {
  real product;
  side->t += part * side->dt;
  side->l += part * side->dl;
  product = side->t * side->l;
  if (is_soft != 0) {
    side->n -= part * side->dl;
    side->s += part * side->ds;
    product += side->s * side->n;
  }
  return product;
}

