// SPDX-License-Identifier: BSD-3-Clause
//
// Functions that call: a recorded leg, twice, and a kernel written by hand.
#pragma once

#include <cmath>
#include <memory>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/record/record.h>

namespace dyntape::testing {

// Solves E - e sin E = M for E by ten steps of Newton's method.
inline void solve_kepler(const double* in, double* out) {
  double e = in[1];
  for (int i = 0; i < 10; ++i) e = e - (e - in[0] * std::sin(e) - in[1]) / (1.0 - in[0] * std::cos(e));
  out[0] = e;
}

inline std::shared_ptr<const Callee> kepler() {
  Kernel newton;
  newton.evaluate = solve_kepler;
  newton.c_body =
      "  double e = in[1];\n  int i;\n"
      "  for (i = 0; i < 10; ++i) e = e - (e - in[0] * sin(e) - in[1]) / (1.0 - in[0] * cos(e));\n"
      "  out[0] = e;";
  auto callee = std::make_shared<Callee>("kepler", 2, 1, newton);
  const std::weak_ptr<const Callee> self = callee;
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

// A u for a matrix A, row by row, and a vector u, by a loop.
inline std::shared_ptr<const Callee> matrix_times_vector(int n) {
  const auto multiply = [n](const auto* in, auto* out) {
    for (int i = 0; i < n; ++i) {
      auto sum = in[i * n] * in[n * n];
      for (int j = 1; j < n; ++j) sum = sum + in[i * n + j] * in[n * n + j];
      out[i] = sum;
    }
  };
  Kernel loop;
  loop.evaluate = multiply;
  const std::string N = std::to_string(n);
  loop.c_body = "int i, j;\nfor (i = 0; i < " + N + "; ++i) {\n  out[i] = in[i * " + N + "] * in[" + N +
                " * " + N + "];\n  for (j = 1; j < " + N + "; ++j) out[i] = out[i] + in[i * " + N +
                " + j] * in[" + N + " * " + N + " + j];\n}\n";
  loop.c_body_of_lanes = loop.c_body;  // it reads the same
  loop.unrolled = [multiply, n] {
    return std::make_shared<const Function>(record("unrolled", n * n + n, [&](const VectorXad& in) {
      VectorXad out(n);
      multiply(in.data(), out.data());
      return out;
    }));
  };
  auto callee = std::make_shared<Callee>("matrix_times_vector", static_cast<std::size_t>(n * n + n),
                                         static_cast<std::size_t>(n), loop);
  callee->jvp = [unrolled = loop.unrolled] { return jvp_callee(recorded_callee(*unrolled())); };
  callee->vjp = [unrolled = loop.unrolled] { return vjp_callee(recorded_callee(*unrolled())); };
  return callee;
}

// Long calls whose arguments are computed here and there, read twice, inputs or constants; and whose results
// are outputs in their order (0, 1), or read by others (1, 2), or left out and repeated (3).
inline Function with_long_calls(int variant) {
  const int n = 8;
  const auto product = matrix_times_vector(n);
  return record("long_calls", 4, [&](const VectorXad& x) {
    VectorXad in(n * n + n);
    for (int i = 0; i < in.size(); ++i) {
      in[i] = i % 7 == 0   ? AD(0.25 * i)
              : i % 5 == 0 ? x[i % 4]
                           : sin(x[i % 4] * (1 + i % 3)) + x[(i + 1) % 4];
    }
    const VectorXad first = call(product, in);
    if (variant == 0) return first;
    VectorXad again = in;
    again.tail(n) = first;
    const VectorXad second = call(product, again);
    VectorXad y(2 * n);
    if (variant == 1) y << second, first;
    if (variant == 2) y << first.reverse(), second.array().sin().matrix();
    if (variant == 3) y << second.head(n - 1), first[0], second.head(n - 1), x[2];
    return y;
  });
}

}  // namespace dyntape::testing
