/* ---- interior-point method ---- */

/* The changes of all sides towards znew; the mean product says how near to a boundary a step may end. */
static dt_barrier dt_changes(@NAME@_state* s, real mean) {
  dt_barrier barrier = {(real)1, (real)1, (real)0, (real)0, (real)0};
  barrier.most = (real)1 - dt_smaller(dt_larger(mean, DT_MU_END), (real)0.01);
  for (int k = 0; k < DT_N; ++k) {
    real value[DT_VALUES];
    for (int i = 0; i < DT_NZ; ++i) {
      value[i] = s->znew[k][i];
    }
    for (int i = 0; i < DT_ROWS; ++i) {
      value[DT_NZ + i] = (real)0;
    }
    dt_rows_apply(s->d[k], s->znew[k], &value[DT_NZ]);
    for (int j = 0; j < DT_SIDES; ++j) {
      dt_side* side = &s->side[k][j];
      dt_change(&barrier, side, side->b + (dt_side_factor[j] * value[dt_side_entry[j]]), (j < DT_HARD) ? 0 : 1);
    }
  }
  {
    real value[DT_END_VALUES];
    for (int i = 0; i < DT_NX; ++i) {
      value[i] = s->znew[DT_N][i];
    }
    for (int i = 0; i < DT_END_ROWS; ++i) {
      value[DT_NX + i] = (real)0;
    }
    dt_end_rows_apply(s->end_d, s->znew[DT_N], &value[DT_NX]);
    for (int j = 0; j < DT_END_SIDES; ++j) {
      dt_side* side = &s->end_side[j];
      dt_change(&barrier, side, side->b + (dt_end_side_factor[j] * value[dt_end_side_entry[j]]), 1);
    }
  }
  return barrier;
}

static void dt_aims(@NAME@_state* s, real mu) {
  for (int k = 0; k < DT_N; ++k) {
    for (int j = 0; j < DT_SIDES; ++j) {
      dt_aim(&s->side[k][j], mu, (j < DT_HARD) ? 0 : 1);
    }
  }
  for (int j = 0; j < DT_END_SIDES; ++j) {
    dt_aim(&s->end_side[j], mu, 1);
  }
}

/* Moves all sides; returns the mean product of slacks and multipliers. */
static real dt_moves(@NAME@_state* s, real part) {
  real sum = (real)0;
  for (int k = 0; k < DT_N; ++k) {
    for (int j = 0; j < DT_SIDES; ++j) {
      sum += dt_move(&s->side[k][j], part, (j < DT_HARD) ? 0 : 1);
    }
  }
  for (int j = 0; j < DT_END_SIDES; ++j) {
    sum += dt_move(&s->end_side[j], part, 1);
  }
  return sum * DT_ONE_OVER_PRODUCTS;
}

static void dt_move_plan(@NAME@_state* s, real part) {
  for (int k = 0; k < DT_N; ++k) {
    for (int i = 0; i < DT_NZ; ++i) {
      s->dz[k][i] += part * (s->znew[k][i] - s->dz[k][i]);
    }
  }
  for (int i = 0; i < DT_NX; ++i) {
    s->dz[DT_N][i] += part * (s->znew[DT_N][i] - s->dz[DT_N][i]);
  }
}

static int dt_is_step_finite(const @NAME@_state* s) {
  real sum = (real)0;
  for (int k = 0; k <= DT_N; ++k) {
    for (int i = 0; i < DT_NX; ++i) {
      sum += s->znew[k][i];
    }
  }
  return dt_is_finite(sum);
}

/* Begins again at no change of the plan, far from all sides. */
static void dt_begin_cold(@NAME@_state* s) {
  for (int k = 0; k < DT_N; ++k) {
    for (int i = 0; i < DT_NZ; ++i) {
      s->dz[k][i] = (real)0;
    }
    for (int j = 0; j < DT_SIDES; ++j) {
      dt_begin_side(&s->side[k][j], s->side[k][j].b, DT_MU_COLD, (j < DT_HARD) ? 0 : 1);
    }
  }
  for (int i = 0; i < DT_NX; ++i) {
    s->dz[DT_N][i] = (real)0;
  }
  for (int j = 0; j < DT_END_SIDES; ++j) {
    dt_begin_side(&s->end_side[j], s->end_side[j].b, DT_MU_COLD, 1);
  }
}

/* Of a quadratic program on the way to its solution. */
typedef struct {
  real mean;      /* product of slacks and multipliers */
  real left;      /* of the residuals of the equations */
  real gap;       /* of sides, by the give of the weights */
  int is_warm;    /* it began near the sides that held the plan before */
  int is_blocked; /* such a beginning allowed only a short step */
  int is_broken;  /* a step was not finite */
} dt_interior;

static void dt_predict_and_correct(@NAME@_state* s, dt_interior* at) {
  dt_barrier barrier;
  real ratio;
  dt_factorise(s);
  dt_solve(s);
  barrier = dt_changes(s, at->mean);
  ratio = at->mean + ((barrier.part * (barrier.first + (barrier.part * barrier.second))) * DT_ONE_OVER_PRODUCTS);
  ratio = ratio / dt_larger(at->mean, DT_MU_END);
  dt_aims(s, dt_larger(((ratio * ratio) * ratio) * at->mean, DT_MU_END));
  dt_solve(s);
  if (dt_is_step_finite(s) == 0) {
    at->is_broken = 1;
  } else {
    barrier = dt_changes(s, at->mean);
    at->mean = dt_moves(s, barrier.part);
    dt_move_plan(s, barrier.part);
    at->left = ((real)1 - barrier.part) * at->left;
    at->gap = (((real)1 - barrier.part) * at->gap) + (barrier.part * (DT_GIVE * barrier.moved));
    at->is_blocked = ((at->is_warm != 0) && (barrier.part < DT_SHORT)) ? 1 : 0;
    s->interior_steps += 1;
  }
}

/* Solves the quadratic program for dz; whether it is solved.  If a warm beginning is blocked, a turn of the loop begins
 * again. */
static int dt_quadratic_program(@NAME@_state* s) {
  dt_interior at = {(real)0, (real)1, (real)0, 0, 0, 0};
  int is_solved = 0;
  at.mean = dt_moves(s, (real)0);
  at.is_warm = (s->mu < DT_MU_COLD) ? 1 : 0;
  for (int i = 0; i < DT_INTERIOR; ++i) {
    if (at.is_blocked != 0) {
      dt_begin_cold(s);
      at.mean = dt_moves(s, (real)0);
      at.left = (real)1;
      at.gap = (real)0;
      at.is_warm = 0;
      at.is_blocked = 0;
    } else {
      dt_predict_and_correct(s, &at);
    }
    is_solved = ((at.left <= DT_LEFT) && (at.gap <= DT_GAP) && (at.mean <= ((real)2 * DT_MU_END))) ? 1 : 0;
    if ((is_solved != 0) || (at.is_broken != 0)) {
      break;
    }
  }
  s->mu = (is_solved != 0) ? DT_MU_WARM : DT_MU_COLD;
  return is_solved;
}
