/* ---- linear model of all stages ---- */

/* Values of the quantities that sides limit: of z, then of rows. */
static void dt_begin_stage_sides(@NAME@_state* s, int k, const real rows[]) {
  for (int j = 0; j < DT_SIDES; ++j) {
    const int e = dt_side_entry[j];
    const real value = (e < DT_NZ) ? s->z[k][e] : rows[e - DT_NZ];
    dt_begin_side(&s->side[k][j], dt_side_factor[j] * (value - s->bound[j]), s->mu, (j < DT_HARD) ? 0 : 1);
  }
}

static void dt_begin_end_sides(@NAME@_state* s, const real rows[]) {
  for (int j = 0; j < DT_END_SIDES; ++j) {
    const int e = dt_end_side_entry[j];
    const real value = (e < DT_NX) ? s->z[DT_N][e] : rows[e - DT_NX];
    dt_begin_side(&s->end_side[j], dt_end_side_factor[j] * (value - s->end_bound[j]), s->mu, 1);
  }
}

/* Values, Jacobians and Gauss-Newton Hessians at the plan; whether they are finite. */
static int dt_linearise(@NAME@_state* s) {
  real sum = (real)0;
  for (int k = 0; k < DT_N; ++k) {
    real y[DT_STAGE_Y];
    real jacobian[DT_STAGE_JACOBIAN];
    dt_stage_first(s->z[k], s->p[k], y, jacobian);
    for (int i = 0; i < DT_NX; ++i) {
      s->c[k][i] = y[i] - s->z[k + 1][i];
      sum += s->c[k][i];
    }
    for (int i = 0; i < DT_AB; ++i) {
      s->ab[k][i] = jacobian[i];
      sum += jacobian[i];
    }
    for (int i = 0; i < DT_D; ++i) {
      s->d[k][i] = jacobian[DT_AB + i];
      sum += jacobian[DT_AB + i];
    }
    dt_stage_cost(y, jacobian, s->h[k], s->g[k]);
    for (int i = 0; i < DT_NZ; ++i) {
      s->h[k][((i * (i + 3)) / 2)] += dt_damping[i];
      sum += s->g[k][i];
      s->dz[k][i] = (real)0;
    }
    dt_begin_stage_sides(s, k, &y[DT_NX]);
  }
  {
    real y[DT_END_Y + 1] = {0};
    real jacobian[DT_END_JACOBIAN + 1] = {0};
    dt_end_first(s->z[DT_N], s->p[DT_N], y, jacobian);
    for (int i = 0; i < DT_END_D; ++i) {
      s->end_d[i] = jacobian[i];
      sum += jacobian[i];
    }
    dt_end_cost(y, jacobian, s->end_h, s->end_g);
    for (int i = 0; i < DT_NX; ++i) {
      s->end_h[((i * (i + 3)) / 2)] += dt_damping[i];
      sum += s->end_g[i];
      s->dz[DT_N][i] = (real)0;
    }
    dt_begin_end_sides(s, y);
  }
  return dt_is_finite(sum);
}

