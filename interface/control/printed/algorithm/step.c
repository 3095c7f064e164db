/* ---- shift ---- */

/* The plan from time t on: states and controls on straight lines between the points, the last ones stay. */
static void dt_shift(@NAME@_state* s, real t) {
  const real most = (real)DT_N;
  const real moved = dt_smaller(dt_larger((t - s->begin) * DT_ONE_OVER_STEP, (real)0), most);
  const int whole = (int)moved;
  const real rest = moved - (real)whole;
  for (int k = 0; k < DT_N; ++k) {
    const int from = ((k + whole) < DT_N) ? (k + whole) : DT_N;
    const int next = (from < DT_N) ? (from + 1) : DT_N;
    const int of_u = (from < DT_N) ? from : (DT_N - 1);
    const int next_u = (next < DT_N) ? next : (DT_N - 1);
    const int of_side = ((rest > (real)0.5) && ((of_u + 1) < DT_N)) ? (of_u + 1) : of_u;
    for (int i = 0; i < DT_NX; ++i) {
      s->z[k][i] = s->z[from][i] + (rest * (s->z[next][i] - s->z[from][i]));
    }
    for (int i = DT_NX; i < DT_NZ; ++i) {
      s->z[k][i] = s->z[of_u][i] + (rest * (s->z[next_u][i] - s->z[of_u][i]));
    }
    for (int j = 0; j < DT_SIDES; ++j) {
      s->side[k][j].l = s->side[of_side][j].l;
    }
  }
}

/* Whether each lower limit is below its upper one, which follows it; those of states and rows may be equal. */
static int dt_have_room(const @NAME@_state* s) {
  int result = 1;
  for (int j = 1; j < DT_SIDES; ++j) {
    const real room = s->bound[j] - s->bound[j - 1];
    if ((dt_side_entry[j] == dt_side_entry[j - 1]) && ((room < (real)0) || ((j < DT_HARD) && (room == (real)0)))) {
      result = 0;
    }
  }
  for (int j = 1; j < DT_END_SIDES; ++j) {
    if ((dt_end_side_entry[j] == dt_end_side_entry[j - 1]) && (s->end_bound[j] < s->end_bound[j - 1])) {
      result = 0;
    }
  }
  return result;
}

/* Moves the controls of the plan to within their limits, which may have changed. */
static void dt_hold_controls(@NAME@_state* s) {
  for (int k = 0; k < DT_N; ++k) {
    for (int j = 0; j < DT_HARD; ++j) {
      const int e = dt_side_entry[j];
      if (((s->z[k][e] - s->bound[j]) * dt_side_factor[j]) < (real)0) {
        s->z[k][e] = s->bound[j];
      }
    }
  }
}

/* ---- what callers see ---- */

static void dt_forget_gains(@NAME@_state* s) {
  for (int k = 0; k < DT_N; ++k) {
    for (int b = 0; b < DT_NU; ++b) {
      for (int i = 0; i < DT_NX; ++i) {
        s->gain[k][b][i] = (real)0;
      }
    }
  }
}

void @NAME@_init(@NAME@_state* s) {
  for (int k = 0; k <= DT_N; ++k) {
    for (int i = 0; i < DT_NZ; ++i) {
      s->z[k][i] = dt_guess[k][i];
      s->dz[k][i] = (real)0;
      s->znew[k][i] = (real)0;
    }
    for (int i = 0; i < DT_NP; ++i) {
      s->p[k][i] = dt_parameters[k][i];
    }
  }
  for (int k = 0; k < DT_N; ++k) {
    for (int j = 0; j < DT_SIDES; ++j) {
      s->side[k][j].l = (real)0;
    }
  }
  dt_forget_gains(s);
  for (int j = 0; j < DT_SIDES; ++j) {
    s->bound[j] = dt_side_bound[j];
  }
  for (int j = 0; j < DT_END_SIDES; ++j) {
    s->end_side[j].l = (real)0;
    s->end_bound[j] = dt_end_side_bound[j];
  }
  s->begin = (real)0;
  s->gap_price = (real)1;
  s->mu = DT_MU_COLD;
  s->cost = (real)0;
  s->violation = (real)0;
  s->has_plan = 0;
  s->iterations = 0;
  s->interior_steps = 0;
}

@NAME@_status @NAME@_step(@NAME@_state* s, const real x[@NX@], real t, int budget) {
  @NAME@_status status = @NAME_UP@_BUDGET_ENDED;
  real sum = t;
  for (int i = 0; i < DT_NX; ++i) {
    sum += x[i];
  }
  for (int j = 0; j < DT_SIDES; ++j) {
    sum += s->bound[j];
  }
  for (int j = 0; j < DT_END_SIDES; ++j) {
    sum += s->end_bound[j];
  }
  s->iterations = 0;
  s->interior_steps = 0;
  if (dt_is_finite(sum) == 0) {
    status = @NAME_UP@_NOT_FINITE;
  } else if (dt_have_room(s) == 0) {
    status = @NAME_UP@_NO_ROOM;
  } else {
    dt_merit now;
    if ((s->has_plan != 0) && (t > s->begin)) {
      dt_shift(s, t);
    }
    for (int i = 0; i < DT_NX; ++i) {
      s->z[0][i] = x[i];
    }
    dt_hold_controls(s);
    s->begin = t;
    s->gap_price = (real)1;
    now = dt_measure(s, (real)0);
    for (int i = 0; i < DT_MOST_ITERATIONS; ++i) {
      real change;
      real part;
      int is_solved;
      if (i >= budget) {
        break;
      }
      if (dt_linearise(s) == 0) {
        status = @NAME_UP@_NOT_FINITE;
        break;
      }
      is_solved = dt_quadratic_program(s);
      change = dt_change_of_plan(s);
      if (dt_is_finite(change) == 0) {
        status = @NAME_UP@_NOT_FINITE;
        break;
      }
      part = dt_line_search(s, &now);
      s->iterations += 1;
      if (part == (real)0) {
        status = @NAME_UP@_NOT_FINITE;
        break;
      }
      s->has_plan = 1;
      if ((is_solved != 0) && (change <= DT_TOLERANCE)) {
        status = @NAME_UP@_SOLVED;
        break;
      }
    }
    if (status == @NAME_UP@_NOT_FINITE) {
      dt_forget_gains(s);
    }
    s->cost = now.cost * DT_COST_UNIT;
    s->violation = now.worst;
  }
  return status;
}

void @NAME@_control(const @NAME@_state* s, real t, const real x[@NX@], real u[@NU@]) {
  const real most = (real)DT_N;
  const real at = dt_smaller(dt_larger((t - s->begin) * DT_ONE_OVER_STEP, (real)0), most);
  const int k = ((int)at < DT_N) ? (int)at : (DT_N - 1);
  const real rest = at - (real)k;
  real off[DT_NX];
  for (int i = 0; i < DT_NX; ++i) {
    off[i] = x[i] - (s->z[k][i] + (rest * (s->z[k + 1][i] - s->z[k][i])));
  }
  for (int b = 0; b < DT_NU; ++b) {
    u[b] = s->z[k][DT_NX + b];
    for (int i = 0; i < DT_NX; ++i) {
      u[b] += s->gain[k][b][i] * off[i];
    }
    if (dt_is_finite(u[b]) == 0) {
      u[b] = s->z[k][DT_NX + b];
    }
  }
  for (int j = 0; j < DT_HARD; ++j) {
    const int b = dt_side_entry[j] - DT_NX;
    if ((dt_is_finite(s->bound[j]) != 0) && (((u[b] - s->bound[j]) * dt_side_factor[j]) < (real)0)) {
      u[b] = s->bound[j];
    }
  }
}
