void @NAME@_hold_parameters(@NAME@_state* s, const real p[@CALLER_P@]) {
  for (int k = 0; k <= DT_N; ++k) {
    for (int i = 0; i < DT_NP; ++i) {
      s->p[k][i] = (i < DT_FIXED_P) ? s->p[k][i] : p[dt_caller_parameter[i]];
    }
  }
}

