// SPDX-License-Identifier: BSD-3-Clause
//
// Functions that call: a recorded leg, twice, and a kernel written by hand.
#pragma once

#include <cmath>
#include <memory>

#include <dyntape/autodiff/callee.h>
#include <dyntape/autodiff/record.h>

namespace dyntape::testing {

// Solves E - e sin E = M for E by ten steps of Newton's method.
inline void solve_kepler(const double* in, double* out) {
  double e = in[1];
  for (int i = 0; i < 10; ++i) e = e - (e - in[0] * std::sin(e) - in[1]) / (1.0 - in[0] * std::cos(e));
  out[0] = e;
}

inline std::shared_ptr<const Callee> kepler() {
  auto callee = std::make_shared<Callee>();
  const std::weak_ptr<const Callee> self = callee;
  callee->name = "kepler";
  callee->n_in = 2;
  callee->n_out = 1;
  callee->evaluate = solve_kepler;
  callee->c_body =
      "  double e = in[1];\n  int i;\n"
      "  for (i = 0; i < 10; ++i) e = e - (e - in[0] * sin(e) - in[1]) / (1.0 - in[0] * cos(e));\n"
      "  out[0] = e;";
  // dE = (sin E de + dM) / (1 - e cos E)
  callee->jvp = [self] {
    return recorded_callee(record("kepler_jvp", 4, [&](const VectorXad& v) {
      const AD e = call(self.lock(), v.head(2))[0];
      return VectorXad::Constant(1, (sin(e) * v[2] + v[3]) / (1.0 - v[0] * cos(e))).eval();
    }));
  };
  callee->vjp = [self] {
    return recorded_callee(record("kepler_vjp", 3, [&](const VectorXad& v) {
      const AD e = call(self.lock(), v.head(2))[0];
      const AD scaled = v[2] / (1.0 - v[0] * cos(e));
      VectorXad result(2);
      result << scaled * sin(e), scaled;
      return result;
    }));
  };
  return callee;
}

// Two calls of one recorded function, and of a kernel on what they give.
inline Function with_calls(const std::shared_ptr<const Callee>& kernel) {
  const auto leg = recorded_callee(record("leg", 3, [](const VectorXad& q) {
    VectorXad y(2);
    y[0] = sin(q[0]) * cos(q[1]) + q[2];
    y[1] = q[0] * q[1] * q[2];
    return y;
  }));
  return record("calls", 5, [&](const VectorXad& x) {
    const VectorXad left = call(leg, x.head(3)), right = call(leg, x.tail(3));
    VectorXad arguments(2);
    arguments << 0.1 * sin(left[0]), right[1];
    VectorXad y(3);
    y << left[1] + right[0], call(kernel, arguments)[0], x[4];
    return y;
  });
}

}  // namespace dyntape::testing
