// SPDX-License-Identifier: BSD-3-Clause
//
// A loop as a kernel on the tape: Kepler's equation  E - e sin E = M.
//
// Newton's iteration runs a fixed number of times in a function that the recording calls.  The derivative does not
// differentiate the loop, but uses the implicit function theorem:
//
//     (1 - e cos E) dE = dM + sin E de
//
// This formula is recorded code that calls the kernel again, so second derivatives follow.
#include <cmath>
#include <cstdio>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>

using namespace dyntape;

std::shared_ptr<const Callee> make_kepler();

// (M, e) -> E.  Use one kernel for all calls: equal calls are then merged.
std::shared_ptr<const Callee> kepler() {
  static const auto kernel = make_kepler();
  return kernel;
}

std::shared_ptr<const Callee> make_kepler() {
  Kernel newton;
  newton.evaluate = [](const double* in, double* out) {
    double E = in[0];
    for (int i = 0; i < 12; ++i) E = E - (E - in[1] * std::sin(E) - in[0]) / (1.0 - in[1] * std::cos(E));
    out[0] = E;
  };
  newton.c_body =  // the same arithmetic in the same order
      "double E = in[0];\n"
      "for (int i = 0; i < 12; ++i) E = E - (E - in[1] * sin(E) - in[0]) / (1.0 - in[1] * cos(E));\n"
      "out[0] = E;\n";
  auto kernel = std::make_shared<Callee>("kepler", 2, 1, newton);
  kernel->jvp = [] {  // (M, e, dM, de) -> dE
    return recorded_callee(record("kepler_jvp", 4, [](const VectorXad& v) {
      const AD E = call(kepler(), v.head(2))[0];
      return VectorXad::Constant(1, (v[2] + sin(E) * v[3]) / (1 - v[1] * cos(E)));
    }));
  };
  kernel->vjp = [] {  // (M, e, l) -> (l dE/dM, l dE/de)
    return recorded_callee(record("kepler_vjp", 3, [](const VectorXad& v) {
      const AD E = call(kepler(), v.head(2))[0], scaled = v[2] / (1 - v[1] * cos(E));
      VectorXad adjoints(2);
      adjoints << scaled, scaled * sin(E);
      return adjoints;
    }));
  };
  return kernel;
}

int main() {
  // Distance from the focus after mean anomaly M on an orbit of semi-major axis 1 and eccentricity e.
  const Function radius = record("radius", 2, [](const VectorXad& x) {
    return VectorXad::Constant(1, 1 - x[1] * cos(call(kepler(), x)[0]));
  });
  const Derivatives d = derive(radius, Order::kSecond);

  const double M = 1.2, e = 0.3, h = 1e-5;
  const std::vector<double> y = evaluate(d.function, {M, e}, {}, {1.0});  // r | dr/dM dr/de | r_MM r_eM r_ee
  std::printf("r = %.12f\ndr/dM = %.12f  dr/de = %.12f\n", y[0], y[1], y[2]);
  std::printf("r_MM = %.12f  r_eM = %.12f  r_ee = %.12f\n", y[3], y[4], y[5]);

  const auto at = [&](double m, double ecc) { return evaluate(radius, {m, ecc})[0]; };
  const double first = (at(M + h, e) - at(M - h, e)) / (2 * h);
  const double mixed =
      (at(M + h, e + h) - at(M + h, e - h) - at(M - h, e + h) + at(M - h, e - h)) / (4 * h * h);
  const double curved = (at(M, e + h) - 2 * at(M, e) + at(M, e - h)) / (h * h);
  const bool good =
      std::abs(y[1] - first) < 1e-9 && std::abs(y[4] - mixed) < 1e-5 && std::abs(y[5] - curved) < 1e-5;
  std::printf("%s with differences\n", good ? "agrees" : "DISAGREES");
  return good ? 0 : 1;
}
