// SPDX-License-Identifier: BSD-3-Clause
//
// What the tests of AdFunction share: a sample function with its derivatives by hand, and a cache of its own.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include <dyntape/interface/ocs2/ad_function.h>

#include "interface/message_of.h"
#include "interface/temporary_cache.h"

namespace dyntape {

using ApproximationOrder = AdFunction::ApproximationOrder;

// y0 = p0 x0^2 + sin x1 x2,  y1 = p1 exp(x0) x2,  y2 = x1
inline void sample(const ad_vector_t& x, const ad_vector_t& p, ad_vector_t& y) {
  y.resize(3);
  y << p[0] * x[0] * x[0] + sin(x[1]) * x[2], p[1] * exp(x[0]) * x[2], x[1];
}

inline const vector_t kX = (vector_t(3) << 0.4, -0.7, 1.3).finished();
inline const vector_t kP = (vector_t(2) << 2.5, -0.3).finished();

inline matrix_t sample_jacobian(const vector_t& x, const vector_t& p) {
  matrix_t J(3, 3);
  J << 2 * p[0] * x[0], std::cos(x[1]) * x[2], std::sin(x[1]),  //
      p[1] * std::exp(x[0]) * x[2], 0, p[1] * std::exp(x[0]),   //
      0, 1, 0;
  return J;
}

inline matrix_t sample_hessian(const vector_t& w, const vector_t& x, const vector_t& p) {
  matrix_t H = matrix_t::Zero(3, 3);
  H(0, 0) = w[0] * 2 * p[0] + w[1] * p[1] * std::exp(x[0]) * x[2];
  H(1, 1) = -w[0] * std::sin(x[1]) * x[2];
  H(0, 2) = H(2, 0) = w[1] * p[1] * std::exp(x[0]);
  H(1, 2) = H(2, 1) = w[0] * std::cos(x[1]);
  return H;
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

class AdFunctionTest : public ::testing::Test {
 protected:
  AdFunction make(AdFunction::ad_parameterized_function_t f, std::size_t n, std::size_t n_p,
                  const std::string& name = "test") const {
    return AdFunction(std::move(f), n, n_p, name, cache_.path(), {"-O1"});
  }
  AdFunction created(AdFunction::ad_parameterized_function_t f, std::size_t n, std::size_t n_p,
                     ApproximationOrder order = ApproximationOrder::Second) const {
    AdFunction function = make(std::move(f), n, n_p);
    function.createModels(order, false);
    return function;
  }
  // An interpreted one: nothing is compiled where the route does not matter.
  AdFunction interpreted(AdFunction::ad_parameterized_function_t f, std::size_t n, std::size_t n_p,
                         ApproximationOrder order = ApproximationOrder::Second) const {
    AdFunctionSettings settings;
    settings.folder = cache_.path();
    settings.codegen.route = Route::kInterpreter;
    AdFunction function(std::move(f), n, n_p, settings);
    function.createModels(order, false);
    return function;
  }

  TemporaryCache cache_;
};

// --- what OCS2 promises ---

}  // namespace dyntape
