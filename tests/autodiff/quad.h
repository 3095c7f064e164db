// SPDX-License-Identifier: BSD-3-Clause
//
// A 113-bit float as the reference, and derivatives of a Function by differences in it.
#pragma once

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/dynamics/algebra/float128.h>

namespace dyntape::testing {

using Quad = dynamics::Float128;
// For unqualified calls where Quad is `long double`, which has no namespace of its own.
using std::abs, std::isfinite, std::isnan;

inline std::string to_text(const Quad& x, int digits) {
  std::ostringstream text;
  text.precision(digits);
  text << x;
  return text.str();
}

inline std::vector<Quad> to_quad(const std::vector<double>& v) { return {v.begin(), v.end()}; }

// Central differences with Richardson extrapolation: d f / d x_j, error about 1e-26 for smooth f of size one.
inline std::vector<Quad> difference(const Function& f, const std::vector<double>& x, std::size_t j,
                                    const std::vector<double>& p = {}, const std::vector<double>& w = {}) {
  const Quad step = Quad(1e-7);
  const auto central = [&](Quad h) {
    std::vector<Quad> up = to_quad(x), down = up;
    up[j] += h;
    down[j] -= h;
    std::vector<Quad> d = evaluate_as<Quad>(f, up, to_quad(p), to_quad(w));
    const std::vector<Quad> b = evaluate_as<Quad>(f, down, to_quad(p), to_quad(w));
    for (std::size_t i = 0; i < d.size(); ++i) d[i] = (d[i] - b[i]) / (2 * h);
    return d;
  };
  std::vector<Quad> fine = central(step / 2);
  const std::vector<Quad> coarse = central(step);
  for (std::size_t i = 0; i < fine.size(); ++i) fine[i] = (4 * fine[i] - coarse[i]) / 3;
  return fine;
}

}  // namespace dyntape::testing
