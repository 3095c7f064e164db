/* ---- Riccati recursion ---- */

/* u = K x + k minimises the quadratic form q of (x, u), in lower rows: eliminates the controls.  The rows of u become
 * L^-1 [Qux | .] with Quu = L D L'; factor holds L below its diagonal, and 1/D on it. */
static void dt_eliminate(real q[DT_NZ][DT_NZ], real factor[DT_NU][DT_NU]) {
  for (int b = 0; b < DT_NU; ++b) {
    const real pivot = q[DT_NX + b][DT_NX + b];
    factor[b][b] = (real)1 / dt_larger(pivot, DT_LEAST_PIVOT);
    for (int a = b + 1; a < DT_NU; ++a) {
      const real l = q[DT_NX + a][DT_NX + b] * factor[b][b];
      factor[a][b] = l;
      for (int j = 0; j < DT_NX; ++j) {
        q[DT_NX + a][j] -= l * q[DT_NX + b][j];
      }
      for (int e = b + 1; e <= a; ++e) {
        q[DT_NX + a][DT_NX + e] -= l * q[DT_NX + e][DT_NX + b];
      }
    }
  }
}

/* k = -(L D L')^-1 r */
static void dt_feedforward(real factor[DT_NU][DT_NU], const real r[DT_NU], real k[DT_NU]) {
  for (int a = 0; a < DT_NU; ++a) {
    real y = r[a];
    for (int b = 0; b < a; ++b) {
      y -= factor[a][b] * k[b];
    }
    k[a] = y;
  }
  for (int i = 0; i < DT_NU; ++i) {
    const int b = (DT_NU - 1) - i;
    real y = -(factor[b][b] * k[b]);
    for (int a = b + 1; a < DT_NU; ++a) {
      y -= factor[a][b] * k[a];
    }
    k[b] = y;
  }
}

/* Gains from the eliminated rows, and the cost to go: p = Qxx - Y' D^-1 Y. */
static void dt_gains(real q[DT_NZ][DT_NZ], real factor[DT_NU][DT_NU], real gain[DT_NU][DT_NX],
                     real p[DT_NX][DT_NX]) {
  for (int i = 0; i < DT_NU; ++i) {
    const int b = (DT_NU - 1) - i;
    for (int j = 0; j < DT_NX; ++j) {
      gain[b][j] = -(factor[b][b] * q[DT_NX + b][j]);
    }
    for (int a = b + 1; a < DT_NU; ++a) {
      for (int j = 0; j < DT_NX; ++j) {
        gain[b][j] -= factor[a][b] * gain[a][j];
      }
    }
  }
  for (int i = 0; i < DT_NX; ++i) {
    for (int j = 0; j <= i; ++j) {
      p[i][j] = q[i][j];
    }
    for (int b = 0; b < DT_NU; ++b) {
      const real y = q[DT_NX + b][i] * factor[b][b];
      for (int j = 0; j <= i; ++j) {
        p[i][j] -= y * q[DT_NX + b][j];
      }
    }
  }
  for (int i = 0; i < DT_NX; ++i) {
    for (int j = 0; j < i; ++j) {
      p[j][i] = p[i][j];
    }
  }
}

static void dt_end_matrix(@NAME@_state* s, real p[DT_NX][DT_NX]) {
  real w[DT_END_VALUES] = {0};
  for (int j = 0; j < DT_END_SIDES; ++j) {
    dt_weigh(&s->end_side[j], 1);
    w[dt_end_side_entry[j]] += (dt_end_side_factor[j] * dt_end_side_factor[j]) * s->end_side[j].w;
  }
  for (int i = 0; i < DT_NX; ++i) {
    for (int j = 0; j <= i; ++j) {
      p[i][j] = s->end_h[((i * (i + 1)) / 2) + j];
    }
    p[i][i] += w[i];
  }
  dt_end_rows_square(s->end_d, &w[DT_NX], p);
  for (int i = 0; i < DT_NX; ++i) {
    for (int j = 0; j < i; ++j) {
      p[j][i] = p[i][j];
    }
  }
}

static void dt_factorise(@NAME@_state* s) {
  real p[DT_NX][DT_NX];
  dt_end_matrix(s, p);
  for (int i = 0; i < DT_N; ++i) {
    const int k = (DT_N - 1) - i;
    real w[DT_VALUES] = {0};
    real q[DT_NZ][DT_NZ];
    for (int a = 0; a < DT_NX; ++a) {
      real sum = (real)0;
      for (int b = 0; b < DT_NX; ++b) {
        sum += p[a][b] * s->c[k][b];
      }
      s->pc[k][a] = sum;
    }
    for (int j = 0; j < DT_SIDES; ++j) {
      dt_weigh(&s->side[k][j], (j < DT_HARD) ? 0 : 1);
      w[dt_side_entry[j]] += (dt_side_factor[j] * dt_side_factor[j]) * s->side[k][j].w;
    }
    for (int a = 0; a < DT_NZ; ++a) {
      for (int b = 0; b <= a; ++b) {
        q[a][b] = s->h[k][((a * (a + 1)) / 2) + b];
      }
      q[a][a] += w[a];
    }
    dt_rows_square(s->d[k], &w[DT_NZ], q);
    dt_transform(s->ab[k], p, q);
    dt_eliminate(q, s->factor[k]);
    dt_gains(q, s->factor[k], s->gain[k], p);
  }
}

/* Solves for znew with the factorised matrices. */
static void dt_solve(@NAME@_state* s) {
  real p[DT_NX];
  {
    real pull[DT_END_VALUES] = {0};
    for (int j = 0; j < DT_END_SIDES; ++j) {
      pull[dt_end_side_entry[j]] += dt_end_side_factor[j] * dt_pull(&s->end_side[j]);
    }
    for (int i = 0; i < DT_NX; ++i) {
      p[i] = s->end_g[i] - pull[i];
    }
    dt_end_rows_pull(s->end_d, &pull[DT_NX], p);
  }
  for (int i = 0; i < DT_N; ++i) {
    const int k = (DT_N - 1) - i;
    real pull[DT_VALUES] = {0};
    real q[DT_NZ];
    for (int j = 0; j < DT_SIDES; ++j) {
      pull[dt_side_entry[j]] += dt_side_factor[j] * dt_pull(&s->side[k][j]);
    }
    for (int a = 0; a < DT_NZ; ++a) {
      q[a] = s->g[k][a] - pull[a];
    }
    dt_rows_pull(s->d[k], &pull[DT_NZ], q);
    for (int a = 0; a < DT_NX; ++a) {
      p[a] += s->pc[k][a];
    }
    dt_transpose(s->ab[k], p, q);
    dt_feedforward(s->factor[k], &q[DT_NX], s->feedforward[k]);
    for (int a = 0; a < DT_NX; ++a) {
      p[a] = q[a];
    }
    for (int b = 0; b < DT_NU; ++b) {
      for (int a = 0; a < DT_NX; ++a) {
        p[a] += s->gain[k][b][a] * q[DT_NX + b];
      }
    }
  }
  for (int a = 0; a < DT_NX; ++a) {
    s->znew[0][a] = (real)0;
  }
  for (int k = 0; k < DT_N; ++k) {
    for (int b = 0; b < DT_NU; ++b) {
      real u = s->feedforward[k][b];
      for (int a = 0; a < DT_NX; ++a) {
        u += s->gain[k][b][a] * s->znew[k][a];
      }
      s->znew[k][DT_NX + b] = u;
    }
    for (int a = 0; a < DT_NX; ++a) {
      s->znew[k + 1][a] = s->c[k][a];
    }
    dt_apply(s->ab[k], s->znew[k], s->znew[k + 1]);
  }
}

