/* ---- merit function ---- */

typedef struct {
  real cost;
  real excess; /* of soft sides, summed in nominal values */
  real gap;    /* between stages, likewise */
  real worst;  /* the largest of these */
} dt_merit;

static real dt_excess(real value) { return (value < (real)0) ? -value : (real)0; }

static void dt_add_excess(dt_merit* m, real excess) {
  m->excess += excess;
  m->worst = dt_larger(m->worst, excess);
}

static void dt_add_gap(dt_merit* m, real gap) {
  m->gap += gap;
  m->worst = dt_larger(m->worst, gap);
}

/* At z + part dz. */
static dt_merit dt_measure(const @NAME@_state* s, real part) {
  dt_merit m = {(real)0, (real)0, (real)0, (real)0};
  real next[DT_NZ];
  for (int i = 0; i < DT_NZ; ++i) {
    next[i] = s->z[0][i] + (part * s->dz[0][i]);
  }
  for (int k = 0; k < DT_N; ++k) {
    real y[DT_VALUE_Y];
    real value[DT_VALUES];
    for (int i = 0; i < DT_NZ; ++i) {
      value[i] = next[i];
    }
    dt_stage_value(value, s->p[k], y);
    for (int i = 0; i < DT_ROWS; ++i) {
      value[DT_NZ + i] = y[DT_NX + i];
    }
    m.cost += y[DT_NX + DT_ROWS];
    for (int i = 0; i < DT_NZ; ++i) {
      next[i] = s->z[k + 1][i] + (part * s->dz[k + 1][i]);
    }
    for (int i = 0; i < DT_NX; ++i) {
      dt_add_gap(&m, dt_gap_factor[i] * dt_size(y[i] - next[i]));
    }
    for (int j = DT_HARD; j < DT_SIDES; ++j) {
      dt_add_excess(&m, dt_excess(dt_side_factor[j] * (value[dt_side_entry[j]] - s->bound[j])));
    }
  }
  {
    real y[DT_END_VALUE_Y + 1];
    real value[DT_END_VALUES];
    dt_end_value(next, s->p[DT_N], y);
    for (int i = 0; i < DT_NX; ++i) {
      value[i] = next[i];
    }
    for (int i = 0; i < DT_END_ROWS; ++i) {
      value[DT_NX + i] = y[i];
    }
    m.cost += y[DT_END_ROWS];
    for (int j = 0; j < DT_END_SIDES; ++j) {
      dt_add_excess(&m, dt_excess(dt_end_side_factor[j] * (value[dt_end_side_entry[j]] - s->end_bound[j])));
    }
  }
  return m;
}

/* The change of cost and price that the quadratic model expects from dz. */
static real dt_expected(const @NAME@_state* s) {
  real sum = (real)0;
  real excess = (real)0;
  for (int k = 0; k < DT_N; ++k) {
    real value[DT_VALUES];
    for (int i = 0; i < DT_NZ; ++i) {
      real row = (real)0;
      for (int j = 0; j < i; ++j) {
        row += s->h[k][((i * (i + 1)) / 2) + j] * s->dz[k][j];
      }
      row += ((real)0.5 * s->h[k][((i * (i + 3)) / 2)]) * s->dz[k][i];
      sum += (row + s->g[k][i]) * s->dz[k][i];
      value[i] = s->dz[k][i];
    }
    for (int i = 0; i < DT_ROWS; ++i) {
      value[DT_NZ + i] = (real)0;
    }
    dt_rows_apply(s->d[k], s->dz[k], &value[DT_NZ]);
    for (int j = DT_HARD; j < DT_SIDES; ++j) {
      const real b = s->side[k][j].b;
      excess += dt_excess(b + (dt_side_factor[j] * value[dt_side_entry[j]])) - dt_excess(b);
    }
  }
  {
    real value[DT_END_VALUES];
    for (int i = 0; i < DT_NX; ++i) {
      real row = (real)0;
      for (int j = 0; j < i; ++j) {
        row += s->end_h[((i * (i + 1)) / 2) + j] * s->dz[DT_N][j];
      }
      row += ((real)0.5 * s->end_h[((i * (i + 3)) / 2)]) * s->dz[DT_N][i];
      sum += (row + s->end_g[i]) * s->dz[DT_N][i];
      value[i] = s->dz[DT_N][i];
    }
    for (int i = 0; i < DT_END_ROWS; ++i) {
      value[DT_NX + i] = (real)0;
    }
    dt_end_rows_apply(s->end_d, s->dz[DT_N], &value[DT_NX]);
    for (int j = 0; j < DT_END_SIDES; ++j) {
      const real b = s->end_side[j].b;
      excess += dt_excess(b + (dt_end_side_factor[j] * value[dt_end_side_entry[j]])) - dt_excess(b);
    }
  }
  return sum + (DT_PRICE * excess);
}

/* Moves the plan along dz, by the first part that lowers the merit enough, or by the best of those tried; returns it,
 * or 0 if none has a finite merit. */
static real dt_line_search(@NAME@_state* s, dt_merit* now) {
  const real expected = dt_expected(s);
  real before;
  real fall;
  real allowed; /* rise: the precision of the quadratic program, and rounding */
  real best = (real)0;
  real part = (real)1;
  real least = (real)0;
  dt_merit at_best = *now;
  if ((expected - DT_PRECISION) > (((real)0.5 * s->gap_price) * now->gap)) {
    s->gap_price = dt_smaller(((real)2 * expected) / dt_larger(now->gap, DT_SMALL), DT_LARGEST_PRICE);
  }
  before = (now->cost + (DT_PRICE * now->excess)) + (s->gap_price * now->gap);
  fall = expected - (s->gap_price * now->gap);
  allowed = DT_PRECISION + (DT_ROUNDING * dt_size(before));
  for (int i = 0; i < DT_TRIALS; ++i) {
    const dt_merit m = dt_measure(s, part);
    const real merit = (m.cost + (DT_PRICE * m.excess)) + (s->gap_price * m.gap);
    if ((dt_is_finite(merit) != 0) && ((best == (real)0) || (merit < least))) {
      best = part;
      least = merit;
      at_best = m;
      if (merit <= ((before + (((real)1e-4 * part) * fall)) + allowed)) {
        break;
      }
    }
    part = (real)0.5 * part;
  }
  *now = at_best;
  for (int k = 0; k < DT_N; ++k) {
    for (int i = 0; i < DT_NZ; ++i) {
      s->z[k][i] += best * s->dz[k][i];
    }
  }
  for (int i = 0; i < DT_NX; ++i) {
    s->z[DT_N][i] += best * s->dz[DT_N][i];
  }
  return best;
}

/* Largest change of the plan in nominal values. */
static real dt_change_of_plan(const @NAME@_state* s) {
  real most = (real)0;
  for (int k = 0; k < DT_N; ++k) {
    for (int i = 0; i < DT_NZ; ++i) {
      most = dt_larger(most, dt_gap_factor[i] * dt_size(s->dz[k][i]));
    }
  }
  for (int i = 0; i < DT_NX; ++i) {
    most = dt_larger(most, dt_gap_factor[i] * dt_size(s->dz[DT_N][i]));
  }
  return most;
}

